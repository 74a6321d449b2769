"""The panel: one thread that handles user actions, talks to the IK node, and draws the results."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import viser
from rclpy.node import Node

from ros_ik_pkg.compare.lessons import LESSONS, Lesson
from ros_ik_pkg.compare.problem import Problem
from ros_ik_pkg.compare.words import LANGUAGES
from ros_ik_pkg.ik import ArgumentError, Arm, IkError
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.panel import robots
from ros_ik_pkg.panel.answer_view import AnswerView
from ros_ik_pkg.panel.asking import Asking
from ros_ik_pkg.panel.drawing.scene import Scene
from ros_ik_pkg.panel.events import Events
from ros_ik_pkg.panel.markup.texts import Texts
from ros_ik_pkg.panel.node_link import NodeLink
from ros_ik_pkg.panel.node_sync import NodeSync
from ros_ik_pkg.panel.pages.controls import Controls
from ros_ik_pkg.panel.pages.drive import DrivePage
from ros_ik_pkg.panel.pages.microscope import OFF, Microscope
from ros_ik_pkg.panel.pages.obstacles import Obstacles
from ros_ik_pkg.panel.pages.page import Page, Tools
from ros_ik_pkg.panel.pages.parameters import COMPARE
from ros_ik_pkg.panel.pages.path import PathPage
from ros_ik_pkg.panel.pages.reach import ReachPage
from ros_ik_pkg.panel.pages.readings import Readings
from ros_ik_pkg.panel.presets import PRESETS, notes
from ros_ik_pkg.panel.robots import ROBOT_PARAMETERS, SHIPPED, Robots
from ros_ik_pkg.ros.input.robot_source import urdf_text

FIELDS = 0.2  # s for which the fields wait for a target that is dragged: a page does much for each change of them
PAGES: tuple[type[Page], ...] = (PathPage, DrivePage, ReachPage)  # the folders of the tab *Motion*, from the top down


class Panel:
    """Owns the page; everything happens in `tick`, on one thread, and callbacks only queue calls for it."""

    def __init__(self, server: viser.ViserServer, node: Node, ik_node: str) -> None:
        self._server = server
        self._events = Events(node.get_logger(), self._failed)
        self._link = NodeLink(node, ik_node, self._events.put)
        self._sync = NodeSync(self._link, self)
        self._asking = Asking()
        self._robots = Robots()
        self._texts, self._dark = Texts(), False
        self._lesson: Lesson | None = None
        self._scene = Scene(server, lambda pose: self._events.put(lambda: self.set_target(pose, dragged=True)))
        self._tools = Tools(server, self._scene, self._link, self._texts, self._events.put, self)
        self._pages = [kind(self._tools) for kind in PAGES]
        self._view = AnswerView(
            self._link.answers, self._scene, self._texts, lambda: self._problem, lambda: self.parameters,
            self._interrupt,
        )
        self._add_page()
        self._obstacles = Obstacles(server.scene, self._events.put, self._send_obstacles)
        self._fields_due = math.inf  # when the fields are to show the target
        self._robot = robots.parameters_of(SHIPPED[0])
        self._name = SHIPPED[0]  # of the robot, on the page
        self._use(robots.load(self._robot))
        self.node_gone()

    def _add_page(self) -> None:
        """Add everything beside the scene, in the language of the page."""
        gui = self._server.gui
        gui.reset()
        self._controls = Controls(self, self._tools, self._robots.names, self._pages, self._dark)
        self._readings = Readings(gui, self._texts, self._make_microscope)
        self._view.controls, self._view.readings = self._controls, self._readings

    def _make_microscope(self) -> Microscope:
        return Microscope(self._server.gui, self._texts, self._controls.on, self._events.put, self._view.look_again)

    def tick(self) -> None:
        """Handle everything since the last tick."""
        with self._server.atomic():
            self._events.run()
            for step in (
                self._sync.watch, self._ask, self._show, self._readings.tick, self._readings.microscope.tick,
                *(page.tick for page in self._pages), self._scene.tick,
            ):  # fmt: skip
                self._events.guard(step)

    def _failed(self, text: str) -> None:
        """Report an error, and show the values in use instead of the requested ones."""
        self._readings.show_notice(text)
        self._controls.show_robots(self._robots.names, self._name)
        self._show_parameters()
        self._controls.show_seed(self._problem.seed)
        self._controls.show_target(self._problem.target)
        self._scene.show_target(self._problem.target)

    # The node: see node_sync.View.

    @property
    def parameter_names(self) -> list[str]:
        """Parameters that the page shows."""
        names = [*ROBOT_PARAMETERS, *self._controls.parameters.names]
        return [*names, *(name for page in self._pages for name in page.parameters)]

    @property
    def parameters(self) -> Mapping[str, Any]:
        """The node's parameters as the page shows them."""
        return self._sync.parameters.shown

    def _show_parameters(self) -> None:
        self._controls.parameters.show(self.parameters)
        for page in self._pages:
            page.show(self.parameters)

    def node_gone(self) -> None:
        """Say that there is no node."""
        self._readings.show_problem(self._texts.fill('no node', name=self._link.name))
        self._readings.show_comparison(self._link.answers, '', old=True)

    def take_node(self) -> bool:
        """Show the node's parameters and robot, and enable the comparison; return whether the robot can be shown."""
        parameters = self._sync.parameters
        if not parameters.node[COMPARE]:
            parameters.changed.setdefault(COMPARE, self._controls.parameters.compared)
        self._show_parameters()
        robot = robots.robot_of(parameters.shown)
        if robot != self._robot and not self._take_robot(robot):
            return False
        self._link.answers.renew()
        if not self._obstacles.empty:
            self._send_obstacles()
        return True

    def _take_robot(self, robot: dict[str, Any]) -> bool:
        """Show the node's robot; if it cannot be read here, tell the user what to do."""
        try:
            arm = robots.load(robot)
        except IkError as error:
            name = robot['robot'] or 'robot_description'
            self._name = self._robots.add(robot, shorten(name, 40))
            self._controls.show_robots(self._robots.names, self._name)
            self._readings.show_problem(self._texts.fill('cannot show', error=error))
            return False
        shipped = robot == robots.parameters_of(robot['robot']) and robot['robot'] in SHIPPED
        self._robot, self._name = robot, self._robots.add(robot, robot['robot'] if shipped else arm.name)
        self._use(arm)
        return True

    def in_step(self) -> None:
        """Ask the node, which now has everything that the page shows."""
        self._asking.ask_again()

    def refused(self, reason: str) -> None:
        """Show the node's values again."""
        self._failed(self._texts.fill('refused by node', reason=reason))

    # Targets and answers.

    def _ask(self) -> None:
        """Publish the seed, as a robot does, and then the target, one at a time."""
        if not self._sync.ready or any(page.drives for page in self._pages):
            return
        self._link.publish_joints(self._arm, self._problem.seed)
        if self._asking.due(self._link.answers, bool(self._controls.parameters.compared)):
            self._link.send_target(self._arm, self._problem.target)

    def _show(self) -> None:
        """Draw new data."""
        if time.monotonic() >= self._fields_due:
            self._fields_due = math.inf
            self._controls.show_target(self._problem.target)
        if self._sync.ready:
            self._view.show_news()

    def _interrupt(self) -> None:
        """Have every page let go of the arm."""
        for page in self._pages:
            page.interrupt()

    def _use(self, arm: Arm) -> None:
        """Begin with another arm."""
        self._arm = arm
        self._link.answers.forget()
        self._controls.show_robots(self._robots.names, self._name)
        self._controls.show_arm(arm)
        self._problem = notes(arm)
        self._obstacles.forget_drawing()
        self._scene.show_arm(arm, self._robot['robot'], self._problem.seed, self._problem.target)
        self._obstacles.draw()
        for page in self._pages:
            page.begin(arm)
        self._controls.show_tip(arm.forward(self._problem.seed), self._texts['the seed'])
        self._pose(self._problem)

    def _pose(self, problem: Problem) -> None:
        """Take a seed and a target, and show both."""
        self._problem = problem
        self._controls.show_seed(problem.seed)
        self._scene.show_seed(problem.seed)
        self._scene.show_target(problem.target)
        self._asking.ask_again(seed_changed=True)
        self._fields_due = 0.0

    # User actions: see controls.Actions. A page may send any value; one that raises changes nothing.

    def choose_robot(self, name: str) -> None:
        """Switch to a robot that the page offers."""
        self._switch(self._robots.parameters(name), name)

    def upload_urdf(self, text: str, file_name: str) -> None:
        """Switch to the robot of a URDF text; refuse anything else, so that no text opens files."""
        origin = f'the file {shorten(file_name, 60)!r}'
        try:
            parameters = robots.parameters_of(robot_description=urdf_text(text, origin))
            name = robots.load(parameters).name
        except IkError as error:
            raise ArgumentError(f'{error}' if origin in str(error) else f'{origin}: {error}') from error
        self._switch(parameters, self._robots.add(parameters, name))

    def _switch(self, parameters: dict[str, Any], name: str) -> None:
        """Show another robot and hand it to the node, together with a posture that no longer fits."""
        arm = robots.load(parameters)
        self._robot, self._name = parameters, name
        self._use(arm)
        values: dict[str, Any] = {**parameters}
        if self._sync.parameters.changed.get('posture'):
            values['posture'] = []
        self._sync.change_robot(values)

    def choose_preset(self, name: str) -> None:
        """Take seed and target of a preset."""
        if name not in PRESETS:
            raise ArgumentError(f'no preset {shorten(name, 60)!r}; expected one of {", ".join(PRESETS)}')
        self._pose(PRESETS[name](self._arm))

    def choose_lesson(self, name: str) -> None:
        """Set robot, seed, target, methods and parameters of a lesson, look into its descent, and say what to watch."""
        lesson = {item.name: item for item in LESSONS}.get(name)
        if lesson is None:
            names = ', '.join(item.name for item in LESSONS)
            raise ArgumentError(f'no lesson {shorten(name, 60)!r}; expected one of {names}')
        self._lesson = lesson
        if self._name != lesson.robot:
            self.choose_robot(lesson.robot)
        self._pose(lesson.problem())
        values = {**lesson.values(), COMPARE: list(lesson.methods)}
        self._sync.change({**self._sync.parameters.changed, **values})
        self._controls.parameters.show(self.parameters)
        self._controls.lessons.show(lesson.text[self._texts.language])
        self._readings.microscope.choose(lesson.watch)

    def choose_obstacle(self, kind: str) -> None:
        """Add an obstacle at the target, or remove all."""
        self._obstacles.choose(kind, self._problem.target[:3, 3])
        if not self._obstacles.empty and not self._arm.tree.shapes:
            self._readings.show_notice(self._texts['no shapes'])

    def _send_obstacles(self) -> None:
        """Tell the node of the obstacles, and ask it again once they have arrived."""
        self._link.publish_obstacles(self._obstacles.message())
        self._asking.ask_again(seed_changed=True)

    def choose_language(self, language: str) -> None:
        """Write the page in another language."""
        if language not in LANGUAGES:
            raise ArgumentError(f'no language {shorten(language, 20)!r}; expected one of {", ".join(LANGUAGES)}')
        method, row = self._readings.microscope.method, self._readings.microscope.row
        self._texts.language = language
        self._add_page()
        self._controls.show_robots(self._robots.names, self._name)
        self._controls.show_arm(self._arm)
        self._show_parameters()
        self._pose(self._problem)
        if self._lesson is not None:
            self._controls.lessons.show(self._lesson.text[language])
        if not self._sync.alive:
            self.node_gone()
        self._link.answers.renew()
        self._readings.microscope.choose(method, row)

    def set_target(self, target: np.ndarray, dragged: bool = False) -> None:
        """Take a target (4, 4) from the fields or from the gizmo."""
        if not np.isfinite(target).all():
            raise ArgumentError('the target is not finite')
        self._problem = Problem(self._arm, self._problem.seed, target)
        if not dragged:
            self._scene.show_target(target)
        self._asking.ask_again()
        self._fields_due = min(self._fields_due, time.monotonic() + FIELDS) if dragged else 0.0

    def set_joint(self, joint: int, position: float) -> None:
        """Take the position [rad, m] of one joint of the seed."""
        seed = self._problem.seed.copy()
        seed[joint] = position
        self._problem = Problem(self._arm, seed, self._problem.target)
        self._scene.show_seed(seed)
        self._asking.ask_again(seed_changed=True)

    def set_parameter(self, name: str, value: Any) -> None:
        """Send a parameter that was changed on the page to the node."""
        self.set_parameters({name: value})
        if self._readings.microscope.method != OFF:
            self._view.look_again()  # the chart of the gains shows it at once, the node at the next target
        if name == COMPARE and not value:
            self._link.answers.forget_runs()

    # What pages ask for: see pages.page.Desk.

    @property
    def target(self) -> np.ndarray:
        """The target (4, 4) in the base frame [m]."""
        return self._problem.target

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Set parameters of the node."""
        self._sync.change(values)

    def start_from(self, q: np.ndarray) -> None:
        """Take q (n,) as the seed, and the pose of its tip as the target."""
        self._pose(Problem(self._arm, q, self._arm.forward(q)))

    def stand_at(self, q: np.ndarray, text: str) -> None:
        """Put the arm at q (n,) [rad, m]; the text says what that is."""
        self._scene.contact.hide()
        self._scene.put(q)
        self._controls.show_tip(self._arm.forward(q), text)

    def say(self, text: str) -> None:
        """Show a notice for a while."""
        self._readings.show_notice(text)

    def choose_theme(self, dark: bool) -> None:
        """Turn the page light or dark."""
        self._dark = bool(dark)
        self._server.gui.configure_theme(dark_mode=bool(dark), show_logo=False, show_share_button=False)
        self._scene.choose_theme(bool(dark))
        self._link.answers.renew()
