"""Views of memory do what NumPy does, as does the plain form of each."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from ros_ik_pkg.ik.kernel import array_views, plain

FORMS = pytest.mark.parametrize('form', ['fast', 'plain'])


def form_of(name, form):
    """Return one of the functions as the solver uses it, or in plain Numba."""
    return getattr({'fast': array_views, 'plain': plain}[form], name)


@FORMS
@pytest.mark.parametrize(
    ('start', 'shape'), [(0, (24,)), (3, (5,)), (4, (2, 3)), (0, (2, 3, 4)), (24, (0,)), (7, (0, 3))]
)
def test_a_view_shows_the_numbers_from_its_start_on_in_its_shape(form, start, shape):
    shaped = form_of('shaped', form)
    copy = njit(lambda array: shaped(array, start, shape).copy())
    whole = np.arange(24.0)
    expected = whole[start : start + int(np.prod(shape))].reshape(shape)
    np.testing.assert_array_equal(copy(whole), expected)


@FORMS
def test_what_is_written_to_a_view_is_in_its_memory_and_nowhere_else(form):
    shaped = form_of('shaped', form)

    @njit
    def write(array):
        view = shaped(array, 2, (2, 3))
        view[1, 2], view[0, 0] = 7.0, 5.0
        row = view[1]
        row[0] = 6.0

    whole = np.zeros(9)
    write(whole)
    np.testing.assert_array_equal(whole, [0.0, 0.0, 5.0, 0.0, 0.0, 6.0, 0.0, 7.0, 0.0])


@FORMS
@pytest.mark.parametrize('kind', [np.float32, np.int64])
def test_a_view_of_other_numbers_steps_by_their_size(form, kind):
    shaped = form_of('shaped', form)
    copy = njit(lambda array: shaped(array, 3, (2, 2)).copy())
    np.testing.assert_array_equal(copy(np.arange(12, dtype=kind)), np.array([[3, 4], [5, 6]], dtype=kind))


@FORMS
def test_blocks_of_memory_do_not_overlap_and_have_their_length(form):
    on_stack = form_of('on_stack', form)

    @njit
    def fill(count):
        one, other = on_stack(count), on_stack(count + 1)
        one[:] = 1.0
        other[:] = 2.0
        return len(one), len(other), one.sum(), other.sum()

    for count in (0, 1, 7, 1000):
        assert fill(count) == (count, count + 1, count, 2.0 * (count + 1))
