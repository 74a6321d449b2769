"""The public call for two tips: check the arguments, run the compiled search, return the result."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ros_ik_pkg.ik.arm_tree import ArmTree
from ros_ik_pkg.ik.collision.obstruction import MOST_TOUCHING
from ros_ik_pkg.ik.exceptions import ArgumentError, OptionError
from ros_ik_pkg.ik.options import SolveOptions
from ros_ik_pkg.ik.search.entry import FOUND, STATUS
from ros_ik_pkg.ik.search.pair_entry import solve_pair
from ros_ik_pkg.ik.search.search import COLLISION
from ros_ik_pkg.ik.solution import Solution, Status
from ros_ik_pkg.ik.solver import DEFAULT_OPTIONS, MOST_ANSWERS, NOTHING, POSE, WIDTH, Transform, as_array
from ros_ik_pkg.ik.touching import take_best
from ros_ik_pkg.ik.world import World

FREE = np.eye(4)  # stands for the target of a tip that has none


def solve_tips(
    arms: ArmTree,
    targets: Sequence[ArrayLike | Transform | None],
    seed: ArrayLike | None = None,
    options: SolveOptions | None = None,
    reference: ArrayLike | None = None,
    relative: bool = False,
    world: World | None = None,
) -> Solution:
    """Find joint positions that bring both tips of a robot to their targets at once.

    Parameters
    ----------
    arms : ArmTree
    targets : two (4, 4) arrays or pinocchio.SE3
        Poses of the tip frames in the base frame [m], in the order of `arms.tip_frames`; None for a tip that is free.
    seed, reference : (n,) arrays, optional
        As in `solve`, with the joints of `arms.joint_names`.
    options : SolveOptions, optional
        `task_weights`, `task_tolerances` and the tolerances hold for each tip. `null_space` must be 'none'.
    relative : bool
        Whether the first target is a pose of the first tip in the frame of the second one, as for two hands on one
        object. With None for the second target nothing else is asked for.
    world : World, optional
        As in `solve`; the robot's other arm counts as part of the robot.

    Returns
    -------
    Solution
        As of `solve`, with the larger of both tips' errors; there is no trace and no `sigma_min`.

    Raises
    ------
    ArgumentError
        If an argument has the wrong shape, is not finite or is not a pose.
    OptionError
        If an objective for the null space is asked for, or `secondary` names rows.

    """
    options = options or DEFAULT_OPTIONS
    if options.null_space != 'none':
        raise OptionError(f"null_space is {options.null_space!r}; two tips are solved with null_space 'none' alone")
    if options.wishes_below == math.inf:
        raise OptionError(f'secondary is {options.secondary!r}; two tips are solved with all rows demanded')
    if len(targets) != 2 or all(target is None for target in targets):
        raise ArgumentError('targets has no pose for either tip; expected two poses, or one and None')
    first, second = (
        FREE if target is None else as_array(getattr(target, 'homogeneous', target), name, POSE)
        for name, target in zip(('first target', 'second target'), targets)
    )
    wanted = np.array([float(target is not None) for target in targets])
    origin = as_array(arms.home if seed is None else seed, 'seed', (arms.n,))
    distant = origin if reference is None else as_array(reference, 'reference', (arms.n,))
    chain, second_chain = arms.packed
    starts, layout = arms.starts
    if relative:
        chain = arms.packed_relative
        if targets[1] is None:
            starts, layout = arms.relative_starts
    in_base = second @ first if relative and targets[1] is not None else first
    room = None
    if options.avoid_collisions and arms.shaped:
        room = arms.contacts.room(world)
        model = np.concatenate([chain, room.packed])
    else:
        model = chain
    poses = np.concatenate([first, second, in_base])
    row = np.empty(arms.n + WIDTH)
    answers = np.empty((MOST_ANSWERS, arms.n)) if options.choice == 'all' else NOTHING
    touching = NOTHING if room is None else np.full((MOST_TOUCHING, arms.n), np.nan)
    good = solve_pair(
        model, second_chain, starts, layout, options.numbers, poses, wanted, origin, distant, row, answers, touching
    )
    if not good:
        raise _argument_error(arms, options, first, second, origin, distant)
    if room is not None and row[STATUS - WIDTH] == COLLISION:

        def look_at(q: np.ndarray, numbers: np.ndarray, one: np.ndarray) -> None:
            solve_pair(chain, second_chain, starts, layout, numbers, poses, wanted, q, distant, one, NOTHING, NOTHING)

        take_best(look_at, options, room, touching[~np.isnan(touching[:, 0])], row)
        if row[STATUS - WIDTH] == Status.CONVERGED and options.choice == 'all':
            answers[0] = row[: arms.n]
    found = answers[: int(row[FOUND - WIDTH])] if options.choice == 'all' else None
    return Solution(row, found, None, room)


def prepare_tips() -> None:
    """Compile the search for two tips, or load it from the cache, before it is needed."""
    solve_pair.prepare()


def _argument_error(
    arms: ArmTree, options: SolveOptions, first: np.ndarray, second: np.ndarray, seed: np.ndarray, reference: np.ndarray
) -> Exception:
    """Return an error that names the argument that the compiled check refused."""
    try:
        options.check_lengths(arms.n)
    except OptionError as error:
        return ArgumentError(str(error))
    for name, value in (('seed', seed), ('reference', reference)):
        if not np.isfinite(value).all():
            return ArgumentError(f'{name} = {value.tolist()}; expected finite numbers [rad, m]')
    return ArgumentError(
        f'targets = {first.tolist()}, {second.tolist()}; expected finite homogeneous matrices with a rotation '
        '(R R^T = I within 1e-3, right-handed) and the last row 0 0 0 1'
    )
