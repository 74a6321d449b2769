"""A slider for each joint of the seed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from ros_ik_pkg.compare.problem import is_rotary
from ros_ik_pkg.ik import ArgumentError, Arm
from ros_ik_pkg.panel.markup.joint_labels import STEPS, short_names, slider_range


class SeedSliders:
    """Sliders in degrees or metres, within the limits; `moved` is called with the joint's index and position."""

    def __init__(
        self,
        gui: viser.GuiApi,
        title: str,
        on: Callable[[Any, Callable[[Any], object]], None],
        moved: Callable[[int, float], object],
    ) -> None:
        self._gui, self._on, self._moved = gui, on, moved
        self._folder = gui.add_folder(title)
        self._sliders: list[viser.GuiSliderHandle[float]] = []

    def show_arm(self, arm: Arm) -> None:
        """Make the sliders of an arm, in place of those that are there."""
        for slider in self._sliders:
            slider.remove()
        self._arm, self._rotary = arm, is_rotary(arm).tolist()
        with self._folder:
            self._sliders = [self._add(joint, name) for joint, name in enumerate(short_names(arm.joint_names))]

    def _add(self, joint: int, name: str) -> viser.GuiSliderHandle[float]:
        low, high = slider_range(float(self._arm.lower[joint]), float(self._arm.upper[joint]), self._rotary[joint])
        slider = self._gui.add_slider(
            name, low, high, STEPS[self._rotary[joint]], low, hint=self._arm.joint_names[joint],
            marks=tuple((end, f'{end:.0f}' if self._rotary[joint] else f'{end:.2f}') for end in (low, high)),
        )  # fmt: skip
        self._on(slider, lambda value: self._move(joint, value))
        return slider

    def _move(self, joint: int, value: float) -> None:
        """Pass a position [rad, m] on; raises ArgumentError if it is outside the slider."""
        slider = self._sliders[joint]
        if not slider.min <= value <= slider.max:
            name = self._arm.joint_names[joint]
            raise ArgumentError(f'{name} = {value:g} is not allowed: expected {slider.min:g} to {slider.max:g}')
        self._moved(joint, math.radians(value) if self._rotary[joint] else value)

    def show(self, seed: np.ndarray) -> None:
        """Set the sliders to the seed (n,) [rad, m]."""
        for slider, value, turns in zip(self._sliders, seed.tolist(), self._rotary):
            slider.value = min(max(round(math.degrees(value) if turns else value, 4), slider.min), slider.max)
