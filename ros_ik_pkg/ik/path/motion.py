"""Times along a joint path: within all limits, with as few rests as possible, and the tip on its line between rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.path.edges import rotation_vectors
from ros_ik_pkg.ik.path.figures import line_errors
from ros_ik_pkg.ik.path.joint_path import JointPath
from ros_ik_pkg.ik.path.path_options import PathOptions
from ros_ik_pkg.ik.path.path_solution import BreakReason
from ros_ik_pkg.ik.path.problem import Problem
from ros_ik_pkg.ik.path.smoothing import sharpen
from ros_ik_pkg.ik.path.timing import time_path
from ros_ik_pkg.ik.path.waypoints import rotation_vectors as turns_between
from ros_ik_pkg.ik.path.waypoints import rotations_of

CORNER = 0.3  # rad between two steps of the joints: they rest at a sharper corner
UNKNOWN_VELOCITY = 1.0  # rad/s or m/s, for joints without a velocity limit
RAMP = 0.5  # s in which a joint without acceleration limit reaches its velocity limit
SHARE = 0.95  # of the tolerances, where the tip is compared with its line; the rest is for the places between
REFINEMENTS = 5  # rounds of inserting rows
STILL = 1e-9  # rad or m: rows this close count as equal
WAIT = 1e-3  # s between two equal rows


@dataclass(frozen=True)
class Motion:
    """Times, velocities and accelerations of the rows of a joint path (see PathSolution)."""

    durations: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    stops: np.ndarray  # (N,) bool
    errors: np.ndarray  # (N - 1, 2) of the tip from its line [m, rad]
    slowed: np.ndarray  # (N - 1,) bool


def make_motion(problem: Problem, path: JointPath) -> Motion:
    """Return the motion along a joint path.

    If the tip leaves its line between two rows at which the joints rest, rows are inserted there; if that does not
    help, the path ends there.
    """
    for _ in range(REFINEMENTS):
        if len(path.q) < 2:
            return _at_rest(path.q)
        motion, bad = _time_rows(problem, path)
        if not bad.any():
            return motion
        _put_between(problem, path, np.flatnonzero(bad))
    while len(path.q) > 1:
        motion, bad = _time_rows(problem, path)
        if not bad.any():
            return motion
        path.end_at(int(np.argmax(bad)), 'the tip would leave its line before {where}', BreakReason.SINGULARITY)
    return _at_rest(path.q)


def _at_rest(q: np.ndarray) -> Motion:
    """Return the motion of a path of one row or none."""
    nothing, still = np.empty(0), np.zeros(q.shape)
    return Motion(nothing, still, still, np.ones(len(q), bool), np.empty((0, 2)), np.empty(0, bool))


def _put_between(problem: Problem, path: JointPath, rows: np.ndarray) -> None:
    """Insert a row on the line in the middle of each interval that begins at `rows`, except beyond the limits."""
    start, end = path.poses[rows], path.poses[rows + 1]
    poses = start.copy()
    poses[:, :3, 3] = 0.5 * (start + end)[:, :3, 3]
    poses[:, :3, :3] = rotations_of(0.5 * turns_between(start[:, :3, :3], end[:, :3, :3])) @ start[:, :3, :3]
    q = 0.5 * (path.q[rows] + path.q[rows + 1])
    sharpen(problem.model, problem.solve, problem.exact, poses.reshape(-1, 4), q)
    lower, upper = problem.row_limits
    inside = ((q >= lower) & (q <= upper)).all(axis=1)
    rows, q, poses = rows[inside], q[inside], poses[inside]
    path.reconfigurations = [row + int((rows < row).sum()) for row in path.reconfigurations]
    path.sample = np.insert(path.sample, rows + 1, 0.5 * (path.sample[rows] + path.sample[rows + 1]))
    path.q, path.poses = np.insert(path.q, rows + 1, q, axis=0), np.insert(path.poses, rows + 1, poses, axis=0)


def _time_rows(problem: Problem, path: JointPath) -> tuple[Motion, np.ndarray]:
    """Return the motion of two rows or more, and (N - 1,) in which intervals the tip leaves its line although the
    joints rest at both ends."""
    q, rows = path.q, len(path.q)
    velocity, acceleration = motion_limits(problem.arm, problem.path)
    steps = np.diff(q, axis=0)
    least = _least_durations(problem, path)
    still = np.abs(steps).max(axis=1) <= STILL
    least[still] = np.maximum(least[still], WAIT)
    bend = _bends(steps)
    stops = np.zeros(rows, dtype=bool)
    stops[[0, -1]] = True
    stops[1:-1] = bend > CORNER
    stops[:-1][still] = stops[1:][still] = True
    changed = np.array([0, *path.reconfigurations] if path.led else path.reconfigurations, dtype=np.int64)
    stops[changed] = stops[changed + 1] = True
    poses = np.ascontiguousarray(path.poses).reshape(-1, 4)
    turns = rotation_vectors(poses)
    bend = np.concatenate([[np.inf], bend, [np.inf]])
    while True:
        durations, v, a = time_path(q, stops, least, velocity, acceleration)
        errors = line_errors(problem.model, problem.continuing, poses, turns, q, durations, v, a)
        errors[changed] = 0.0
        bad = (errors[:, 0] > SHARE * problem.path.tolerance) | (errors[:, 1] > SHARE * problem.path.angle_tolerance)
        bad |= _overshoots(q, durations, v, a, problem.limits)
        more = _more_stops(bad, stops, bend)
        if not len(more):
            break
        stops[more] = True
    fastest = (np.abs(steps) / velocity).max(axis=1)
    slowed = (least > 0.0) & (fastest > least) & ~still
    return Motion(durations, v, a, stops, errors, slowed), bad


def motion_limits(arm: Arm, path: PathOptions) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity and acceleration limits (n,) of a motion, all finite [rad/s, m/s], [rad/s^2, m/s^2]."""
    velocity = np.where(np.isfinite(arm.velocity_limits), arm.velocity_limits, UNKNOWN_VELOCITY)
    acceleration = np.minimum(arm.acceleration_limits, path.acceleration_limits or np.inf)
    return velocity, np.where(np.isfinite(acceleration), acceleration, velocity / RAMP)


def _least_durations(problem: Problem, path: JointPath) -> np.ndarray:
    """Return the shortest time of each interval between rows (N - 1,) [s]: its share of that between samples."""
    if not len(problem.least):
        return np.zeros(len(path.q) - 1)
    at = np.concatenate([[0.0], np.cumsum(problem.least)])
    return np.diff(np.interp(path.sample, np.arange(len(at)), at))


def _overshoots(
    q: np.ndarray, durations: np.ndarray, v: np.ndarray, a: np.ndarray, limits: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return (N - 1,) in which intervals a joint may leave its limits; from rest to rest it cannot.

    A polynomial stays within the range of its Bernstein coefficients.
    """
    h, (lower, upper) = durations[:, None], limits
    coefficients = np.stack([
        q[:-1] + 0.2 * h * v[:-1], q[:-1] + 0.4 * h * v[:-1] + 0.05 * h * h * a[:-1],
        q[1:] - 0.4 * h * v[1:] + 0.05 * h * h * a[1:], q[1:] - 0.2 * h * v[1:],
    ])  # fmt: skip
    return np.asarray(((coefficients < lower) | (coefficients > upper)).any(axis=(0, 2)))


def _bends(steps: np.ndarray) -> np.ndarray:
    """Return the angle between each step of the joints and the next [rad]."""
    lengths = np.linalg.norm(steps, axis=1)
    product = lengths[:-1] * lengths[1:]
    cosine = np.divide((steps[:-1] * steps[1:]).sum(axis=1), product, out=np.ones_like(product), where=product > 0.0)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _more_stops(bad: np.ndarray, stops: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """Return the rows at which the joints must rest too: for each bad interval, the end with the sharper corner unless
    they rest there already. Between two rests the joints move in a straight line, which was checked as an edge."""
    k = np.flatnonzero(bad)
    before = np.where(stops[k], -1.0, bend[k])
    after = np.where(stops[k + 1], -1.0, bend[k + 1])
    row = np.where(before >= after, k, k + 1)
    return row[np.maximum(before, after) >= 0.0]
