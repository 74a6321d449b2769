"""Where the arm of the page stands once a target is answered: at the solution, or at the least bad configuration."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.answers import Answers, least_bad_of
from ros_ik_pkg.panel.controls import Controls
from ros_ik_pkg.panel.scene import Scene
from ros_ik_pkg.panel.texts import Texts
from ros_ik_pkg.ros.handling.result import CLOSEST


def show_solution(answers: Answers, arm: Arm, scene: Scene, controls: Controls, texts: Texts) -> None:
    """Draw the arm at the solution, at a published closest approach, at a failure by contact, or not at all."""
    scene.contact.hide()
    if set(arm.joint_names) <= set(answers.solution):
        q = np.array([answers.solution[name] for name in arm.joint_names])
        scene.go_to(q)
        controls.show_tip(arm.forward(q), texts['closest'] if answers.result.get('published') == CLOSEST else '')
    elif least_bad := least_bad_of(answers.result, arm):
        q, links = least_bad
        scene.go_to(q)
        scene.contact.show(q, links)
        controls.show_tip(arm.forward(q), texts.fill('contact', links=', '.join(links)))
    else:
        scene.go_to(None)
        controls.show_tip(None, texts['no solution'])
