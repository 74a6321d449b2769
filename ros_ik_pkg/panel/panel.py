"""The panel: one thread that handles user actions, talks to the IK node, and draws the results."""

from __future__ import annotations

import math
import time
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
from ros_ik_pkg.panel.answers import COMPARISON, PATHS, RESULT, TRACE
from ros_ik_pkg.panel.controls import Controls
from ros_ik_pkg.panel.events import Events
from ros_ik_pkg.panel.microscope import OFF, Microscope
from ros_ik_pkg.panel.node_link import NodeLink
from ros_ik_pkg.panel.node_parameters import NodeParameters
from ros_ik_pkg.panel.obstacles import Obstacles
from ros_ik_pkg.panel.parameter_controls import COMPARE
from ros_ik_pkg.panel.presets import PRESETS, notes
from ros_ik_pkg.panel.readings import Readings
from ros_ik_pkg.panel.robots import ROBOT_PARAMETERS, SHIPPED, Robots
from ros_ik_pkg.panel.scene import Scene
from ros_ik_pkg.panel.solution_view import show_solution
from ros_ik_pkg.panel.texts import Texts
from ros_ik_pkg.ros.input.robot_source import urdf_text

PATIENCE = 1.0  # s for an answer; then the target is sent again
MOST_PATIENCE = 16.0  # s, if it does not come again and again
SERVICE_PATIENCE = 3.0  # s for an answer of a parameter service
FIELDS = 0.2  # s for which the fields wait for a target that is dragged: a page does much for each change of them


class Panel:
    """Owns the page; everything happens in `tick`, on one thread, and callbacks only queue calls for it."""

    def __init__(self, server: viser.ViserServer, node: Node, ik_node: str) -> None:
        self._server = server
        self._events = Events(node.get_logger(), self._failed)
        self._link = NodeLink(node, ik_node, self._events.put)
        self._robots = Robots()
        self._parameters = NodeParameters()
        self._texts, self._dark = Texts(), False
        self._lesson: Lesson | None = None
        self._add_page()
        self._scene = Scene(server, lambda pose: self._events.put(lambda: self.set_target(pose, dragged=True)))
        self._obstacles = Obstacles(server.scene, self._events.put, self._send_obstacles)
        self._ready = False  # whether the node has the robot of the page
        self._alive = False
        self._ask_again = math.inf  # when to repeat a question about parameters
        self._questions = 0
        self._dirty = self._seed_changed = False
        self._patience = PATIENCE
        self._sent = 0.0  # time of the last target
        self._fields_due = math.inf  # when the fields are to show the target
        self._robot = robots.parameters_of(SHIPPED[0])
        self._name = SHIPPED[0]  # of the robot, on the page
        self._use(robots.load(self._robot))
        self._say_gone()

    def _add_page(self) -> None:
        """Add everything beside the scene, in the language of the page."""
        gui = self._server.gui
        gui.reset()
        self._controls = Controls(gui, self, self._events.put, self._robots.names, self._texts, self._dark)
        self._readings = Readings(gui, self._texts, self._make_microscope)

    def _make_microscope(self) -> Microscope:
        return Microscope(self._server.gui, self._texts, self._controls.on, self._events.put, self._look_again)

    def tick(self) -> None:
        """Handle everything since the last tick."""
        with self._server.atomic():
            self._events.run()
            for step in (
                self._watch_node, self._ask, self._show, self._readings.tick, self._readings.microscope.tick,
                self._scene.tick,
            ):  # fmt: skip
                self._events.guard(step)

    def _failed(self, text: str) -> None:
        """Report an error, and show the values in use instead of the requested ones."""
        self._readings.show_notice(text)
        self._controls.show_robots(self._robots.names, self._name)
        self._controls.parameters.show(self._parameters.shown)
        self._controls.show_seed(self._problem.seed)
        self._controls.show_target(self._problem.target)
        self._scene.show_target(self._problem.target)

    # The node: presence and settings.

    def _watch_node(self) -> None:
        """Detect that the node appears or disappears; when it appears, synchronise page and node."""
        alive = self._link.alive
        unheard = alive and time.monotonic() > self._ask_again  # the first answers may get lost in discovery
        if alive == self._alive and not unheard:
            return
        self._alive, self._ready, self._ask_again = alive, False, math.inf
        if alive:
            self._read_parameters()
        else:
            self._say_gone()

    def _say_gone(self) -> None:
        self._readings.show_problem(self._texts.fill('no node', name=self._link.name))
        self._readings.show_comparison(self._link.answers, '', old=True)

    def _read_parameters(self) -> None:
        self._ask_again = time.monotonic() + SERVICE_PATIENCE
        names = [*ROBOT_PARAMETERS, *self._controls.parameters.names]
        self._link.get_parameters(names, self._take_over)

    def _take_over(self, values: dict[str, Any]) -> None:
        """Show the node's settings, send it the changes made on the page, and enable the comparison."""
        self._ask_again = math.inf
        self._parameters.node = dict(values)
        if not values[COMPARE]:
            self._parameters.changed.setdefault(COMPARE, self._controls.parameters.compared)
        self._controls.parameters.show(self._parameters.shown)
        robot = robots.robot_of(self._parameters.shown)
        if robot != self._robot and not self._take_robot(robot):
            return
        self._link.answers.renew()
        if not self._obstacles.empty:
            self._send_obstacles()
        self._send_parameters(self._parameters.changed)

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

    def _send_parameters(self, values: dict[str, Any]) -> None:
        """Send these parameters; the page is in step with the node once the newest of them are answered."""
        values = dict(values)
        self._questions += 1
        question = self._questions

        def done(refusal: str) -> None:
            if question == self._questions:
                self._ask_again = math.inf
            if refusal:
                self._refused(values, refusal)
                return
            self._parameters.take(values)
            if question == self._questions:
                self._ready = self._dirty = True

        self._ask_again = time.monotonic() + SERVICE_PATIENCE
        self._link.set_parameters(values, done)

    def _refused(self, values: dict[str, Any], refusal: str) -> None:
        """Show the node's values again."""
        self._parameters.take_back(values)
        self._failed(self._texts.fill('refused by node', reason=refusal))
        if not self._ready:
            self._read_parameters()

    # Targets and answers.

    def _ask(self) -> None:
        """Publish the seed, as a robot does, and then the target, one at a time."""
        if not self._ready:
            return
        answers = self._link.answers
        waited = time.monotonic() - self._sent
        silent = waited > self._patience and not answers.result
        if silent or (answers.passing and waited > PATIENCE):
            self._dirty = True  # the seed may have come too late, or the first messages before discovery
        self._link.publish_joints(self._arm, self._problem.seed)
        done = answers.result and (answers.compared or answers.refused or not self._controls.parameters.compared)
        if self._seed_changed:  # let it arrive before the target
            self._seed_changed = False
        elif self._dirty and (done or waited > PATIENCE):
            # A slow node would never be heard if it were asked again and again before it answers.
            again = silent and self._sent > 0.0
            self._patience = min(2.0 * self._patience, MOST_PATIENCE) if again else PATIENCE
            self._dirty, self._sent = False, time.monotonic()
            self._link.send_target(self._arm, self._problem.target)

    def _show(self) -> None:
        """Draw new data."""
        if time.monotonic() >= self._fields_due:
            self._fields_due = math.inf
            self._controls.show_target(self._problem.target)
        if not self._ready:
            return
        answers, compared = self._link.answers, self._controls.parameters.compared
        news = answers.take_news()
        if news & {RESULT, COMPARISON}:
            self._readings.show_count(len(compared))
            self._readings.show_status(answers, compared)
        if COMPARISON in news:
            self._readings.show_comparison(answers, self._parameters.shown['method'])
        if PATHS in news:
            self._scene.show_paths(answers.paths)
        if self._readings.microscope.method != OFF:
            if news & {RESULT, COMPARISON, TRACE}:
                self._look_again()
        elif RESULT in news and answers.result:
            self._show_solution()

    def _look_again(self) -> None:
        """Show the iterate that is looked at, or the solution if none is."""
        answers, microscope = self._link.answers, self._readings.microscope
        looked = microscope.show(self._arm, self._problem.target, answers, self._parameters.shown)
        self._readings.show_curves(answers)
        if looked is None:
            self._scene.iterate.hide()
            if answers.result:
                self._show_solution()
            return
        iterate, positions = looked
        self._scene.contact.hide()
        self._scene.stand_at(iterate, microscope.shown_method, positions)
        text = self._texts.fill('an iterate', k=iterate.iteration, method=microscope.shown_method)
        self._controls.show_tip(iterate.base_from_tip, text)

    def _show_solution(self) -> None:
        show_solution(self._link.answers, self._arm, self._scene, self._controls, self._texts)

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
        self._controls.show_tip(arm.forward(self._problem.seed), self._texts['the seed'])
        self._pose(self._problem)

    def _pose(self, problem: Problem) -> None:
        """Take a seed and a target, and show both."""
        self._problem = problem
        self._controls.show_seed(problem.seed)
        self._scene.show_seed(problem.seed)
        self._scene.show_target(problem.target)
        self._dirty = self._seed_changed = True
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
        self._ready = False
        values: dict[str, Any] = {**parameters}
        if self._parameters.changed.get('posture'):
            values['posture'] = []
        self._parameters.changed |= values
        if self._alive:
            self._send_parameters(values)

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
        self._parameters.changed |= values
        self._controls.parameters.show(self._parameters.shown)
        if self._alive:
            self._send_parameters(self._parameters.changed)
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
        self._dirty = self._seed_changed = True

    def choose_language(self, language: str) -> None:
        """Write the page in another language."""
        if language not in LANGUAGES:
            raise ArgumentError(f'no language {shorten(language, 20)!r}; expected one of {", ".join(LANGUAGES)}')
        method, row = self._readings.microscope.method, self._readings.microscope.row
        self._texts.language = language
        self._add_page()
        self._controls.show_robots(self._robots.names, self._name)
        self._controls.show_arm(self._arm)
        self._controls.parameters.show(self._parameters.shown)
        self._pose(self._problem)
        if self._lesson is not None:
            self._controls.lessons.show(self._lesson.text[language])
        if not self._alive:
            self._say_gone()
        self._link.answers.renew()
        self._readings.microscope.choose(method, row)

    def set_target(self, target: np.ndarray, dragged: bool = False) -> None:
        """Take a target (4, 4) from the fields or from the gizmo."""
        if not np.isfinite(target).all():
            raise ArgumentError('the target is not finite')
        self._problem = Problem(self._arm, self._problem.seed, target)
        if not dragged:
            self._scene.show_target(target)
        self._dirty = True
        self._fields_due = min(self._fields_due, time.monotonic() + FIELDS) if dragged else 0.0

    def set_joint(self, joint: int, position: float) -> None:
        """Take the position [rad, m] of one joint of the seed."""
        seed = self._problem.seed.copy()
        seed[joint] = position
        self._problem = Problem(self._arm, seed, self._problem.target)
        self._scene.show_seed(seed)
        self._dirty = self._seed_changed = True

    def set_parameter(self, name: str, value: Any) -> None:
        """Send a parameter that was changed on the page to the node."""
        self._parameters.changed[name] = value
        if self._readings.microscope.method != OFF:
            self._look_again()  # the chart of the gains shows it at once, the node at the next target
        if name == COMPARE and not value:
            self._link.answers.forget_runs()
        if self._alive:
            self._send_parameters({name: value})

    def choose_theme(self, dark: bool) -> None:
        """Turn the page light or dark."""
        self._dark = bool(dark)
        self._server.gui.configure_theme(dark_mode=bool(dark), show_logo=False, show_share_button=False)
        self._scene.choose_theme(bool(dark))
        self._link.answers.renew()
