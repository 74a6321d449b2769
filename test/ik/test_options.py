"""Every option: its default, its range, what is refused and how that is said."""

from __future__ import annotations

import dataclasses
import math
from array import array

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numerics import law

from ros_ik_pkg.ik import CHOICES, METHODS, OPTIONS, IkError, OptionError, SolveOptions
from ros_ik_pkg.ik.kernel.data_layout import Tuning
from ros_ik_pkg.ik.options import FURTHER, NULL_SPACES, TASK_FRAMES

NUMBERS = [spec for spec in OPTIONS if isinstance(spec.default, (int, float)) and not isinstance(spec.default, bool)]
TUPLES = [spec for spec in OPTIONS if isinstance(spec.default, tuple)]
TEXTS = [spec for spec in OPTIONS if isinstance(spec.default, str)]


WORDS = {
    'method': METHODS, 'choice': CHOICES, 'task_frame': TASK_FRAMES, 'null_space': NULL_SPACES,
    'collision_geometry': ('convex', 'mesh'), 'secondary': ('auto', 'none', 'orientation', 'position'),
}  # fmt: skip


def name_of(spec):
    return spec.name


def filled(spec, value):
    """A tuple option of the right length with one value all over."""
    return (value,) * (len(spec.default) or 3)


def assert_refused(spec, value):
    """Assert that an option refuses a value, naming itself, the value and what is allowed."""
    with pytest.raises(OptionError) as caught:
        SolveOptions(**{spec.name: value})
    text = str(caught.value)
    assert text.startswith(f'{spec.ros_name} = {value!r} is not allowed: expected ')
    assert spec.expected() in text


def test_the_options_are_the_fields_of_solve_options():
    fields = [field.name for field in dataclasses.fields(SolveOptions) if field.init]
    assert [spec.name for spec in OPTIONS] == fields
    assert {spec.name: spec.default for spec in OPTIONS} == {name: getattr(SolveOptions(), name) for name in fields}


@pytest.mark.parametrize('spec', OPTIONS, ids=name_of)
def test_each_option_says_what_it_is(spec):
    assert len(spec.text) > 15
    assert spec.ros_name.replace('.', '_') == spec.name
    assert spec.expected()


@pytest.mark.parametrize('spec', NUMBERS, ids=name_of)
def test_a_number_may_be_anything_in_its_range_and_nothing_outside(spec):
    whole = isinstance(spec.default, int)
    for value in (spec.minimum, spec.maximum, spec.default):
        taken = getattr(SolveOptions(**{spec.name: value}), spec.name)
        assert taken == value
        assert type(taken) is (int if whole else float)
    step = 1 if whole else 1e-9
    for value in (spec.minimum - step, spec.maximum + max(step, 1e-9 * spec.maximum)):
        assert_refused(spec, value)


NO_NUMBERS = (math.nan, math.inf, -math.inf, 'nan', '1 m', None, True, [1.0], np.ones(1), 1j)


@pytest.mark.parametrize('value', NO_NUMBERS, ids=repr)
@pytest.mark.parametrize('spec', NUMBERS, ids=name_of)
def test_a_number_must_be_a_finite_number(spec, value):
    assert_refused(spec, value)


@pytest.mark.parametrize('name', ['max_iterations', 'max_attempts'])
def test_a_count_must_be_whole(name):
    assert getattr(SolveOptions(**{name: 7.0}), name) == 7
    with pytest.raises(OptionError, match=rf'{name} = 7\.5 is not allowed: expected a whole number from'):
        SolveOptions(**{name: 7.5})


@law
@given(st.floats(1e-12, 1.0))
def test_numbers_of_numpy_are_taken_as_python_numbers(value):
    options = SolveOptions(position_tolerance=np.float64(value), max_iterations=np.int32(3))
    assert (options.position_tolerance, options.max_iterations) == (value, 3)
    assert (type(options.position_tolerance), type(options.max_iterations)) == (float, int)


@pytest.mark.parametrize('spec', TEXTS, ids=name_of)
def test_a_choice_is_one_of_the_words(spec):
    for word in spec.allowed:
        assert getattr(SolveOptions(**{spec.name: word}), spec.name) == word
    for value in ('nonsense', '', spec.allowed[0].upper(), 0, None):
        assert_refused(spec, value)


def test_the_words_are_those_of_the_package():
    allowed = {spec.name: spec.allowed for spec in TEXTS}
    assert allowed == WORDS
    assert METHODS == ('transpose', 'pinv', 'dls', 'adaptive_dls', 'sdls')


@pytest.mark.parametrize('value', [True, False, np.True_])
def test_a_flag_is_true_or_false(value):
    assert SolveOptions(respect_limits=value).respect_limits is bool(value)


@pytest.mark.parametrize('value', [0, 1, 'true', None])
def test_a_flag_is_nothing_else(value):
    assert_refused(next(spec for spec in OPTIONS if spec.name == 'respect_limits'), value)


@pytest.mark.parametrize('spec', TUPLES, ids=name_of)
def test_weights_are_numbers_of_their_range(spec):
    taken = getattr(SolveOptions(**{spec.name: list(filled(spec, 2))}), spec.name)
    assert taken == filled(spec, 2.0)
    assert all(type(weight) is float for weight in taken)
    for value in (spec.minimum - 1.0, spec.maximum + 1.0, math.nan, math.inf):
        assert_refused(spec, filled(spec, value))
    for value in (1.0, None, filled(spec, 'x')):
        assert_refused(spec, value)


@pytest.mark.parametrize('count', [0, 5, 7])
def test_the_task_has_six_weights(count):
    with pytest.raises(OptionError, match='expected 6 numbers'):
        SolveOptions(task_weights=(1.0,) * count)


def test_a_task_without_rows_is_refused():
    with pytest.raises(OptionError, match='task_weights drops all six rows'):
        SolveOptions(task_weights=(0.0,) * 6)


def test_options_cannot_be_changed_only_replaced():
    options = SolveOptions(method='dls')
    with pytest.raises(dataclasses.FrozenInstanceError):
        options.method = 'sdls'
    replaced = dataclasses.replace(options, max_iterations=7)
    assert (replaced.method, replaced.max_iterations) == ('dls', 7)
    with pytest.raises(OptionError):
        dataclasses.replace(options, max_iterations=-1)


def test_options_with_the_same_values_are_equal():
    assert SolveOptions(deadline=1) == SolveOptions(deadline=1.0)
    assert SolveOptions(deadline=1) != SolveOptions()
    assert hash(SolveOptions()) == hash(SolveOptions())


def test_an_unknown_option_is_refused_by_name():
    with pytest.raises(OptionError, match="option 'max_iteration' is not known; did you mean max_iterations"):
        SolveOptions(max_iteration=3)


@pytest.mark.parametrize(
    ('name', 'value', 'number'),
    [
        ('position_tolerance', '1e-05', 1e-5),
        ('deadline', '2', 2.0),
        ('max_iterations', '200', 200),
        ('max_iterations', '1e3', 1000),
        ('task_weights', '[1.0, 1, 1e-05, 1, 1, 0]', (1.0, 1.0, 1e-5, 1.0, 1.0, 0.0)),
        ('task_weights', ['1.0', 1, '1e-05', 1, 1, 0], (1.0, 1.0, 1e-5, 1.0, 1.0, 0.0)),
        ('posture', '[]', ()),
    ],
)
def test_text_that_is_a_number_stands_for_the_number_in_lists_too(name, value, number):
    taken = getattr(SolveOptions(**{name: value}), name)
    assert taken == number and type(taken) is type(number)


def test_a_refused_array_is_shown_as_a_list():
    with pytest.raises(OptionError, match=r'^task_weights = \[1, 1, 1\] is not allowed: '):
        SolveOptions(task_weights=array('q', [1, 1, 1]))


@pytest.mark.parametrize(
    'text', ['soon', '1_0', '[1, 2', '1, 1, 1, 1, 1, 1', '[1, one, 1, 1, 1, 1]', '[[1], 1, 1, 1, 1, 1]']
)
def test_other_text_is_no_number_and_no_list(text):
    for spec in (option for option in OPTIONS if option.name in ('deadline', 'task_weights')):
        assert_refused(spec, text)


def test_an_option_error_is_an_error_of_the_package_and_of_a_value():
    assert issubclass(OptionError, IkError) and issubclass(IkError, ValueError)


def test_the_compiled_code_gets_every_number_in_its_place():
    values = {spec.name: spec.default for spec in OPTIONS}
    values |= {'max_iterations': 11, 'deadline': 0.125, 'sdls_max_step': 0.5, 'max_joint_jump': 0.25}
    values |= {'method': 'sdls', 'choice': 'all', 'task_frame': 'tip', 'null_space': 'limits'}
    values |= {'task_weights': (1, 2, 3, 4, 5, 6), 'task_tolerances': (7, 8, 9, 10, 11, 12)}
    values |= {'joint_weights': (13, 14), 'posture': (15, 16)}
    numbers = SolveOptions(**values).numbers
    assert numbers.dtype == np.float64
    expected = values | {name: words.index(values[name]) for name, words in WORDS.items()}
    expected |= {'step_cap': np.inf, 'may_hurry': True, 'finish_by_lm': True}  # of sdls
    assert SolveOptions(method='adaptive_dls').numbers[Tuning._fields.index('step_cap')] == 0.3
    places = [Tuning._fields.index(name) for name in ('may_hurry', 'finish_by_lm')]
    assert not SolveOptions(method='transpose').numbers[places].any()
    count = len(Tuning._fields)
    expected['collision_margin'] += FURTHER
    assert numbers[:count].tolist() == [float(expected[name]) for name in Tuning._fields]
    assert numbers[count:].tolist() == [*range(1, 13), 2, *range(13, 17)]


def test_lists_for_each_joint_are_as_long_as_the_arm_has_joints():
    SolveOptions(joint_weights=(1.0,) * 6, posture=(0.0,) * 6).check_lengths(6)
    for name in ('joint_weights', 'posture'):
        with pytest.raises(OptionError, match=f'{name} has 6 numbers; expected 7'):
            SolveOptions(**{name: (1.0,) * 6}).check_lengths(7)
