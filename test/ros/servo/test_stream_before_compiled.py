"""A stream whose code is still being compiled: it refuses commands instead of waiting, and needs no node to show it."""

from __future__ import annotations

import threading
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from geometry_msgs.msg import TwistStamped

from ros_ik_pkg.ik import SolveOptions, load_arm
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.codes import Code
from ros_ik_pkg.ros.servo.stream import COMPILING, Stream

ARM = load_arm('panda')
SETTINGS = SimpleNamespace(
    servo=replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=100.0),
    thresholds=Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS}),
    options=SolveOptions(), velocity_scale=1.0, seed_source='home',
)  # fmt: skip


class Handler:
    """The parts of a target handler that a stream asks: no room, no joint states, a start at home."""

    surroundings = SimpleNamespace(world=lambda arm, settings: (None, ()))
    joint_states = SimpleNamespace(empty=True)

    def start(self, arm) -> np.ndarray:
        return arm.home

    def refuse_stale(self, *_) -> None:
        pass

    def base_from_frame(self, *_) -> tuple[np.ndarray, tuple[str, ...]]:
        return np.eye(4), ()


def test_commands_are_refused_until_what_the_stream_calls_is_compiled_and_taken_then():
    ready, published = threading.Event(), threading.Event()
    node = SimpleNamespace(get_logger=lambda: SimpleNamespace(warning=lambda *_, **__: None))
    stream = Stream(node, Handler(), lambda *_: published.set(), ready.is_set)
    stream.take_over(SETTINGS, ARM)
    stream.on_twist(TwistStamped())
    assert stream.look().finding == (0.0, Code.REFUSED, COMPILING)
    assert stream.on_pose(ARM, ARM.home) == COMPILING
    assert stream.position is None and not published.is_set()
    ready.set()
    try:
        assert stream.on_pose(ARM, ARM.home) == ''
        assert published.wait(60.0)
        assert stream.look().finding.code is not Code.REFUSED
    finally:
        stream.close()
