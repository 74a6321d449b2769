"""Variables of a chain: limits, home, turns, and the joints that mimic others."""

from __future__ import annotations

import numpy as np
import pytest
from chains import chain, joint_xml, urdf

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.loading import load_arm

EXACT = 1e-12


@pytest.mark.parametrize(
    ('lower', 'upper', 'wraps'), [(-3.0, 3.0, 0), (-6.2, 6.2, 1), (0.0, 6.3, 1), (0.0, 6.28, 0)]
)
def test_a_revolute_joint_wraps_where_a_turn_fits_between_its_limits(lower, upper, wraps):
    assert load_arm(chain(('j', 'revolute', {'lower': lower, 'upper': upper}))).wraps.tolist() == [wraps]


def test_a_continuous_joint_is_unbounded_and_wraps():
    arm = load_arm(chain(('j', 'continuous', {})))
    assert (arm.lower[0], arm.upper[0], arm.wraps[0]) == (-np.inf, np.inf, 1)
    assert arm.velocity_limits[0] == np.inf


def test_a_prismatic_joint_never_wraps():
    assert load_arm(chain(('j', 'prismatic', {'lower': -9.0, 'upper': 9.0}))).wraps.tolist() == [0]


def test_revolute_limits_beyond_any_use_mean_unbounded():
    arm = load_arm(chain(('j', 'revolute', {'lower': -1e16, 'upper': 1e16})))
    assert (arm.lower[0], arm.upper[0]) == (-np.inf, np.inf)


@pytest.mark.parametrize(
    ('lower', 'upper', 'home'), [(-1.0, 2.0, 0.0), (0.0, 2.0, 1.0), (-3.0, -1.0, -2.0), (-2.0, 0.0, -1.0)]
)
def test_home_is_zero_or_the_middle_where_zero_is_not_inside_the_limits(lower, upper, home):
    assert load_arm(chain(('j', 'revolute', {'lower': lower, 'upper': upper}))).home.tolist() == [home]


@pytest.mark.parametrize(('lower', 'upper', 'home'), [(0.0, 1e6, np.pi), (-1e6, 0.0, -np.pi), (5.0, 1e6, 5.0 + np.pi)])
def test_home_is_near_zero_in_a_range_that_is_wider_than_any_use(lower, upper, home):
    assert load_arm(chain(('j', 'revolute', {'lower': lower, 'upper': upper}))).home == pytest.approx([home])


def test_velocity_limits_come_from_the_file_and_zero_means_unknown():
    arm = load_arm(chain(('j1', 'revolute', {'velocity': 2.5}), ('j2', 'revolute', {'velocity': 0.0})))
    assert arm.velocity_limits.tolist() == [2.5, np.inf]


def test_a_mimic_joint_shares_the_variable_of_its_master():
    arm = load_arm(
        chain(
            ('j1', 'revolute', {'lower': -1.0, 'upper': 1.0}),
            ('j2', 'revolute', {'lower': -1.0, 'upper': 1.0, 'mimic': ('j1', -2.0, 0.5), 'velocity': 1.0}),
        )
    )
    assert arm.joint_names == ('j1',)
    assert arm.variable.tolist() == [0, 0]
    assert (arm.multiplier.tolist(), arm.offset.tolist()) == ([1.0, -2.0], [0.0, 0.5])
    assert (arm.lower[0], arm.upper[0]) == (-0.25, 0.75)
    assert arm.velocity_limits[0] == 0.5


def test_a_mimic_of_a_mimic_leads_back_to_one_master():
    arm = load_arm(
        chain(
            ('j1', 'revolute', {}),
            ('j2', 'revolute', {'mimic': ('j1', 2.0, 0.1)}),
            ('j3', 'revolute', {'mimic': ('j2', -0.5, 0.2)}),
        )
    )
    assert arm.joint_names == ('j1',)
    np.testing.assert_allclose(arm.multiplier, [1.0, 2.0, -1.0])
    np.testing.assert_allclose(arm.offset, [0.0, 0.1, 0.15])


def test_a_master_outside_the_chain_becomes_a_variable():
    text = urdf(
        ('base', 'side', 'tip'),
        [
            joint_xml('master', 'revolute', 'base', 'side', lower=-0.5, upper=0.4),
            joint_xml('j', 'revolute', 'base', 'tip', mimic=('master', 2.0, 0.0)),
        ],
    )
    arm = load_arm(text, tip='tip')
    assert arm.joint_names == ('master',)
    assert (arm.lower[0], arm.upper[0], arm.multiplier[0]) == (-0.5, 0.4, 2.0)
    np.testing.assert_allclose(arm.base_from_frame('tip', {'master': 0.3}), arm.forward([0.3]), atol=EXACT)


@pytest.mark.parametrize(('multiplier', 'wraps'), [(1.0, 1), (-1.0, 1), (3.0, 1), (0.5, 0)])
def test_a_turn_of_a_master_must_be_whole_turns_of_its_mimics(multiplier, wraps):
    arm = load_arm(chain(('j1', 'continuous', {}), ('j2', 'continuous', {'mimic': ('j1', multiplier, 0.1)})))
    assert arm.wraps.tolist() == [wraps]


def test_a_prismatic_mimic_keeps_its_master_from_wrapping():
    arm = load_arm(chain(('j1', 'continuous', {}), ('j2', 'prismatic', {'mimic': ('j1', 0.1, 0.0)})))
    assert arm.wraps.tolist() == [0]
    assert (arm.lower[0], arm.upper[0]) == (-20.0, 20.0)


@pytest.mark.parametrize('offset', [1.5, -2.5])
def test_a_mimic_that_stands_still_outside_its_limits_is_refused(offset):
    limits = {'lower': -2.0, 'upper': 1.0}
    expected = f"'j2' mimics with multiplier 0, so it stays at {offset}, outside its limits lower = -2 and upper = 1"
    with pytest.raises(ModelError, match=expected):
        load_arm(chain(('j1', 'revolute', {}), ('j2', 'revolute', {**limits, 'mimic': ('j1', 0.0, offset)})))
    assert load_arm(chain(('j1', 'revolute', {}), ('j2', 'revolute', {**limits, 'mimic': ('j1', 0.0, 1.0)}))).n == 1


@pytest.mark.parametrize(
    ('mimic', 'words'),
    [
        (('nobody', 1.0, 0.0), "'j2' mimics 'nobody', which does not exist"),
        (('j3', 1.0, 0.0), 'round in a circle: j2 -> j3 -> j2'),
        (('j2', 1.0, 0.0), 'round in a circle: j2 -> j2'),
        (('weld', 1.0, 0.0), "mimics 'weld', which is of type fixed"),
        (('j1', 1.0, 9.0), 'j2 [-2, 2] = 1 * j1 + 9, j3 [-2, 2] = 1 * j1 + 9) have no common range'),
    ],
)
def test_a_mimic_that_cannot_be_followed_is_refused(mimic, words):
    links = ('base', 'a', 'b', 'c', 'tip')
    text = urdf(
        links,
        [
            joint_xml('j1', 'revolute', 'base', 'a'),
            joint_xml('j2', 'revolute', 'a', 'b', mimic=mimic),
            joint_xml('j3', 'revolute', 'b', 'c', mimic=('j2', 1.0, 0.0)),
            joint_xml('weld', 'fixed', 'c', 'tip'),
        ],
    )
    with pytest.raises(ModelError) as caught:
        load_arm(text)
    assert words in str(caught.value)


def test_the_motor_of_a_gripper_keeps_its_range_where_a_mimic_joint_repeats_it_with_the_wrong_sign():
    limits = {'lower': 0.0, 'upper': 0.8}
    other = {**limits, 'mimic': ('motor', -1.0, 0.0)}
    arm = load_arm(chain(('motor', 'revolute', limits), ('other', 'revolute', other)))
    assert (arm.lower[0], arm.upper[0]) == (0.0, 0.8)
    assert "joint 'other': limits [0, 0.8]" in arm.warnings[0] and "limits of 'motor' count alone" in arm.warnings[0]


@pytest.mark.parametrize('limit', [99999.0, 999999.0, 1e12, 1e308])
def test_an_endless_slide_is_unbounded_and_starts_near_the_arm(limit):
    arm = load_arm(chain(('j1', 'continuous', {}), ('j2', 'prismatic', {'lower': -limit, 'upper': limit})))
    assert (arm.lower[1], arm.upper[1]) == (-np.inf, np.inf)
    assert 'are read as no limits' in arm.warnings[0]
    assert np.abs(arm.starts[1]).max() < 100.0


def test_a_slide_much_longer_than_the_arm_starts_near_the_arm():
    arm = load_arm(chain(('j1', 'continuous', {}), ('j2', 'prismatic', {'lower': 5.0, 'upper': 1e6})))
    assert arm.starts[1].min() >= 5.0 and arm.starts[1].max() < 100.0
