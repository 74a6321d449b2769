"""Many targets: on several cores, and if the options are the usual ones, side by side in the lanes of a vector."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.exceptions import ArgumentError
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN
from ros_ik_pkg.ik.options import SolveOptions
from ros_ik_pkg.ik.ordered_solver import search_targets
from ros_ik_pkg.ik.search.entry import (
    ATTEMPTS,
    JOINT_DISTANCE,
    NOT_AN_ARGUMENT,
    ORIENTATION_ERROR,
    POSITION_ERROR,
    STATUS,
    STEPS,
    TIME,
    WISHED_ORIENTATION_ERROR,
    WISHED_POSITION_ERROR,
)
from ros_ik_pkg.ik.solution import Status
from ros_ik_pkg.ik.solver import DEFAULT_OPTIONS, NOTHING, WIDTH, argument_error, as_array, solve_at_length
from ros_ik_pkg.ik.world import World

if not WHY_PLAIN:
    from ros_ik_pkg.ik.batch.entry import solve_lanes
    from ros_ik_pkg.ik.batch.events import HANDED_OVER, MOST_ATTEMPTS

FEWEST = 256  # targets side by side: with fewer, lanes are empty too long
SHORTEST_DEADLINE = 1e-3  # [s] a lane looks at no clock, and gives its target up long before
CHUNK, LANES_CHUNK = 256, 4096  # targets that a thread takes at a time, one by one and side by side


@dataclass(slots=True)
class BatchSolution:
    """Answers for N targets, row by row; see Solution for the meaning of each array."""

    q: np.ndarray  # (N, n) [rad, m]
    status: np.ndarray  # (N,) int64, values of Status
    position_error: np.ndarray  # (N,) [m]
    orientation_error: np.ndarray  # (N,) [rad]
    iterations: np.ndarray  # (N,) int64
    attempts: np.ndarray  # (N,) int64
    joint_distance: np.ndarray  # (N,) [rad, m]
    solve_time: np.ndarray  # (N,) [s]
    wished_position_error: np.ndarray  # (N,) [m]
    wished_orientation_error: np.ndarray  # (N,) [rad]

    @property
    def converged(self) -> np.ndarray:
        """(N,) bool."""
        return self.status == Status.CONVERGED


def solve_batch(
    arm: Arm,
    targets: ArrayLike,
    seeds: ArrayLike | None = None,
    options: SolveOptions | None = None,
    references: ArrayLike | None = None,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
    world: World | None = None,
) -> BatchSolution:
    """Solve N targets on several cores; each row is what `solve` would return for it.

    With the usual options (see `fits_lanes`) targets are solved side by side in the lanes of a vector, four times as
    fast. The search is the same, but its arithmetic is rounded differently, so answers differ from those of `solve`
    by rounding: about one in 10^4 ends elsewhere. For six joints with a closed form `solve` asks it after three
    attempts, while lanes search on: about three in a hundred answers are other solutions of the arm. Each answer is
    checked by the kinematics of `solve` and depends on no other target or number of workers. Targets that lanes do not
    solve are left to the usual search. A `solve_time` is then the time in which the other lanes worked too.

    Parameters
    ----------
    targets : (N, 4, 4) array
    seeds, references : (N, n) or (n,) arrays, optional
        As in `solve`; one row serves all targets.
    workers : int, optional
        Threads; default: one for each core that this process may use.
    progress : callable, optional
        Called with the number of targets done since the last call.
    world : World, optional
        As in `solve`.

    Raises
    ------
    ArgumentError
        As `solve`; the text names the first bad row.

    """
    options = options or DEFAULT_OPTIONS
    goals = as_array(targets, 'targets', (None, 4, 4))
    count = len(goals)
    flat = goals.reshape(4 * count, 4)
    starts = _rows(arm.home if seeds is None else seeds, count, arm.n, 'seeds')
    origins = starts if references is None else _rows(references, count, arm.n, 'references')
    out = np.empty((count, arm.n + WIDTH))
    room = arm.contacts.room(world) if options.avoid_collisions and arm.shaped else None
    lanes = room is None and arm.n >= options.wishes_below and fits_lanes(options, count)

    def arguments(a: int, b: int) -> tuple[Any, ...]:
        of_joints = slice(a * arm.n, b * arm.n)
        return flat[4 * a : 4 * b], starts[of_joints], origins[of_joints], out[a:b]

    def run(chunk: slice) -> int:
        a, b = chunk.start, chunk.stop
        rest = [(a, b)]
        if lanes:
            solve_lanes(arm.packed, options.numbers, *arguments(a, b))
            rest = [(a + first, a + last) for first, last in _runs(out[a:b, arm.n + STATUS] == HANDED_OVER)]
        for first, last in rest:
            part = *arguments(first, last), NOTHING, NOTHING, NOTHING
            search_targets(arm, room, options, *part)
        for k in (a + np.flatnonzero(out[a:b, arm.n + STATUS] == Status.COLLISION)).tolist():
            of_joints = slice(k * arm.n, (k + 1) * arm.n)
            out[k] = solve_at_length(arm, goals[k], starts[of_joints], options, origins[of_joints], False, room).row
        return b - a

    threads = len(os.sched_getaffinity(0)) if workers is None else workers
    if threads < 1:
        raise ArgumentError(f'workers is {workers}; expected 1 or more, or None for one for each core')
    with ThreadPoolExecutor(threads) as pool:
        for done in pool.map(run, _chunks(count, threads, LANES_CHUNK if lanes else CHUNK)):
            if progress is not None:
                progress(done)
    figures = out[:, arm.n :].T
    bad = np.flatnonzero(figures[STATUS] == NOT_AN_ARGUMENT)
    if len(bad):
        k = int(bad[0])
        rows = slice(k * arm.n, (k + 1) * arm.n)
        raise ArgumentError(f'row {k}: {argument_error(arm, options, goals[k], starts[rows], origins[rows])}')
    status, steps, attempts = figures[[STATUS, STEPS, ATTEMPTS]].astype(np.int64)
    return BatchSolution(
        out[:, : arm.n], status, figures[POSITION_ERROR], figures[ORIENTATION_ERROR], steps, attempts,
        figures[JOINT_DISTANCE], figures[TIME], figures[WISHED_POSITION_ERROR], figures[WISHED_ORIENTATION_ERROR],
    )  # fmt: skip


def _rows(values: Any, count: int, n: int, name: str) -> np.ndarray:
    """Return (count * n,) numbers from as many rows, or from one for all."""
    rows = as_array(values if np.ndim(values) == 2 else [values], name, (None, n))
    if len(rows) not in (1, count):
        raise ArgumentError(f'{name} has {len(rows)} rows; expected {count}, one for each target, or one for all')
    return np.broadcast_to(rows, (count, n)).flatten()  # a copy, because the compiled code takes no read-only array


def fits_lanes(options: SolveOptions, count: int) -> bool:
    """Return whether that many targets with these options, without contact, are solved side by side.

    That takes adaptive_dls with damping and within the limits, the first solution found, no weights, tolerances of
    rows, null space or largest jump, and an unhurried search.
    """
    usual = SolveOptions()
    same = ('method', 'respect_limits', 'choice', 'max_joint_jump', 'task_weights', 'task_tolerances', 'null_space',
            'posture', 'joint_weights')  # fmt: skip
    return (
        not WHY_PLAIN
        and count >= FEWEST
        and all(getattr(options, name) == getattr(usual, name) for name in same)
        and options.adaptive_dls_damping > 0.0
        and options.max_attempts >= MOST_ATTEMPTS
        and not 0.0 < options.deadline < SHORTEST_DEADLINE
    )


def _runs(chosen: np.ndarray) -> list[tuple[int, int]]:
    """Return begin and end of each run of True in (N,) bool."""
    edges = np.flatnonzero(np.diff(chosen, prepend=False, append=False))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def _chunks(count: int, threads: int, most: int) -> Iterator[slice]:
    """Split 0..count-1 into pieces small enough to keep all threads busy to the end."""
    size = max(1, min(most, count // (8 * threads) + 1))
    return (slice(k, min(k + size, count)) for k in range(0, count, size))
