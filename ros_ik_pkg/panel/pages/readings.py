"""Status, table and plots of the page."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

import viser

from ros_ik_pkg.panel.answers import Answers
from ros_ik_pkg.panel.markup.chart import plots_html
from ros_ik_pkg.panel.markup.html import comparison_words, node_words, status_html, table_html
from ros_ik_pkg.panel.markup.style import STYLE
from ros_ik_pkg.panel.markup.texts import Texts
from ros_ik_pkg.panel.pages.microscope import Microscope

WIDTH = 450  # pixels
NOTICE_TIME = 6.0  # s for which a notice replaces the node's message


class Readings:
    """The panel on the right: status, and a tab each for the methods and for one iteration."""

    def __init__(self, gui: viser.GuiApi, texts: Texts, add_microscope: Callable[[], Microscope]) -> None:
        self._gui, self._texts = gui, texts
        gui.main_panel.dock_right()
        gui.main_panel.set_width(WIDTH)
        self._count = -1
        self._notice, self._until = '', 0.0
        self._said = (texts['looking'], False, '')
        gui.add_html(STYLE)
        self._status = gui.add_html('')
        tabs = gui.add_tab_group()
        with tabs.add_tab(texts['methods']):
            self._table = gui.add_html(table_html({}, '', texts=texts))
            self._plots = gui.add_html(plots_html({}, texts=texts))
        with tabs.add_tab(texts['iteration']):
            self.microscope = add_microscope()
        self._write()
        self.show_count(0)

    def show_count(self, count: int) -> None:
        """Have the title say how many methods are compared."""
        if count != self._count:
            self._count = count
            self._gui.set_panel_label(self._texts.title(count))

    def show_status(self, answers: Answers, compared: Iterable[str]) -> None:
        """Show what the node says, and the comparison of the methods that are `compared` in words."""
        words = comparison_words(answers.runs.values(), any(compared), self._texts)
        # Without a result, what was said of the target before stands.
        said = node_words(answers.result, self._texts) if answers.result else self._said[:2]
        self._said = (*said, words)
        self._write()

    def show_comparison(self, answers: Answers, method: str, old: bool = False) -> None:
        """Show table and plots; `method` is the node's own. What is `old` is shown faint."""
        self._table.content = table_html(answers.runs, method, old, self._texts)
        self.show_curves(answers, old)

    def show_curves(self, answers: Answers, old: bool = False) -> None:
        """Show the plots, with a line at the iteration that is looked at."""
        self._plots.content = plots_html(answers.curves, old, self._texts, self.microscope.cursor)

    def show_problem(self, text: str) -> None:
        """Show a problem with the node instead of a result."""
        self._said = (text, False, '')
        self._write()

    def show_notice(self, text: str) -> None:
        """Show the outcome of a user action for a while."""
        self._notice, self._until = text, time.monotonic() + NOTICE_TIME
        self._write()

    def tick(self) -> None:
        """Take a notice away that has been there long enough."""
        if self._notice and time.monotonic() > self._until:
            self._notice = ''
            self._write()

    def _write(self) -> None:
        state, good, words = self._said
        self._status.content = status_html(self._notice or state, good and not self._notice, words)
