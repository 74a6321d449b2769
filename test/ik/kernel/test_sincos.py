"""Sine and cosine against libm."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numerics import law

from ros_ik_pkg.ik.kernel.data_layout import blocks
from ros_ik_pkg.ik.kernel.sincos import LARGE, sincos_all

CLOSE = 2.3e-16  # two units in the last place of 1


def sincos(*angles):
    """Sines and cosines of angles, as forward kinematics asks for them: a block filled up with zeros."""
    values = np.zeros(blocks(len(angles)))
    values[: len(angles)] = angles
    sines, cosines = np.empty_like(values), np.empty_like(values)
    sincos_all(values, sines, cosines)
    return sines[: len(angles)], cosines[: len(angles)]


@law
@given(st.lists(st.floats(-LARGE, LARGE, exclude_min=True, exclude_max=True) | st.floats(-7.0, 7.0), max_size=12))
def test_it_is_within_two_units_in_the_last_place_of_libm(angles):
    sines, cosines = sincos(*angles)
    np.testing.assert_allclose(sines, [math.sin(x) for x in angles], rtol=0, atol=CLOSE)
    np.testing.assert_allclose(cosines, [math.cos(x) for x in angles], rtol=0, atol=CLOSE)


@pytest.mark.parametrize('quarter', [1, 2, 3, 4, 5, -1, -2, 7, 1000, 63661])
@pytest.mark.parametrize('nudge', [0.0, 1e-15, -1e-12, 1e-8, math.pi / 4])
def test_it_is_right_about_multiples_of_a_quarter_turn(quarter, nudge):
    x = quarter * math.pi / 2 + nudge
    (sine,), (cosine,) = sincos(x)
    assert abs(sine - math.sin(x)) <= CLOSE
    assert abs(cosine - math.cos(x)) <= CLOSE


@law
@given(st.floats(0.0, LARGE))
def test_sine_is_odd_and_cosine_even(x):
    (sine, negative), (cosine, same) = sincos(x, -x)
    assert (negative, same) == (-sine, cosine)


@law
@given(st.lists(st.floats(-7.0, 7.0), min_size=1, max_size=12))
def test_an_angle_has_the_same_bits_alone_and_among_others(angles):
    assert [[float(part[0]) for part in sincos(x)] for x in angles] == np.transpose(sincos(*angles)).tolist()


def test_it_is_exact_at_zero():
    assert sincos(0.0) == ([0.0], [1.0])


@pytest.mark.parametrize('x', [LARGE, -1e6, 1e22])
def test_libm_answers_for_large_angles_and_all_beside_them(x):
    angles = [0.5, x, -2.0]
    np.testing.assert_array_equal(sincos(*angles), [[f(v) for v in angles] for f in (math.sin, math.cos)])


@pytest.mark.parametrize('x', [math.inf, -math.inf, math.nan])
def test_no_angle_has_no_sine(x):
    sines, cosines = sincos(0.5, x)
    assert np.isnan(sines[1]) and np.isnan(cosines[1])
    np.testing.assert_allclose((sines[0], cosines[0]), (math.sin(0.5), math.cos(0.5)), rtol=0, atol=CLOSE)
