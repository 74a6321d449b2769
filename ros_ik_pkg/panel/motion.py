"""The motion along a solved path, as the node published it, and what its charts need."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from trajectory_msgs.msg import JointTrajectory

from ros_ik_pkg.ik import ArgumentError, Arm
from ros_ik_pkg.ik.path.path_solution import positions_at

SAMPLES = 240  # places in time of a chart: a pixel each


@dataclass(frozen=True)
class Motion:
    """A motion of n joints through N rows, and samples of it for charts.

    reconfigurations: (k, 2) begin and end of the motions off the path [s].
    """

    times: np.ndarray  # (N,) [s]
    positions: np.ndarray  # (N, n) [rad, m]
    velocities: np.ndarray
    accelerations: np.ndarray
    reconfigurations: np.ndarray
    sampled: np.ndarray  # (SAMPLES, n) joint positions, evenly spaced in time
    sigma_min: np.ndarray  # (SAMPLES,) smallest singular value of the Jacobian there

    @property
    def duration(self) -> float:
        """The time of the last row [s]."""
        return float(self.times[-1])

    def at(self, time: float) -> np.ndarray:
        """Return the joint positions (n,) at a time [s]."""
        return positions_at(np.array([time]), self.times, self.positions, self.velocities, self.accelerations)[0]


def read_motion(message: JointTrajectory, arm: Arm, reconfigured_at: list[float]) -> Motion:
    """Return the motion in a message; raises ArgumentError if it is for other joints, or no motion.

    reconfigured_at: times at which the joints leave the path [s].
    """
    if tuple(message.joint_names) != arm.joint_names or len(message.points) < 2:
        raise ArgumentError(f'a motion of {len(message.points)} points for {", ".join(message.joint_names)}')
    times = np.array([point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in message.points])
    q, v, a = (np.array([getattr(point, name) for point in message.points])
               for name in ('positions', 'velocities', 'accelerations'))  # fmt: skip
    rows = np.clip(np.searchsorted(times, np.array(reconfigured_at) - 1e-5), 0, len(times) - 2)
    sampled = positions_at(np.linspace(0.0, times[-1], SAMPLES), times, q, v, a)
    last = min(arm.n, 6) - 1
    sigma_min = np.array([np.linalg.svd(arm.jacobian(row), compute_uv=False)[last] for row in sampled])
    return Motion(times, q, v, a, np.stack([times[rows], times[rows + 1]], axis=1), sampled, sigma_min)
