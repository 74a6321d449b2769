"""The error of two tips and its Jacobian: the rows of one task below those of the other."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel, variant_of
from ros_ik_pkg.ik.kernel.linalg import ROWS
from ros_ik_pkg.ik.kernel.pair_layout import PairGeometry, PairTask
from ros_ik_pkg.ik.kinematics.task import keep_slack, look_around, look_at_error, make_task, tolerated_norm, with_slack


@inlined
def make_pair_task(targets, first_weights, second_weights, tolerances, in_tip_axes):
    """Return the task of bringing the first and the second tip to the poses `targets[:4]` and `targets[4:8]`.

    `targets[8:]` is the pose of the first one in the base frame.
    """
    first = make_task(targets[:4], first_weights, tolerances, in_tip_axes)
    second = make_task(targets[4:8], second_weights, tolerances, in_tip_axes)
    in_base = make_task(targets[8:], first_weights, tolerances, in_tip_axes)
    return PairTask(first, second, in_base, first.plain * second.plain)


@variant_of(tolerated_norm, PairTask)
def tolerated_norm_of_both(task, tuning):
    """Return the largest norm of the weighted errors that is within all tolerances."""
    first, second = tolerated_norm(task.first, tuning), tolerated_norm(task.second, tuning)
    return math.sqrt(first * first + second * second)


@variant_of(with_slack, PairTask)
def with_slack_for_both(task, position_slack, orientation_slack):
    """Return the task of bringing each tip within these distances [m, rad] of its pose."""
    first = with_slack(task.first, position_slack, orientation_slack)
    return PairTask(first, with_slack(task.second, position_slack, orientation_slack), task.first_in_base, 0.0)


@variant_of(look_at_error, PairGeometry)
def look_at_both_errors(geometry, task, work):
    """Write both errors to the tips' workspaces; return the larger norms of their halves [m, rad], the norm of all
    weighted rows, and rotations and positions of the tips."""
    position, orientation, norm, R, p = look_at_error(geometry.first, task.first, work.first)
    other_position, other_orientation, other_norm, other_R, other_p = look_at_error(
        geometry.second, task.second, work.second
    )
    whole = math.sqrt(norm * norm + other_norm * other_norm)
    return max(position, other_position), max(orientation, other_orientation), whole, (R, other_R), (p, other_p)


@variant_of(look_around, PairGeometry)
def look_around_both(geometry, task, R, p, work):
    """Write the system of both tasks to the pair's workspace, where the tips are at (R, p)."""
    look_around(geometry.first, task.first, R[0], p[0], work.first)
    look_around(geometry.second, task.second, R[1], p[1], work.second)
    stack(work)


@variant_of(keep_slack, PairTask)
def keep_slack_of_both(task, work):
    """Add the halves of the errors to the system that the step dq would bring out of their slack; return whether there
    are any."""
    first, second = keep_slack(task.first, work.first), keep_slack(task.second, work.second)
    if first or second:
        stack(work)
    return first or second


@kernel
def stack(work):
    """Write the rows of the first tip, and below them those of the second, as one system."""
    for r in range(ROWS):
        work.e[r], work.e[ROWS + r] = work.first.e[r], work.second.e[r]
        work.weights[r], work.weights[ROWS + r] = work.first.weights[r], work.second.weights[r]
    for i in range(len(work.q)):
        for r in range(ROWS):
            work.columns[i, r] = work.first.columns[i, r]
            work.columns[i, ROWS + r] = work.second.columns[i, r]
