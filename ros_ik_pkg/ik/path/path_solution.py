"""The result of solve_path: the joint path, its times, where it breaks and why."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np


class BreakReason(enum.StrEnum):
    """Why a path cannot be followed further."""

    REACH = 'reach'
    LIMIT = 'limit'
    SINGULARITY = 'singularity'
    BRANCH = 'branch'
    VELOCITY = 'velocity'
    CONTACT = 'contact'
    DEADLINE = 'deadline'


@dataclass(frozen=True)
class PathBreak:
    """Where a path breaks: `place` is the index of a given pose plus the fraction of the way to the next."""

    place: float
    reason: BreakReason
    text: str  # a sentence that names the pose


@dataclass(frozen=True)
class PathSolution:
    """A joint path and its times, as far as the path could be followed; N is 0 if the first pose has no solution.

    Between two rows the joints follow the polynomial of the fifth degree through positions, velocities and
    accelerations, as joint_trajectory_controller interpolates; the figures hold for that motion.

    Attributes
    ----------
    complete : bool
        Whether q leads to the last pose.
    q : (N, n) array
        Joint positions [rad, m].
    times : (N,) array
        From 0, rising [s].
    velocities, accelerations : (N, n) arrays
        [rad/s, m/s] and [rad/s^2, m/s^2]; zero where the joints rest.
    place : (N,) array
        Index of the given pose before, plus the fraction of the way to the next.
    base_from_tip : (N, 4, 4) array
        Poses on the path that the rows belong to [m].
    reconfigurations : tuple of int
        Rows from which the joints leave the path, and return to it at the same pose in the next row.
    stops : tuple of int
        Rows at which the joints rest: both ends, sharp corners, both ends of a reconfiguration.
    led : bool
        Whether the first row is the seed, and the second the start of the path (PathOptions.lead_in).
    slowed : (N - 1,) bool array
        Intervals in which joint velocity limits keep the tip slower than tool_speed or the stamps ask for.
    breaks : tuple of PathBreak
        Empty if the path is complete.
    position_error, orientation_error, sigma_min : (N,) arrays
        Errors of the tip [m, rad], and the smallest singular value of the task Jacobian.
    line_error, line_angle : float
        Largest distance of the tip from its line, also between rows, without motions off the path [m, rad].
    solve_time : float
        [s]

    """

    complete: bool
    q: np.ndarray
    times: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    place: np.ndarray
    base_from_tip: np.ndarray
    reconfigurations: tuple[int, ...]
    stops: tuple[int, ...]
    led: bool
    slowed: np.ndarray
    breaks: tuple[PathBreak, ...]
    position_error: np.ndarray
    orientation_error: np.ndarray
    sigma_min: np.ndarray
    line_error: float
    line_angle: float
    solve_time: float

    @property
    def off_path(self) -> tuple[int, ...]:
        """Rows from which the joints move straight to the next while the tip is off the path."""
        return (0, *self.reconfigurations) if self.led else self.reconfigurations

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the joint positions (k, n) at times (k,) [s]; before the start and after the end of the motion, those
        of its ends."""
        return positions_at(times, self.times, self.q, self.velocities, self.accelerations)

    @property
    def length(self) -> float:
        """Sum of the joint steps (L2) [rad, m]."""
        return float(np.linalg.norm(np.diff(self.q, axis=0), axis=1).sum())

    @property
    def largest_joint_travel(self) -> float:
        """Distance of the joint that travels furthest [rad, m]."""
        return float(np.abs(np.diff(self.q, axis=0)).sum(axis=0).max(initial=0.0))


def positions_at(
    when: np.ndarray, times: np.ndarray, q: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray
) -> np.ndarray:
    """Return the joint positions (k, n) at times (k,) [s] of a motion: times (N,) of its rows, N at least 2, and
    their positions, velocities and accelerations (N, n), joined by polynomials of the fifth degree. Before its start
    and after its end those of its ends."""
    when = np.clip(when, 0.0, times[-1])
    row = np.clip(np.searchsorted(times, when, side='right') - 1, 0, len(times) - 2)
    h, t = (times[row + 1] - times[row])[:, None], (when - times[row])[:, None]
    p, v, a = q[row], velocities[row], accelerations[row]
    d = q[row + 1] - p - h * (v + 0.5 * h * a)
    e, f = h * (velocities[row + 1] - v - h * a), h * h * (accelerations[row + 1] - a)
    s = t / h
    rest = s**3 * (10.0 * d - 4.0 * e + 0.5 * f + s * (-15.0 * d + 7.0 * e - f + s * (6.0 * d - 3.0 * e + 0.5 * f)))
    return p + t * (v + 0.5 * t * a) + rest
