"""The reach map of an arm: for each cell of poses, whether a configuration reaches it, and one that does.

Random configurations fill most cells; then steps from there into the cells beside them find those of which the arm
reaches a thin corner only, round by round, until nothing new is found (docs/reach.md has the figures).
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.collision.scene import clearances_of
from ros_ik_pkg.ik.exceptions import ArgumentError
from ros_ik_pkg.ik.kernel.data_layout import packed_size
from ros_ik_pkg.ik.options import SolveOptions
from ros_ik_pkg.ik.reachability.aiming import mark_aimed
from ros_ik_pkg.ik.reachability.cells import FACES, rotation_centres, rotation_neighbours
from ros_ik_pkg.ik.reachability.sampling import UNKNOWN, look_at, mark_samples, samples
from ros_ik_pkg.ik.search.reach import make_reach
from ros_ik_pkg.ik.search.starts import sampling_range
from ros_ik_pkg.ik.world import World

ACROSS = 21  # cells along each axis by default
MOST_CELLS = 50_000_000
SAMPLES, ROUNDS = 10_000_000, 12
CHUNKS = 8  # of the work: the same for any number of threads, so that the map is the same too
Progress = Callable[[int], object]


@dataclass(frozen=True)
class ReachMap:
    """What an arm can reach. A cell is reached if one configuration within the limits, and clear of contact if that
    counts, has its tip's pose in it; a cell that is not reached may still hold a few reachable poses."""

    joint_names: tuple[str, ...]
    base_frame: str
    corner: np.ndarray  # (3,) of the grid in the base frame [m]
    step: float  # length of a cell's edge [m]
    shape: tuple[int, int, int]  # cells along x, y and z
    parts: int  # 4 parts^3 cells of rotations
    cells: np.ndarray  # (k,) int64, ascending: the cells that are reached
    q: np.ndarray  # (k, n) a configuration for each of them [rad, m]
    sigma_min: np.ndarray  # (k,) smallest singular value of the Jacobian there
    clearance: np.ndarray  # (k,) lower bound of its distance from contact [m]; NaN if contact does not count

    @property
    def rotations(self) -> int:
        """Number of rotation cells."""
        return FACES * self.parts**3

    @property
    def share(self) -> np.ndarray:
        """Share of the rotations that are reached at each position (nx, ny, nz), 0 to 1."""
        counts = np.bincount(self.cells // self.rotations, minlength=math.prod(self.shape))
        return counts.reshape(self.shape) / self.rotations

    @property
    def best_sigma_min(self) -> np.ndarray:
        """The largest sigma_min at each position (nx, ny, nz); NaN where nothing is reached."""
        return self._largest(self.sigma_min)

    @property
    def best_clearance(self) -> np.ndarray:
        """The largest clearance at each position (nx, ny, nz) [m]; NaN where nothing is reached or contact does not
        count."""
        return self._largest(self.clearance)

    def _largest(self, values: np.ndarray) -> np.ndarray:
        """Return the largest of the values (k,) of the cells at each position (nx, ny, nz); NaN where there is none."""
        best = np.full(math.prod(self.shape), np.nan)
        np.fmax.at(best, self.cells // self.rotations, values)
        return best.reshape(self.shape)

    def centres(self) -> np.ndarray:
        """Return the middles (nx, ny, nz, 3) of the position cells in the base frame [m]."""
        axes = [self.corner[axis] + self.step * (np.arange(self.shape[axis]) + 0.5) for axis in range(3)]
        return np.stack(np.meshgrid(*axes, indexing='ij'), -1)

    def configuration(self, position: ArrayLike, rotation: ArrayLike | None = None) -> np.ndarray | None:
        """Return a configuration (n,) whose tip is in the cell of a position (3,) [m], and of a rotation (3, 3) if one
        is given, else in the rotation with the largest sigma_min; None if the cell is not reached."""
        place = np.floor((np.asarray(position, dtype=np.float64) - self.corner) / self.step).astype(int)
        if (place < 0).any() or (place >= self.shape).any():
            return None
        cell = int(np.ravel_multi_index(tuple(place.tolist()), self.shape)) * self.rotations
        first, last = np.searchsorted(self.cells, [cell, cell + self.rotations])
        if rotation is not None:
            middles = rotation_centres(self.parts).reshape(-1, 9)
            wanted = cell + int(np.argmax(middles @ np.asarray(rotation, dtype=np.float64).reshape(9)))
            first = int(np.searchsorted(self.cells, wanted))
            last = first + int(first < len(self.cells) and self.cells[first] == wanted)
        return self.q[first + np.argmax(self.sigma_min[first:last])].copy() if last > first else None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write everything to a .npz file."""
        np.savez_compressed(Path(path), **{name: getattr(self, name) for name in self.__dataclass_fields__})


def load_reach_map(path: str | os.PathLike[str]) -> ReachMap:
    """Read a .npz file that ReachMap.save wrote; raises ArgumentError if it is none."""
    try:
        with np.load(path, allow_pickle=False) as file:
            values: dict[str, Any] = {name: file[name] for name in ReachMap.__dataclass_fields__}
    except (OSError, ValueError, KeyError) as error:
        raise ArgumentError(f'{path}: no reach map ({error})') from error
    x, y, z = values['shape'].tolist()
    return ReachMap(
        tuple(map(str, values['joint_names'])), str(values['base_frame']), values['corner'], float(values['step']),
        (x, y, z), int(values['parts']), values['cells'], values['q'], values['sigma_min'],
        values['clearance'],
    )  # fmt: skip


def reach_map(
    arm: Arm,
    step: float | None = None,
    parts: int = 3,
    box: ArrayLike | None = None,
    samples_count: int = SAMPLES,
    rounds: int = ROUNDS,
    options: SolveOptions | None = None,
    world: World | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> ReachMap:
    """Map what an arm can reach.

    Parameters
    ----------
    arm : Arm
    step : float, optional
        Edge of a position cell [m]; default: a 21st of the box's longest side.
    parts : int
        The rotations are cut into 4 parts^3 cells, each about 90 / parts degrees wide.
    box : (2, 3) array, optional
        Lowest and highest corner of the grid in the base frame [m]; default: all that the arm can reach.
    samples_count : int
        Random configurations.
    rounds : int
        At most so many rounds of steps from reached cells into their neighbours.
    options : SolveOptions, optional
        Only `avoid_collisions` and `collision_margin` count.
    world : World, optional
        As in `solve`.
    workers : int, optional
        Threads; default: one for each core that this process may use. The map does not depend on it.
    progress : callable, optional
        Called with the number of steps done since the last call, of 8 + rounds in all.

    Raises
    ------
    ArgumentError
        If an argument is out of range, or if the arm slides without end and no box is given.

    """
    problem = reach_problem(arm, step, parts, box, samples_count, rounds, options, world)
    return solve_reach_problem(problem, workers, progress)


@dataclass(frozen=True)
class ReachProblem:
    """All that a map is made of, in plain values: another process can make it (apart.py).

    model: a packed arm, with a packed scene behind it if contact counts.
    """

    joint_names: tuple[str, ...]
    base_frame: str
    model: np.ndarray
    lower: np.ndarray  # (n,) of the configurations that are tried [rad, m]
    upper: np.ndarray  # (n,)
    corner: np.ndarray  # (3,) [m]
    step: float  # m
    shape: tuple[int, int, int]
    parts: int
    margin: float  # m
    samples: int
    rounds: int

    @property
    def grid(self) -> tuple[np.ndarray, float, np.ndarray, int]:
        """The cells, as compiled code takes them."""
        return self.corner, self.step, np.array(self.shape), self.parts


def reach_problem(
    arm: Arm, step: float | None = None, parts: int = 3, box: ArrayLike | None = None, samples_count: int = SAMPLES,
    rounds: int = ROUNDS, options: SolveOptions | None = None, world: World | None = None,
) -> ReachProblem:  # fmt: skip
    """Check the arguments of `reach_map` and return what they mean; raises ArgumentError."""
    options = options or SolveOptions()
    corner, step, shape = _grid(arm, step, box)
    if parts < 1 or math.prod(shape) * FACES * parts**3 > MOST_CELLS:
        raise ArgumentError(f'step = {step:.4g} m and parts = {parts} make {math.prod(shape)} positions with '
                            f'{FACES * parts**3} rotations each; expected at most {MOST_CELLS} cells in all')
    model = arm.packed
    if options.avoid_collisions and arm.shaped:
        model = arm.contacts.room(world).behind(model)
    lower, upper = sampling_range(arm.geometry)
    return ReachProblem(arm.joint_names, arm.base_frame, model, lower, upper, corner, step, shape, parts,
                        options.collision_margin, samples_count, rounds)  # fmt: skip


def solve_reach_problem(
    problem: ReachProblem, workers: int | None = None, progress: Progress | None = None
) -> ReachMap:
    """Make the map of a problem, as `reach_map` does."""
    work = _Work(problem, progress)
    with ThreadPoolExecutor(workers or len(os.sched_getaffinity(0))) as pool:
        work.sample(pool)
        left = problem.rounds
        while left and work.aim(pool):
            left -= 1
            work.advance(1)
        work.advance(left)
        return work.finish(pool)


def _grid(arm: Arm, step: float | None, box: ArrayLike | None) -> tuple[np.ndarray, float, tuple[int, int, int]]:
    """Return corner (3,), edge of a cell and shape of the grid."""
    if box is None:
        reach = make_reach(arm.geometry)
        radius = float(reach.lengths[1])
        if not math.isfinite(radius):
            raise ArgumentError('the arm slides without end; expected a box, its lowest and highest corner [m]')
        corners = np.array([reach.in_base - radius, reach.in_base + radius])
    else:
        corners = np.array(box, dtype=np.float64)
        if corners.shape != (2, 3) or not np.isfinite(corners).all() or not (corners[1] > corners[0]).all():
            raise ArgumentError(f'box = {corners.tolist()}; expected its lowest and its highest corner [m]')
    sides = corners[1] - corners[0]
    edge = float(sides.max()) / ACROSS if step is None else float(step)
    if not (math.isfinite(edge) and edge > 0.0):
        raise ArgumentError(f'step = {edge}; expected a length above 0 [m]')
    x, y, z = np.maximum(np.ceil(sides / edge - 1e-9), 1).astype(int).tolist()
    return corners[0], edge, (x, y, z)


class _Work:
    """A map in the making."""

    def __init__(self, problem: ReachProblem, progress: Progress | None) -> None:
        self._problem, self._grid = problem, problem.grid
        self.advance = progress or (lambda steps: None)
        self._n = len(problem.lower)
        self._rotations = FACES * problem.parts**3
        self._cells = math.prod(problem.shape) * self._rotations
        self._known = np.zeros(self._cells, np.bool_)
        self._q = np.empty((0, self._n))
        self._index = np.full(self._cells, UNKNOWN, np.int64)  # rows of q by cell
        self._other = self._index.copy()  # the same of another configuration, for some of the cells

    def sample(self, pool: ThreadPoolExecutor) -> None:
        """Fill cells with random configurations."""
        problem = self._problem
        lower, spans = problem.lower, problem.upper - problem.lower
        ends = np.linspace(0, problem.samples, CHUNKS + 1).astype(np.int64)

        def run(k: int) -> np.ndarray:
            found = np.full(self._cells, UNKNOWN, np.int64)
            mark_samples(problem.model, lower, spans, *self._grid, ends[k], ends[k + 1] - ends[k], problem.margin,
                         found)  # fmt: skip
            return found

        first, last = np.full((2, self._cells), UNKNOWN, np.int64)
        for found in pool.map(run, range(CHUNKS)):
            first = np.where(first == UNKNOWN, found, first)
            last = np.where(found == UNKNOWN, last, found)
            self.advance(1)
        cells = np.flatnonzero(first != UNKNOWN)
        self._take(cells, samples(first[cells], lower, spans))
        cells = np.flatnonzero(last != first)  # more than one chunk came there
        self._other[cells] = len(self._q) + np.arange(len(cells))
        self._q = np.concatenate([self._q, samples(last[cells], lower, spans)])

    def _take(self, cells: np.ndarray, q: np.ndarray) -> None:
        self._index[cells] = len(self._q) + np.arange(len(cells))
        self._q = np.concatenate([self._q, q])
        self._known[cells] = True

    def aim(self, pool: ThreadPoolExecutor) -> int:
        """Step from reached cells into those beside them that are not reached, from both configurations that are known
        of a cell; return how many cells are new."""
        before, problem = len(self._q), self._problem
        cells, beside = self._border()
        for index in (self._index, self._other):
            sources = index[beside]
            chosen = np.flatnonzero((sources != UNKNOWN) & ~self._known[cells])
            goals, starts, known = cells[chosen], self._q[sources[chosen]], self._known.copy()
            ends = np.linspace(0, len(goals), CHUNKS + 1).astype(np.int64)

            def run(k: int, goals: np.ndarray = goals, starts: np.ndarray = starts, ends: np.ndarray = ends,
                    known: np.ndarray = known) -> Any:
                """Chunks that wait for a thread must not see what others have found meanwhile: `known` is a copy."""
                part = slice(ends[k], ends[k + 1])
                out = np.empty((2 * (ends[k + 1] - ends[k]) + 1, self._n))
                count = mark_aimed(problem.model, goals[part], starts[part], problem.lower, problem.upper, *self._grid,
                                   problem.margin, known.copy(), out)  # fmt: skip
                return out[:count]

            for q in pool.map(run, range(CHUNKS)):
                found, _ = look_at(problem.model, q, *self._grid)
                new = ~self._known[found]
                self._take(found[new], q[new])
        return len(self._q) - before

    def _border(self) -> tuple[np.ndarray, np.ndarray]:
        """Return pairs of neighbours, in position or rotation: cells (k,) that are not reached, ascending, and cells
        (k,) that are."""
        known = self._known.reshape(*self._problem.shape, self._rotations)
        number = np.arange(self._cells).reshape(known.shape)
        cells, beside = [], []
        for axis in range(3):
            behind, before = [slice(None)] * 4, [slice(None)] * 4
            behind[axis], before[axis] = slice(1, None), slice(0, -1)
            for one, other in ((tuple(behind), tuple(before)), (tuple(before), tuple(behind))):
                pairs = ~known[one] & known[other]
                cells.append(number[one][pairs])
                beside.append(number[other][pairs])
        for column in rotation_neighbours(self._problem.parts).T:
            pairs = ~known & known[..., column]
            cells.append(number[pairs])
            beside.append(number[..., column][pairs])
        order = np.argsort(np.concatenate(cells), kind='stable')
        return np.concatenate(cells)[order], np.concatenate(beside)[order]

    def finish(self, pool: ThreadPoolExecutor) -> ReachMap:
        """Return the map."""
        problem = self._problem
        cells = np.flatnonzero(self._known)
        q = self._q[self._index[cells]]
        looks = pool.map(lambda rows: look_at(problem.model, rows, *self._grid), np.array_split(q, CHUNKS))
        sigmas = np.concatenate([sigma for _, sigma in looks])
        scene, clearances = problem.model[packed_size(problem.model) :], np.full(len(q), np.nan)
        if len(scene):
            parts = pool.map(lambda rows: clearances_of(scene, rows)[:, 0], np.array_split(q, CHUNKS))
            clearances = np.concatenate(list(parts))
        return ReachMap(problem.joint_names, problem.base_frame, problem.corner, problem.step, problem.shape,
                        problem.parts, cells, q, sigmas, clearances)  # fmt: skip
