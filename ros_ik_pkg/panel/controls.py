"""The controls of the page; each user action calls a method of an Actions object."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol

import numpy as np
import viser

from ros_ik_pkg.compare.problem import numbers_of, pose
from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.html import tip_html
from ros_ik_pkg.panel.parameter_controls import ParameterControls
from ros_ik_pkg.panel.seed_sliders import SeedSliders

PRESET_ROWS = {
    'Begin with': ('Lecture notes', 'Random'),
    'Singular': ('Wrist singular', 'Arm stretched out'),
    'Far': ('Behind the base', 'Unreachable'),
}
WIDTH = 340  # pixels


class Actions(Protocol):
    """User actions; called on the panel's thread."""

    def choose_robot(self, name: str) -> None: ...
    def upload_urdf(self, text: str, file_name: str) -> None: ...
    def choose_preset(self, name: str) -> None: ...
    def set_target(self, target: np.ndarray) -> None: ...
    def set_joint(self, joint: int, position: float) -> None: ...
    def set_parameter(self, name: str, value: Any) -> None: ...
    def choose_theme(self, dark: bool) -> None: ...


class Controls:
    """The panel on the left. Callbacks of viser only hand calls to `later`; one thread does all the work."""

    def __init__(
        self,
        gui: viser.GuiApi,
        actions: Actions,
        later: Callable[[Callable[[], object]], object],
        robots: Iterable[str],
    ) -> None:
        self._gui, self._actions, self._later = gui, actions, later
        panel = gui.add_panel()
        with panel.add_tab('Task'):
            self._add_robot(tuple(robots))
            self._add_presets()
            self._add_target()
            self._seed = SeedSliders(gui, self._on, actions.set_joint)
            with gui.add_folder('Tip of the solution'):
                self._tip = gui.add_html(tip_html(None, ''))
        with panel.add_tab('Parameters'):
            self.parameters = ParameterControls(gui, self._on, actions.set_parameter)
            self._on(gui.add_checkbox('Dark page', False), actions.choose_theme)
        panel.dock_left()
        panel.set_width(WIDTH)

    def _on(self, handle: Any, call: Callable[[Any], object]) -> None:
        """Have a call made with the handle's value when the user, not the program, changes it."""

        @handle.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                value = event.target.value
                self._later(lambda: call(value))

    def _add_robot(self, robots: tuple[str, ...]) -> None:
        self._robot = self._gui.add_dropdown('Robot', robots, initial_value=robots[0])
        self._on(self._robot, self._actions.choose_robot)
        upload = self._gui.add_upload_button('Open a URDF …', icon=viser.Icon.UPLOAD, color='gray')

        @upload.on_upload
        def _(event: viser.GuiEvent) -> None:
            file = event.target.value
            text = file.content.decode(errors='replace')
            self._later(lambda: self._actions.upload_urdf(text, file.name))

    def _add_presets(self) -> None:
        for label, names in PRESET_ROWS.items():
            group = self._gui.add_button_group(label, names)

            @group.on_click
            def _(event: viser.GuiEvent) -> None:
                name = event.target.value
                self._later(lambda: self._actions.choose_preset(name))

    def _add_target(self) -> None:
        with self._gui.add_folder('Target'):
            self._position = self._gui.add_vector3('x y z [m]', (0.0, 0.0, 0.0), step=0.001)
            self._rotation = self._gui.add_vector3('r p y [°]', (0.0, 0.0, 0.0), step=0.1)
        # The typed value, not the current one of the field, which a preset may have overwritten in between.
        self._on(self._position, lambda value: self._actions.set_target(pose([*value, *self._rotation.value])))
        self._on(self._rotation, lambda value: self._actions.set_target(pose([*self._position.value, *value])))

    def show_robots(self, names: Iterable[str], chosen: str) -> None:
        """Offer these robots, one of them chosen."""
        self._robot.options = tuple(names)
        self._robot.value = chosen

    def show_arm(self, arm: Arm) -> None:
        """Make a slider for each joint."""
        self._seed.show_arm(arm)

    def show_seed(self, seed: np.ndarray) -> None:
        """Set the sliders to the seed (n,) [rad, m]."""
        self._seed.show(seed)

    def show_tip(self, base_from_tip: np.ndarray | None, text: str) -> None:
        """Show the tip pose (4, 4), or dashes for None, with a label."""
        self._tip.content = tip_html(None if base_from_tip is None else numbers_of(base_from_tip), text)

    def show_target(self, target: np.ndarray) -> None:
        """Set the fields to the target (4, 4), those that show another one."""
        numbers = numbers_of(target)
        for handle, part, digits in ((self._position, numbers[:3], 4), (self._rotation, numbers[3:], 2)):
            values = tuple((part.round(digits) + 0.0).tolist())  # no minus before a zero
            if handle.value != values:
                handle.value = values
