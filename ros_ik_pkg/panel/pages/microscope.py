"""The walk through the iterations: which descent is looked into, at which iteration, and whether it plays."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import viser

from ros_ik_pkg.compare.iterate import Iterate, make_iterate
from ros_ik_pkg.compare.problem import is_rotary
from ros_ik_pkg.ik import METHODS, Arm, OptionError, SolveOptions
from ros_ik_pkg.panel.answers import SEARCH, Answers, Curve
from ros_ik_pkg.panel.markup.iterate_html import iterate_html
from ros_ik_pkg.panel.markup.joint_labels import short_names
from ros_ik_pkg.panel.markup.texts import Texts

OFF = 'off'
CHOICES = (OFF, SEARCH, *METHODS)
PERIOD = 0.35  # s for each iterate while it plays
KEYS = {'back': 'B', 'play': 'P', 'next': 'N'}


class Microscope:
    """The tab of the iterations. `changed` is called when another iterate is to be shown, or none."""

    def __init__(
        self,
        gui: viser.GuiApi,
        texts: Texts,
        on: Callable[[Any, Callable[[Any], object]], None],
        later: Callable[[Callable[[], object]], object],
        changed: Callable[[], object],
    ) -> None:
        self._gui, self._texts, self._changed = gui, texts, changed
        self._curve: Curve | None = None
        self._playing, self._due = False, 0.0
        self.method, self.row = OFF, 0
        names = {OFF: texts['nothing'], SEARCH: texts['search']}
        self._labels = {choice: names.get(choice, choice) for choice in CHOICES}
        self._choice = gui.add_dropdown(texts['look into'], tuple(self._labels.values()))
        on(self._choice, self._choose_label)
        self._slider = gui.add_slider(texts['iteration'], 0, 1, 1, 0, disabled=True)
        on(self._slider, self._go)
        buttons = {'back': lambda: self.move(-1), 'play': self.toggle, 'next': lambda: self.move(1)}
        self._buttons = gui.add_button_group('', tuple(texts[key] for key in buttons))

        @self._buttons.on_click
        def _(event: viser.GuiEvent) -> None:
            pressed = {texts[key]: act for key, act in buttons.items()}[event.target.value]
            later(pressed)

        for key, act in buttons.items():
            command = gui.add_command(texts[key], hotkey=KEYS[key])
            command.on_trigger(lambda _, act=act: later(act))
        self._card = gui.add_html(self._hint('choose descent'))

    def _hint(self, key: str) -> str:
        return f'<div class="ik" data-testid="iterate"><div class="lesson">{self._texts[key]}</div></div>'

    def _choose_label(self, label: str) -> None:
        self.choose(next((choice for choice, text in self._labels.items() if text == label), OFF))

    def choose(self, method: str, row: int = 0) -> None:
        """Look into the descent of a method, into the node's search, or, with OFF, into none."""
        self.method, self.row, self._playing = method, row, False
        self._choice.value = self._labels[method]
        self._changed()

    def _go(self, row: int) -> None:
        self.row, self._playing = int(row), False
        self._changed()

    def move(self, rows: int) -> None:
        """Go some iterates on or back, and stop playing."""
        self._playing = False
        self._step(rows)

    def _step(self, rows: int) -> None:
        if self._curve is not None:
            self.row = min(max(self.row + rows, 0), len(self._curve.iteration) - 1)
            self._changed()

    def toggle(self) -> None:
        """Play from here, from the start if this is the end, or pause."""
        if self._curve is None:
            return
        self._playing = not self._playing
        self._due = time.monotonic() + PERIOD
        if self._playing and self.row == len(self._curve.iteration) - 1:
            self.row = 0
            self._changed()

    def tick(self) -> None:
        """Go on if it plays; the end stops it."""
        if self._playing and time.monotonic() >= self._due:
            self._due += PERIOD
            self._step(1)
            self._playing = self._curve is not None and self.row < len(self._curve.iteration) - 1

    def show(
        self, arm: Arm, target: np.ndarray, answers: Answers, parameters: Mapping[str, Any]
    ) -> tuple[Iterate, np.ndarray] | None:
        """Show the iterate that is looked at; return it with the joint positions (k, n) of its descent, or None."""
        self._curve = answers.search if self.method == SEARCH else answers.curves.get(self.method)
        shown = self._curve is not None and self._curve.joint_positions.shape[1] == arm.n
        self._slider.disabled = not shown
        if not shown or self._curve is None:
            self._curve = None
            self._card.content = self._hint('choose descent' if self.method == OFF else 'no descent')
            return None
        curve = self._curve
        last = len(curve.iteration) - 1
        self.row = min(self.row, last)
        self._slider.max = max(last, 1)
        if self._slider.value != self.row:
            self._slider.value = self.row
        inside = np.flatnonzero(curve.attempt == curve.attempt[self.row])
        positions = curve.joint_positions[inside]
        options = options_of(parameters)
        iterate = make_iterate(arm, target, curve.method, options, positions, self.row - int(inside[0]))
        names, rotary = short_names(arm.joint_names), is_rotary(arm).tolist()
        end = self.row == inside[-1]
        self._card.content = iterate_html(iterate, curve.method, options, names, rotary, end, self._texts)
        return iterate, positions

    @property
    def shown_method(self) -> str:
        """The method of the steps that are looked at."""
        return self._curve.method if self._curve is not None else self.method

    @property
    def cursor(self) -> int | None:
        """The iteration to mark in the plots; None unless a compared method is looked into."""
        shown = self._curve is not None and self.method in METHODS
        return int(self._curve.iteration[self.row]) if shown and self._curve is not None else None


def options_of(parameters: Mapping[str, Any]) -> SolveOptions:
    """Return the options that the page's parameters mean; the defaults if they are between two valid states."""
    names = {option: option.replace('.', '_') for option in parameters}
    known = {name for name in SolveOptions.__dataclass_fields__ if name != 'numbers'}
    try:
        return SolveOptions(**{name: parameters[ros] for ros, name in names.items() if name in known})
    except OptionError:
        return SolveOptions()
