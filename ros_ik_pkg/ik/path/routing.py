"""The best route through candidates as joint positions: within the deadline, free of contact between poses too."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from ros_ik_pkg.ik.path.clear_of_room import ClearOfRoom
from ros_ik_pkg.ik.path.problem import TURN, Problem
from ros_ik_pkg.ik.path.route import extend_route, trace_route

CHUNK = 1000  # poses between two readings of the clock
MOST_NODES = 1024  # of a pose
REPAIRS = 50  # routes that are discarded at most because they touch between two poses
CONTACT_STEP = 0.02  # rad or m of the joint that moves most, between two checks of a motion for contact
IN_CONTACT = 'the arm is in contact before {where}'
NO_CLEAR_MOTION = 'the branch ends before {where}; each motion to another one that was tried is in contact'


@dataclass
class Route:
    """Joint positions at samples, as far as a route was found.

    q: (N, n) [rad, m]. sample: (N,) sample of each row. jumps: rows from which a reconfiguration leads to the next row,
    at the same sample. reached: number of samples. late: whether the deadline ended the route. contact: a sentence
    about {where} if contact ended it, else empty.
    """

    q: np.ndarray
    sample: np.ndarray
    jumps: list[int]
    reached: int
    late: bool = False
    contact: str = ''


def find_route(problem: Problem, candidates: np.ndarray, counts: np.ndarray) -> Route:
    """Return the best route through candidates (N, m, n), of which `counts` (N,) there are.

    A candidate that can only be reached through contact is taken out of them.
    """
    turns_apart = _most_turns(problem, candidates.shape[1])
    total = int(np.prod(turns_apart))
    digits = np.stack(np.unravel_index(np.arange(total), turns_apart, order='F'), axis=1)
    digits = np.ascontiguousarray(digits, dtype=np.int64)
    barred = np.empty((0, 2, problem.arm.n))
    for repair in range(REPAIRS + 1):
        nodes, changed, reached, late = _best_route(problem, candidates, counts, digits, barred)
        samples = np.cumsum(~changed) - 1
        raw = candidates[samples, nodes // total] + TURN * digits[nodes % total]
        q = _unwound(problem, raw)
        jumps = [int(row) - 1 for row in np.flatnonzero(changed)]
        touched = first_contact(problem, q)
        if touched is None or repair == REPAIRS or time.monotonic() > problem.stop_time:
            break
        if touched in jumps:
            barred = np.concatenate([barred, raw[None, touched : touched + 2]])
        else:
            _remove(candidates, counts, samples[touched + 1], nodes[touched + 1] // total)
    contact = NO_CLEAR_MOTION if len(barred) and reached < len(counts) and not late else ''
    if touched is not None:
        contact = NO_CLEAR_MOTION if touched in jumps else IN_CONTACT
        reached, late = int(samples[touched]) + 1 if touched >= 0 else 0, False
        q, samples = q[: touched + 1], samples[: touched + 1]
        jumps = [row for row in jumps if row < touched]
    return Route(q, samples, jumps, reached, late, contact)


def first_contact(problem: Problem, q: np.ndarray) -> int | None:
    """Return the first row from which the joints come into contact on the straight line to the next, -1 if the first
    row is in contact itself, None if there is none."""
    if problem.clear is None or not len(q):
        return None
    if not problem.clear(q[:1])[0]:
        return -1
    moved = np.diff(q, axis=0)
    counts = np.maximum(2, np.ceil(np.abs(moved).max(axis=1) / CONTACT_STEP)).astype(np.int64)
    row = np.repeat(np.arange(len(counts)), counts)
    part = np.arange(len(row)) - (np.cumsum(counts) - counts)[row] + 1
    step = moved[row] / counts[row, None]
    ends = q[row] + part[:, None] * step
    if isinstance(problem.clear, ClearOfRoom):
        good = problem.clear.lines(ends - step, ends)
    else:
        good = np.asarray(problem.clear(ends), dtype=bool)
    return None if good.all() else int(row[np.argmin(good)])


def _most_turns(problem: Problem, most: int) -> np.ndarray:
    """Return how many values whole turns apart each joint can have within its limits, (n,) int64."""
    lower, upper = problem.row_limits
    out = np.ones(problem.arm.n, np.int64)
    for j in np.flatnonzero(problem.arm.wraps)[::-1]:  # the last joints wind up first
        if np.isfinite(upper[j] - lower[j]):
            values = math.floor((upper[j] - lower[j]) / TURN - 1e-9) + 1
            out[j] = max(1, min(values, MOST_NODES // (most * int(np.prod(out)))))
    return out


def _best_route(
    problem: Problem, candidates: np.ndarray, counts: np.ndarray, digits: np.ndarray, barred: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int, bool]:
    """Return the nodes of the route, whether a reconfiguration leads to each, the number of samples reached, and
    whether the deadline ended the search."""
    count, most, n = candidates.shape
    total = len(digits)
    upper = problem.row_limits[1]
    weights = np.array(problem.options.joint_weights or (1.0,) * n)
    parents = np.empty((count, int(counts.max(initial=0)) * total), np.int16)
    jumps, costs = np.empty((2, most * total), np.int64), np.empty((2, most * total))
    reached, late = 0, False
    # A route that begins where the joints are is preferred.
    tries = [(True, 0)] if len(problem.seed) else []
    for stay, reconfigurations in [*tries, (False, problem.path.max_reconfigurations)]:
        reached = 0
        while reached < count and not late:
            stop = min(reached + CHUNK, count)
            now = extend_route(
                problem.model, problem.solve, problem.continuing, problem.poses, problem.turns, candidates, counts,
                upper, problem.arm.wraps, digits, weights, problem.most_steps, problem.bounds, problem.seed, stay,
                reconfigurations, barred, reached, stop, parents, jumps, costs,
            )  # fmt: skip
            problem.report(0)
            reached = now
            if now < stop:
                break
            late = reached < count and time.monotonic() > problem.stop_time
        if late or reached == count:
            break
    route = np.empty(2 * count, np.int64)
    route = route[: trace_route(parents, jumps, costs, counts, total, reached, route)]
    changed = route < 0
    return np.where(changed, -1 - route, route), changed, reached, late


def _unwound(problem: Problem, q: np.ndarray) -> np.ndarray:
    """Return joint positions (N, n) in which joints without limits move less than half a turn between rows, beginning
    near the seed."""
    q, (lower, upper) = q.copy(), problem.row_limits
    for j in range(problem.arm.n):
        if problem.arm.wraps[j] and not np.isfinite(upper[j] - lower[j]) and len(q):
            start = q[0, j]
            if len(problem.seed):
                start += TURN * np.round((problem.seed[j] - start) / TURN)
            steps = np.diff(q[:, j])
            q[:, j] = np.cumsum([start, *(steps - TURN * np.round(steps / TURN))])
            q[:, j] += TURN * np.ceil(max(0.0, lower[j] - q[:, j].min()) / TURN)
            q[:, j] -= TURN * np.ceil(max(0.0, q[:, j].max() - upper[j]) / TURN)
    return q


def _remove(candidates: np.ndarray, counts: np.ndarray, sample: int, candidate: int) -> None:
    """Remove one candidate of a pose."""
    last = counts[sample] - 1
    candidates[sample, candidate] = candidates[sample, last]
    counts[sample] = last
