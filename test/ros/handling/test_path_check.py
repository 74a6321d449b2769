"""The final check of a motion lets good ones pass and finds each fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
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
    loose = replace(ARM, velocity_limits=np.full(6, 1e3))
    assert 'leaves its line' in fault(replace(motion, accelerations=bent), arm=loose, path=PathOptions(tolerance=1e-6))


def test_a_default_acceleration_and_those_of_the_robot_are_limits_too(motion):
    fast = replace(motion, times=0.8 * motion.times, velocities=motion.velocities / 0.8,
                   accelerations=motion.accelerations / 0.8**2)  # fmt: skip
    assert 'acceleration limit' in fault(fast, arm=replace(ARM, velocity_limits=1.3 * ARM.velocity_limits))
    assert 'acceleration limit' in fault(motion, arm=replace(ARM, acceleration_limits=np.full(6, 0.5)))
    unknown = replace(ARM, velocity_limits=np.full(6, np.inf))
    speed = np.abs(motion.velocities).max()
    faster = replace(motion, times=motion.times * speed / 1.2, velocities=1.2 * motion.velocities / speed,
                     accelerations=motion.accelerations * (1.2 / speed) ** 2)  # fmt: skip
    assert 'velocity limit' in fault(faster, arm=unknown)


def test_a_turn_of_the_tip_between_points_is_found_unless_the_task_leaves_it_free(motion):
    turned = changed(motion.accelerations, 5, [0.0, 0.0, 0.0, 0.0, 0.0, 400.0])
    loose = replace(ARM, velocity_limits=np.full(6, 1e3))
    bent, tight = replace(motion, accelerations=turned), PathOptions(angle_tolerance=1e-3)
    assert 'leaves its line' in fault(bent, arm=loose, path=tight)
    roll = SolveOptions(task_weights=(1, 1, 1, 1, 1, 0), task_frame='tip')
    assert fault(bent, arm=loose, path=tight, options=roll) == ''
    slack = SolveOptions(task_tolerances=(0, 0, 0, 0, 0, 0.5), task_frame='tip')
    assert fault(bent, arm=loose, path=tight, options=slack) == ''
    pitched = replace(motion, accelerations=changed(motion.accelerations, 5, [0.0, 0.0, 0.0, 0.0, 400.0, 0.0]))
    assert 'leaves its line' in fault(pitched, arm=loose, path=PathOptions(tolerance=0.1), options=roll)


@pytest.mark.parametrize('options', [
    SolveOptions(task_weights=(1, 1, 0, 1, 1, 1)),
    SolveOptions(task_weights=(1, 1, 1, 1, 1, 0), task_frame='tip'),
    SolveOptions(task_weights=(1, 1, 1, 0, 0, 0)),
    SolveOptions(task_weights=(0, 0, 0, 1, 1, 1)),
    SolveOptions(task_tolerances=(0.002, 0.002, 0.002, 0.1, 0.1, 0.1)),
], ids=lambda options: f'{options.task_weights} {options.task_tolerances[0]}')  # fmt: skip
def test_good_motions_of_tasks_with_freedom_pass(options):
    end = ARM.forward(START)
    end[:3, 3] += [0.05, 0.1, 0.05]
    end[:3, :3] = pin.exp3(np.array([0.3, 0.2, 0.4])) @ end[:3, :3]
    motion = solve_path(ARM, [ARM.forward(START), end], START, options, PathOptions(deadline=0.0))
    assert motion.complete and len(motion.stops) == 2
    assert motion.line_error <= 1e-4 and motion.line_angle <= 1e-3
    assert fault(motion, options=options) == ''


def test_a_motion_that_leads_to_the_start_first_passes():
    end = ARM.forward(START)
    end[1, 3] += 0.1
    path = PathOptions(lead_in=True, deadline=0.0)
    motion = solve_path(ARM, [ARM.forward(START), end], START + 0.2, path=path)
    assert motion.led and fault(motion, path=path) == ''


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
