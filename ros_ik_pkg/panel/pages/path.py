"""The folder *Path*: way points to drag, the node's motion through them, played and drawn over time."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from ros_ik_pkg.ik import ArgumentError, Arm
from ros_ik_pkg.panel.answers import values_of
from ros_ik_pkg.panel.drawing.path_drawing import PathDrawing
from ros_ik_pkg.panel.markup.joint_labels import short_names
from ros_ik_pkg.panel.markup.motion_html import charts_html, moved_html, path_html, path_words
from ros_ik_pkg.panel.motion import Motion, read_motion
from ros_ik_pkg.panel.node_link import write_pose
from ros_ik_pkg.panel.pages.page import Page, Tools
from ros_ik_pkg.ros.handling.result import SOLVED
from ros_ik_pkg.ros.input.pose import stamp_text
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.reply import PathMotions

TOOL_SPEED, BRANCHES = 'path.tool_speed', 'path.max_reconfigurations'
APART = pin.SE3(pin.utils.rotate('z', np.radians(20.0)), np.zeros(3))  # about the base: the next way point
MOST = 50  # way points


class PathPage(Page):
    """Sends the way points as a path, and shows the motion or why there is none."""

    title = 'path'
    parameters = (TOOL_SPEED, BRANCHES)

    def __init__(self, tools: Tools) -> None:
        super().__init__(tools)
        self._poses: list[np.ndarray] = []
        self._chosen = -1
        self._stamp = ''  # of the path that is asked for
        self._result: dict[str, str] = {}
        self._coming = PathMotions()
        self._markers: MarkerArray | None = None
        self._motion: Motion | None = None
        self._time = self._due = 0.0  # s: in the motion, and when that was shown
        self._playing = False
        self._publisher = tools.link.publisher(topics.TARGET_PATH)
        tools.link.listen(topics.PATH_SOLUTION, self._take_motion)
        tools.link.listen(topics.PATH_MARKERS, self._take_markers)
        tools.link.listen(topics.PATH_RESULT, self._take_result)

    def add(self) -> None:
        """Add the controls, and show in them what is known."""
        gui, texts = self._tools.server.gui, self._texts
        self._tools.buttons(
            texts['way points'], {'add': self.add_point, 'delete': self.delete_point, 'clear': self.clear}
        )
        self._speed = gui.add_number(texts['tool speed'], 0.0, min=0.0, max=100.0, step=0.01, hint=texts['speed hint'])
        self._branches = gui.add_number(texts['branches'], 0, min=0, max=100, step=1, hint=texts['branches hint'])
        self._tools.on(self._speed, lambda value: self._desk.set_parameters({TOOL_SPEED: float(value)}))
        self._tools.on(self._branches, lambda value: self._desk.set_parameters({BRANCHES: int(value)}))
        gui.add_button(texts['solve path'], color='gray').on_click(lambda _: self._tools.later(self.solve))
        self._words = gui.add_html(path_html(*self._said()))
        self._slider = gui.add_slider(texts['time in motion'], 0.0, 1.0, 0.01, 0.0, disabled=True)
        self._tools.on(self._slider, self.go_to)
        self._tools.buttons('', {'play': self.play, 'stop': self.interrupt})
        self._charts, self._moment = gui.add_html(''), gui.add_html('')
        self._show_motion()

    def begin(self, arm: Arm) -> None:
        """Begin with another arm, without a path."""
        super().begin(arm)
        scene = self._tools.server.scene
        later = self._tools.later
        self._drawing = PathDrawing(
            scene, arm, lambda k: later(lambda: self.choose(k)), lambda k, pose: later(lambda: self.move(k, pose))
        )
        self._poses, self._chosen = [], -1
        self._forget()

    def show(self, parameters: Mapping[str, Any]) -> None:
        """Show the node's parameters."""
        for handle, name in ((self._speed, TOOL_SPEED), (self._branches, BRANCHES)):
            if name in parameters:
                handle.value = parameters[name]

    # Way points.

    def add_point(self) -> None:
        """Add a way point after the chosen one, a little further round the base; the first one at the target."""
        if len(self._poses) >= MOST:
            raise ArgumentError(f'there are {MOST} way points already')
        pose = APART.homogeneous @ self._poses[self._chosen] if self._poses else self._desk.target.copy()
        self._chosen += 1
        self._poses.insert(self._chosen, pose)
        self._changed()

    def delete_point(self) -> None:
        """Delete the chosen way point; the one before it is chosen then."""
        if self._poses:
            del self._poses[self._chosen]
            self._chosen = min(max(self._chosen - 1, 0), len(self._poses) - 1)
            self._changed()

    def clear(self) -> None:
        """Delete all way points."""
        self._poses, self._chosen = [], -1
        self._changed()

    def choose(self, k: int) -> None:
        """Put the gizmo at way point k."""
        if 0 <= k < len(self._poses):
            self._chosen = k
            self._drawing.show_points(self._poses, k)

    def move(self, k: int, pose: np.ndarray) -> None:
        """Take the pose (4, 4) that a way point was dragged to; raises ArgumentError if it is none."""
        if not np.isfinite(pose).all():
            raise ArgumentError('the pose of the way point is not finite')
        if 0 <= k < len(self._poses):
            self._poses[k] = pose
            self._drawing.move(k, self._poses)
            self._forget()

    def _changed(self) -> None:
        self._drawing.show_points(self._poses, self._chosen)
        self._tools.scene.hide_paths(bool(self._poses))
        self._forget()

    def _forget(self) -> None:
        """Forget the result: the way points have changed."""
        self._stamp, self._result, self._motion, self._playing = '', {}, None, False
        self._drawing.clear_result()
        self._say()
        self._show_motion()

    # The node.

    def solve(self) -> None:
        """Send the path."""
        if len(self._poses) < 2:
            raise ArgumentError(self._texts['path hint'])
        self._forget()
        path = Path()
        path.header.frame_id, path.header.stamp = self._arm.base_frame, self._tools.link.now()
        for pose in self._poses:
            stamped = PoseStamped()
            write_pose(stamped.pose, pose)
            path.poses.append(stamped)
        self._stamp = stamp_text(path.header.stamp)
        self._coming.clear()
        self._markers = None
        self._publisher.publish(path)
        self._say()

    def _take_motion(self, message: JointTrajectory) -> None:
        self._coming.add(message)
        self._show_result()

    def _take_markers(self, message: MarkerArray) -> None:
        if message.markers and stamp_text(message.markers[0].header.stamp) == self._stamp:
            self._markers = message
            self._draw_result()

    def _take_result(self, message: DiagnosticArray) -> None:
        if stamp_text(message.header.stamp) == self._stamp:
            self._result = {**values_of(message.status[0]), 'message': message.status[0].message}
            self._say()
            self._draw_result()
            self._show_result()

    def _show_result(self) -> None:
        """Show the motion once it and its result are there."""
        if self._result.get('outcome') != SOLVED or self._motion is not None:
            return
        motion = self._coming.of(self._result)
        if motion is not None:
            times = list(map(float, self._result['reconfigured_at_times'].split()))
            self._motion, self._time = read_motion(motion, self._arm, times), 0.0
            self._show_motion()

    def _draw_result(self) -> None:
        """Draw line, break and places off the path once they are there."""
        if self._result and self._markers is not None:
            places = map(float, self._result.get('reconfigured_at_poses', '').split())
            self._drawing.show_result(self._markers, [self._position(place) for place in places])

    def _position(self, place: float) -> np.ndarray:
        """Return the position (3,) at a pose number and the fraction of the way to the next."""
        positions = np.array([pose[:3, 3] for pose in self._poses])
        return np.array([np.interp(place, np.arange(len(positions)), column) for column in positions.T])

    def _said(self) -> tuple[str, bool | None]:
        """Return what there is to say of the path, and whether it is good; None while that is not known."""
        if self._result:
            return path_words(self._result, self._texts), self._result['outcome'] == SOLVED
        key = 'path sent' if self._stamp else 'path ready' if len(self._poses) > 1 else 'path hint'
        return self._texts[key], None

    def _say(self) -> None:
        self._words.content = path_html(*self._said())

    # The motion in time.

    def _show_motion(self) -> None:
        """Show charts and slider of the motion, or none."""
        motion = self._motion
        self._slider.disabled = motion is None
        if motion is None:
            self._charts.content = self._moment.content = ''
            return
        self._charts.content = charts_html(motion, self._arm, short_names(self._arm.joint_names), self._texts)
        self._slider.max = round(motion.duration, 2) or 0.01
        self._show_time()

    def go_to(self, seconds: float) -> None:
        """Put the arm where it is at a time of the motion [s]."""
        if self._motion is not None:
            self._playing = False
            self._time = min(max(float(seconds), 0.0), self._motion.duration)
            self._show_time()
            self._stand()

    def play(self) -> None:
        """Play from here, from the start if this is the end."""
        if self._motion is not None:
            self._time = 0.0 if self._time >= self._motion.duration else self._time
            self._playing, self._due = True, time.monotonic()

    def interrupt(self) -> None:
        """Stop playing."""
        self._playing = False

    def tick(self) -> None:
        """Go on in time if it plays; the end stops it."""
        if not self._playing or self._motion is None:
            return
        now = time.monotonic()
        self._time, self._due = min(self._time + now - self._due, self._motion.duration), now
        self._playing = self._time < self._motion.duration
        self._show_time()
        self._stand()

    def _show_time(self) -> None:
        assert self._motion is not None
        self._slider.value = min(round(self._time, 2), self._slider.max)
        self._moment.content = moved_html(self._time, self._motion, self._texts)

    def _stand(self) -> None:
        assert self._motion is not None
        self._desk.stand_at(self._motion.at(self._time), self._texts.fill('on the path', seconds=f'{self._time:.2f}'))
