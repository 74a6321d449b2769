"""The posture for null_space: posture if the parameter posture is empty: the configuration of the first seed.

If each solve held its own seed, joints that start from the last solution would drift along a closed path.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ros_ik_pkg.ik import Arm, OptionError
from ros_ik_pkg.ros.interface.parameters import Settings


class HeldPosture:
    """Puts the first seed after a change of null_space, posture or arm into the settings."""

    def __init__(self) -> None:
        self.awaited = False  # whether the next seed is to be held
        self._posture: tuple[float, ...] = ()
        self._arm: Arm | None = None

    def take_over(self, settings: Settings, arm: Arm | None) -> Settings:
        """Return the settings with the held posture, if it is still held."""
        options = settings.options
        wanted = options.null_space == 'posture' and not options.posture
        if not wanted or arm is None or not arm.same_robot(self._arm):
            self._posture = ()
        self._arm = arm
        self.awaited = wanted and not self._posture
        return _with_posture(settings, self._posture) if self._posture else settings

    def hold(self, settings: Settings, seed: np.ndarray) -> Settings:
        """Return the settings with the seed (n,) [rad, m] as posture, unless the seed is absurd."""
        try:
            held = _with_posture(settings, tuple(seed.tolist()))
        except OptionError:
            return settings
        self._posture, self.awaited = held.options.posture, False
        return held


def _with_posture(settings: Settings, posture: tuple[float, ...]) -> Settings:
    return replace(settings, options=replace(settings.options, posture=posture))
