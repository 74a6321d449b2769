"""What the page shows about the answers: status line, table, plots."""

from __future__ import annotations

import viser

from ros_ik_pkg.panel.answers import Answers
from ros_ik_pkg.panel.chart import DARK, LIGHT, errors_figure
from ros_ik_pkg.panel.html import comparison_words, node_words, status_html, table_html

WIDTH = 520  # pixels
ASPECT = 0.58
PLOTS = {'position_error': 'Distance from the target [m]', 'orientation_error': 'Angle from the target [rad]'}


class Readings:
    """The panel on the right."""

    def __init__(self, gui: viser.GuiApi) -> None:
        gui.set_panel_label('Five methods, one target')
        gui.main_panel.dock_right()
        gui.main_panel.set_width(WIDTH)
        self._theme = LIGHT
        self._status = gui.add_html(status_html('looking for the node …', False, ''))
        self._table = gui.add_html(table_html({}, ''))
        self._plots = {
            column: gui.add_plotly(errors_figure({}, column, title, self._theme), config={'displayModeBar': False},
                                   aspect=ASPECT)
            for column, title in PLOTS.items()
        }  # fmt: skip

    def choose_theme(self, dark: bool) -> None:
        """Take the colours for a light or a dark page, from the next drawing on."""
        self._theme = DARK if dark else LIGHT

    def show_answers(self, answers: Answers, method: str) -> None:
        """Show everything about the newest target; `method` is the node's own."""
        self.show_result(answers)
        self._table.content = table_html(answers.runs, method)
        for column, title in PLOTS.items():
            self._plots[column].figure = errors_figure(answers.curves, column, title, self._theme)

    def show_result(self, answers: Answers) -> None:
        """Show the status line."""
        state, good = node_words(answers.result)
        self._status.content = status_html(state, good, comparison_words(answers.runs.values()))

    def show_problem(self, text: str) -> None:
        """Say what is wrong, instead of an answer."""
        self._status.content = status_html(text, False, '')
