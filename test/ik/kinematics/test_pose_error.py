"""The twist error and its logarithm, from no rotation to half a turn, against Pinocchio and closed forms."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numerics import SEEDS, law, random_rotation

from ros_ik_pkg.ik.kinematics.pose_error import rotation_log, twist_error

EXACT = 1e-14
TINY_ANGLES = [0.0, 1e-300, 1e-16, 1e-12, 1e-9, 1e-8, 1e-6, 1e-4, 1e-3]
ANGLES = [*TINY_ANGLES, 0.1, 1.0, np.pi / 2, 2.0, 2 * np.pi / 3, 3.0, np.pi - 1e-4, np.pi - 1e-7, np.pi - 1e-9]
AXES = [
    (1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1),
    (1, 1, 1), (-1, 2, 0.5), (1e-9, 1, 0), (0.3, -1e-5, -1),
]  # fmt: skip


def log(R):
    return np.array(rotation_log(tuple(np.ravel(R))))


def turn(axis, angle):
    """Rotation about an axis (Rodrigues)."""
    x, y, z = unit(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + 2.0 * np.sin(angle / 2.0) ** 2 * K @ K


def unit(axis):
    return np.array(axis, dtype=float) / np.linalg.norm(axis)


@pytest.mark.parametrize('angle', ANGLES)
@pytest.mark.parametrize('axis', AXES)
def test_the_logarithm_is_axis_times_angle(axis, angle):
    np.testing.assert_allclose(log(turn(axis, angle)), angle * unit(axis), rtol=0, atol=EXACT)


@pytest.mark.parametrize('angle', TINY_ANGLES[3:])
@pytest.mark.parametrize('axis', AXES)
def test_tiny_angles_keep_their_relative_precision(axis, angle):
    assert np.linalg.norm(log(turn(axis, angle))) == pytest.approx(angle, rel=1e-12)


@pytest.mark.parametrize('axis', AXES)
def test_half_a_turn_is_about_the_axis_one_way_or_the_other(axis):
    R = 2.0 * np.outer(unit(axis), unit(axis)) - np.eye(3)
    w = log(R)
    assert np.linalg.norm(w) == pytest.approx(np.pi, abs=EXACT)
    np.testing.assert_allclose(abs(w @ unit(axis)), np.pi, rtol=0, atol=EXACT)


def test_no_rotation_has_the_logarithm_zero():
    assert log(np.eye(3)).tolist() == [0.0, 0.0, 0.0]


@law
@given(SEEDS)
def test_it_is_pinocchios_logarithm(seed):
    R = random_rotation(np.random.default_rng(seed))
    expected = pin.log3(R)
    # its own precision falls towards half a turn
    loss = 1.0 / max(np.pi - np.linalg.norm(expected), 1e-6)
    np.testing.assert_allclose(log(R), expected, rtol=0, atol=1e-14 + 1e-13 * loss)


@law
@given(SEEDS)
def test_the_exponential_undoes_it(seed):
    R = random_rotation(np.random.default_rng(seed))
    np.testing.assert_allclose(pin.exp3(log(R)), R, rtol=0, atol=1e-14)


@law
@given(SEEDS, st.sampled_from(ANGLES), st.sampled_from([1e-15, 1e-12, 1e-9, 1e-6, 1e-4]))
def test_a_matrix_slightly_off_the_rotations_counts_as_the_nearest_one(seed, angle, noise):
    rng = np.random.default_rng(seed)
    R = turn(rng.normal(size=3), angle) + noise * rng.uniform(-1.0, 1.0, (3, 3))
    U, _, Vt = np.linalg.svd(R)
    w = log(R)
    assert np.linalg.norm(w) <= np.pi + EXACT
    # compared as rotations: at half a turn two opposite vectors are the same
    np.testing.assert_allclose(pin.exp3(w), U @ Vt, rtol=0, atol=EXACT + 5.0 * noise)


@law
@given(SEEDS)
def test_the_twist_error_leads_from_the_pose_to_the_target_in_base_axes(seed):
    rng = np.random.default_rng(seed)
    target, pose = (pin.SE3(random_rotation(rng), rng.uniform(-1.0, 1.0, 3)) for _ in range(2))
    e = np.array(twist_error(*numbers(target), *numbers(pose)))
    np.testing.assert_allclose(pose.translation + e[:3], target.translation, rtol=0, atol=EXACT)
    np.testing.assert_allclose(pin.exp3(e[3:]) @ pose.rotation, target.rotation, rtol=0, atol=EXACT)


def numbers(pose):
    """Rotation, row by row, and translation as tuples."""
    return tuple(pose.rotation.ravel()), tuple(pose.translation)
