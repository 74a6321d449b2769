"""What the page shows of the node's answers: words, table, curves, tip paths, and where the arm stands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ros_ik_pkg.compare.problem import Problem
from ros_ik_pkg.panel.answers import COMPARISON, PATHS, RESULT, TRACE, Answers, least_bad_of
from ros_ik_pkg.panel.drawing.scene import Scene
from ros_ik_pkg.panel.markup.texts import Texts
from ros_ik_pkg.panel.pages.controls import Controls
from ros_ik_pkg.panel.pages.microscope import OFF
from ros_ik_pkg.panel.pages.readings import Readings
from ros_ik_pkg.ros.handling.result import CLOSEST


class AnswerView:
    """Draws the answers to a problem. controls, readings: of the page, new ones if its language changes.

    moves: called before the arm is put where an answer has it.
    """

    controls: Controls
    readings: Readings

    def __init__(
        self, answers: Answers, scene: Scene, texts: Texts, problem: Callable[[], Problem],
        parameters: Callable[[], Mapping[str, Any]], moves: Callable[[], object],
    ) -> None:  # fmt: skip
        self._answers, self._scene, self._texts = answers, scene, texts
        self._problem, self._parameters, self._moves = problem, parameters, moves

    def show_news(self) -> None:
        """Draw what has come since the last call."""
        answers, compared = self._answers, self.controls.parameters.compared
        news = answers.take_news()
        if news & {RESULT, COMPARISON}:
            self.readings.show_count(len(compared))
            self.readings.show_status(answers, compared)
        if COMPARISON in news:
            self.readings.show_comparison(answers, self._parameters()['method'])
        if PATHS in news:
            self._scene.show_paths(answers.paths)
        if self.readings.microscope.method != OFF:
            if news & {RESULT, COMPARISON, TRACE}:
                self.look_again()
        elif RESULT in news and answers.result:
            self._show_solution()

    def look_again(self) -> None:
        """Show the iterate that is looked at, or the solution if none is."""
        answers, microscope, problem = self._answers, self.readings.microscope, self._problem()
        looked = microscope.show(problem.arm, problem.target, answers, self._parameters())
        self.readings.show_curves(answers)
        if looked is None:
            self._scene.iterate.hide()
            if answers.result:
                self._show_solution()
            return
        self._moves()
        iterate, positions = looked
        self._scene.contact.hide()
        self._scene.stand_at(iterate, microscope.shown_method, positions)
        text = self._texts.fill('an iterate', k=iterate.iteration, method=microscope.shown_method)
        self.controls.show_tip(iterate.base_from_tip, text)

    def _show_solution(self) -> None:
        """Draw the arm at the solution, at a published closest approach, at a failure by contact, or not at all."""
        self._moves()
        answers, arm, texts = self._answers, self._problem().arm, self._texts
        self._scene.contact.hide()
        if set(arm.joint_names) <= set(answers.solution):
            q = np.array([answers.solution[name] for name in arm.joint_names])
            self._scene.go_to(q)
            closest = answers.result.get('published') == CLOSEST
            self.controls.show_tip(arm.forward(q), texts['closest'] if closest else '')
        elif least_bad := least_bad_of(answers.result, arm):
            q, links = least_bad
            self._scene.go_to(q)
            self._scene.contact.show(q, links)
            self.controls.show_tip(arm.forward(q), texts.fill('contact', links=', '.join(links)))
        else:
            self._scene.go_to(None)
            self.controls.show_tip(None, texts['no solution'])
