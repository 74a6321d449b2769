"""The last check of a motion lets good ones out, and finds each fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.published_robots import UR5
from ros_ik_pkg.ik import Obstacle, PathOptions, SolveOptions, World, load_arm, solve_path
from ros_ik_pkg.ik.model.transforms import transform
from ros_ik_pkg.ros.handling.path_check import fault_of_motion

ARM = load_arm('ur5')
START = np.array([0.3, -1.2, 1.5, 0.2, 0.9, 0.1])


@pytest.fixture(scope='module')
def motion():
    end = ARM.forward(START)
    end[1, 3] += 0.1
    return solve_path(ARM, [ARM.forward(START), end], START, path=PathOptions(deadline=0.0))


def fault(motion, arm=ARM, path=PathOptions(), options=SolveOptions()):  # noqa: B008
    return fault_of_motion(motion, arm, options, path)


def changed(array, row, value):
    out = array.copy()
    out[row] += value
    return out


def test_a_good_motion_passes(motion):
    assert fault(motion) == ''


def test_each_fault_is_found(motion):
    assert 'do not rise' in fault(replace(motion, times=changed(motion.times, 5, 1.0)))
    assert 'point 5' in fault(replace(motion, q=changed(motion.q, 5, 1e-3)))
    assert 'not finite' in fault(replace(motion, velocities=changed(motion.velocities, 5, np.nan)))
    assert 'velocity limit' in fault(replace(motion, times=0.2 * motion.times))
    assert 'acceleration limit' in fault(motion, path=PathOptions(acceleration_limits=(0.01,) * 6))
    assert 'outside the limits' in fault(motion, arm=replace(ARM, upper=np.full(6, 0.05), lower=np.full(6, -6.0)))
    bent = changed(motion.accelerations, 5, [0.0, 30.0, 0.0, 0.0, 0.0, 0.0])
    loose = replace(ARM, velocity_limits=np.full(6, np.inf))
    assert 'leaves its line' in fault(replace(motion, accelerations=bent), arm=loose, path=PathOptions(tolerance=1e-6))


def test_a_motion_that_touches_between_its_points_is_held_back():
    urdf, srdf, tip = UR5
    arm = load_arm(urdf, tip=tip, srdf=srdf)
    start, end = arm.forward(START), arm.forward(START)
    end[1, 3] += 0.2
    options = SolveOptions(avoid_collisions=False)
    motion = solve_path(arm, [start, end], START, options, PathOptions(deadline=0.0))
    middle = transform(np.eye(3), 0.5 * (start + end)[:3, 3])
    room = arm.contacts.room(World(obstacles=(Obstacle('ball', 'sphere', (0.03,), middle),)))
    assert fault_of_motion(motion, arm, options, PathOptions()) == ''
    found = fault_of_motion(motion, arm, options, PathOptions(), room)
    assert 'ball' in found and 'touch' in found
