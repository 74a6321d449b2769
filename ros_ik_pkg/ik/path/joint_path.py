"""Joint positions along the samples of a path: candidates, the best route through them, smoothing."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import numpy as np

from ros_ik_pkg.ik.path.candidates import find_candidates, normalise
from ros_ik_pkg.ik.path.edges import count_parts, cut_edges
from ros_ik_pkg.ik.path.path_solution import BreakReason
from ros_ik_pkg.ik.path.problem import Problem
from ros_ik_pkg.ik.path.routing import CHUNK, IN_CONTACT, Route, find_route, first_contact
from ros_ik_pkg.ik.path.smoothing import sharpen, smooth

MOST_BRANCHES = 16  # isolated solutions of a pose, not counting whole turns (Manseur and Doty 1989)
MOST_MEMORY = 1e9  # bytes of candidates
DENSER = 3  # times as many candidates in the second search for a redundant arm
SPACING = 0.05  # rad or m: of two closer candidates of a redundant arm one is enough, an edge leads to it
WIDTHS = (128, 32, 8, 2)  # poses to either side over which the joints of redundant arms are averaged
PASSES = 3  # with each width
SHORTER = 0.999  # a pass that leaves more than this share of the length is the last one of its width
THERE = 1e-6  # rad or m: a seed this near to the start of the path needs no lead-in


@dataclass
class JointPath:
    """Joint positions along a path, as far as it could be followed."""

    q: np.ndarray  # (N, n) [rad, m]
    sample: np.ndarray  # (N,) index of the sample, plus the fraction of the way to the next
    poses: np.ndarray  # (N, 4, 4)
    reached: int  # samples
    late: bool = False
    why: str = ''  # what ended it, if known: a sentence about {where}
    reason: BreakReason = BreakReason.CONTACT  # in a word
    reconfigurations: list[int] = field(default_factory=list)  # rows after which the next is at the same pose
    led: bool = False  # whether the first row is the seed, off the path

    def end_at(self, row: int, why: str, reason: BreakReason) -> None:
        """Remove all rows after this one, -1 for all rows."""
        self.reached = int(self.sample[row]) + 1 if row >= 0 else 0
        self.late, self.why, self.reason = False, why, reason
        self.q, self.sample, self.poses = (rows[: row + 1] for rows in (self.q, self.sample, self.poses))
        self.reconfigurations = [before for before in self.reconfigurations if before < row]
        self.led = self.led and row > 0


def follow(problem: Problem) -> JointPath:
    """Return joint positions for as many samples as can be followed."""
    n = problem.arm.n
    route = _find_best_route(problem)
    path = JointPath(np.empty((0, n)), np.empty(0), np.empty((0, 4, 4)), route.reached, route.late, route.contact)
    if not route.reached:
        return path
    q, sample, jumps, parts = route.q, route.sample, route.jumps, []
    for first, last in zip([0, *(row + 1 for row in jumps)], [*jumps, len(q) - 1]):
        stretch = q[first : last + 1]
        if problem.spare and len(stretch) > 2:
            stretch = _smoothed(problem, stretch, int(sample[first]))
        parts.append(_cut(problem, stretch, int(sample[first])))
    path.q, path.sample, path.poses = (np.concatenate(rows) for rows in zip(*parts))
    path.reconfigurations = [int(row) for row in np.cumsum([len(part[0]) for part in parts])[:-1] - 1]
    _end_before_faults(problem, path)
    if problem.path.lead_in and len(problem.seed) and len(path.q) and np.abs(path.q[0] - problem.seed).max() > THERE:
        _lead_in(problem, path)
    return path


def _find_best_route(problem: Problem) -> Route:
    """Return the best route. Reconfigurations, and breaks at poses that have a solution, are accepted only after a
    second, thorough search: through more candidates for a redundant arm, with longer edges for another one."""
    most = problem.path.samples if problem.spare else MOST_BRANCHES
    route, final = _search(replace(problem, path=replace(problem.path, max_reconfigurations=0)), most)
    if final:
        return route
    if time.monotonic() > problem.stop_time:
        return replace(route, late=True)
    second = replace(problem, thorough=True, progress=lambda _: problem.report(0))
    thorough, _ = _search(second, DENSER * most if problem.spare else most)
    return max(thorough, route, key=lambda found: (found.reached, -len(found.jumps)))


def _search(problem: Problem, most: int) -> tuple[Route, bool]:
    """Return the best route through up to `most` candidates of each pose, and whether another search cannot improve a
    route without reconfigurations: it is whole, or the pose after its end has no solution."""
    candidates, counts, looked_at = _find_candidates(problem, most)
    route = find_route(problem, candidates[:looked_at], counts[:looked_at])
    if route.reached == looked_at < len(problem.samples.poses):
        route.late = True
    return route, route.reached == looked_at or not counts[route.reached]


def _end_before_faults(problem: Problem, path: JointPath) -> None:
    """End the path before a row beyond a limit or in contact: cutting and smoothing move rows a little."""
    lower, upper = problem.row_limits
    beyond = np.flatnonzero(((path.q < lower) | (path.q > upper)).any(axis=1))
    last = first_contact(problem, path.q)
    why, reason = IN_CONTACT, BreakReason.CONTACT
    if len(beyond) and (last is None or beyond[0] <= last):
        last, why, reason = int(beyond[0]) - 1, 'a joint comes to its limit before {where}', BreakReason.LIMIT
    if last is not None:
        path.end_at(last, why, reason)


def _lead_in(problem: Problem, path: JointPath) -> None:
    """Put the seed before the path; remove the path if the joints cannot move to it in a straight line."""
    q = np.concatenate([problem.seed[None], path.q])
    lower, upper = problem.limits
    outside = bool(np.any((problem.seed < lower) | (problem.seed > upper)))
    if outside or first_contact(problem, q[:2]) is not None:
        if outside:
            path.end_at(-1, 'the joints are beyond their limits, no motion leads to {where}', BreakReason.LIMIT)
        else:
            path.end_at(-1, 'the straight motion of the joints from where they are to {where} is in contact',
                        BreakReason.CONTACT)  # fmt: skip
        return
    path.q, path.sample = q, np.concatenate([path.sample[:1], path.sample])
    path.poses = np.concatenate([problem.arm.forward(problem.seed)[None], path.poses])
    path.reconfigurations, path.led = [row + 1 for row in path.reconfigurations], True


def _find_candidates(problem: Problem, most: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Return up to `most` candidates of each pose (N, m, n), their numbers, and for how many poses there was time."""
    count, n = len(problem.samples.poses), problem.arm.n
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
            problem.model, problem.solve, problem.continuing, searching, problem.poses, seed.copy(),
            SPACING if problem.spare else 0.0, done, stop, candidates, counts, since,
        )  # fmt: skip
        problem.report(stop - done)
        done = stop
        if time.monotonic() > problem.stop_time:
            break
    lower, upper = problem.row_limits
    normalise(candidates[:done], counts[:done], lower, upper, problem.arm.wraps)
    _keep_allowed(problem, candidates, counts, done)
    return candidates, counts, done


def _keep_allowed(problem: Problem, candidates: np.ndarray, counts: np.ndarray, done: int) -> None:
    """Remove candidates in contact, and those that no whole turns bring within the limits."""
    lower, upper = problem.row_limits
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


def _smoothed(problem: Problem, q: np.ndarray, first: int) -> np.ndarray:
    """Return a joint path for the samples from `first` on whose weighted length is at most that of q."""
    last = first + len(q)
    weights = np.array(problem.options.joint_weights or (1.0,) * problem.arm.n)

    def length(path: np.ndarray) -> float:
        return float(np.linalg.norm(weights * np.diff(path, axis=0), axis=1).sum())

    lower, upper = problem.row_limits
    best, fresh = np.ascontiguousarray(q), np.empty_like(q)
    for width in WIDTHS:
        for _ in range(PASSES):
            if time.monotonic() > problem.stop_time:
                return best
            good = smooth(
                problem.model, problem.solve, problem.continuing, problem.poses[4 * first : 4 * last],
                problem.turns[first : last - 1], best, width, problem.most_steps[first : last - 1], problem.bounds,
                fresh,
            ) and np.all((fresh >= lower) & (fresh <= upper))  # fmt: skip
            good = good and first_contact(problem, fresh) is None
            gain = length(fresh) / max(length(best), 1e-12) if good else 1.0
            if gain >= 1.0:
                break
            best, fresh = fresh, np.empty_like(q)
            if gain > SHORTER:
                break
    return best


def _cut(problem: Problem, q: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q with a row at each cut of its edges, the samples of the rows, and their poses."""
    last = first + len(q)
    poses, turns = problem.poses[4 * first : 4 * last], problem.turns[first : last - 1]
    parts = np.empty(len(q) - 1, np.int64)
    q = np.ascontiguousarray(q)
    count_parts(problem.model, problem.solve, problem.continuing, poses, turns, q, problem.bounds, parts)
    parts = np.maximum(parts, 1)
    total = int(parts.sum()) + 1
    rows, places, cut = np.empty((total, problem.arm.n)), np.empty(total), np.empty((total, 4, 4))
    cut_edges(
        problem.model, problem.solve, problem.continuing, poses, turns, q, problem.bounds, parts, rows, places, cut
    )
    lower, upper = problem.row_limits
    sharp = rows.copy()
    sharpen(problem.model, problem.solve, problem.exact, cut.reshape(-1, 4), sharp)
    inside = np.all((sharp >= lower) & (sharp <= upper), axis=1)
    rows[inside] = sharp[inside]
    return rows, first + places, cut
