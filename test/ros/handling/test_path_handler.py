"""A path is solved in the room as it is when its motion is published; without DDS."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from nav_msgs.msg import Path
from rclpy.clock import ROSClock
from ros_helpers import CALM, joint_state, pose_of

from bench.published_robots import UR5
from ros_ik_pkg.ik import Obstacle, World, load_arm
from ros_ik_pkg.ros.handling import path_handler
from ros_ik_pkg.ros.handling.path_handler import answer_path, read_path
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.input.joint_states import JointStates
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, Settings

ARM = load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])
START = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
LENGTH = 0.2  # m


@pytest.fixture
def job():
    frames = SimpleNamespace(set_timeout=lambda timeout: None, why_not='TF is not asked here')
    handler = TargetHandler(ROSClock(), frames, JointStates(), lambda: 'no robot yet')
    defaults = {name: option.default for name, option in PARAMETERS.items()}
    handler.take_over(Settings.from_values(defaults | CALM | {'path.deadline': 0.0}), ARM)
    handler.joint_states.keep(joint_state(ARM.joint_names, START))
    poses = [ARM.forward(START) for _ in range(5)]
    for k, pose in enumerate(poses):
        pose[1, 3] += LENGTH * k / (len(poses) - 1)
    return read_path(Path(poses=[pose_of(pose) for pose in poses]), handler)


def ball(place, size=0.03):
    pose = np.eye(4)
    pose[:3, 3] = place
    return World(obstacles=(Obstacle('ball', 'sphere', (size,), pose),))


def on_the_line(job, k=2):
    """Return a room with a ball on the tip's line: no motion passes it."""
    return ball(job.poses[k][:3, 3])


def solves(monkeypatch):
    """Return a list to which each solve of a path adds its room."""
    counted, solve = [], path_handler._answer_path
    monkeypatch.setattr(path_handler, '_answer_path', lambda job, go_on: counted.append(job.world) or solve(job, go_on))
    return counted


def answer(job, *worlds):
    """Return the result of a path while the room changes after each solve; the last one stays."""
    left = list(worlds)
    return answer_path(job, lambda _: None, lambda: left.pop(0) if len(left) > 1 else left[0])


def test_in_a_room_that_stays_a_path_is_solved_once(job, monkeypatch):
    counted = solves(monkeypatch)
    assert answer(job, job.world).outcome == 'solved' and counted == [job.world]


def test_a_motion_that_touches_what_has_come_meanwhile_is_not_published(job, monkeypatch):
    counted, room = solves(monkeypatch), on_the_line(job)
    result = answer(job, room)
    assert (result.outcome, result.status) == ('partial', 'contact'), result.reason
    assert counted == [job.world, room]


def test_a_motion_that_is_clear_of_what_has_come_meanwhile_needs_no_second_solve(job, monkeypatch):
    counted, room = solves(monkeypatch), ball((-0.5, -0.5, 0.9))
    result = answer(job, room)
    assert result.outcome == 'solved' and counted == [job.world] and result.job.world is room


def test_a_path_that_was_blocked_is_solved_when_the_way_is_free(job):
    blocked = path_handler.replace(job, world=on_the_line(job), contacts=ARM.contacts)
    assert answer(blocked, blocked.world).outcome != 'solved'
    assert answer(blocked, job.world).outcome == 'solved'


def test_a_room_in_which_the_motion_always_touches_by_now_is_no_room_for_it(job, monkeypatch):
    monkeypatch.setattr(path_handler, '_fault_in', lambda job, solution: 'it touches')
    result = answer(job, *(ball((-0.5, -0.5, 0.9 + 0.01 * k)) for k in range(4)))
    assert (result.outcome, result.status) == ('refused', 'room') and '3 times' in result.reason
