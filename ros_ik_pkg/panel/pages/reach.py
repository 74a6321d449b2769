"""The folder *Reach*: the node's map of what the arm reaches, as cubes; a click sends the arm there."""

from __future__ import annotations

import math
from html import escape

import numpy as np
import pinocchio as pin
from geometry_msgs.msg import Pose, PoseArray
from visualization_msgs.msg import MarkerArray

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ik.reachability.figures import red_to_blue
from ros_ik_pkg.panel.drawing.reach_drawing import ReachDrawing
from ros_ik_pkg.panel.pages.page import Page, Tools
from ros_ik_pkg.ros.input.pose import stamp_text
from ros_ik_pkg.ros.interface import topics

FIGURES = ('share', 'sigma_min', 'clearance')  # in the order of the menu


class ReachPage(Page):
    """Asks for the map, and shows it: all of it, or what lies behind a cut."""

    title = 'reach'

    def __init__(self, tools: Tools) -> None:
        super().__init__(tools)
        self._answer = ''  # of the service, while the map is awaited
        self._stamps = ['', '']  # of cubes and poses
        self._positions = np.empty((0, 3))
        self._parts: dict[str, np.ndarray] = {}  # of the largest value, 0 to 1, by the figure's name
        self._ends: dict[str, float] = {}  # the largest values
        self._figure = 'share'
        self._poses: list[Pose] = []
        self._edge, self._cut = 0.0, -np.inf  # m
        self._shown, self._clicked = False, -1
        tools.link.listen(topics.REACH, self._take_cubes)
        tools.link.listen(topics.REACH_POSES, self._take_poses)

    def add(self) -> None:
        """Add the controls, and show in them what is known."""
        gui, texts = self._tools.server.gui, self._texts
        gui.add_button(texts['map reach'], color='gray').on_click(lambda _: self._tools.later(self.ask))
        self._switch = gui.add_checkbox(texts['show reach'], self._shown)
        self._tools.on(self._switch, self.choose)
        names = [texts[name] for name in FIGURES]
        self._choice = gui.add_dropdown(texts['colour by'], names, initial_value=texts[self._figure])
        self._tools.on(self._choice, self.colour_by)
        self._slider = gui.add_slider(texts['cut'], -1.0, 1.0, 0.01, -1.0, disabled=True)
        self._tools.on(self._slider, self.cut_at)
        self._words = gui.add_html('')
        self._say()
        self._show_range()

    def begin(self, arm: Arm) -> None:
        """Begin with another arm, of which no map is known."""
        super().begin(arm)
        later = self._tools.later
        self._drawing = ReachDrawing(self._tools.server.scene, lambda k: later(lambda: self.go_to(k)))
        self._stamps, self._answer, self._shown = ['', ''], '', False
        self._switch.value = False
        self._say()

    def ask(self) -> None:
        """Have the node make the map of its arm."""
        self._stamps, self._shown, self._clicked = ['', ''], True, -1
        self._switch.value = True
        self._drawing.hide()
        self._tools.link.call(topics.MAP_REACH, self._take_answer)

    def _take_answer(self, text: str) -> None:
        self._answer = text
        self._say()

    def _take_cubes(self, message: MarkerArray) -> None:
        cubes = message.markers[0]
        self._positions = np.array([[p.x, p.y, p.z] for p in cubes.points]).reshape(-1, 3)
        self._parts = {marker.ns: np.array([c.b for c in marker.colors]) for marker in message.markers}
        self._ends = {marker.ns: float(marker.text) for marker in message.markers}
        self._edge = cubes.scale.x
        self._take(0, stamp_text(cubes.header.stamp))

    def _take_poses(self, message: PoseArray) -> None:
        self._poses = list(message.poses)
        self._take(1, stamp_text(message.header.stamp))

    def _take(self, which: int, stamp: str) -> None:
        """Take note of one of the two messages of a map; show the map once both are there."""
        self._stamps[which] = stamp
        if self._known:
            self._answer, self._cut, self._clicked = '', -np.inf, -1
            self._show_range()
            self._say()
            self._draw()

    @property
    def _known(self) -> bool:
        return self._stamps[0] != '' and self._stamps[0] == self._stamps[1] and len(self._positions) > 0

    def _show_range(self) -> None:
        """Let the slider go from one end of the map to the other."""
        self._slider.disabled = not self._known
        if self._known:
            low, high = self._positions[:, 1].min(), self._positions[:, 1].max()
            self._slider.min, self._slider.max = round(float(low), 2) - 0.01, round(float(high), 2)
            self._slider.value = min(max(float(self._cut), self._slider.min), self._slider.max)

    def choose(self, shown: bool) -> None:
        """Show the map, or hide it."""
        self._shown = bool(shown)
        self._draw()

    def colour_by(self, words: str) -> None:
        """Show another figure of the positions in colours."""
        self._figure = next(name for name in FIGURES if self._texts[name] == words)
        self._draw()
        self._say()

    def cut_at(self, y: float) -> None:
        """Show only what lies at this y or beyond [m], so that the inside is seen."""
        self._cut = float(y)
        self._draw()

    def _draw(self) -> None:
        if self._shown and self._known:
            chosen = np.flatnonzero(self._positions[:, 1] >= self._cut)
            parts = self._parts.get(self._figure, np.zeros(len(self._positions)))
            colours = (255.0 * red_to_blue(parts, 1.0)).round().astype(np.uint8)
            self._drawing.show(self._positions, colours, self._edge, chosen)
        else:
            self._drawing.hide()

    def go_to(self, number: int) -> None:
        """Make the pose that the map has at a position the target."""
        if self._known and 0 <= number < len(self._poses):
            self._clicked = number
            p, q = self._poses[number].position, self._poses[number].orientation
            self._desk.set_target(pin.XYZQUATToSE3(np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w])).homogeneous)
            self._say()

    def _say(self) -> None:
        words = self._answer or self._texts['reach hint']
        if self._known and not self._answer:
            words = self._texts.fill('reach known', count=len(self._positions), figure=self._texts[self._figure],
                                     end=f'{self._ends.get(self._figure, math.nan):.3g}')  # fmt: skip
        if self._clicked >= 0:
            x, y, z = self._positions[self._clicked]
            share, sigma, gap = (self._value(name) for name in FIGURES)
            words += ' ' + self._texts.fill('reach at', x=x, y=y, z=z, share=100.0 * share, sigma=sigma)
            words += '' if math.isnan(gap) else ', ' + self._texts.fill('reach gap', gap=gap)
        self._words.content = f'<div class="ik said" data-testid="reach">{escape(words)}</div>'

    def _value(self, name: str) -> float:
        """Return a figure of the position that was clicked; NaN if the map has none."""
        return float(self._ends[name] * self._parts[name][self._clicked]) if name in self._parts else math.nan
