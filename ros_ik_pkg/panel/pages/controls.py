"""The controls of the page; each user action calls a method of an Actions object."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, Protocol

import numpy as np
import viser

from ros_ik_pkg.compare.problem import numbers_of, pose
from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.markup.html import tip_html
from ros_ik_pkg.panel.markup.texts import LANGUAGE_NAMES
from ros_ik_pkg.panel.pages.lessons import LessonTab
from ros_ik_pkg.panel.pages.obstacles import BALL, BOX, NONE
from ros_ik_pkg.panel.pages.page import Page, Tools
from ros_ik_pkg.panel.pages.parameters import ParameterControls
from ros_ik_pkg.panel.pages.seed_sliders import SeedSliders

PRESET_ROWS = {
    'begin': ('Lecture notes', 'Random'),
    'singular': ('Wrist singular', 'Arm stretched out'),
    'far': ('Behind the base', 'Unreachable'),
}
WIDTH = 340  # pixels


class Actions(Protocol):
    """User actions; called on the panel's thread."""

    def choose_robot(self, name: str) -> None: ...
    def upload_urdf(self, text: str, file_name: str) -> None: ...
    def choose_preset(self, name: str) -> None: ...
    def choose_lesson(self, name: str) -> None: ...
    def choose_obstacle(self, kind: str) -> None: ...
    def set_target(self, target: np.ndarray) -> None: ...
    def set_joint(self, joint: int, position: float) -> None: ...
    def set_parameter(self, name: str, value: Any) -> None: ...
    def choose_theme(self, dark: bool) -> None: ...
    def choose_language(self, language: str) -> None: ...


class Controls:
    """The panel on the left. Callbacks of viser only hand calls to `later`; one thread does all the work."""

    def __init__(
        self,
        actions: Actions,
        tools: Tools,
        robots: Iterable[str],
        pages: Sequence[Page] = (),
        dark: bool = False,
    ) -> None:
        gui, texts = tools.server.gui, tools.texts
        self._gui, self._actions, self._tools, self._texts = gui, actions, tools, texts
        panel = gui.add_panel()
        with panel.add_tab(texts['task']):
            self._add_robot(tuple(robots))
            self._add_presets()
            self._add_target()
            self._add_button_row('obstacles', (BOX, BALL, NONE), actions.choose_obstacle)
            self._seed = SeedSliders(gui, texts['seed'], self.on, actions.set_joint)
            with gui.add_folder(texts['tip']):
                self._tip = gui.add_html(tip_html(None, ''))
        with panel.add_tab(texts['motion tab']):
            for page in pages:
                with gui.add_folder(texts[page.title], expand_by_default=False):
                    page.add()
        with panel.add_tab(texts['lessons']):
            self.lessons = LessonTab(gui, texts, self.on, tools.later, actions.choose_lesson)
        with panel.add_tab(texts['parameters']):
            self.parameters = ParameterControls(gui, texts, self.on, actions.set_parameter)
            self.on(gui.add_checkbox(texts['dark'], dark), actions.choose_theme)
            self._add_languages()
        panel.dock_left()
        panel.set_width(WIDTH)

    def on(self, handle: Any, call: Callable[[Any], object]) -> None:
        """Have a call made with the handle's value when the user, not the program, changes it."""
        self._tools.on(handle, call)

    def _add_robot(self, robots: tuple[str, ...]) -> None:
        self._robot = self._gui.add_dropdown(self._texts['robot'], robots, initial_value=robots[0])
        self.on(self._robot, self._actions.choose_robot)
        upload = self._gui.add_upload_button(self._texts['open urdf'], icon=viser.Icon.UPLOAD, color='gray')

        @upload.on_upload
        def _(event: viser.GuiEvent) -> None:
            file = event.target.value
            text = file.content.decode(errors='replace')
            self._tools.later(lambda: self._actions.upload_urdf(text, file.name))

    def _add_presets(self) -> None:
        for label, names in PRESET_ROWS.items():
            self._add_button_row(label, names, self._actions.choose_preset)

    def _add_button_row(self, label: str, names: tuple[str, ...], choose: Callable[[str], object]) -> None:
        """Add a button for each name, which calls `choose` with it."""
        self._tools.buttons(self._texts[label], {name: partial(choose, name) for name in names})

    def _add_languages(self) -> None:
        by_name = {name: language for language, name in LANGUAGE_NAMES.items()}
        names, shown = tuple(by_name), LANGUAGE_NAMES[self._texts.language]
        choice = self._gui.add_dropdown(self._texts['language'], names, initial_value=shown)
        self.on(choice, lambda name: self._actions.choose_language(by_name.get(name, name)))

    def _add_target(self) -> None:
        with self._gui.add_folder(self._texts['target']):
            self._position = self._gui.add_vector3('x y z [m]', (0.0, 0.0, 0.0), step=0.001)
            self._rotation = self._gui.add_vector3('r p y [°]', (0.0, 0.0, 0.0), step=0.1)
        # What was typed, not what the field holds by then: a preset that was chosen before may have written to it.
        self.on(self._position, lambda value: self._actions.set_target(pose([*value, *self._rotation.value])))
        self.on(self._rotation, lambda value: self._actions.set_target(pose([*self._position.value, *value])))

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
