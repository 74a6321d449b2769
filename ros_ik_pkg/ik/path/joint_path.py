"""From samples of a path to joint positions at each of them: candidates, the best route through them, smoothing."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.kernel.data_layout import GEOMETRY_JOINTS, HEADER, Tuning
from ros_ik_pkg.ik.options import SolveOptions
from ros_ik_pkg.ik.path.candidates import find_candidates, normalise
from ros_ik_pkg.ik.path.edges import MOST_PARTS, count_parts, cut_edges, rotation_vectors
from ros_ik_pkg.ik.path.path_options import PathOptions
from ros_ik_pkg.ik.path.route import best_route
from ros_ik_pkg.ik.path.smoothing import sharpen, smooth
from ros_ik_pkg.ik.path.waypoints import Samples

TURN = 2.0 * math.pi
EXACT = 1e-11  # m, rad: error of the rows of the path
CHUNK = 1000  # poses between two looks at the clock
MOST_BRANCHES = 16  # isolated solutions of a pose, whole turns aside (Manseur and Doty 1989)
MOST_NODES = 1024  # of a pose, whole turns included
MOST_MEMORY = 1e9  # bytes of candidates
MARGIN = 0.75  # share of the tolerance that an edge may use, the rest is for the curved motion along it
EDGE = (1.0, MOST_PARTS)  # longest step of a joint [rad or m], parts at most
EDGE_SPARE = (0.25, 4)  # the same for arms with joints to spare, where a long step is a motion of its own
WIDTHS = (128, 32, 8, 2)  # poses to either side over which joints to spare are averaged
PASSES = 3  # with each width
SHORTER = 0.999  # what a pass must gain to be followed by another
REPAIRS = 50  # times that a route in contact between two poses is replaced by another

Clear = Callable[[np.ndarray], np.ndarray]


@dataclass
class Problem:
    """One path for one arm."""

    arm: Arm
    samples: Samples
    seed: np.ndarray  # (n,), or (0,) if the path may begin anywhere
    options: SolveOptions
    path: PathOptions
    least: np.ndarray  # (N - 1,) times that the intervals may take at least [s]
    clear: Clear | None
    stop_time: float  # of time.monotonic
    progress: Callable[[int], object] | None

    @cached_property
    def poses(self) -> np.ndarray:
        """(4 N, 4), as the compiled code takes them."""
        return np.ascontiguousarray(self.samples.poses).reshape(-1, 4)

    @cached_property
    def turns(self) -> np.ndarray:
        """(N - 1, 3) rotations from each sample to the next [rad]."""
        return rotation_vectors(self.poses)

    @cached_property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limits (n,), infinite if they are not respected."""
        if self.options.respect_limits:
            return self.arm.lower, self.arm.upper
        return np.full(self.arm.n, -np.inf), np.full(self.arm.n, np.inf)

    @cached_property
    def model(self) -> np.ndarray:
        """The packed arm, without limits of joints that may turn round: a branch goes on beyond them."""
        packed, n, joints = self.arm.packed.copy(), self.arm.n, len(self.arm.prismatic)
        first = HEADER + 12 * (joints + 1) + GEOMETRY_JOINTS * joints
        free = self.arm.wraps != 0
        packed[first : first + n][free] = -np.inf
        packed[first + n : first + 2 * n][free] = np.inf
        return packed

    @cached_property
    def continuing(self) -> np.ndarray:
        """SolveOptions.numbers of one descent from a neighbour."""
        return replace(
            self.options, max_attempts=1, choice='first', deadline=0.0, max_joint_jump=0.0, null_space='none'
        ).numbers

    @cached_property
    def exact(self) -> np.ndarray:
        """The same, as exact as double precision allows with something to spare."""
        numbers = self.continuing.copy()
        for name, bound in (('position_tolerance', EXACT), ('orientation_tolerance', EXACT)):
            place = Tuning._fields.index(name)
            numbers[place] = min(numbers[place], bound)
        return numbers

    @cached_property
    def spare(self) -> bool:
        """Whether the joints can move while the task holds."""
        rows = zip(self.options.task_weights, self.options.task_tolerances)
        return self.arm.n > sum(weight > 0.0 and bound == 0.0 for weight, bound in rows)

    @cached_property
    def bounds(self) -> np.ndarray:
        """(4,) what edges are held to, see parts_of_edge."""
        longest = EDGE_SPARE if self.spare else EDGE
        return np.array([MARGIN * self.path.tolerance, MARGIN * self.path.angle_tolerance, *longest])

    @cached_property
    def most_steps(self) -> np.ndarray:
        """(N - 1, n) how far the joints may move between two samples, inf if the tip may slow down."""
        if not self.path.keep_speed:
            return np.full((len(self.least), self.arm.n), np.inf)
        with np.errstate(invalid='ignore'):
            steps = self.least[:, None] * self.arm.velocity_limits
        steps[self.least == 0.0] = np.inf
        return np.nan_to_num(steps, nan=np.inf, posinf=np.inf)


@dataclass
class JointPath:
    """Joint positions along a path, as far as it could be followed."""

    q: np.ndarray  # (N, n) [rad, m]
    sample: np.ndarray  # (N,) sample, and the fraction of the way to the next
    poses: np.ndarray  # (N, 4, 4)
    reached: int  # samples
    late: bool = False
    reconfigurations: list[int] = field(default_factory=list)  # rows after which the next is at the same pose


def follow(problem: Problem) -> JointPath:
    """Find joint positions for as many samples as can be followed."""
    count, n = len(problem.samples.poses), problem.arm.n
    candidates, counts, looked_at = _find_candidates(problem)
    late = looked_at < count
    turns_apart = _most_turns(problem, candidates.shape[1])
    for _ in range(REPAIRS if problem.clear is not None else 1):
        nodes, samples, jumps, reached = _best_route(problem, candidates, counts, turns_apart, looked_at)
        q = _positions(problem, candidates, turns_apart, nodes, samples)
        touched = _touched_between(problem, q, jumps)
        if touched is None:
            break
        _remove(candidates, counts, samples[touched], nodes[touched] // int(np.prod(turns_apart)))
    else:
        if touched is not None:
            keep = samples < samples[touched]
            q, samples, reached = q[keep], samples[keep], int(samples[touched])
            jumps = [row for row in jumps if row + 1 < len(q)]
    path = JointPath(np.empty((0, n)), np.empty(0), np.empty((0, 4, 4)), reached, late)
    if not reached:
        return path
    parts = []
    for first, last in zip([0, *(row + 1 for row in jumps)], [*jumps, len(q) - 1]):
        stretch = q[first : last + 1]
        if problem.spare and len(stretch) > 2:
            stretch = _smoothed(problem, stretch, int(samples[first]))
        parts.append(_cut(problem, stretch, int(samples[first])))
    path.q, path.sample, path.poses = (np.concatenate(rows) for rows in zip(*parts))
    path.reconfigurations = [int(row) for row in np.cumsum([len(part[0]) for part in parts])[:-1] - 1]
    return path


def _find_candidates(problem: Problem) -> tuple[np.ndarray, np.ndarray, int]:
    """Return candidates (N, m, n), how many there are of each pose, and how many poses there was time for."""
    count, n = len(problem.samples.poses), problem.arm.n
    most = problem.path.samples if problem.spare else MOST_BRANCHES
    most = max(2, min(most, int(MOST_MEMORY / (8 * n * count))))
    attempts = min(problem.options.max_attempts, max(3 * most, 100)) if problem.spare else problem.options.max_attempts
    searching = replace(
        problem.options, choice='all', max_attempts=attempts, deadline=0.0, max_joint_jump=0.0, null_space='none'
    ).numbers
    candidates, counts = np.empty((count, most, n)), np.zeros(count, np.int64)
    since = np.zeros(1, np.int64)
    seed = problem.seed if len(problem.seed) else problem.arm.home
    done = 0
    while done < count:
        stop = min(done + CHUNK, count)
        find_candidates(
            problem.model, problem.continuing, searching, problem.poses, seed.copy(), done, stop, candidates, counts,
            since,
        )  # fmt: skip
        if problem.progress is not None:
            problem.progress(stop - done)
        done = stop
        if time.monotonic() > problem.stop_time:
            break
    lower, upper = problem.limits
    normalise(candidates[:done], counts[:done], lower, upper, problem.arm.wraps)
    _keep_allowed(problem, candidates, counts, done)
    return candidates, counts, done


def _keep_allowed(problem: Problem, candidates: np.ndarray, counts: np.ndarray, done: int) -> None:
    """Leave out candidates beyond the limits, whole turns aside, and those in contact."""
    lower, upper = problem.limits
    there = np.arange(candidates.shape[1]) < counts[:done, None]
    q = candidates[:done][there]
    good = np.all((q >= lower) & (q <= upper), axis=1)
    if problem.clear is not None:
        good[good] = np.asarray(problem.clear(q[good]), dtype=bool)
    if good.all():
        return
    places = np.argwhere(there)
    for k in np.unique(places[~good, 0]):
        kept = q[(places[:, 0] == k) & good]
        candidates[k, : len(kept)] = kept
        counts[k] = len(kept)


def _most_turns(problem: Problem, most: int) -> np.ndarray:
    """Return (n,) int64: how many values, whole turns apart, a joint can have between its limits."""
    lower, upper = problem.limits
    out = np.ones(problem.arm.n, np.int64)
    for j in np.flatnonzero(problem.arm.wraps)[::-1]:  # the last joints wind up first
        if np.isfinite(upper[j] - lower[j]):
            values = math.floor((upper[j] - lower[j]) / TURN - 1e-9) + 1
            out[j] = max(1, min(values, MOST_NODES // (most * int(np.prod(out)))))
    return out


def _best_route(
    problem: Problem, candidates: np.ndarray, counts: np.ndarray, turns_apart: np.ndarray, looked_at: int
) -> tuple[np.ndarray, np.ndarray, list[int], int]:
    """Return nodes, their samples, the rows after which joints are reconfigured, and how many samples were reached."""
    lower, upper = problem.limits
    weights = np.array(problem.options.joint_weights or (1.0,) * problem.arm.n)
    parents = np.empty((looked_at, candidates.shape[1] * int(np.prod(turns_apart))), np.int32)
    route = np.empty(2 * looked_at, np.int64)
    # Best from where the joints are, if that is a solution of the first pose.
    ways = [(True, 0)] if len(problem.seed) else []
    for stay, most in dict.fromkeys([*ways, (False, 0), (False, problem.path.max_reconfigurations)]):
        reached, _, length = best_route(
            problem.model, problem.continuing, problem.poses, problem.turns, candidates[:looked_at],
            counts[:looked_at], lower, upper, problem.arm.wraps, turns_apart, weights, problem.most_steps,
            problem.bounds, problem.seed, stay, most, parents, route,
        )  # fmt: skip
        if reached == looked_at:
            break
    changed = route[:length] < 0
    nodes = np.where(changed, -1 - route[:length], route[:length])
    samples = np.cumsum(~changed) - 1
    return nodes, samples, [int(row) - 1 for row in np.flatnonzero(changed)], int(reached)


def _positions(
    problem: Problem, candidates: np.ndarray, turns_apart: np.ndarray, nodes: np.ndarray, samples: np.ndarray
) -> np.ndarray:
    """Return the joint positions (N, n) of nodes; joints without limits go on from row to row."""
    total = int(np.prod(turns_apart))
    q = candidates[samples, nodes // total].copy()
    digits, (lower, upper) = nodes % total, problem.limits
    for j in range(problem.arm.n):
        q[:, j] += TURN * (digits % turns_apart[j])
        digits = digits // turns_apart[j]
        if problem.arm.wraps[j] and not np.isfinite(upper[j] - lower[j]) and len(q):
            start = q[0, j]
            if len(problem.seed):
                start += TURN * np.round((problem.seed[j] - start) / TURN)
            steps = np.diff(q[:, j])
            q[:, j] = np.cumsum([start, *(steps - TURN * np.round(steps / TURN))])
            q[:, j] += TURN * np.ceil(max(0.0, lower[j] - q[:, j].min()) / TURN)
            q[:, j] -= TURN * np.ceil(max(0.0, q[:, j].max() - upper[j]) / TURN)
    return q


def _touched_between(problem: Problem, q: np.ndarray, jumps: list[int]) -> int | None:
    """Return the first row to which the joints get by a contact in the middle of the step, None if there is none."""
    if problem.clear is None or len(q) < 2:
        return None
    good = np.asarray(problem.clear(0.5 * (q[:-1] + q[1:])), dtype=bool)
    good[jumps] = True
    return None if good.all() else int(np.argmin(good)) + 1


def _remove(candidates: np.ndarray, counts: np.ndarray, sample: int, candidate: int) -> None:
    """Take one candidate of a pose out."""
    last = counts[sample] - 1
    candidates[sample, candidate] = candidates[sample, last]
    counts[sample] = last


def _smoothed(problem: Problem, q: np.ndarray, first: int) -> np.ndarray:
    """Return a joint path for the samples from `first` on that is shorter, weighted, or the same one."""
    last = first + len(q)
    weights = np.array(problem.options.joint_weights or (1.0,) * problem.arm.n)

    def length(path: np.ndarray) -> float:
        return float(np.linalg.norm(weights * np.diff(path, axis=0), axis=1).sum())

    lower, upper = problem.limits
    best, fresh = np.ascontiguousarray(q), np.empty_like(q)
    for width in WIDTHS:
        for _ in range(PASSES):
            if time.monotonic() > problem.stop_time:
                return best
            good = smooth(
                problem.model, problem.continuing, problem.poses[4 * first : 4 * last], problem.turns[first : last - 1],
                best, width, problem.most_steps[first : last - 1], problem.bounds, fresh,
            ) and np.all((fresh >= lower) & (fresh <= upper))  # fmt: skip
            if good and problem.clear is not None:
                good = bool(np.all(problem.clear(fresh)) and np.all(problem.clear(0.5 * (fresh[:-1] + fresh[1:]))))
            gain = length(fresh) / max(length(best), 1e-12) if good else 1.0
            if gain >= 1.0:
                break
            best, fresh = fresh, np.empty_like(q)
            if gain > SHORTER:
                break
    return best


def _cut(problem: Problem, q: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q with a row for every cut of its edges, the samples of the rows and their poses."""
    last = first + len(q)
    poses, turns = problem.poses[4 * first : 4 * last], problem.turns[first : last - 1]
    parts = np.empty(len(q) - 1, np.int64)
    q = np.ascontiguousarray(q)
    count_parts(problem.model, problem.continuing, poses, turns, q, problem.bounds, parts)
    parts = np.maximum(parts, 1)
    total = int(parts.sum()) + 1
    rows, places, cut = np.empty((total, problem.arm.n)), np.empty(total), np.empty((total, 4, 4))
    cut_edges(problem.model, problem.continuing, poses, turns, q, problem.bounds, parts, rows, places, cut)
    lower, upper = problem.limits
    sharp = rows.copy()
    sharpen(problem.model, problem.exact, cut.reshape(-1, 4), sharp)
    inside = np.all((sharp >= lower) & (sharp <= upper), axis=1)
    rows[inside] = sharp[inside]
    return rows, first + places, cut
