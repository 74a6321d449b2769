"""What solve_path returns: the joint path, its times, where it breaks and why."""

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
    """Where a path breaks: `place` is the index of a given pose and the fraction of the way to the next."""

    place: float
    reason: BreakReason
    text: str  # a sentence for people that names the pose


@dataclass(frozen=True)
class PathSolution:
    """A joint path and its times, as far as the path could be followed; N is 0 if that is not even the first pose.

    Between two rows the joints follow the polynomial of the fifth degree through positions, velocities and
    accelerations, which joint trajectory controllers use; the figures hold for that.

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
        Index of the pose given, and the fraction of the way to the next.
    base_from_tip : (N, 4, 4) array
        Samples of the path [m].
    reconfigurations : tuple of int
        Rows from which the joints leave the path; they are back on it in the next row, at the same pose.
    stops : tuple of int
        Rows at which the joints rest: both ends, corners, both ends of a reconfiguration.
    led : bool
        Whether the first row is where the joints are, and the second the start of the path (PathOptions.lead_in).
    slowed : (N - 1,) bool array
        Intervals in which joint velocity limits keep the tip slower than tool_speed or the stamps ask for.
    breaks : tuple of PathBreak
        Empty if the path is complete.
    position_error, orientation_error, sigma_min : (N,) arrays
        Errors of the tip [m, rad], and the smallest singular value of the task Jacobian.
    line_error, line_angle : float
        How far the tip is from its line at most, between the rows too [m, rad]; motions off the path do not count.
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
        """Rows from which the joints get to the next in a straight line of their own, wherever that leads the tip."""
        return (0, *self.reconfigurations) if self.led else self.reconfigurations

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the joint positions (k, n) of the motion at times (k,) [s]; before its start and after its end those
        of its ends."""
        return positions_at(times, self.times, self.q, self.velocities, self.accelerations)

    @property
    def length(self) -> float:
        """Sum of the joint steps (L2) [rad, m]."""
        return float(np.linalg.norm(np.diff(self.q, axis=0), axis=1).sum())

    @property
    def largest_joint_travel(self) -> float:
        """Way of the joint that travels furthest [rad, m]."""
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
