"""The controls of the page; what the user does comes out as calls of an object with a method for each."""

from __future__ import annotations

import queue
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
import viser

from ros_ik_pkg.compare.problem import is_rotary, numbers_of, pose
from ros_ik_pkg.compare.singular import bounds
from ros_ik_pkg.ik import METHODS, Arm
from ros_ik_pkg.panel.html import tip_html

ROBOTS = ('puma560', 'ur5', 'panda', 'iiwa14')
TOLERANCES = tuple(f'1e-{k}' for k in range(2, 9))
PRESET_ROWS = {
    'Begin with': ('Lecture notes', 'Random'),
    'Singular': ('Wrist singular', 'Arm stretched out'),
    'Far': ('Behind the base', 'Unreachable'),
}
WIDTH = 340  # pixels


class Actions(Protocol):
    """What the user can do; called on the thread that takes `events`."""

    def choose_robot(self, name: str) -> None: ...
    def upload_urdf(self, text: str) -> None: ...
    def choose_preset(self, name: str) -> None: ...
    def set_target(self, target: np.ndarray) -> None: ...
    def set_seed(self, seed: np.ndarray) -> None: ...
    def set_parameters(self, values: dict[str, Any]) -> None: ...
    def choose_theme(self, dark: bool) -> None: ...


class Controls:
    """The panel on the left. Callbacks of viser only put calls into `events`; one thread does all the work."""

    def __init__(self, gui: viser.GuiApi, actions: Actions, events: queue.SimpleQueue[Callable[[], object]]) -> None:
        self._gui, self._actions, self._events = gui, actions, events
        panel = gui.add_panel()
        with panel.add_tab('Task'):
            self._add_robot()
            self._add_presets()
            self._add_target()
            self._seed_folder = gui.add_folder('Seed')
            with gui.add_folder('Tip of the solution'):
                self._tip = gui.add_html('')
        with panel.add_tab('Parameters'):
            self._add_parameters()
        panel.dock_left()
        panel.set_width(WIDTH)
        self._sliders: list[viser.GuiInputHandle[float]] = []
        self._arm: Arm | None = None

    def _on(self, handle: Any, call: Callable[[Any], object]) -> None:
        """Queue a call with the handle's value when the user, not the program, changes it."""

        @handle.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                value = event.target.value
                self._events.put(lambda: call(value))

    def _add_robot(self) -> None:
        self._robot = self._gui.add_dropdown('Robot', ROBOTS, initial_value=ROBOTS[0])
        self._on(self._robot, self._actions.choose_robot)
        upload = self._gui.add_upload_button('Open a URDF …', icon=viser.Icon.UPLOAD, color='gray')

        @upload.on_upload
        def _(event: viser.GuiEvent) -> None:
            text = event.target.value.content.decode(errors='replace')
            self._events.put(lambda: self._actions.upload_urdf(text))

    def _add_presets(self) -> None:
        for label, names in PRESET_ROWS.items():
            group = self._gui.add_button_group(label, names)

            @group.on_click
            def _(event: viser.GuiEvent) -> None:
                name = event.target.value
                self._events.put(lambda: self._actions.choose_preset(name))

    def _add_target(self) -> None:
        with self._gui.add_folder('Target'):
            self._position = self._gui.add_vector3('x y z [m]', (0.0, 0.0, 0.0), step=0.001)
            self._rotation = self._gui.add_vector3('r p y [°]', (0.0, 0.0, 0.0), step=0.1)
        for handle in (self._position, self._rotation):
            self._on(handle, lambda _: self._actions.set_target(pose([*self._position.value, *self._rotation.value])))

    def _add_parameters(self) -> None:
        add = self._gui
        method = add.add_dropdown('Node solves by', METHODS, initial_value='adaptive_dls')
        with add.add_folder('Compared methods'):
            self._compared = {name: add.add_checkbox(name, True) for name in METHODS}
        with add.add_folder('All methods'):
            self._tolerance = add.add_dropdown('Tolerance', TOLERANCES, initial_value='1e-6', hint='m and rad')
            iterations = add.add_number('Iterations', 2000, min=1, max=100000, step=100)
            step_size = add.add_slider('Step size', 0.05, 1.5, 0.05, 1.0)
        with add.add_folder('Damping'):
            damping = add.add_slider('dls', 0.0, 0.5, 0.005, 0.05, hint='lambda')
            smallest = add.add_number('adaptive, least', 0.001, min=0.0, max=1.0, step=0.001, hint='lambda_0')
            gain = add.add_slider('adaptive, gain', 0.0, 1.0, 0.01, 0.2, hint='lambda = gain * error')
        self._on(add.add_checkbox('Dark page', False), self._actions.choose_theme)
        self._settings = {
            'method': method, 'max_iterations': iterations, 'step_size': step_size, 'dls.damping': damping,
            'adaptive_dls.damping': smallest, 'adaptive_dls.gain': gain,
        }  # fmt: skip
        for handle in (*self._settings.values(), self._tolerance, *self._compared.values()):
            self._on(handle, lambda _: self._actions.set_parameters(self.parameters()))

    @property
    def method(self) -> str:
        """The node's own method."""
        return self._settings['method'].value

    def compared(self) -> list[str]:
        """Return the methods that are switched on."""
        return [name for name, box in self._compared.items() if box.value]

    def parameters(self) -> dict[str, Any]:
        """Return the node's parameters as they are set on the page."""
        tolerance = float(self._tolerance.value)
        return {
            **{name: handle.value for name, handle in self._settings.items()},
            'position_tolerance': tolerance,
            'orientation_tolerance': tolerance,
            'compare': self.compared(),
        }

    def show_parameters(self, values: Mapping[str, Any]) -> None:
        """Show the parameters that the node has; tolerances as the nearest power of ten."""
        exponent = min(max(round(-np.log10(values['position_tolerance'])), 2), 8)
        self._tolerance.value = f'1e-{exponent}'
        for name, handle in self._settings.items():
            handle.value = values[name]

    def show_arm(self, arm: Arm) -> None:
        """Make a slider for each joint, in degrees or metres, within the limits."""
        for slider in self._sliders:
            slider.remove()
        lower, upper = (in_degrees(arm, limit) for limit in bounds(arm))
        self._robot.options = tuple(dict.fromkeys((*ROBOTS, arm.name)))
        self._robot.value = arm.name
        with self._seed_folder:
            self._sliders = [
                self._gui.add_slider(name, low, high, 0.1 if turns else 0.001, (low + high) / 2)
                for name, low, high, turns in zip(arm.joint_names, lower.tolist(), upper.tolist(), is_rotary(arm))
            ]
        for slider in self._sliders:
            self._on(slider, lambda _: self._actions.set_seed(self._seed()))
        self._arm = arm

    def _seed(self) -> np.ndarray:
        values = np.array([slider.value for slider in self._sliders])
        return np.where(is_rotary(self._arm), np.radians(values), values)

    def show_seed(self, seed: np.ndarray) -> None:
        """Set the sliders to the seed (n,) [rad, m]."""
        for slider, value in zip(self._sliders, in_degrees(self._arm, seed).tolist()):
            slider.value = round(value, 4)

    def show_tip(self, base_from_tip: np.ndarray) -> None:
        """Show the pose (4, 4) of the solution's tip."""
        self._tip.content = tip_html(numbers_of(base_from_tip))

    def show_target(self, target: np.ndarray) -> None:
        """Set the fields to the target (4, 4)."""
        numbers = numbers_of(target)
        self._position.value = tuple(numbers[:3].round(4).tolist())
        self._rotation.value = tuple(numbers[3:].round(2).tolist())


def in_degrees(arm: Arm, values: np.ndarray) -> np.ndarray:
    """Return joint values (n,) [rad, m] with the angles in degrees."""
    return np.where(is_rotary(arm), np.degrees(values), values)
