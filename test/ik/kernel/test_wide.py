"""Numbers of several lanes against NumPy: what is done to one lane is done to each, and to no other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numba import njit
from numerics import law

from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN, on_stack, shaped

if WHY_PLAIN:
    pytest.skip('plain Numba has no numbers of several lanes', allow_module_level=True)

from ros_ik_pkg.ik.kernel.wide import LANES, bits_of, larger, smaller, where, wide, wide_view

NUMBERS = arrays(np.float64, (2, LANES), elements=st.floats(-1e6, 1e6) | st.just(math.nan))


def of_lanes(function):
    """Return what a function of two Wide numbers gives, for arrays (2, LANES)."""
    function = njit(function)

    @njit(error_model='numpy')
    def run(numbers, out):
        memory = on_stack(3 * LANES)
        plain, lanes = shaped(memory, 0, (3, LANES)), wide_view(memory, 0, (3,))
        for k in range(2):
            for w in range(LANES):
                plain[k, w] = numbers[k, w]
        lanes[2] = function(lanes[0], lanes[1])
        for w in range(LANES):
            out[w] = plain[2, w]

    def call(numbers):
        out = np.empty(LANES)
        run(numbers, out)
        return out

    return call


def sum_to_three(a, b):
    """Begin with a plain number, as loops of the kernels do."""
    total = 0.0
    for _ in range(3):
        total += a * b
    return total


ARITHMETIC = {
    'sum': (of_lanes(lambda a, b: a + b), lambda a, b: a + b),
    'difference': (of_lanes(lambda a, b: a - b), lambda a, b: a - b),
    'product': (of_lanes(lambda a, b: a * b), lambda a, b: a * b),
    'quotient': (of_lanes(lambda a, b: a / b), lambda a, b: a / b),
    'opposite': (of_lanes(lambda a, b: -a), lambda a, b: -a),
    'size': (of_lanes(lambda a, b: abs(a)), lambda a, b: np.abs(a)),
    'root': (of_lanes(lambda a, b: math.sqrt(a)), lambda a, b: np.sqrt(a)),
    'floor': (of_lanes(lambda a, b: math.floor(a)), lambda a, b: np.floor(a)),
    'with numbers': (of_lanes(lambda a, b: 2.0 - a + 3), lambda a, b: 2.0 - a + 3),
    'a number': (of_lanes(lambda a, b: wide(7)), lambda a, b: np.full(LANES, 7.0)),
    'a loop': (of_lanes(sum_to_three), lambda a, b: a * b + a * b + a * b),
    'smaller': (of_lanes(lambda a, b: smaller(a, b)), lambda a, b: np.where(b < a, b, a)),
    'larger': (of_lanes(lambda a, b: larger(a, b)), lambda a, b: np.where(b > a, b, a)),
}
CHOICES = {
    'less': (of_lanes(lambda a, b: where(a < b, 1.0, 0.0)), lambda a, b: a < b),
    'at most': (of_lanes(lambda a, b: where(a <= b, 1.0, 0.0)), lambda a, b: a <= b),
    'more': (of_lanes(lambda a, b: where(a > b, 1.0, 0.0)), lambda a, b: a > b),
    'at least': (of_lanes(lambda a, b: where(a >= 0.0, 1.0, 0.0)), lambda a, b: a >= 0.0),
    'both': (of_lanes(lambda a, b: where((a > 0.0) & (b > 0.0), 1.0, 0.0)), lambda a, b: (a > 0) & (b > 0)),
    'either': (of_lanes(lambda a, b: where((a > 0.0) | (b > 0.0), 1.0, 0.0)), lambda a, b: (a > 0) | (b > 0)),
    'not': (of_lanes(lambda a, b: where(~(a < b), 1.0, 0.0)), lambda a, b: ~(a < b)),
    'which lanes': (
        of_lanes(lambda a, b: wide(float(bits_of(a < b)))),
        lambda a, b: np.full(LANES, float(sum(1 << k for k in np.flatnonzero(a < b).tolist()))),
    ),
}


@pytest.mark.parametrize('name', [*ARITHMETIC, *CHOICES])
@law
@given(NUMBERS)
@pytest.mark.filterwarnings('ignore:.*(divide|invalid|overflow).*:RuntimeWarning')
def test_each_lane_is_what_numpy_says(name, numbers):
    ours, numpys = {**ARITHMETIC, **CHOICES}[name]
    np.testing.assert_allclose(ours(numbers), numpys(*numbers), rtol=1e-15, atol=0)
