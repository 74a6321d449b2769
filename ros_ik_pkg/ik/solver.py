"""The public calls: check the arguments, run the compiled search, return the result."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy import empty, ndarray
from numpy.typing import ArrayLike

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.collision.obstruction import MOST_TOUCHING
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ik.exceptions import ArgumentError, NotCompiledError, OptionError
from ros_ik_pkg.ik.kernel.data_layout import TRACE_WIDTH
from ros_ik_pkg.ik.options import SolveOptions, demanded_alone
from ros_ik_pkg.ik.ordered_solver import measure_wishes, search_targets
from ros_ik_pkg.ik.search.entry import (
    COMPLETENESS,
    FOUND,
    NOT_AN_ARGUMENT,
    STATUS,
    solve_one,
    solve_range,
    solve_usual,
)
from ros_ik_pkg.ik.search.search import COLLISION, NOT_COMPILED
from ros_ik_pkg.ik.solution import BY_PROOF, FIGURES, NOT_KNOWN, Solution, Status, Trace
from ros_ik_pkg.ik.touching import add_clear, take_best
from ros_ik_pkg.ik.world import World

TRACE_CAPACITY = 20000  # iterates; 2 MB
MOST_ANSWERS = 64  # that choice='all' returns
DEFAULT_OPTIONS = SolveOptions()
FLOAT = np.dtype(np.float64)
POSE = (4, 4)
NOTHING = np.empty((0, 0))
WIDTH = len(FIGURES)
STILL_COMPILING = (
    'the solver is still being compiled: so far it finds one solution for a whole pose, at first by adaptive_dls alone '
    'and neither clear of contact nor nearest to what is out of reach'
)

one_target: Callable[..., bool] | None = None  # what `solve` calls; set when it is first needed
all_compiled = True  # whether more than `one_target` may be called; else it is still being compiled


class Transform(Protocol):
    """An object with a (4, 4) matrix, such as a pinocchio.SE3."""

    @property
    def homogeneous(self) -> np.ndarray:
        """Homogeneous transform (4, 4) [m]."""


def solve(
    arm: Arm,
    target: ArrayLike | Transform,
    seed: ArrayLike | None = None,
    options: SolveOptions | None = None,
    reference: ArrayLike | None = None,
    trace: bool = False,
    world: World | None = None,
) -> Solution:
    """Find joint positions that bring the arm's tip frame to a target pose.

    Parameters
    ----------
    arm : Arm
    target : (4, 4) array or pinocchio.SE3
        Pose of the tip frame in the arm's base frame [m].
    seed : (n,) array, optional
        Where the first attempt starts [rad, m]; default: the arm's home. It is not modified.
    options : SolveOptions, optional
    reference : (n,) array, optional
        What 'nearest', max_joint_jump and whole turns are measured from; default: the seed.
    trace : bool
        Whether to keep every iterate.
    world : World, optional
        What the arm must not touch besides itself, if avoid_collisions is on and the robot has shapes.

    Returns
    -------
    Solution
        `converged` or the closest approach with the reason; the figures are those of its q.

    Raises
    ------
    ArgumentError
        If an argument has the wrong shape, is not finite or is not a pose.
    NotCompiledError
        If only the usual solve is compiled so far (see `Compilation`) and more is needed.

    """
    if options is None:
        options = DEFAULT_OPTIONS
    if seed is None:
        seed = arm.home
    # Inlined for speed: a call of _array() for each argument takes a tenth of the time of a solve. `is` is exact
    # enough: equal but distinct types go the slow way below.
    if type(target) is not ndarray or target.dtype is not FLOAT:
        target = as_array(getattr(target, 'homogeneous', target), 'target', POSE)
    if type(seed) is not ndarray or seed.dtype is not FLOAT:
        seed = as_array(seed, 'seed', (arm.n,))
    # The usual arm without shapes is told by one attribute.
    room = None if arm.bare or not (options.avoid_collisions and arm.shaped) else arm.contacts.room(world)
    n = arm.n
    if n < options.at_length_below or trace or reference is not None:
        return solve_at_length(arm, target, seed, options, reference, trace, room)
    call = one_target or use_usual(False)  # held, because another thread may change it
    model = arm.packed if room is None or call is solve_usual.compiled else room.behind(arm.packed)
    row = empty(n + WIDTH)
    try:
        good = call(model, options.numbers, target, seed, row)
    except TypeError:  # other dimensions, or not aligned
        target, seed = as_array(target, 'target', POSE), as_array(seed, 'seed', (n,))
        good = call(model, options.numbers, target, seed, row)
    if not good:
        if row[STATUS - WIDTH] == NOT_COMPILED:
            raise NotCompiledError(STILL_COMPILING)
        raise argument_error(arm, options, target, seed, seed)
    if room is None:
        return Solution(row)
    if call is solve_usual.compiled:
        _refuse_contact(row[:n], options, room)
    elif row[STATUS - WIDTH] == COLLISION:  # an int: an enumeration takes a microsecond to compare
        return solve_at_length(arm, target, seed, options, None, False, room)
    return Solution(row, None, None, room)


def use_usual(usual: bool, alone: bool | None = None) -> Callable[..., bool]:
    """Let `solve` call `solve_usual`, or else `solve_one`, compiled by now; return what it calls.

    If that is `alone`, by default for `solve_usual`, what needs more is refused.
    """
    global one_target, all_compiled
    entry = solve_usual if usual else solve_one
    entry.prepare()
    one_target, all_compiled = entry.compiled, not (usual if alone is None else alone)
    return one_target


def _refuse_contact(q: np.ndarray, options: SolveOptions, room: Room) -> None:
    """Raise NotCompiledError unless coal finds q (n,) clear: the usual solve does not look at contact."""
    if not room.is_clear(q, options.collision_margin, options.collision_geometry == 'mesh'):
        raise NotCompiledError(STILL_COMPILING)


def solve_at_length(
    arm: Arm, target: np.ndarray, seed: np.ndarray, options: SolveOptions, reference: Any, trace: bool,
    room: Room | None,
) -> Solution:
    """Solve if more is wanted than one solution from one seed, or if the solutions that were found may touch."""
    if not all_compiled:
        raise NotCompiledError(STILL_COMPILING)
    n = arm.n
    target, seed = as_array(target, 'target', POSE), as_array(seed, 'seed', (n,))
    row = np.empty(n + WIDTH)
    origin = seed if reference is None else as_array(reference, 'reference', (n,))
    answers = np.empty((MOST_ANSWERS, n)) if options.choice == 'all' else NOTHING
    rows = np.empty((TRACE_CAPACITY, TRACE_WIDTH + n + 3)) if trace else NOTHING
    touching = NOTHING if room is None else np.full((MOST_TOUCHING, n), np.nan)
    count = search_targets(arm, room, options, target, seed, origin, row.reshape(1, -1), answers, touching, rows)
    if row[STATUS - WIDTH] == NOT_AN_ARGUMENT:
        raise argument_error(arm, options, target, seed, origin)
    touching = touching[~np.isnan(touching[:, 0])] if room is not None else NOTHING
    if room is not None and len(touching):

        def look_at(q: np.ndarray, numbers: np.ndarray, one: np.ndarray) -> None:
            solve_range(arm.packed, numbers, target, q, origin, one.reshape(1, -1), NOTHING, NOTHING, NOTHING)

        proven = row[COMPLETENESS - WIDTH] == BY_PROOF
        touched = row[STATUS - WIDTH] == COLLISION
        if touched:
            wishes = n < options.wishes_below
            alone = demanded_alone(options) if wishes else options
            take_best(look_at, alone, room, touching, row)
            if wishes:
                measure_wishes(arm, options, target, origin, row)
        if row[STATUS - WIDTH] == Status.CONVERGED and options.choice == 'all':
            if touched:
                answers[0] = row[:n]
            if proven:  # nothing else is known to be left out
                add_clear(look_at, options, room, touching, origin, row, answers)
            if len(touching) == MOST_TOUCHING or (touched and not proven):
                row[COMPLETENESS - WIDTH] = NOT_KNOWN  # coal may find others clear too
    found = answers[: int(row[FOUND - WIDTH])] if options.choice == 'all' else None
    return Solution(row, found, _trace(rows, count, n) if trace else None, room)


def as_array(value: Any, name: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """Return the value as a contiguous float64 array of the given shape (None: any length), itself if it is one, or
    raise ArgumentError."""
    array = value
    if type(value) is not ndarray or value.dtype is not FLOAT or not value.flags.carray:
        try:
            array = np.array(value, dtype=FLOAT, order='C')
        except (TypeError, ValueError) as error:
            raise ArgumentError(f'{name} is not an array of numbers: {error}') from None
    fits = array.shape == shape or (
        len(array.shape) == len(shape) and all(want in (None, got) for got, want in zip(array.shape, shape))
    )
    if not fits:
        wanted = ', '.join('N' if length is None else str(length) for length in shape)
        raise ArgumentError(f'{name} has shape {array.shape}; expected ({wanted}{"," if len(shape) == 1 else ""})')
    return array


def argument_error(arm: Arm, options: SolveOptions, target: Any, seed: Any, reference: Any) -> ArgumentError:
    """Return an error that names the argument that the compiled check refused."""
    try:
        options.check_lengths(arm.n)
        pose = as_array(target, 'target', POSE)
        as_array(seed, 'seed', (arm.n,))
    except (OptionError, ArgumentError) as error:
        return ArgumentError(str(error))
    for name, value in (('seed', seed), ('reference', reference)):
        if not np.all(np.isfinite(value)):
            return ArgumentError(f'{name} = {np.asarray(value).tolist()}; expected finite numbers [rad, m]')
    return ArgumentError(
        f'target = {pose.tolist()}; expected a finite homogeneous matrix with a rotation (R R^T = I within 1e-3, '
        'right-handed) and the last row 0 0 0 1'
    )


def _trace(rows: np.ndarray, count: int, n: int) -> Trace:
    """Return the trace in the rows that were written."""
    used = rows[:count].copy()
    return Trace(
        used[:, :TRACE_WIDTH], used[:, TRACE_WIDTH : TRACE_WIDTH + n], used[:, TRACE_WIDTH + n :], count > len(rows)
    )
