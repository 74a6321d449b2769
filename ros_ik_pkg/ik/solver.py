"""The public calls: check what came in, run the compiled search, say what came out."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ros_ik_pkg.ik.exceptions import ArgumentError
from ros_ik_pkg.ik.options import SolveOptions
from ros_ik_pkg.ik.reach import make_reach
from ros_ik_pkg.ik.records import Geometry, make_recorder
from ros_ik_pkg.ik.robot import Arm
from ros_ik_pkg.ik.solution import Solution, Status, Trace
from ros_ik_pkg.ik.solve_range import FIGURES, Figure, solve_range
from ros_ik_pkg.ik.starts import make_starts

TRACE_CAPACITY = 20000  # iterates; 2 MB
MOST_ANSWERS = 64  # that choice='all' returns
DEFAULT_OPTIONS = SolveOptions()
STATUSES = tuple(Status)


class _Prepared(NamedTuple):
    """What the compiled code needs of an arm, computed once."""

    starts: tuple[Any, ...]
    reach: tuple[Any, ...]
    silent: tuple[np.ndarray, ...]  # a recorder that records nothing
    ones: np.ndarray  # (n,)


_prepared: WeakKeyDictionary[Arm, _Prepared] = WeakKeyDictionary()


def solve(
    arm: Arm,
    target: Any,
    seed: Any = None,
    options: SolveOptions | None = None,
    reference: Any = None,
    trace: bool = False,
) -> Solution:
    """Find joint positions that bring the arm's tip frame to a target pose.

    Parameters
    ----------
    arm : Arm
    target : (4, 4) array or pinocchio.SE3
        Pose of the tip frame in the arm's base frame [m].
    seed : (n,) array, optional
        Where the first attempt starts [rad, m]; default: the arm's home. Never written to.
    options : SolveOptions, optional
    reference : (n,) array, optional
        What 'nearest', max_joint_jump and whole turns are measured from; default: the seed.
    trace : bool
        Whether to keep every iterate.

    Returns
    -------
    Solution
        `converged` or the closest approach with the reason; the figures are those of its q.

    Raises
    ------
    ArgumentError
        Where an argument has the wrong shape, is not finite or is not a pose.

    """
    options = options or DEFAULT_OPTIONS
    prepared = _prepared.get(arm) or _prepare(arm)
    n = arm.n
    start = _row(arm.home if seed is None else seed, n, 'seed')
    origin = start if reference is None else _row(reference, n, 'reference')
    goal = _pose(target)
    many = MOST_ANSWERS if options.choice == 'all' else 1
    recorder = tuple(make_recorder(TRACE_CAPACITY, n)) if trace else prepared.silent
    q, figures, answers = np.empty((1, n)), np.empty((1, FIGURES)), np.empty((many, n))
    solve_range(
        arm.geometry, prepared.starts, prepared.reach, options.numbers, options.row_weights,
        _joint_weights(options, prepared), goal, start, origin, 0, 1, q, figures, answers, recorder,
    )  # fmt: skip
    row = figures[0].tolist()
    if row[Figure.STATUS] < 0.0:
        raise _argument_error(target, seed, reference)
    found = int(row[Figure.FOUND])
    return Solution(
        q[0],
        STATUSES[int(row[Figure.STATUS])],
        row[Figure.POSITION_ERROR],
        row[Figure.ORIENTATION_ERROR],
        int(row[Figure.STEPS]),
        int(row[Figure.ATTEMPTS]),
        row[Figure.JOINT_DISTANCE],
        row[Figure.SIGMA_MIN],
        int(row[Figure.LIMITS_MASK]),
        row[Figure.SEED_CLIPPED] > 0.0,
        row[Figure.TIME],
        answers[:found],
        _trace(recorder) if trace else None,
    )


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

    @property
    def converged(self) -> np.ndarray:
        """(N,) bool."""
        return self.status == Status.CONVERGED


def solve_batch(
    arm: Arm,
    targets: Any,
    seeds: Any = None,
    options: SolveOptions | None = None,
    references: Any = None,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> BatchSolution:
    """Solve N targets on several cores; each row is what `solve` would return for it.

    Parameters
    ----------
    targets : (N, 4, 4) array
    seeds, references : (N, n) or (n,) arrays, optional
        As in `solve`; one row serves all targets.
    workers : int, optional
        Threads; default: one for each core that this process may use.
    progress : callable, optional
        Called with the number of targets done since the last call.

    Raises
    ------
    ArgumentError
        As `solve`; the text names the first bad row.

    """
    options = options or DEFAULT_OPTIONS
    prepared = _prepared.get(arm) or _prepare(arm)
    goals = _array(targets, 'targets', (4, 4))
    count = len(goals)
    starts = _rows(arm.home if seeds is None else seeds, count, arm.n, 'seeds')
    origins = starts if references is None else _rows(references, count, arm.n, 'references')
    q, figures = np.empty((count, arm.n)), np.empty((count, FIGURES))
    weights = _joint_weights(options, prepared)

    def run(chunk: range) -> int:
        solve_range(
            arm.geometry, prepared.starts, prepared.reach, options.numbers, options.row_weights, weights, goals,
            starts, origins, chunk.start, chunk.stop, q, figures, np.empty((1, arm.n)), prepared.silent,
        )  # fmt: skip
        return len(chunk)

    threads = workers or len(os.sched_getaffinity(0))
    with ThreadPoolExecutor(threads) as pool:
        for done in pool.map(run, _chunks(count, threads)):
            if progress is not None:
                progress(done)
    bad = np.flatnonzero(figures[:, Figure.STATUS] < 0.0)
    if len(bad):
        k = int(bad[0])
        raise ArgumentError(f'row {k}: {_argument_error(goals[k], starts[k], origins[k])}')
    whole = figures.astype(np.int64)
    return BatchSolution(
        q, whole[:, Figure.STATUS], figures[:, Figure.POSITION_ERROR], figures[:, Figure.ORIENTATION_ERROR],
        whole[:, Figure.STEPS], whole[:, Figure.ATTEMPTS], figures[:, Figure.JOINT_DISTANCE], figures[:, Figure.TIME],
    )  # fmt: skip


def warm_up(report: Callable[[str], object] = print) -> float:
    """Compile everything, or load it from the cache; return the seconds that it took.

    `report` is called with a sentence where it takes long, as it does once on every machine.
    """
    began = time.monotonic()
    notice = threading.Timer(
        2.0, report, ['compiling the solver for this machine: once, about half a minute, kept for later starts']
    )
    notice.daemon = True
    notice.start()
    try:
        from ros_ik_pkg.ik.robot import load_arm

        arm = load_arm('planar3r')
        solve(arm, arm.forward(arm.home), arm.home)
        arm.jacobian(arm.home)
    finally:
        notice.cancel()
    return time.monotonic() - began


def _prepare(arm: Arm) -> _Prepared:
    """Compute and remember what belongs to an arm."""
    prepared = _Prepared(
        tuple(make_starts(arm.geometry)),
        tuple(make_reach(Geometry(*arm.geometry))),
        tuple(make_recorder(0, arm.n)),
        np.ones(arm.n),
    )
    _prepared[arm] = prepared
    return prepared


def _joint_weights(options: SolveOptions, prepared: _Prepared) -> np.ndarray:
    """Return (n,) weights of the joint-space distance."""
    if not options.joint_weights:
        return prepared.ones
    if len(options.joint_weights) != len(prepared.ones):
        raise ArgumentError(
            f'joint_weights has {len(options.joint_weights)} numbers; expected {len(prepared.ones)}, one for each joint'
        )
    return np.array(options.joint_weights)


def _pose(target: Any) -> np.ndarray:
    """Return a target as a (1, 4, 4) array."""
    if not isinstance(target, np.ndarray):
        target = getattr(target, 'homogeneous', target)  # pinocchio.SE3
    return _array([target] if not isinstance(target, np.ndarray) else target[None], 'target', (4, 4))


def _row(values: Any, n: int, name: str) -> np.ndarray:
    """Return one configuration as a (1, n) array."""
    return _array(np.asarray(values)[None], name, (n,))


def _rows(values: Any, count: int, n: int, name: str) -> np.ndarray:
    """Return (count, n) configurations from as many rows, or from one for all."""
    given = np.asarray(values)
    array = _array(given if given.ndim == 2 else given[None], name, (n,))
    if len(array) not in (1, count):
        raise ArgumentError(f'{name} has {len(array)} rows; expected {count}, one for each target, or one for all')
    return np.ascontiguousarray(np.broadcast_to(array, (count, n)))


def _array(values: Any, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return values as a contiguous float64 array of items of the given shape, or raise ArgumentError."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f'{name} is not an array of numbers: {error}') from None
    if array.shape[1:] != shape:
        raise ArgumentError(f'{name} has shape {array.shape[1:]}; expected {shape}')
    return array if array.flags.writeable else array.copy()


def _argument_error(target: Any, seed: Any, reference: Any) -> ArgumentError:
    """Say which argument the compiled check refused."""
    for name, value in (('seed', seed), ('reference', reference)):
        if value is not None and not np.all(np.isfinite(np.asarray(value, dtype=float))):
            return ArgumentError(f'{name} = {np.asarray(value).tolist()}; expected finite numbers [rad, m]')
    pose = np.asarray(getattr(target, 'homogeneous', target), dtype=float)
    return ArgumentError(
        f'target = {pose.tolist()}; expected a finite homogeneous matrix with a rotation (R R^T = I within 1e-3, '
        'right-handed) and the last row 0 0 0 1'
    )


def _chunks(count: int, threads: int) -> Iterator[range]:
    """Split 0..count-1 into pieces small enough to keep all threads busy to the end."""
    size = max(1, min(256, count // (8 * threads) + 1))
    return (range(k, min(k + size, count)) for k in range(0, count, size))


def _trace(recorder: tuple[np.ndarray, ...]) -> Trace:
    """Copy the rows that were written."""
    rows, q, p, count = recorder[:4]
    k = min(int(count[0]), len(rows))
    return Trace(rows[:k].copy(), q[:k].copy(), p[:k].copy(), truncated=int(count[0]) > len(rows))
