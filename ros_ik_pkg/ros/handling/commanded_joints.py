"""The last commanded joint positions, by joint name; they are kept if the arm is reloaded, even with other frames."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik import Arm


class CommandedJoints:
    """The last command of every joint of one robot; joints of another robot may have the same names."""

    def __init__(self) -> None:
        self._robot = ''
        self._told: dict[str, float] = {}  # [rad, m]

    def keep(self, arm: Arm, command: np.ndarray) -> None:
        """Remember the last command (n,) [rad, m] of an arm."""
        self._belong_to(arm)
        self._told.update(zip(arm.joint_names, command.tolist()))

    def of(self, arm: Arm) -> np.ndarray | None:
        """Return the last commanded positions (n,) [rad, m] of an arm; None if one is unknown."""
        self._belong_to(arm)
        if not self._told.keys() >= set(arm.joint_names):
            return None
        return np.array([self._told[name] for name in arm.joint_names])

    def _belong_to(self, arm: Arm) -> None:
        """Forget everything if the robot is another one."""
        if arm.name != self._robot:
            self._robot, self._told = arm.name, {}
