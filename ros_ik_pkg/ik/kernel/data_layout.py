"""The records that the compiled functions hand to each other: named tuples of arrays and numbers.

Python hands a whole arm over as one flat array, because every array that crosses into compiled code costs a quarter
of a microsecond; `unpack_model` cuts it into views again.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kernel.sincos import BLOCK
from ros_ik_pkg.ik.solution import TRACE_COLUMNS
from ros_ik_pkg.methods import option_names

TRACE_WIDTH = len(TRACE_COLUMNS)
HEADER = 3  # numbers before the parts of a packed arm


class Geometry(NamedTuple):
    """One chain (see Arm): nj joints, n variables; all float64, indices and flags too."""

    placements: np.ndarray  # (nj + 1, 12)
    prismatic: np.ndarray  # (nj,)
    variable: np.ndarray  # (nj,)
    multiplier: np.ndarray  # (nj,)
    offset: np.ndarray  # (nj,)
    lower: np.ndarray  # (n,)
    upper: np.ndarray  # (n,)
    wraps: np.ndarray  # (n,)


class Reach(NamedTuple):
    """A bound on where the arm can be (see reach.py)."""

    in_base: np.ndarray  # (3,) fixed point of the base [m]
    in_tip: np.ndarray  # (3,) fixed point of the tip frame [m]
    lengths: np.ndarray  # (2,) largest distance of the two points, and of the tip from in_base [m]


# SolveOptions as numbers, except those that are lists; what the table of methods says of the selected method; and the
# options that methods own.
METHOD_COLUMNS = ('step_cap', 'may_hurry', 'finish_by_lm')
Tuning: Any = namedtuple('Tuning', (  # type: ignore[misc]  # its names come from a table
    'method', 'max_iterations', 'max_attempts', 'deadline', 'position_tolerance', 'orientation_tolerance', 'step_size',
    'max_joint_step', 'respect_limits', 'choice', 'max_joint_jump', 'task_frame', 'null_space', 'null_space_step',
    'collision_margin', *METHOD_COLUMNS, *option_names(),
))  # fmt: skip
TUNABLES = len(Tuning._fields)


class Task(NamedTuple):
    """What is asked for: a pose in the base frame, and how its six error components count."""

    R: tuple[float, ...]  # 9, row by row
    p: tuple[float, ...]  # 3 [m]
    weights: np.ndarray  # (6,)
    tolerances: np.ndarray  # (6,) within which an error counts as none [m, rad]
    in_tip_axes: float
    plain: float  # whether all six count alike, without tolerances: then the axes do not matter either
    position_slack: float  # [m] and
    orientation_slack: float  # [rad]: lengths of the two halves up to which the error counts as none


class Preferences(NamedTuple):
    """Which of many solutions is wanted, and what none may touch."""

    reference: np.ndarray  # (n,) from which distances, jumps and whole turns are measured [rad, m]
    joint_weights: np.ndarray  # (n,), or (0,) if the option is unset
    posture: np.ndarray  # (n,) [rad, m]
    obstruction: NamedTuple | None  # see collision/obstruction.py; None where contact is left out


class Solutions(NamedTuple):
    """The solutions with the k lowest ranks so far."""

    rows: np.ndarray  # (k, n) [rad, m]
    ranks: np.ndarray  # (k,) rising


class Joints(NamedTuple):
    """What forward kinematics leaves of the joints; the last three are filled up to whole blocks of sincos.py."""

    axes: np.ndarray  # (nj, 6) axis and a point of each
    values: np.ndarray  # [rad, m]
    sines: np.ndarray
    cosines: np.ndarray


class Workspace(NamedTuple):
    """Everything that a search writes to, made once for many."""

    joints: Joints
    columns: np.ndarray  # (n, 6) Jacobian by columns
    e: np.ndarray  # (6,) weighted error of the task
    weights: np.ndarray  # (6,) of its rows at this iterate; 0 drops a row
    y: np.ndarray  # (6,) solution of the Gram system
    A: np.ndarray  # (6, 6) Gram matrix
    rhs: np.ndarray  # (6,) right-hand side of the normal equations
    U: np.ndarray  # (6, 6) left singular vectors, by rows
    W: np.ndarray  # (6, n) sigma_i v_i, by rows
    sigma: np.ndarray  # (6,)
    dq: np.ndarray  # (n,) step
    q: np.ndarray  # (n,) iterate
    near: np.ndarray  # (n,) iterate of the smallest error in this descent
    best: np.ndarray  # (n,) closest approach of all descents so far
    seed: np.ndarray  # (n,) where the search began
    null: np.ndarray  # (n,) direction in the null space of the task
    went: np.ndarray  # (n,) last step in it
    trial: np.ndarray  # (n, 6) Jacobian by columns of a configuration that is only looked at
    scales: np.ndarray  # (n,) of the Jacobian's columns in a step, or (0,) if the option joint_weights is unset
    scores: np.ndarray  # (m,) how far each start is from the target
    clock: np.ndarray  # (2,) seconds and nanoseconds


class Recorder(NamedTuple):
    """Where the iterates go when somebody wants them; without rows when nobody does."""

    rows: np.ndarray  # (k, TRACE_WIDTH + n + 3)
    written: np.ndarray  # (1,) iterates that there were
    U: np.ndarray  # (6, 6) scratch of the singular values
    W: np.ndarray  # (6, n)
    sigma: np.ndarray  # (6,)


@inlined
def tuning_of(numbers):
    """Give the first numbers their names."""
    return Tuning(*to_fixed_tuple(numbers, TUNABLES))


def pack_model(geometry: Geometry, reach: Reach, starts: np.ndarray) -> np.ndarray:
    """Put an arm and its starts (n + 7, m) float32, m even, into one flat float64 array that begins with n, nj, m."""
    sizes = len(geometry.lower), len(geometry.prismatic), starts.shape[1]
    numbers = [np.ravel(part).astype(np.float64) for part in (sizes, *geometry, *reach)]
    return np.concatenate([*numbers, np.ravel(starts).view(np.float64)])


@inlined
def unpack_model(model):
    """Return Geometry, Reach and starts, views of what pack_model packed. To be called by kernels only: the views are
    not counted as references."""
    n, joints, m = int(model[0]), int(model[1]), int(model[2])
    a = HEADER + 12 * (joints + 1)
    b = a + 4 * joints
    c = b + 3 * n
    per_joint, per_variable = shaped(model, a, (4, joints)), shaped(model, b, (3, n))
    geometry = Geometry(
        shaped(model, HEADER, (joints + 1, 12)),
        per_joint[0], per_joint[1], per_joint[2], per_joint[3],
        per_variable[0], per_variable[1], per_variable[2],
    )  # fmt: skip
    reach = Reach(shaped(model, c, (3,)), shaped(model, c + 3, (3,)), shaped(model, c + 6, (2,)))
    return geometry, reach, shaped(model.view(np.float32), 2 * (c + 8), (n + 7, m))


@inlined
def packed_size(model):
    """Return how many numbers a packed arm has; a packed scene may follow them."""
    n, joints, m = int(model[0]), int(model[1]), int(model[2])
    return HEADER + 12 * (joints + 1) + 4 * joints + 3 * n + 8 + (n + 7) * m // 2


@inlined
def blocks(joints):
    """Return how many angles sincos.py is given for so many joints."""
    return (joints + BLOCK - 1) // BLOCK * BLOCK


@inlined
def joints_size(model):
    """Return how many numbers make_joints cuts up for a packed arm."""
    joints = int(model[1])
    return 6 * joints + 3 * blocks(joints)


@inlined
def make_joints(model, memory):
    """Cut the Joints of a packed arm from a block of memory; to be called by kernels only."""
    joints = int(model[1])
    angles = shaped(memory, 6 * joints, (3, blocks(joints)))
    return Joints(shaped(memory, 0, (joints, 6)), angles[0], angles[1], angles[2])


# How many arrays of each shape make_records needs: (6, 6), (6,), (n, 6), (6, n) and (n,), besides one answer (n,)
SQUARES, SIXES, BY_COLUMN, BY_ROW, VECTORS = 3, 6, 2, 2, 8
FIXED = 36 * SQUARES + 6 * SIXES
PER_VARIABLE = 6 * (BY_COLUMN + BY_ROW) + VECTORS + 1


@inlined
def buffer_size(model):
    """Return how many numbers make_records cuts up for a packed arm."""
    return FIXED + PER_VARIABLE * int(model[0]) + joints_size(model)


@inlined
def make_records(model, buffer, scores, integers, rows, weighted):
    """Cut a Workspace, a Recorder that writes to `rows` and one answer (1, n) from three blocks of memory.

    `weighted` is how many joint weights there are, n or 0. Where `rows` is None the Recorder is too: then nothing that
    needs one is compiled (see entry.solve_usual).
    To be called by kernels only, as unpack_model.
    """
    n = int(model[0])
    a = FIXED
    b = a + BY_COLUMN * 6 * n
    c = b + BY_ROW * 6 * n
    d = c + VECTORS * n
    e = d + n
    squares, sixes = shaped(buffer, 0, (SQUARES, 6, 6)), shaped(buffer, SQUARES * 36, (SIXES, 6))
    by_column = shaped(buffer, a, (BY_COLUMN, n, 6))
    by_row, vectors = shaped(buffer, b, (BY_ROW, 6, n)), shaped(buffer, c, (VECTORS, n))
    work = Workspace(
        make_joints(model, shaped(buffer, e, (joints_size(model),))), by_column[0],
        sixes[0], sixes[5], sixes[1], squares[0], sixes[2], squares[1], by_row[0], sixes[3],
        vectors[0], vectors[1], vectors[2], vectors[3], vectors[6], vectors[4], vectors[5], by_column[1],
        shaped(vectors, VECTORS * n - n, (weighted,)), scores, shaped(integers, 0, (2,)),
    )  # fmt: skip
    if rows is None:  # noqa: SIM108 Numba drops the other branch of an `if` alone
        recorder = None
    else:
        recorder = Recorder(rows, shaped(integers, 2, (1,)), squares[2], by_row[1], sixes[4])
    return work, recorder, shaped(buffer, d, (1, n))
