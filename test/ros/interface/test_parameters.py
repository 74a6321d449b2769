"""Parameters: one declaration, from which checks, descriptors, the YAML file and the docs follow."""

from __future__ import annotations

import math

import pytest
import yaml

from ros_ik_pkg.ik import OPTIONS, PATH_OPTIONS, OptionError, SolveOptions
from ros_ik_pkg.ros.interface.generate_reference import parameters_markdown, parameters_yaml
from ros_ik_pkg.ros.interface.health_limits import HEALTH_OPTIONS
from ros_ik_pkg.ros.interface.parameters import NODE_OPTIONS, PARAMETERS, Settings, descriptor
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS

DEFAULTS = {name: option.default for name, option in PARAMETERS.items()}
NUMERIC = [option for option in OPTIONS if type(option.default) in (int, float)]


def flat(tree: dict, prefix: str = '') -> dict:
    """Join nested YAML keys with dots, as ROS does."""
    out = {}
    for key, value in tree.items():
        out |= flat(value, f'{prefix}{key}.') if isinstance(value, dict) else {prefix + key: value}
    return out


def test_the_defaults_are_the_solvers():
    assert Settings.from_values(DEFAULTS).options == SolveOptions()


def test_every_option_of_the_solver_is_a_parameter():
    options = (*OPTIONS, *NODE_OPTIONS, *PATH_OPTIONS, *SERVO_OPTIONS, *CAUTION_OPTIONS, *HEALTH_OPTIONS)
    assert set(PARAMETERS) == {option.ros_name for option in options}


@pytest.mark.parametrize('option', PARAMETERS.values(), ids=PARAMETERS)
def test_every_parameter_is_described_with_what_is_allowed(option):
    described = descriptor(option)
    assert option.text in described.description
    assert option.unit in described.description
    assert described.additional_constraints == option.expected()


@pytest.mark.parametrize('option', NUMERIC, ids=lambda option: option.ros_name)
def test_numbers_carry_their_range(option):
    described = descriptor(option)
    (bounds,) = described.integer_range or described.floating_point_range
    assert (bounds.from_value, bounds.to_value) == (option.minimum, option.maximum)


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('method', 'nonsense'),
        ('max_iterations', -1),
        ('max_iterations', 2.5),
        ('position_tolerance', math.nan),
        ('dls.damping', 'much'),
        ('task_weights', [1.0, 1.0]),
        ('task_weights', [0.0] * 6),
        ('respect_limits', 1),
        ('robot', None),
        ('seed_source', 'guess'),
        ('home_until_joint_states', 'yes'),
        ('compare', ['pinv', 'newton']),
        ('compare', 'pinv'),
        ('compare', None),
    ],
)
def test_a_wrong_value_is_refused_by_name(name, value):
    with pytest.raises(OptionError, match=name.replace('.', r'\.')):
        Settings.from_values(DEFAULTS | {name: value})


def test_an_integer_stands_for_a_number():
    settings = Settings.from_values(DEFAULTS | {'max_joint_jump': 1})
    assert settings.options.max_joint_jump == 1.0 and isinstance(settings.options.max_joint_jump, float)


def test_compare_takes_methods_once_each_and_all():
    settings = Settings.from_values(DEFAULTS | {'compare': ['dls', 'pinv', 'dls', 'all']})
    assert settings.compare == ('dls', 'pinv', 'all')


def test_the_yaml_file_holds_every_parameter_at_its_default(root):
    text = (root / 'config' / 'ik_node.yaml').read_text()
    assert text == parameters_yaml()
    values = flat(yaml.safe_load(text)['/**/ik_node']['ros__parameters'])
    assert Settings.from_values(values) == Settings.from_values(DEFAULTS)


def test_the_parameter_reference_is_that_of_the_code(root):
    assert (root / 'docs' / 'parameters.md').read_text() == parameters_markdown()
