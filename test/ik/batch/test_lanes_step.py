"""Steps of many descents at once against the formula in NumPy, with limits and caps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numerics import SEEDS, get_arm, law, tuning

from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.kernel.data_layout import unpack_model
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN, on_stack, shaped

if WHY_PLAIN:
    pytest.skip('plain Numba has no numbers of several lanes', allow_module_level=True)

from ros_ik_pkg.ik.batch.records import lanes_size, make_lanes
from ros_ik_pkg.ik.batch.step import take_steps
from ros_ik_pkg.ik.kernel.wide import LANES

CAP = 0.6


@kernel
def _step(model, options, weights, memory, q, errors, columns, norms, moves):
    geometry, _, _ = unpack_model(model)
    lanes = make_lanes(model, memory, weights)
    n = len(q)
    rows = shaped(memory, (n + 12 + 8 + n) * LANES, (6 + 6 * n, LANES))
    for w in range(LANES):
        for i in range(n):
            lanes.q_of[i, w] = q[i, w]
            for r in range(6):
                rows[6 + 6 * i + r, w] = columns[i, r, w]
        for r in range(6):
            rows[r, w] = errors[r, w]
        lanes.figure_of[0, w], lanes.figure_of[1, w] = norms[w], moves[w]
    take_steps(geometry, options, CAP, lanes.figures[0], lanes.figures[1] > 0.0, lanes)
    for w in range(LANES):
        for i in range(n):
            q[i, w] = lanes.q_of[i, w]


@njit(error_model='numpy')
def _run(model, options, q, errors, columns, norms, moves):
    weights, memory = np.ones(6), on_stack(lanes_size(model))
    _step(model, options, weights, memory, q, errors, columns, norms, moves)


def step_lanes(arm, q, errors, jacobians, moves, **options):
    """Return where configurations (LANES, n) go with errors (LANES, 6) and Jacobians (LANES, 6, n)."""
    out = np.ascontiguousarray(q.T)
    _run(
        arm.packed, tuning(**options), out, np.ascontiguousarray(errors.T),
        np.ascontiguousarray(jacobians.transpose(2, 1, 0)), np.linalg.norm(errors, axis=1), moves,
    )  # fmt: skip
    return out.T


def expected_step(arm, q, e, J, damping=1e-3, gain=0.2, step_size=1.0):
    """The step of the notes, and with joints at a limit that it pushes outwards left out."""
    free = np.ones(arm.n, bool)

    def pushes(dq):
        return free & (((q <= arm.lower) & (dq < 0.0)) | ((q >= arm.upper) & (dq > 0.0)))

    free &= ~pushes(J.T @ e)
    size = max(damping, gain * np.linalg.norm(e))
    while True:
        K = J * free
        dq = K.T @ np.linalg.solve(K @ K.T + size**2 * np.eye(6), e)
        pushed = pushes(dq)
        if not pushed.any():
            return np.clip(q + np.clip(step_size * dq, -CAP, CAP), arm.lower, arm.upper)
        free &= ~pushed


@law
@given(SEEDS, st.sampled_from(['panda', 'ur5', 'so100']), st.booleans())
def test_each_lane_takes_the_step_of_its_own_task(seed, name, at_limits):
    arm, rng = get_arm(name), np.random.default_rng(seed)
    q = rng.uniform(np.maximum(arm.lower, -9.0), np.minimum(arm.upper, 9.0), (LANES, arm.n))
    if at_limits:
        ends = np.where(rng.random(q.shape) < 0.5, arm.lower, arm.upper)
        q = np.where((rng.random(q.shape) < 0.4) & np.isfinite(ends), ends, q)
    jacobians = np.array([arm.jacobian(configuration) for configuration in q])
    errors = rng.normal(size=(LANES, 6)) * 10.0 ** rng.uniform(-4.0, 0.0, (LANES, 1))
    moves = (rng.random(LANES) < 0.7).astype(float)
    found = step_lanes(arm, q, errors, jacobians, moves)
    for k in range(LANES):
        expected = expected_step(arm, q[k], errors[k], jacobians[k]) if moves[k] else q[k]
        np.testing.assert_allclose(found[k], expected, rtol=0, atol=1e-9)


def test_options_of_the_step_count():
    arm, rng = get_arm('panda'), np.random.default_rng(2)
    q = rng.uniform(0.9 * arm.lower, 0.9 * arm.upper, (LANES, arm.n))
    jacobians, errors = np.array([arm.jacobian(row) for row in q]), 0.1 * rng.normal(size=(LANES, 6))
    options = {'adaptive_dls_damping': 0.3, 'adaptive_dls_gain': 0.05, 'step_size': 0.5}
    found = step_lanes(arm, q, errors, jacobians, np.ones(LANES), **options)
    for k in range(LANES):
        expected = expected_step(arm, q[k], errors[k], jacobians[k], 0.3, 0.05, 0.5)
        np.testing.assert_allclose(found[k], expected, rtol=0, atol=1e-12)


def test_a_lane_without_a_finite_step_becomes_nan_and_the_others_go_on():
    arm, rng = get_arm('panda'), np.random.default_rng(2)
    q = rng.uniform(0.9 * arm.lower, 0.9 * arm.upper, (LANES, arm.n))
    jacobians, errors = np.array([arm.jacobian(row) for row in q]), 0.1 * rng.normal(size=(LANES, 6))
    broken = jacobians.copy()
    broken[3, 2, 4] = np.nan
    found = step_lanes(arm, q, errors, broken, np.ones(LANES))
    assert np.isnan(found[3]).all()
    rest = np.arange(LANES) != 3
    np.testing.assert_array_equal(found[rest], step_lanes(arm, q, errors, jacobians, np.ones(LANES))[rest])
