"""The second look agrees with Pinocchio about tolerance and limits, and lets nothing through that is not finite."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numerics import SEEDS, law, pinocchio_tip

from ros_ik_pkg.ik import SolveOptions, load_arm
from ros_ik_pkg.ik.kinematics.pose_error import pose_matrix
from ros_ik_pkg.ik.search.final_check import passes

ARM = load_arm('panda')
OPTIONS = SolveOptions(position_tolerance=1e-4, orientation_tolerance=1e-3)


def passes_with(q, target, **options) -> bool:
    return passes(ARM.packed, SolveOptions(**options).numbers, target, np.asarray(q, dtype=float))


@law
@given(SEEDS, st.floats(0.5, 1.5), st.floats(0.5, 1.5))
def test_it_passes_what_pinocchio_finds_within_both_tolerances(seed, away, turned):
    random = np.random.default_rng(seed)
    q = random.uniform(ARM.lower, ARM.upper)
    tip = pin.SE3(pinocchio_tip(ARM, q))
    direction, axis = (vector / np.linalg.norm(vector) for vector in random.normal(size=(2, 3)))
    position = tip.translation + away * OPTIONS.position_tolerance * direction
    target = pin.SE3(pin.exp3(turned * OPTIONS.orientation_tolerance * axis) @ tip.rotation, position)
    within = away <= 1.0 and turned <= 1.0
    assert passes(ARM.packed, OPTIONS.numbers, np.ascontiguousarray(target.homogeneous), q) == within


def test_half_a_turn_off_passes_no_tolerance_but_half_a_turn():
    target = ARM.forward(ARM.home)
    target[:3, :3] = target[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    assert not passes_with(ARM.home, target, orientation_tolerance=3.0)
    assert passes_with(ARM.home, target, orientation_tolerance=np.pi)


@pytest.mark.parametrize('joint', range(ARM.n))
@pytest.mark.parametrize('bound', ['lower', 'upper'])
def test_a_joint_on_its_limit_passes_and_one_beyond_does_not(joint, bound):
    q, outwards = ARM.home.copy(), {'lower': -np.inf, 'upper': np.inf}[bound]
    q[joint] = getattr(ARM, bound)[joint]
    assert passes_with(q, ARM.forward(q))
    q[joint] = np.nextafter(q[joint], outwards)
    assert not passes_with(q, ARM.forward(q))
    assert passes_with(q, ARM.forward(q), respect_limits=False)


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_never_passes(bad):
    q, target = ARM.home.copy(), ARM.forward(ARM.home)
    q[3] = bad
    assert not passes_with(q, target, respect_limits=False)
    target[1, 3] = bad
    assert not passes_with(ARM.home, target)


@pytest.mark.parametrize('task', [{'task_weights': (1, 1, 1, 0, 0, 0)}, {'task_tolerances': (0.1, 0, 0, 0, 0, 0)}])
def test_a_task_whose_rows_do_not_count_alike_is_left_to_others(task):
    assert not passes_with(ARM.home, ARM.forward(ARM.home), **task)


@law
@given(SEEDS, st.floats(0.1, 10.0))
def test_a_pose_of_a_quaternion_of_any_length_is_that_of_pinocchio(seed, length):
    random = np.random.default_rng(seed)
    position, quaternion = random.normal(size=3), random.normal(size=4)
    unit = quaternion / np.linalg.norm(quaternion)
    expected = pin.XYZQUATToSE3(np.r_[position, unit]).homogeneous
    np.testing.assert_allclose(pose_matrix(*position, *(length * unit)), expected, rtol=0, atol=1e-14)
