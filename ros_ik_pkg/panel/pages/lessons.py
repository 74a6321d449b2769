"""The tab of the lessons: a button for each phenomenon, what to watch, and Newton in one dimension."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

import viser

from ros_ik_pkg.compare.lessons import LESSONS
from ros_ik_pkg.compare.newton import STEPS
from ros_ik_pkg.panel.markup.newton_html import newton_html
from ros_ik_pkg.panel.markup.texts import Texts


class LessonTab:
    """Buttons; `choose` is called with the name of a lesson."""

    def __init__(
        self,
        gui: viser.GuiApi,
        texts: Texts,
        on: Callable[[Any, Callable[[Any], object]], None],
        later: Callable[[Callable[[], object]], object],
        choose: Callable[[str], object],
    ) -> None:
        self._texts = texts
        for item in LESSONS:
            button = gui.add_button(item.title[texts.language], color='gray')

            @button.on_click
            def _(_: viser.GuiEvent, name: str = item.name) -> None:
                later(lambda: choose(name))

        self._text = gui.add_html(self._said(texts['choose lesson']))
        with gui.add_folder(texts['newton']):
            slider = gui.add_slider(texts['tangents'], 0, STEPS, 1, 1)
            self._newton = gui.add_html(newton_html(1, texts))
            on(slider, self._show_tangents)

    def _show_tangents(self, count: int) -> None:
        self._newton.content = newton_html(int(count), self._texts)

    @staticmethod
    def _said(text: str) -> str:
        return f'<div class="ik" data-testid="lesson"><div class="lesson">{escape(text)}</div></div>'

    def show(self, text: str) -> None:
        """Say what to watch."""
        self._text.content = self._said(text)
