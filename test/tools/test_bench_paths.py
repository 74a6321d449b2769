"""The check of paths lets good motions pass, and finds each fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from bench.collision import add_room
from bench.judge import Judge
from bench.path_check import violation
from bench.paths import AS_GIVEN, long_path
from bench.published_robots import UR5, UrdfJudge, moving_pairs
from ros_ik_pkg.ik import Obstacle, PathOptions, SolveOptions, World, load_arm, solve_path
from ros_ik_pkg.ik.model.transforms import transform

pytestmark = pytest.mark.once

START = np.array([0.3, -1.2, 1.5, -1.8, -1.5, 0.1])
PATH = PathOptions(deadline=0.0)


@pytest.fixture(scope='module')
def found():
    """The UR5, a motion of it along a line, and a function that says what is wrong with a motion in a world."""
    urdf, srdf, tip = UR5
    arm = load_arm(urdf, tip=tip, srdf=srdf)
    start, end = arm.forward(START), arm.forward(START)
    end[1, 3] += 0.2
    line = np.array([start, end])
    motion = solve_path(arm, line, START, SolveOptions(avoid_collisions=False), PATH)

    def fault(motion, path=PATH, arm=arm, obstacles=(), poses=None, vias=()):
        world = World(obstacles=obstacles)
        room = arm.contacts.room(world)
        contact = UrdfJudge(urdf, moving_pairs(room), room.positions, base=arm.base_frame)
        add_room(contact, arm, room, world)
        return violation(arm, Judge(arm), contact, motion, path, line if poses is None else poses, vias)

    return arm, motion, fault


def test_each_fault_is_found(found):
    arm, motion, fault = found
    assert fault(motion) == ''
    assert 'rise' in fault(replace(motion, times=motion.times[::-1]))
    assert 'too fast' in fault(replace(motion, times=0.2 * motion.times))
    assert 'accelerates' in fault(motion, path=replace(PATH, acceleration_limits=(0.01,) * 6))
    assert 'limits' in fault(motion, arm=replace(arm, upper=motion.q.max(axis=0) - 1e-3))
    moved, turned = motion.base_from_tip[[0, -1]], motion.base_from_tip[[0, -1]]
    moved[1, 0, 3] += 2e-4
    turned[1] = turned[1] @ transform(pin.exp3(np.array([2e-3, 0.0, 0.0])), np.zeros(3))
    for poses in (moved, turned):
        assert 'off its line' in fault(motion, poses=poses)
    middle = transform(np.eye(3), motion.base_from_tip[len(motion.q) // 2][:3, 3])
    assert 'contact' in fault(motion, obstacles=(Obstacle('box', 'box', (0.15, 0.15, 0.15), middle),))


def test_an_arc_is_judged_by_its_circle(found):
    arm, _, fault = found
    poses = np.array([arm.forward(START)] * 3)
    poses[1, 1:3, 3] += 0.1
    poses[2, 1, 3] += 0.2
    poses[2] = poses[2] @ transform(pin.exp3(np.array([0.2, 0.0, 0.0])), np.zeros(3))
    arc = solve_path(arm, poses, START, SolveOptions(avoid_collisions=False), PATH, vias=[1])
    assert arc.complete and fault(arc, poses=poses, vias=[1]) == ''
    assert 'off its line' in fault(arc, poses=poses)
    wider = poses.copy()
    wider[1, 1:3, 3] -= np.array([0.02, 0.04])  # not on the circle
    assert 'off its line' in fault(arc, poses=wider, vias=[1])


def test_the_long_path_takes_a_panda_one_reconfiguration():
    solution = solve_path(load_arm('panda'), long_path(), path=PathOptions(max_reconfigurations=9, **AS_GIVEN))
    assert solution.complete and len(solution.reconfigurations) == 1
    broken = solve_path(load_arm('panda'), long_path(), path=PathOptions(**AS_GIVEN))
    assert not broken.complete
