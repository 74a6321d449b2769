"""Kinematics and errors of many configurations at once against Pinocchio and libm."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from chains import random_urdf
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numerics import SEEDS, few, get_arm, numeric_jacobian, pinocchio_tip, random_configurations, random_rotation

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.kernel.data_layout import unpack_model
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN, on_stack, shaped

if WHY_PLAIN:
    pytest.skip('plain Numba has no numbers of several lanes', allow_module_level=True)

from ros_ik_pkg.ik.batch.kinematics import (
    look_around_lanes,
    look_at_errors,
    rotation_log_of_lanes,
    sincos_of_lanes,
)
from ros_ik_pkg.ik.batch.records import lanes_size, make_lanes
from ros_ik_pkg.ik.kernel.sincos import LARGE
from ros_ik_pkg.ik.kernel.wide import LANES, bits_of, wide_view

EXACT = 1e-12
ROBOTS = ('panda', 'ur5', 'stanford', 'so100')
NEAR_HALF_A_TURN = [np.pi - gap for gap in (0.2, 0.1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 0.0)]
ANGLES = [0.0, 1e-300, 1e-16, 1e-9, 1e-5, 1e-3, 0.1, 0.785, 0.786, 1.0, np.pi / 2, 2.0, 2.3, 2.4, *NEAR_HALF_A_TURN]


@kernel
def _look(model, weights, memory, q, goals, errors, columns, squares):
    geometry, _, _ = unpack_model(model)
    lanes = make_lanes(model, memory, weights)
    for w in range(LANES):
        for i in range(len(q)):
            lanes.q_of[i, w] = q[i, w]
        for i in range(12):
            lanes.goal_of[i, w] = goals[i, w]
    position, orientation, p, too_large = look_at_errors(geometry, lanes)
    look_around_lanes(geometry, lanes, p)
    lanes.goals[0], lanes.goals[1] = position, orientation
    n = len(q)
    first = n + 12 + 8 + n  # the errors, then the columns
    rows = shaped(memory, first * LANES, (6 + 6 * n, LANES))
    for w in range(LANES):
        for r in range(6):
            errors[r, w] = rows[r, w]
            for i in range(n):
                columns[i, r, w] = rows[6 + 6 * i + r, w]
        squares[0, w], squares[1, w] = lanes.goal_of[0, w], lanes.goal_of[1, w]
    return bits_of(too_large)


@njit
def look(model, q, goals, errors, columns, squares):
    """Write errors (6, LANES), Jacobians (n, 6, LANES) and squares (2, LANES) of configurations (n, LANES)."""
    weights, memory = np.ones(6), on_stack(lanes_size(model))
    return _look(model, weights, memory, q, goals, errors, columns, squares)


def look_at(arm, q, targets):
    """Errors (LANES, 6), Jacobians (LANES, 6, n), squares (LANES, 2) and which angles are too large."""
    goals = np.hstack([targets[:, :3, :3].reshape(LANES, 9), targets[:, :3, 3]])
    errors, columns, squares = np.empty((6, LANES)), np.empty((arm.n, 6, LANES)), np.empty((2, LANES))
    bits = look(arm.packed, np.ascontiguousarray(q.T), np.ascontiguousarray(goals.T), errors, columns, squares)
    return errors.T, columns.transpose(2, 1, 0), squares.T, bits


def random_targets(rng):
    targets = np.tile(np.eye(4), (LANES, 1, 1))
    targets[:, :3, :3] = [random_rotation(rng) for _ in range(LANES)]
    targets[:, :3, 3] = rng.normal(size=(LANES, 3))
    return targets


def assert_right(arm, rng):
    q, targets = random_configurations(arm, rng, LANES), random_targets(rng)
    errors, jacobians, squares, bits = look_at(arm, q, targets)
    assert bits == 0
    for k in range(LANES):
        pose = pinocchio_tip(arm, q[k])
        np.testing.assert_allclose(errors[k, :3], targets[k, :3, 3] - pose[:3, 3], rtol=0, atol=EXACT)
        np.testing.assert_allclose(pin.exp3(errors[k, 3:]) @ pose[:3, :3], targets[k, :3, :3], rtol=0, atol=EXACT)
        assert np.linalg.norm(errors[k, 3:]) < np.pi + EXACT
        np.testing.assert_allclose(jacobians[k], numeric_jacobian(arm, q[k]), rtol=0, atol=1e-8)
        np.testing.assert_allclose(jacobians[k], arm.jacobian(q[k]), rtol=0, atol=EXACT)
    np.testing.assert_allclose(squares[:, 0], (errors[:, :3] ** 2).sum(1), rtol=1e-14)
    np.testing.assert_allclose(squares[:, 1], (errors[:, 3:] ** 2).sum(1), rtol=1e-14)


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('seed', range(5))
def test_errors_and_jacobians_of_known_arms_are_pinocchios(name, seed):
    assert_right(get_arm(name), np.random.default_rng(seed))


@few
@given(SEEDS, st.integers(1, 9), st.integers(0, 3))
def test_errors_and_jacobians_of_random_chains_are_pinocchios(seed, joints, mimics):
    rng = np.random.default_rng(seed)
    assert_right(load_arm(random_urdf(rng, joints=joints, mimics=mimics), 'base', 'tip'), rng)


def test_a_lane_says_if_its_angles_are_too_large():
    arm, rng = get_arm('panda'), np.random.default_rng(1)
    q = random_configurations(arm, rng, LANES)
    q[2, 3] = -1.01 * LARGE
    assert look_at(arm, q, random_targets(rng))[3] == 1 << 2


@njit(error_model='numpy')
def _apply(rotations, angles, logs, sines):
    memory = on_stack(14 * LANES)
    plain, lanes = shaped(memory, 0, (14, LANES)), wide_view(memory, 0, (14,))
    for w in range(LANES):
        for i in range(9):
            plain[i, w] = rotations[i, w]
        plain[12, w] = angles[w]
    R = (lanes[0], lanes[1], lanes[2], lanes[3], lanes[4], lanes[5], lanes[6], lanes[7], lanes[8])
    lanes[9], lanes[10], lanes[11] = rotation_log_of_lanes(R)
    lanes[12], lanes[13] = sincos_of_lanes(lanes[12])
    for w in range(LANES):
        for i in range(3):
            logs[i, w] = plain[9 + i, w]
        sines[0, w], sines[1, w] = plain[12, w], plain[13, w]


def apply(rotations, angles):
    """Logarithms (LANES, 3) of rotations, and sine and cosine (LANES, 2) of angles."""
    logs, sines = np.empty((3, LANES)), np.empty((2, LANES))
    _apply(np.ascontiguousarray(np.reshape(rotations, (LANES, 9)).T), np.array(angles, float), logs, sines)
    return logs.T, sines.T


@pytest.mark.parametrize('angle', ANGLES)
def test_the_logarithm_is_axis_times_angle(angle):
    rng = np.random.default_rng(3)
    axes = np.vstack([np.eye(3), -np.eye(3), rng.normal(size=(LANES - 6, 3))])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    logs, _ = apply([pin.AngleAxis(angle, axis).toRotationMatrix() for axis in axes], np.zeros(LANES))
    for axis, vector in zip(axes, logs):
        expected = angle * axis if vector @ axis > 0.0 or angle < 3.1 else -angle * axis  # half a turn has two
        np.testing.assert_allclose(vector, expected, rtol=0, atol=2e-14 if angle < 3.0 else 1e-12)


def test_tiny_angles_keep_their_relative_precision():
    for angle in (1e-12, 1e-9, 1e-6, 1e-3):
        R = np.eye(3) + np.sin(angle) * pin.skew(np.array([0.6, 0.0, 0.8]))
        logs, _ = apply([R] * LANES, np.zeros(LANES))
        np.testing.assert_allclose(np.linalg.norm(logs, axis=1), angle, rtol=angle**2 + 1e-15)


@few
@given(st.lists(st.floats(-LARGE, LARGE) | st.floats(-7.0, 7.0), min_size=LANES, max_size=LANES))
def test_sine_and_cosine_are_those_of_libm(angles):
    _, sines = apply([np.eye(3)] * LANES, angles)
    expected = [(math.sin(x), math.cos(x)) for x in angles]
    np.testing.assert_allclose(sines, expected, rtol=0, atol=2.3e-16)


@pytest.mark.parametrize('quarter', [-5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 6, 63661])
def test_every_quarter_turn_has_its_signs(quarter):
    angles = quarter * math.pi / 2 + np.linspace(-0.8, 0.8, LANES)
    _, sines = apply([np.eye(3)] * LANES, angles)
    np.testing.assert_allclose(sines, np.array([np.sin(angles), np.cos(angles)]).T, rtol=0, atol=2.3e-16)
