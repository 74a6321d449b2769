"""Samples of a path: straight lines and arcs through its poses, in short steps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ros_ik_pkg.ik.exceptions import ArgumentError
from ros_ik_pkg.ik.path.path_options import PathOptions

ROTATION_TOLERANCE = 1e-3  # largest component of R R^T - I that still counts as a rotation
SAME_POSITION = 1e-9  # m
SAME_ANGLE = 1e-9  # rad
MOST_SAMPLES = 2_000_000
SAG = 0.1  # distance of a chord from its arc, as a share of the tolerance


class Samples(NamedTuple):
    """Poses along a path, no two in succession equal."""

    poses: np.ndarray  # (N, 4, 4) of the tip in the base frame [m]
    place: np.ndarray  # (N,) index of the given pose before, plus the fraction of the way to the next


def read_poses(poses: Any) -> np.ndarray:
    """Return poses (N, 4, 4) in float64 with exact rotations; raise ArgumentError that names the wrong pose."""
    try:
        array = np.array([getattr(pose, 'homogeneous', pose) for pose in poses], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f'poses are not an array of numbers of shape (N, 4, 4): {error}') from None
    if array.ndim != 3 or array.shape[1:] != (4, 4):
        raise ArgumentError(f'poses have shape {array.shape}; expected (N, 4, 4)')
    if len(array) < 2:
        raise ArgumentError(f'the path has {len(array)} pose; expected 2 or more')
    rotations = array[:, :3, :3]
    finite = np.asarray(np.isfinite(array).all(axis=(1, 2)))  # NumPy before 2.5 types it as one bool or an array
    with np.errstate(invalid='ignore', over='ignore'):
        skew = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
        good = finite & (skew < ROTATION_TOLERANCE) & (array[:, 3] == (0.0, 0.0, 0.0, 1.0)).all(axis=1)
    good[good] = np.linalg.det(rotations[good]) > 0.0
    if not good.all():
        k = int(np.argmin(good))
        wrong = 'is not finite' if not finite[k] else (
            'is no homogeneous matrix with a right-handed rotation (R R^T = I within 1e-3) and the last row 0 0 0 1')
        raise ArgumentError(f'pose {k} {wrong}: {array[k].tolist()}')
    u, _, v = np.linalg.svd(rotations)
    array[:, :3, :3] = u @ v
    return array


def read_stamps(stamps: Any, count: int) -> np.ndarray:
    """Return the times (N,) of the poses [s]; raise ArgumentError that names the pose whose time does not rise."""
    try:
        times = np.array(stamps, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f'stamps are not an array of numbers: {error}') from None
    if times.shape != (count,):
        raise ArgumentError(f'stamps have shape {times.shape}; expected ({count},), one for each pose')
    if not np.isfinite(times).all():
        k = int(np.argmin(np.isfinite(times)))
        raise ArgumentError(f'the stamp of pose {k} is {times[k]}; expected a finite number [s]')
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        k = int(late[0]) + 1
        raise ArgumentError(f'stamps run back: pose {k} is at {times[k]:g} s, pose {k - 1} at {times[k - 1]:g} s')
    return times


def sample_arcs(
    poses: Any, vias: Sequence[int], stamps: Any = None, tolerance: float = PathOptions().tolerance
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """Return a path of straight lines in place of one with arcs: a nav_msgs/Path holds no arcs.

    Parameters
    ----------
    poses, vias, stamps : as in solve_path
    tolerance : float, optional
        That of the path [m]; the lines leave the arcs by at most a tenth of it.

    Returns
    -------
    poses : (M, 4, 4) array
    stamps : (M,) array or None
    place : (M,) array
        For each pose the index of the given pose before it, plus the fraction of the way to the next.

    Raises
    ------
    ArgumentError
        As solve_path does. The text names the pose.

    """
    given = read_poses(poses)
    times = None if stamps is None else read_stamps(stamps, len(given))
    if not len(vias):
        return given, times, np.arange(len(given), dtype=float)
    samples = sample_path(given, vias, math.inf, math.inf, tolerance, times is not None)
    if times is not None:
        times = np.interp(samples.place, np.arange(len(times)), times)
    return samples.poses, times, samples.place


def sample_path(
    poses: np.ndarray, vias: Sequence[int], step: float, angle_step: float, tolerance: float, stamped: bool
) -> Samples:
    """Return samples of the path through poses (N, 4, 4); solve_path describes lines, arcs and steps."""
    centres = _check_vias(vias, len(poses))
    moved = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    turned = rotation_vectors(poses[:-1, :3, :3], poses[1:, :3, :3])
    angles = np.linalg.norm(turned, axis=1)
    still = (moved <= SAME_POSITION) & (angles <= SAME_ANGLE)
    if still.all():
        raise ArgumentError('the path has no length: pose 1 and all after it equal pose 0')
    if stamped and still.any():
        k = int(np.argmax(still))
        raise ArgumentError(f'pose {k + 1} equals pose {k}, but has a stamp of its own: the tip cannot wait on a path')
    counts = np.where(still, 0, np.maximum(1, np.ceil(np.maximum(moved / step, angles / angle_step) - 1e-9)))
    arcs = {}
    for k in centres:
        arc = _Arc(poses[k - 1], poses[k], poses[k + 1], k)
        chord = min(step, math.sqrt(8.0 * arc.radius * SAG * tolerance))
        for i in (0, 1):
            arcs[k - 1 + i] = arc
            counts[k - 1 + i] = max(counts[k - 1 + i], math.ceil(arc.length(i) / chord))
    if not counts.sum() <= MOST_SAMPLES:
        raise ArgumentError(f'the path has {counts.sum():.3g} samples; expected {MOST_SAMPLES} at most: choose longer '
                            f'steps than {step:g} m and {angle_step:g} rad')
    counts = counts.astype(np.int64)
    segment = np.repeat(np.arange(len(counts)), counts)
    first = np.cumsum(counts) - counts
    fraction = (np.arange(counts.sum()) - first[segment] + 1) / counts[segment]
    out = np.empty((len(segment) + 1, 4, 4))
    start = int(np.argmax(~still))
    out[0] = poses[start]
    out[1:] = _interpolate(poses, turned, segment, fraction)
    for k, arc in arcs.items():
        inside = np.flatnonzero(segment == k)
        out[1 + inside, :3, 3] = arc.positions(k - arc.via + 1, fraction[inside])
    return Samples(out, np.concatenate([[start], segment + fraction]))


def _interpolate(poses: np.ndarray, turned: np.ndarray, segment: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    """Return poses at fractions of straight segments; at fraction 1 exactly the given pose."""
    out = np.empty((len(segment), 4, 4))
    a, b = poses[segment], poses[segment + 1]
    out[:, :3, 3] = a[:, :3, 3] + fraction[:, None] * (b[:, :3, 3] - a[:, :3, 3])
    out[:, :3, :3] = rotations_of(fraction[:, None] * turned[segment]) @ a[:, :3, :3]
    out[:, 3] = (0.0, 0.0, 0.0, 1.0)
    ends = fraction == 1.0
    out[ends] = b[ends]
    return out


def rotations_of(vectors: np.ndarray) -> np.ndarray:
    """Return rotations (N, 3, 3) of rotation vectors (N, 3) [rad] (formula of Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    skew = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    half = np.sinc(0.5 * angle / math.pi)
    return np.eye(3) + np.sinc(angle / math.pi) * skew + 0.5 * half * half * (skew @ skew)


def rotation_vectors(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return (N, 3): axis times angle [rad] of the rotations after before^T, (N, 3, 3) each, by quaternions."""
    R = after @ before.transpose(0, 2, 1)
    d0, d1, d2 = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    # Four times the outer product of the quaternion (w, x, y, z) with itself; the longest row is the best conditioned.
    p, m, s = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    xy, xz, yz = R[:, 0, 1] + R[:, 1, 0], R[:, 0, 2] + R[:, 2, 0], R[:, 1, 2] + R[:, 2, 1]
    outer = np.stack([
        np.stack([1.0 + d0 + d1 + d2, p, m, s], axis=1),
        np.stack([p, 1.0 + d0 - d1 - d2, xy, xz], axis=1),
        np.stack([m, xy, 1.0 - d0 + d1 - d2, yz], axis=1),
        np.stack([s, xz, yz, 1.0 - d0 - d1 + d2], axis=1),
    ], axis=1)  # fmt: skip
    longest = np.argmax(np.einsum('kii->ki', outer), axis=1)
    quaternion = outer[np.arange(len(R)), longest]
    quaternion *= np.where(quaternion[:, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(quaternion[:, 1:], axis=1)
    angle = 2.0 * np.arctan2(sine, quaternion[:, 0])
    scale = np.divide(angle, sine, out=np.zeros_like(sine), where=sine > 0.0)
    return scale[:, None] * quaternion[:, 1:]


def _check_vias(vias: Sequence[int], count: int) -> list[int]:
    """Return the sorted indices of vias; raise ArgumentError for an index that cannot be one."""
    for k in vias:
        if isinstance(k, bool) or not isinstance(k, (int, np.integer)) or not 0 < k < count - 1:
            raise ArgumentError(f'via {k!r} is not the index of a pose between the first and the last ({count} poses)')
    centres = sorted({int(k) for k in vias})
    for a, b in itertools.pairwise(centres):
        if b - a < 2:
            raise ArgumentError(f'poses {a} and {b} are both vias: expected a pose between two arcs')
    return centres


class _Arc:
    """The arc from the position of the first pose through the second to the third."""

    def __init__(self, start: np.ndarray, via: np.ndarray, end: np.ndarray, index: int) -> None:
        p, q, r = start[:3, 3], via[:3, 3], end[:3, 3]
        a, b = q - p, r - p
        normal = np.cross(a, b)
        square = normal @ normal
        if square <= (1e-6 * max(a @ a, b @ b)) ** 2:
            raise ArgumentError(f'poses {index - 1}, {index} and {index + 1} lie on a line: no arc leads through them')
        to_centre = (np.cross(normal, a) * (b @ b) + np.cross(b, normal) * (a @ a)) / (2.0 * square)
        self.via, self.centre, self.radius = index, p + to_centre, float(np.linalg.norm(to_centre))
        self._x = -to_centre / self.radius
        self._y = np.cross(normal / math.sqrt(square), self._x)
        self._angles = (0.0, *(self._angle(point) for point in (q, r)))

    def _angle(self, point: np.ndarray) -> float:
        """Return the angle from the start of the arc to a point of the circle, in the direction of the arc [rad]."""
        away = point - self.centre
        return math.atan2(away @ self._y, away @ self._x) % (2.0 * math.pi)

    def length(self, half: int) -> float:
        """Return the length of a half [m]: 0 from the start to the via, 1 from the via to the end."""
        return self.radius * (self._angles[half + 1] - self._angles[half])

    def positions(self, half: int, fraction: np.ndarray) -> np.ndarray:
        """Return the positions (N, 3) at fractions of one half [m]."""
        angle = self._angles[half] + fraction * (self._angles[half + 1] - self._angles[half])
        return self.centre + self.radius * (np.cos(angle)[:, None] * self._x + np.sin(angle)[:, None] * self._y)
