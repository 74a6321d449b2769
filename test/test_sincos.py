"""Sine and cosine against libm."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numerics import law

from ros_ik_pkg.ik.sincos import LARGE, sincos

CLOSE = 2.3e-16  # two units in the last place of 1


@law
@given(st.floats(-LARGE, LARGE) | st.floats(-7.0, 7.0))
def test_it_is_within_two_units_in_the_last_place_of_libm(x):
    sine, cosine = sincos(x)
    assert abs(sine - math.sin(x)) <= CLOSE
    assert abs(cosine - math.cos(x)) <= CLOSE


@pytest.mark.parametrize('quarter', [1, 2, 3, 4, 5, -1, -2, 7, 1000, 63661])
@pytest.mark.parametrize('nudge', [0.0, 1e-15, -1e-12, 1e-8, math.pi / 4])
def test_it_is_right_about_multiples_of_a_quarter_turn(quarter, nudge):
    x = quarter * math.pi / 2 + nudge
    sine, cosine = sincos(x)
    assert abs(sine - math.sin(x)) <= CLOSE
    assert abs(cosine - math.cos(x)) <= CLOSE


@law
@given(st.floats(0.0, LARGE))
def test_sine_is_odd_and_cosine_even(x):
    sine, cosine = sincos(x)
    assert sincos(-x) == (-sine, cosine)


def test_it_is_exact_at_zero():
    assert sincos(0.0) == (0.0, 1.0)


@pytest.mark.parametrize('x', [LARGE, -1e6, 1e22])
def test_libm_answers_for_large_angles(x):
    np.testing.assert_allclose(sincos(x), (math.sin(x), math.cos(x)), rtol=0, atol=CLOSE)


@pytest.mark.parametrize('x', [math.inf, -math.inf, math.nan])
def test_no_angle_has_no_sine(x):
    assert all(math.isnan(value) for value in sincos(x))
