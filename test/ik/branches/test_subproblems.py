"""The small problems of closed forms: every solution, for numbers whose solutions are known or found by NumPy."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from numerics import SEEDS, law

from ros_ik_pkg.ik.branches.circles import meet_circles
from ros_ik_pkg.ik.branches.subproblems import angle_onto, component, four_angles, turn, two_angles

TURN = 2.0 * np.pi


def apart(a, b):
    gap = np.asarray(a) - b
    return np.abs(gap - TURN * np.round(gap / TURN))


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


@given(SEEDS)
@law
def test_a_vector_turns_about_an_axis_as_pinocchio_turns_it(seed):
    rng = np.random.default_rng(seed)
    axis, v, h, angle = unit(rng), rng.normal(size=3), rng.normal(size=3), rng.uniform(-3, 3)
    turned = pin.exp3(axis * angle) @ v
    np.testing.assert_allclose(turn(tuple(axis), np.cos(angle), np.sin(angle), tuple(v)), turned, atol=1e-12)
    a, b, c = component(tuple(h), tuple(axis), tuple(v))
    assert a + b * np.cos(angle) + c * np.sin(angle) == pytest.approx(h @ turned, abs=1e-12)
    found, lever = angle_onto(tuple(axis), tuple(v), tuple(turned))
    assert apart(found, angle) < 1e-9
    assert lever == pytest.approx(np.linalg.norm(np.cross(axis, v)))


@given(SEEDS)
@law
def test_two_angles_solve_a_linear_equation_in_cosine_and_sine(seed):
    rng = np.random.default_rng(seed)
    b, c = rng.normal(size=2)
    level = rng.uniform(-1.2, 1.2) * np.hypot(b, c)
    count, *angles = two_angles(b, c, level, 0.0, 0.0)
    assert count == (2 if abs(level) < np.hypot(b, c) else 0)
    for angle in angles[:count]:
        assert b * np.cos(angle) + c * np.sin(angle) == pytest.approx(level, abs=1e-12)
    assert count == 0 or apart(*angles) > 1e-9


def test_an_equation_that_just_has_no_solution_counts_as_solved_within_the_slack():
    assert two_angles(1.0, 0.0, 1.001, 1e-4, 0.0)[0] == 0
    assert two_angles(1.0, 0.0, 1.001, 1e-2, 0.0)[:2] == (1, 0.0)
    count, angle, _ = two_angles(1.0, 0.0, -1.001, 1e-2, 0.0)
    assert (count, apart(angle, np.pi) < 1e-12) == (1, True)


def test_an_equation_that_every_angle_solves_is_told_apart():
    assert two_angles(1e-7, 1e-7, 1e-7, 1e-3, 1e-5)[0] == -1
    assert two_angles(1e-7, 1e-7, 1e-2, 1e-3, 1e-5)[0] == 0


@given(SEEDS)
@law
def test_four_angles_are_all_roots_on_the_unit_circle(seed):
    a0, a1, b1, a2, b2 = np.random.default_rng(seed).normal(size=5)
    z = np.roots([a2 - 1j * b2, a1 - 1j * b1, 2 * a0, a1 + 1j * b1, a2 + 1j * b2])
    expected = np.angle(z[np.abs(np.abs(z) - 1.0) < 1e-6])
    roots = np.empty(6)
    found = roots[: four_angles(a0, a1, b1, a2, b2, 1e-6, roots)]
    assert len(found) == len(expected)
    for angle in expected:
        assert apart(found, angle).min() < 1e-6


def test_a_double_root_and_one_that_is_just_lost_are_found_within_the_slack():
    roots = np.empty(6)
    for lost in (0.0, 1e-8):  # 1 - cos t and a little more, times 2 + cos t, which has no root
        c = 1.0 + lost  # (c - cos t) (2 + cos t) = 2 c - 1 / 2 + (c - 2) cos t - cos 2t / 2
        count = four_angles(2.0 * c - 0.5, c - 2.0, 0.0, -0.5, 0.0, 1e-3, roots)
        assert count == 2 and (apart(roots[:2], 0.0) < 1e-3).all()
    assert four_angles(2.1 * 2.0 - 0.5, 0.1, 0.0, -0.5, 0.0, 1e-3, roots) == 0


@pytest.mark.parametrize('independent', [True, False])
@given(seed=SEEDS)
@law
def test_two_circles_meet_in_all_pairs_of_angles(independent, seed):
    rng = np.random.default_rng(seed)
    first_a, second_a, first_b, second_b = rng.normal(size=(4, 3))
    if not independent:
        second_b[1:] = 0.0
    a, b = rng.uniform(-3, 3, 2)

    def miss(p, q):
        left = np.array([first_a, second_a]) @ [1.0, np.cos(p), -np.sin(p)]
        return left - np.array([first_b, second_b]) @ [1.0, np.cos(q), np.sin(q)]

    levels, pairs = miss(a, b), np.empty((4, 6))
    count, single = meet_circles(
        tuple(first_a), tuple(second_a), tuple(first_b), tuple(second_b), *levels, 1e-9, 1e-9, 0.0, 0.0, pairs,
        np.empty(6),
    )  # fmt: skip
    assert single and 1 <= count <= 4
    for p, q in pairs[:count, :2]:
        np.testing.assert_allclose(miss(p, q), levels, atol=1e-6)
    assert np.maximum(apart(pairs[:count, 0], a), apart(pairs[:count, 1], b)).min() < 1e-5
