"""Soft limits, limits by joint name, and joints that are held."""

from __future__ import annotations

import numpy as np
import pytest
from chains import chain, pinocchio_pose

from ros_ik_pkg.ik import ModelError, load_arm
from ros_ik_pkg.ik.model.joint_limits import parse_held

TWO = chain(('j1', 'revolute', {'lower': -2.0, 'upper': 2.0}), ('j2', 'prismatic', {'lower': -1.0, 'upper': 3.0}))


def with_soft(lower, upper, text=TWO):
    """Give the first joint soft limits."""
    given = {'soft_lower_limit': lower, 'soft_upper_limit': upper}
    attributes = ''.join(f' {key}="{value}"' for key, value in given.items() if value is not None)
    return text.replace('</joint>', f'<safety_controller k_velocity="1"{attributes}/></joint>', 1)


def limits_yaml(**limits):
    """Write a joint_limits.yaml for the second joint."""
    return 'joint_limits:\n  j2:\n' + ''.join(f'    {key}: {value}\n' for key, value in limits.items())


def test_soft_limits_narrow_the_hard_ones_unless_hard_limits_are_asked_for():
    text = with_soft(-1.5, 2.5)
    assert (load_arm(text).lower[0], load_arm(text).upper[0]) == (-1.5, 2.0)
    assert (load_arm(text, limits='hard').lower[0], load_arm(text, limits='hard').upper[0]) == (-2.0, 2.0)
    with pytest.raises(ModelError, match="limits is 'softer'; expected one of soft, hard"):
        load_arm(text, limits='softer')


@pytest.mark.parametrize(('lower', 'upper'), [(None, None), (0, 0)])
def test_soft_limits_that_are_missing_or_both_zero_are_none(lower, upper):
    arm = load_arm(with_soft(lower, upper))
    assert (arm.lower[0], arm.upper[0], arm.warnings) == (-2.0, 2.0, ())


@pytest.mark.parametrize(('lower', 'upper'), [(1, -1), (3, 4), ('x', 1), (1, 1)])
def test_soft_limits_that_leave_no_range_are_ignored_with_a_warning(lower, upper):
    arm = load_arm(with_soft(lower, upper))
    assert (arm.lower[0], arm.upper[0]) == (-2.0, 2.0)
    assert "joint 'j1'" in arm.warnings[0] and 'ignored' in arm.warnings[0]


def test_limits_by_name_narrow_the_range_and_add_dynamics(tmp_path):
    text = limits_yaml(has_position_limits='true', min_position=0.5, max_position=1.5, has_velocity_limits='true',
                       max_velocity=0.25, has_acceleration_limits='true', max_acceleration=2.0,
                       has_jerk_limits='true', max_jerk=9)
    path = tmp_path / 'joint_limits.yaml'
    path.write_text(text)
    for source in (text, path, str(path), path.as_uri()):
        arm = load_arm(TWO, joint_limits=source)
        assert (arm.lower[1], arm.upper[1], arm.home[1], arm.warnings) == (0.5, 1.5, 1.0, ())
        assert arm.velocity_limits.tolist() == [1.5, 0.25]
        assert arm.acceleration_limits.tolist() == [np.inf, 2.0]
        assert arm.jerk_limits.tolist() == [np.inf, 9.0]


def test_limits_by_name_never_widen_those_of_the_robot():
    arm = load_arm(TWO, joint_limits=limits_yaml(has_position_limits='true', min_position=-5, max_position=1,
                                                 has_velocity_limits='true', max_velocity=100))
    assert (arm.lower[1], arm.upper[1], arm.velocity_limits[1]) == (-1.0, 1.0, 1.5)
    assert 'joint_limits [-5, 1] are wider than its limits [-1, 3]' in arm.warnings[0]


def test_limits_by_name_count_where_the_robot_has_none():
    text = TWO.replace('<limit lower="-1.0" upper="3.0"', '<limit')
    with pytest.raises(ModelError, match=r'neither lower nor upper.*give limits in joint_limits'):
        load_arm(text)
    arm = load_arm(text, joint_limits=limits_yaml(has_position_limits='true', min_position=-5, max_position=1))
    assert (arm.lower[1], arm.upper[1]) == (-5.0, 1.0)


def test_limits_that_are_switched_off_do_not_count():
    arm = load_arm(TWO, joint_limits=limits_yaml(has_position_limits='false', min_position=0, max_position=1))
    assert (arm.lower[1], arm.upper[1]) == (-1.0, 3.0)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('a: [', 'not well-formed YAML'),
        ('limits: 1', 'expected the key joint_limits'),
        ('joint_limits: {j3: {}}', "joint 'j3' does not exist; did you mean"),
        ('joint_limits: {j2: 3}', "joint 'j2' has no mapping"),
        ('joint_limits: {j2: {max_speed: 3}}', "unknown key 'max_speed'"),
        ('joint_limits: {j2: {has_velocity_limits: 3}}', 'expected true or false'),
        (limits_yaml(has_velocity_limits='true'), 'max_velocity is .None.; expected a finite number'),
        (limits_yaml(has_jerk_limits='true', max_jerk=-1), 'max_jerk is -1; expected a number above 0'),
        (limits_yaml(has_position_limits='true', min_position=1, max_position=0), 'min_position < max_position'),
        (limits_yaml(has_position_limits='true', min_position=7, max_position=8), 'have no common range'),
        ('/nowhere/joint_limits.yaml', 'No such file'),
    ],
)
def test_limits_by_name_that_make_no_sense_are_refused(text, words):
    with pytest.raises(ModelError, match=words):
        load_arm(TWO, joint_limits=text)


@pytest.mark.parametrize(('name', 'value', 'others'), [('j1', 0.7, {'j2': 0.4}), ('j2', -0.3, {'j1': 0.4})])
def test_a_held_joint_is_a_fixed_joint_at_its_position(name, value, others):
    arm = load_arm(TWO, held={name: value})
    assert arm.joint_names == tuple(others)
    expected = pinocchio_pose(TWO, 'base', 'tip', {name: value, **others})
    np.testing.assert_allclose(arm.forward(list(others.values())), expected, atol=1e-12)


def test_a_joint_that_mimics_a_held_one_is_fixed_with_it():
    text = chain(('j1', 'revolute', {}), ('j2', 'revolute', {'mimic': ('j1', -0.5, 0.1), 'axis': (1, 0, 0)}),
                 ('j3', 'revolute', {}))
    arm = load_arm(text, held={'j1': 0.6})
    assert arm.joint_names == ('j3',)
    expected = pinocchio_pose(text, 'base', 'tip', {'j1': 0.6, 'j2': -0.2, 'j3': 0.3})
    np.testing.assert_allclose(arm.forward([0.3]), expected, atol=1e-12)


@pytest.mark.parametrize('value', [0.0, 0.75])
def test_equal_limits_hold_a_joint_with_a_warning(value):
    text = TWO.replace('lower="-2.0" upper="2.0"', f'lower="{value}" upper="{value}"')
    arm = load_arm(text)
    assert arm.joint_names == ('j2',)
    assert f"joint 'j1': lower and upper limit are both {value:g}; it is held there" in arm.warnings
    np.testing.assert_allclose(
        arm.forward([0.4]), pinocchio_pose(text, 'base', 'tip', {'j1': value, 'j2': 0.4}), atol=1e-12)


@pytest.mark.parametrize(
    ('held', 'words'),
    [({'j3': 0.0}, "joint 'j3' does not exist"), ({'j1': 2.5}, '2.5 of joint .j1. is outside its limits'),
     ({'j1': np.nan}, 'outside its limits')],
)
def test_a_joint_that_cannot_be_held_is_refused(held, words):
    with pytest.raises(ModelError, match=f'held_joints: .*{words}'):
        load_arm(TWO, held=held)


def test_held_joints_are_written_as_names_with_or_without_a_position():
    assert parse_held(['a', 'b:=0.5', ' c := -1 ']) == {'a': None, 'b': 0.5, 'c': -1.0}
    for entry in ('', ':=1', 'a:=', 'a:=x'):
        with pytest.raises(ModelError, match='expected NAME or NAME:=POSITION'):
            parse_held([entry])
    arm = load_arm(TWO, held={'j2': None})
    assert arm.joint_names == ('j1',)
