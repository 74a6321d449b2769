"""The five step rules against their formulas in NumPy, and the laws that they keep for every size and rank."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numerics import (
    SEEDS,
    get_arm,
    law,
    numeric_jacobian,
    pair_step,
    random_configurations,
    random_jacobian,
    step,
    tuning,
)

from ros_ik_pkg.ik import METHODS
from ros_ik_pkg.ik.step.methods import joint_step_cap

SIZES = st.integers(1, 12)
RANKS = st.integers(0, 6)
DAMPED = ('dls', 'adaptive_dls', 'sdls')
GAMMA = 0.7  # sdls.max_step in these tests


# The formulas, with LAPACK


def transpose_rule(J, e):
    JJTe = J @ J.T @ e
    return J.T @ e * (e @ JJTe) / (JJTe @ JJTe)


def pinv_rule(J, e):
    return np.linalg.pinv(J) @ e


def damped_rule(J, e, damping):
    return J.T @ np.linalg.solve(J @ J.T + damping**2 * np.eye(len(e)), e)


def dls_rule(J, e):
    return damped_rule(J, e, 0.1)


def adaptive_dls_rule(J, e):
    return damped_rule(J, e, max(0.01, 0.3 * np.linalg.norm(e)))


def sdls_rule(J, e, blocks=(slice(0, 3), slice(3, 6))):
    """Buss & Kim 2005 with one target for each block of rows."""
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    dq = np.zeros(J.shape[1])
    rho = [np.linalg.norm(J[block], axis=0) for block in blocks]
    for u, s, v in zip(U.T, sigma, Vt):
        if s > 1e-10:
            N = sum(np.linalg.norm(u[block]) for block in blocks)
            M = sum(np.abs(v) @ lengths for lengths in rho) / s
            dq += clamp((u @ e) / s * v, min(1.0, N / M) * GAMMA)
    return clamp(dq, GAMMA)


def clamp(w, bound):
    largest = np.max(np.abs(w))
    return w if largest <= bound else w * bound / largest


RULES = {
    'transpose': transpose_rule, 'pinv': pinv_rule, 'dls': dls_rule, 'adaptive_dls': adaptive_dls_rule,
    'sdls': sdls_rule,
}  # fmt: skip
OPTIONS = {'dls_damping': 0.1, 'adaptive_dls_damping': 0.01, 'adaptive_dls_gain': 0.3, 'sdls_max_step': GAMMA}


def problem(seed, n, rank=6, rows=6):
    """Make up a Jacobian and an error of 1e-3 to 10."""
    rng = np.random.default_rng(seed)
    e = np.zeros(6)
    e[:rows] = rng.normal(size=rows)
    return random_jacobian(rng, n, rank, rows), e / np.linalg.norm(e) * 10.0 ** rng.uniform(-3.0, 1.0)


def assert_step(found, expected, J, e):
    """Assert that a step is as expected, but for what rounding does to the Gram matrix."""
    dq, damping = found
    limit = 1e-14 * (10.0 + condition_of(J) ** 2) * (1.0 + np.linalg.norm(expected))
    if damping > 0.0:
        limit += 1e-15 * np.linalg.norm(J) * np.linalg.norm(e) / damping**2
    np.testing.assert_allclose(dq, expected, rtol=0, atol=limit)


def condition_of(J):
    sigma = np.linalg.svd(J, compute_uv=False)
    return sigma[0] / sigma[-1] if sigma[-1] > 0.0 else np.inf


def test_every_method_has_a_rule_that_judges_it():
    assert set(RULES) == set(METHODS)


@pytest.mark.parametrize('method', sorted(RULES))
@law
@given(SEEDS, SIZES)
def test_each_step_is_its_formula(method, seed, n):
    J, e = problem(seed, n)
    assume(condition_of(J) < 1e4)
    assert_step(step(method, J, e, **OPTIONS), RULES[method](J, e), J, e)


@pytest.mark.parametrize('method', sorted(RULES))
@law
@given(SEEDS, st.integers(1, 17), st.integers(0, 3))
def test_each_step_of_two_tips_is_its_formula_over_all_twelve_rows(method, seed, n, shared):
    rng = np.random.default_rng(seed)
    J, e = rng.normal(size=(12, n)), rng.normal(size=12) * 10.0 ** rng.uniform(-3.0, 1.0)
    alone = np.arange(n) >= shared
    J[6:, alone & (np.arange(n) % 2 == 0)] = 0.0
    J[:6, alone & (np.arange(n) % 2 == 1)] = 0.0
    assume(condition_of(J) < 1e4)
    blocks = [slice(k, k + 3) for k in range(0, 12, 3)]
    expected = sdls_rule(J, e, blocks) if method == 'sdls' else RULES[method](J, e)
    assert_step(pair_step(method, J, e, **OPTIONS), expected, J, e)


@pytest.mark.parametrize('name', ['planar3r', 'puma560', 'stanford', 'panda'])
@pytest.mark.parametrize('method', sorted(RULES))
def test_each_step_of_a_real_arm_is_its_formula(method, name):
    arm, rng = get_arm(name), np.random.default_rng(8)
    for q in random_configurations(arm, rng, 20):
        J, e = arm.jacobian(q), rng.normal(size=6)
        if condition_of(J) < 1e4:
            assert_step(step(method, J, e, **OPTIONS), RULES[method](J, e), J, e)


# What holds for every size and rank


@pytest.mark.parametrize('method', ['transpose', *DAMPED])
@law
@given(SEEDS, SIZES, RANKS)
def test_a_bounded_step_never_leads_away_from_the_target(method, seed, n, rank):
    J, e = problem(seed, n, rank)
    dq, _ = step(method, J, e, **OPTIONS)
    assert np.all(np.isfinite(dq))
    assert e @ (J @ dq) >= -1e-12 * np.linalg.norm(e) * np.linalg.norm(J) * np.linalg.norm(dq)


@law
@given(SEEDS, SIZES, RANKS)
def test_the_transpose_step_lowers_the_linear_error_as_far_as_its_direction_can(seed, n, rank):
    J, e = problem(seed, n, rank)
    dq, _ = step('transpose', J, e)
    assert abs((e - J @ dq) @ (J @ dq)) <= 1e-11 * (e @ e)


@law
@given(SEEDS, SIZES, RANKS, st.floats(1e-3, 10.0))
def test_a_damped_step_is_bounded_by_the_error_over_twice_the_damping(seed, n, rank, damping):
    J, e = problem(seed, n, rank)
    dq, _ = step('dls', J, e, dls_damping=damping)
    assert np.linalg.norm(dq) <= np.linalg.norm(e) / (2.0 * damping) * (1.0 + 1e-9)


@law
@given(SEEDS, SIZES, RANKS)
def test_an_sdls_step_stays_below_its_bound_at_every_rank(seed, n, rank):
    J, e = problem(seed, n, rank)
    dq, _ = step('sdls', J, 100.0 * e, sdls_max_step=GAMMA)
    assert np.max(np.abs(dq)) <= GAMMA * (1.0 + 1e-15)


@law
@given(SEEDS, SIZES, st.integers(1, 6))
def test_an_sdls_step_is_the_pseudoinverse_step_where_nothing_clamps(seed, n, rank):
    J, e = problem(seed, n, rank)
    sigma = np.linalg.svd(J, compute_uv=False)[: min(n, rank)]
    assume(sigma[0] < 1e4 * sigma[-1])
    e = 1e-7 * sigma[-1] * e / np.linalg.norm(e)
    dq, _ = step('sdls', J, e)
    np.testing.assert_allclose(dq, np.linalg.pinv(J, rcond=1e-10) @ e, rtol=0, atol=1e-16)


@pytest.mark.parametrize('n', range(3, 10))
@pytest.mark.parametrize('method', sorted(RULES))
def test_an_arm_that_cannot_move_the_tip_at_all_takes_no_step(method, n):
    dq, _ = step(method, np.zeros((6, n)), np.ones(6), **OPTIONS)
    assert np.all(dq == 0.0)


@pytest.mark.parametrize('method', sorted(RULES))
def test_no_error_needs_no_step(method):
    J, _ = problem(1, 7)
    assert not step(method, J, np.zeros(6), **OPTIONS)[0].any()


@pytest.mark.parametrize('n', range(3, 10))
@pytest.mark.parametrize('method', DAMPED)
def test_purely_rotational_directions_are_solved(method, n):
    rng = np.random.default_rng(n)
    J, e = np.zeros((6, n)), np.zeros(6)
    J[3:], e[3:] = rng.normal(size=(3, n)), 1e-3 * rng.normal(size=3)
    dq, _ = step(method, J, e, dls_damping=1e-6, adaptive_dls_damping=1e-6, adaptive_dls_gain=0.0)
    np.testing.assert_allclose(dq, np.linalg.pinv(J) @ e, rtol=1e-6, atol=1e-12)


def test_an_sdls_step_along_a_vanishing_direction_stays_small():
    # sigma = 1e-9 is above the threshold of rank: the pseudoinverse would step 1e9
    J = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 1e-9])
    dq, _ = step('sdls', J, np.ones(6), sdls_max_step=GAMMA)
    assert np.max(np.abs(dq)) <= GAMMA
    assert np.all(dq[:5] > 0.1)


# Singular for pinv


def test_a_singular_pseudoinverse_gives_no_finite_step():
    J, e = problem(3, 7)
    J[4] = 0.0
    assert np.all(np.isnan(step('pinv', J, e)[1]))


def test_a_nearly_singular_pseudoinverse_explodes():
    J, e = problem(3, 7)
    J[4] *= 1e-7
    assert np.max(np.abs(step('pinv', J, e)[0])) > 1e5


# Frozen joints and dropped rows


@pytest.mark.parametrize('method', sorted(RULES))
@law
@given(SEEDS, st.integers(2, 9), st.integers(1, 5))
def test_a_frozen_joint_stays_and_the_others_step_as_if_it_were_not_there(method, seed, n, frozen):
    J, e = problem(seed, n)
    still = np.zeros(n, dtype=bool)
    still[np.random.default_rng(seed).permutation(n)[: min(frozen, n - 1)]] = True
    J[:, still] = 0.0
    free = J[:, ~still]
    assume(condition_of(free) < 1e4)
    dq, damping = step(method, J, e, **OPTIONS)
    assert not dq[still].any()
    assert_step((dq[~still], damping), RULES[method](free, e), free, e)


@pytest.mark.parametrize('method', sorted(RULES))
@law
@given(SEEDS, st.integers(1, 9), st.sets(st.integers(0, 5), min_size=1, max_size=5))
def test_a_dropped_row_is_as_if_it_were_not_there(method, seed, n, dropped):
    J, e = problem(seed, n)
    kept = sorted(set(range(6)) - dropped)
    weights = np.array([float(r in kept) for r in range(6)])
    assume(condition_of(J[kept]) < 1e4)
    found = step(method, weights[:, None] * J, weights * e, weights, **OPTIONS)
    if method == 'sdls':
        position = sum(r < 3 for r in kept)
        expected = sdls_rule(J[kept], e[kept], (slice(0, position), slice(position, None)))
    else:
        expected = RULES[method](J[kept], e[kept])
    assert_step(found, expected, J[kept], e[kept])


# Damping and caps


def test_the_damping_that_is_reported_is_the_one_that_was_used():
    J, e = problem(2, 7)
    e /= np.linalg.norm(e)
    assert step('dls', J, e, **OPTIONS)[1] == 0.1
    assert step('adaptive_dls', J, e, **OPTIONS)[1] == pytest.approx(0.3)
    assert step('adaptive_dls', J, 1e-3 * e, **OPTIONS)[1] == 0.01
    assert [step(method, J, e, **OPTIONS)[1] for method in ('transpose', 'pinv', 'sdls')] == [0.0] * 3


@pytest.mark.parametrize('method', sorted(RULES))
def test_each_joints_step_is_capped_by_the_option_or_as_the_method_says(method):
    assert joint_step_cap(tuning(method=method, max_joint_step=0.2), 1.0) == 0.2
    expected = 0.3 if method == 'adaptive_dls' else np.inf
    assert joint_step_cap(tuning(method=method), 1.0) == expected
    # In a hurry a method's own cap grows, one that was asked for does not.
    assert joint_step_cap(tuning(method=method), 2.0) == 2.0 * expected
    assert joint_step_cap(tuning(method=method, max_joint_step=0.2), 2.0) == 0.2


def test_a_pseudoinverse_step_lands_on_a_target_nearby():
    arm = get_arm('puma560')
    J, e = numeric_jacobian(arm, arm.home), 1e-4 * np.array([1.0, -2.0, 0.5, 1.0, 1.0, -1.0])
    dq, _ = step('pinv', J, e)
    moved = arm.forward(arm.home + dq)[:3, 3] - arm.forward(arm.home)[:3, 3]
    np.testing.assert_allclose(moved, e[:3], rtol=0, atol=1e-6)
