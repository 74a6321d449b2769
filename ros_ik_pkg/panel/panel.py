"""The panel: one thread that takes what the user did, talks to the IK node, and draws what came back."""

from __future__ import annotations

import math
import queue
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import viser
from rclpy.node import Node

from ros_ik_pkg.compare.problem import Problem
from ros_ik_pkg.ik import Arm, IkError, load_arm
from ros_ik_pkg.panel.controls import ROBOTS, Controls
from ros_ik_pkg.panel.node_link import NodeLink
from ros_ik_pkg.panel.presets import PRESETS, notes
from ros_ik_pkg.panel.readings import Readings
from ros_ik_pkg.panel.scene import Scene
from ros_ik_pkg.ros.answer import shorten
from ros_ik_pkg.ros.robot_source import urdf_text

PATIENCE = 1.0  # s for an answer; then the target is sent again
SERVICE_PATIENCE = 3.0  # s for an answer of a parameter service
ROBOT_PARAMETERS = ('robot', 'robot_description', 'base_frame', 'tip_frame')


class Panel:
    """Owns the page; everything happens in `tick`, on one thread, and callbacks only queue calls for it."""

    def __init__(self, server: viser.ViserServer, node: Node, ik_node: str) -> None:
        self._server = server
        self._events: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._link = NodeLink(node, ik_node)
        self._readings = Readings(server.gui)
        self._controls = Controls(server.gui, self, self._events)
        self._scene = Scene(server, lambda pose: self._events.put(lambda: self.set_target(pose, dragged=True)))
        self._robot: dict[str, Any] = {'robot': ROBOTS[0], 'robot_description': '', 'base_frame': '', 'tip_frame': ''}
        self._known = False  # whether the node's parameters were ever read
        self._ready = False  # whether the node has the parameters of the page
        self._alive = False
        self._ask_again = math.inf  # when to repeat a question about parameters
        self._dirty = self._seed_changed = self._target_changed = False
        self._sent = 0.0  # when the last target went out
        self._news = 0
        self._use(load_arm(ROBOTS[0]))
        self._say_gone()

    def tick(self) -> None:
        """Do what has come up since the last tick."""
        while not self._events.empty():
            self._events.get()()
        with self._server.atomic():
            self._watch_node()
            if self._ready:
                self._ask()
            self._show()
            self._scene.tick()

    def _watch_node(self) -> None:
        """Notice the node's coming and going; whenever it comes, bring page and node in step."""
        alive = self._link.alive
        unheard = alive and time.monotonic() > self._ask_again  # the first answers may get lost in discovery
        if alive == self._alive and not unheard:
            return
        self._alive, self._ready = alive, False
        self._ask_again = time.monotonic() + SERVICE_PATIENCE
        if not alive:
            self._say_gone()
        elif self._known:
            self._send_parameters({**self._robot, **self._controls.parameters()})
        else:
            names = [*ROBOT_PARAMETERS, *self._controls.parameters()]
            self._link.get_parameters(names, self._take_over)

    def _say_gone(self) -> None:
        self._readings.show_problem(f'no IK node {self._link.name}; waiting for it …')

    def _take_over(self, values: dict[str, Any]) -> None:
        """Show what the node is set to, and ask it to compare."""
        self._known, self._ask_again = True, math.inf
        self._controls.show_parameters(values)
        compare = {'compare': self._controls.compared()}
        source = values['robot_description'] or values['robot']
        if not source:  # it follows a topic that the panel does not hear
            self._send_parameters({**self._robot, **compare})
            return
        self._robot = {name: values[name] for name in ROBOT_PARAMETERS}
        self._use(load_arm(source, values['base_frame'] or None, values['tip_frame'] or None))
        self._send_parameters(compare)

    def _send_parameters(self, values: dict[str, Any]) -> None:
        def done(refusal: str) -> None:
            self._ready = self._dirty = not refusal
            self._ask_again = math.inf
            if refusal:
                self._readings.show_problem(f'the node refused: {refusal}')

        self._ask_again = time.monotonic() + SERVICE_PATIENCE
        self._link.set_parameters(values, done)

    def _ask(self) -> None:
        """Publish the seed, as a robot does, and then the target, one at a time."""
        answers = self._link.answers
        waited = time.monotonic() - self._sent
        refused = answers.result.get('outcome') == 'refused'
        if waited > PATIENCE and (refused or not answers.result):
            self._dirty = True  # the seed may have come too late, or the first messages before discovery
        self._link.publish_joints(self._arm, self._problem.seed)
        if self._seed_changed:  # let it arrive before the target
            self._seed_changed = False
        elif self._dirty and (answers.compared or not self._controls.compared() or waited > PATIENCE or refused):
            self._dirty, self._sent = False, time.monotonic()
            self._link.send_target(self._arm, self._problem.target)

    def _show(self) -> None:
        """Draw what is new."""
        answers = self._link.answers
        if self._target_changed:
            self._target_changed = False
            self._controls.show_target(self._problem.target)
        if answers.news == self._news:
            return
        self._news = answers.news
        if self._ready and answers.result:
            self._readings.show_answers(answers, self._controls.method)
            self._scene.show_paths(answers.paths)
        if set(self._arm.joint_names) <= set(answers.solution):
            q = np.array([answers.solution[name] for name in self._arm.joint_names])
            self._scene.go_to(q)
            self._controls.show_tip(self._arm.forward(q))

    def _use(self, arm: Arm) -> None:
        """Begin with another arm."""
        self._arm = arm
        self._link.answers.forget()
        self._controls.show_arm(arm)
        self._problem = notes(arm)
        self._scene.show_arm(arm, self._robot['robot'], self._problem.seed, self._problem.target)
        self._controls.show_tip(arm.forward(self._problem.seed))
        self._pose(self._problem)

    def _pose(self, problem: Problem) -> None:
        """Take a seed and a target, and show both."""
        self._problem = problem
        self._controls.show_seed(problem.seed)
        self._scene.show_seed(problem.seed)
        self._scene.show_target(problem.target)
        self._dirty = self._seed_changed = self._target_changed = True

    # What the user can do: see controls.Actions.

    def choose_robot(self, name: str) -> None:
        """Switch to a robot of config/robots; a page may send any text, a path too."""
        if name in ROBOTS:
            self._switch(name, {'robot': name, 'robot_description': ''})
        else:
            self._readings.show_problem(f'no robot {shorten(name, 60)!r}; expected one of {", ".join(ROBOTS)}')

    def upload_urdf(self, text: str) -> None:
        """Switch to the robot of a URDF; anything else is refused, so that no text opens files."""
        self._switch(text, {'robot': '', 'robot_description': text})

    def _switch(self, source: str, parameters: dict[str, str]) -> None:
        try:
            arm = load_arm(source if parameters['robot'] else urdf_text(source, 'the file'))
        except IkError as error:
            self._readings.show_problem(str(error))
            return
        self._robot = {**parameters, 'base_frame': '', 'tip_frame': ''}
        self._use(arm)
        self._ready = False
        self._send_parameters(self._robot)

    def choose_preset(self, name: str) -> None:
        """Take seed and target of a preset."""
        self._pose(PRESETS[name](self._arm))

    def set_target(self, target: np.ndarray, dragged: bool = False) -> None:
        """Take a target (4, 4) from the fields or from the gizmo, which is where it is already."""
        self._problem = Problem(self._arm, self._problem.seed, target)
        if not dragged:
            self._scene.show_target(target)
        self._dirty, self._target_changed = True, dragged

    def set_seed(self, seed: np.ndarray) -> None:
        """Take a seed (n,) [rad, m] from the sliders."""
        self._problem = Problem(self._arm, seed, self._problem.target)
        self._scene.show_seed(seed)
        self._dirty = self._seed_changed = True

    def set_parameters(self, values: dict[str, Any]) -> None:
        """Hand the parameters of the page to the node."""
        if self._alive:
            self._send_parameters(values)

    def choose_theme(self, dark: bool) -> None:
        """Turn the page light or dark."""
        self._server.gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False)
        self._readings.choose_theme(dark)
        self._scene.choose_theme(dark)
        self._link.answers.news += 1
