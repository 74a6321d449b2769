"""The newest commands of the stream: velocity and acceleration of each joint as shares of their limits."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
from trajectory_msgs.msg import JointTrajectory

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ros.interface.servo_settings import SERVO_OPTIONS, ServoSettings
from ros_ik_pkg.ros.servo.servo import motion_limits

SECONDS = 10.0  # that are kept
BINS = 100  # places in time of a chart


class Commands:
    """Keeps the commands of the last seconds. parameters: of the node, by name.

    position: the last command (n,) [rad, m].
    """

    def __init__(self, arm: Arm, start: np.ndarray, parameters: Mapping[str, Any]) -> None:
        settings = ServoSettings(**{option.name: parameters[option.ros_name] for option in SERVO_OPTIONS})
        limits = motion_limits(arm, settings, parameters['velocity_scale'])
        self._limits = np.stack([limits.velocity, limits.acceleration])
        self._shares: deque[np.ndarray] = deque(maxlen=max(round(SECONDS * settings.command_rate), BINS))
        self.position = start

    def take(self, message: JointTrajectory) -> None:
        """Keep a command."""
        point = message.points[-1]
        self.position = np.array(point.positions)
        self._shares.append(np.array([point.velocities, point.accelerations]) / self._limits)

    @property
    def peaks(self) -> np.ndarray:
        """Of each part of the time kept, the share (k, 2, n) that is largest by magnitude; k is BINS at most."""
        shares = np.array(self._shares)
        if not len(shares):
            return np.empty((0, *self._limits.shape))
        parts = [part for part in np.array_split(shares, BINS) if len(part)]
        largest = [np.abs(part).argmax(axis=0) for part in parts]
        return np.array([np.take_along_axis(part, k[None], axis=0)[0] for part, k in zip(parts, largest)])
