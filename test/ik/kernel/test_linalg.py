"""The small dense kernels against LAPACK."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numerics import SEEDS, law, random_jacobian

from ros_ik_pkg.ik.kernel.linalg import factor, gram, lower_triangle, substitute, svd

EPS = np.finfo(float).eps


def decompose(J):
    """Return U with the singular vectors in its columns, W with sigma_i v_i in its rows, and sigma."""
    n = J.shape[1]
    U, W, sigma = np.full((6, 6), np.nan), np.full((6, n), np.nan), np.full(6, np.nan)
    svd(np.ascontiguousarray(J.T), U, W, sigma)
    return U.T, W, sigma


def assert_decomposition(J):
    """Assert that U diag(sigma) V^T is J, with what U, sigma and V must be, LAPACK's values among it."""
    U, W, sigma = decompose(J)
    scale = np.linalg.norm(J)
    np.testing.assert_allclose(U @ W, J, rtol=0, atol=50 * EPS * scale)
    np.testing.assert_allclose(U.T @ U, np.eye(6), rtol=0, atol=50 * EPS)
    np.testing.assert_allclose(np.linalg.norm(W, axis=1), sigma, rtol=1e-13, atol=0)
    assert np.all(np.diff(sigma) <= 0.0)
    expected = np.zeros(6)
    expected[: min(J.shape)] = np.linalg.svd(J, compute_uv=False)
    np.testing.assert_allclose(sigma, expected, rtol=1e-12, atol=50 * EPS * scale)
    present = sigma > 1e-12 * scale
    V = W[present] / sigma[present, None]
    np.testing.assert_allclose(V @ V.T, np.eye(len(V)), rtol=0, atol=1e-10)


@law
@given(SEEDS, st.integers(1, 12), st.integers(0, 6))
def test_the_svd_is_right_for_every_size_and_rank(seed, n, rank):
    assert_decomposition(random_jacobian(np.random.default_rng(seed), n, rank))


@law
@given(st.integers(1, 12).flatmap(lambda n: arrays(np.float64, (6, n), elements=st.integers(-2, 2))))
def test_the_svd_copes_with_equal_singular_values_and_zero_rows_and_columns(J):
    assert_decomposition(J)


@law
@given(SEEDS, st.integers(1, 12), st.floats(-60.0, 60.0))
def test_the_svd_scales_with_the_matrix(seed, n, exponent):
    J = random_jacobian(np.random.default_rng(seed), n, min(n, 4))
    _, _, sigma = decompose(10.0**exponent * J)
    _, _, expected = decompose(J)
    np.testing.assert_allclose(sigma / 10.0**exponent, expected, rtol=1e-12, atol=50 * EPS * expected[0])


@pytest.mark.parametrize('n', range(1, 13))
def test_the_zero_matrix_has_no_singular_values(n):
    U, W, sigma = decompose(np.zeros((6, n)))
    assert sigma.tolist() == [0.0] * 6
    assert not W.any()
    np.testing.assert_array_equal(U.T @ U, np.eye(6))


@law
@given(SEEDS, st.integers(6, 12))
def test_small_singular_values_have_full_relative_precision(seed, n):
    rng = np.random.default_rng(seed)
    left, right = (np.linalg.qr(rng.normal(size=(size, 6)))[0] for size in (6, n))
    B = left * rng.uniform(1.0, 2.0, 6) @ right.T
    rows = 10.0 ** rng.uniform(-12.0, 0.0, 6)
    _, _, sigma = decompose(rows[:, None] * B)
    # LAPACK has the largest singular value of a matrix to full precision, so the smallest through the inverse
    np.testing.assert_allclose(sigma[5], 1.0 / np.linalg.norm(np.linalg.pinv(B) / rows, 2), rtol=1e-11)
    np.testing.assert_allclose(np.prod(sigma), np.prod(rows) * np.prod(np.linalg.svd(B)[1]), rtol=1e-11)


def lower(A):
    """Return the lower triangle of a matrix as the kernels take it."""
    return tuple(A[np.tril_indices(6)].tolist())


def solve(A, b):
    """Return y of A y = b; None if the factors say that A is not positive definite."""
    definite, L, _, inverses = factor(lower(A))
    return np.array(substitute(L, inverses, b)) if definite else None


@law
@given(SEEDS, st.integers(1, 12))
def test_the_gram_matrix_is_j_jt_with_the_diagonal_added(seed, n):
    rng = np.random.default_rng(seed)
    J, diagonal = random_jacobian(rng, n, 6), rng.uniform(0.0, 1.0, 6)
    A = gram(np.ascontiguousarray(J.T), tuple(diagonal.tolist()))
    np.testing.assert_allclose(A, lower(J @ J.T + np.diag(diagonal)), rtol=1e-14, atol=1e-13)


@law
@given(SEEDS)
def test_a_lower_triangle_is_read_row_by_row(seed):
    A = np.random.default_rng(seed).normal(size=(6, 6))
    assert lower_triangle(A) == lower(A)


@law
@given(SEEDS, st.integers(6, 9))
def test_the_factors_multiply_to_the_matrix(seed, n):
    J = random_jacobian(np.random.default_rng(seed), n, 6)
    A = J @ J.T + 1e-3 * np.eye(6)
    definite, below, pivots, inverses = factor(lower(A))
    L = np.eye(6)
    L[np.tril_indices(6, -1)] = below
    assert definite
    np.testing.assert_allclose(np.multiply(pivots, inverses), 1.0, rtol=4 * EPS)
    np.testing.assert_allclose(L @ np.diag(pivots) @ L.T, A, rtol=0, atol=50 * EPS * np.linalg.norm(A))


@law
@given(SEEDS, st.floats(0.0, 6.0))
def test_the_factors_solve_as_lapack_does(seed, exponent):
    rng = np.random.default_rng(seed)
    J = random_jacobian(rng, 8, 6)
    A, b = J @ J.T + 10.0**-exponent * np.eye(6), rng.normal(size=6)
    expected = np.linalg.solve(A, b)
    limit = 100 * EPS * np.linalg.cond(A) * np.linalg.norm(expected)
    np.testing.assert_allclose(solve(A, b), expected, rtol=0, atol=limit)


@pytest.mark.parametrize('place', range(6))
@pytest.mark.parametrize('bad', [0.0, -1.0, -1e-300, np.nan])
def test_what_is_not_positive_definite_has_no_factors(place, bad):
    A = np.eye(6)
    A[place, place] = bad
    assert solve(A, np.ones(6)) is None


def test_an_indefinite_matrix_with_a_positive_diagonal_has_no_factors():
    A = np.eye(6)
    A[0, 1] = A[1, 0] = 2.0
    assert solve(A, np.ones(6)) is None


@law
@given(SEEDS, st.integers(1, 4))
def test_a_gram_matrix_that_lacks_two_ranks_or_more_has_no_factors(seed, rank):
    J = random_jacobian(np.random.default_rng(seed), 7, rank)
    assert not factor(gram(np.ascontiguousarray(J.T), (0.0,) * 6))[0]


@law
@given(SEEDS)
def test_a_gram_matrix_of_rank_five_has_a_last_pivot_that_is_rounding(seed):
    """With z^T J = 0 and z_5 = 1 the exact last pivot is z^T A z = 0; the computed one belongs to A + E.

    |E| is at most g (|L| |D| |L^T| + |J| |J^T|) with g = 8 u / (1 - 8 u) (Higham 2002, theorem 10.3). If A's leading
    block is ill-conditioned, z is long and such a pivot exceeds SINGULAR: then one matrix in 15 counts as definite.
    """
    J = random_jacobian(np.random.default_rng(seed), 7, 5)
    _, below, pivots, _ = factor(gram(np.ascontiguousarray(J.T), (0.0,) * 6))
    L = np.eye(6)
    L[np.tril_indices(6, -1)] = below
    z = np.linalg.svd(J)[0][:, 5]
    z = np.abs(z / z[5])
    bound = 4.0 * EPS * z @ (np.abs(L) @ np.diag(np.abs(pivots)) @ np.abs(L.T) + np.abs(J) @ np.abs(J.T)) @ z
    assert abs(pivots[5]) <= bound
