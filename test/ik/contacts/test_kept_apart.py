"""Pairs that keep a distance within the joint limits are skipped there, and only there."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bench.published_robots import TIAGO, UR5, UrdfJudge, configurations
from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ik.collision.scene import clearances_of, contacts_of

CORNER = np.sqrt(0.5)  # [m] from the middle of the plate to its corner
AT = 0.1  # [rad] joint position at which the corner points at the ball; not that of home


def plate(bump, lower=-0.4, upper=0.4, joint='fixed'):
    """Return an arm whose square plate turns by its corner past a small ball `bump` [m] from the axis; the ball is on
    a post, or on a joint outside the chain."""
    angle = 0.25 * np.pi + AT
    return load_arm(f"""
<robot name="plate">
  <link name="base"/>
  <link name="post"><collision><geometry><sphere radius="0.0001"/></geometry></collision></link>
  <link name="plate"><collision><geometry><box size="1 1 0.01"/></geometry></collision></link>
  <link name="tip"/>
  <joint name="stand" type="{joint}"><parent link="base"/><child link="post"/>
    <origin xyz="{bump * np.cos(angle)} {bump * np.sin(angle)} 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="turn" type="revolute"><parent link="base"/><child link="plate"/><axis xyz="0 0 1"/>
    <limit lower="{lower}" upper="{upper}" velocity="1" effort="1"/></joint>
  <joint name="lift" type="prismatic"><parent link="plate"/><child link="tip"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" velocity="1" effort="1"/></joint>
</robot>""", base='base', tip='tip')


def kept(arm):
    """Return the distance that each pair keeps, by the two names [m]; inf for those that are looked at."""
    room = arm.contacts.room()
    found = {}
    for k, pair in enumerate(room._pairs):
        names = frozenset(room.names(k))
        found[names] = min(found.get(names, np.inf), arm.contacts._kept_apart.get(pair, 0.0))
    return found


@pytest.mark.parametrize(('robot', 'base'), [(TIAGO, 'torso_fixed_link'), (UR5, None)], ids=['tiago', 'ur5'])
def test_links_of_a_robot_keep_the_distance_that_is_claimed(robot, base):
    urdf, srdf, tip = robot
    arm = load_arm(urdf, base=base, tip=tip, srdf=srdf)
    claimed = {pair: distance for pair, distance in kept(arm).items() if distance > 0.0}
    assert claimed
    corners = itertools.islice(itertools.product(*zip(arm.lower, arm.upper)), 256)
    q = [*np.clip(list(corners), -np.pi, np.pi), *configurations(arm, 1500, seed=4)]
    for pair, distance in claimed.items():
        judge = UrdfJudge(urdf, [pair], arm.contacts.room().positions)
        judge.keep(distance)
        assert not any(judge.touches(arm.joint_names, row) for row in q)


def test_a_plate_that_never_reaches_a_ball_keeps_a_distance():
    arm = plate(CORNER + 0.01)
    distance = kept(arm)[frozenset(('post', 'plate'))]
    assert 0.0 < distance < 0.01


def test_a_touch_in_a_thousandth_of_the_range_is_not_overlooked():
    arm = plate(CORNER - 1e-4)
    random = np.random.default_rng(0).uniform(arm.lower, arm.upper, (200, 2))
    assert np.all(contacts_of(arm.contacts.room().packed, random, 0.0) < 0)  # samples do not show it
    assert kept(arm)[frozenset(('post', 'plate'))] == 0.0
    assert contacts_of(arm.contacts.room().packed, np.array([[AT, 0.0]]), 0.0)[0] >= 0


def test_a_distance_that_is_kept_counts_within_the_limits_alone():
    arm = plate(CORNER - 1e-4, lower=0.15)
    assert kept(arm)[frozenset(('post', 'plate'))] > 0.0
    packed = arm.contacts.room().packed
    assert contacts_of(packed, np.array([[0.2, 0.1], [AT, 0.1]]), 0.0).tolist() == [-1, 0]
    assert clearances_of(packed, np.array([[AT, 0.1]]))[0, 0] <= 0.0


def test_a_margin_beyond_the_distance_is_looked_at():
    arm = plate(CORNER + 0.01)
    packed = arm.contacts.room().packed
    assert contacts_of(packed, np.array([[AT, 0.0]]), 0.009)[0] < 0
    assert contacts_of(packed, np.array([[AT, 0.0]]), 0.011)[0] >= 0


def test_nothing_is_claimed_of_links_that_a_joint_outside_the_chain_moves():
    arm = plate(CORNER + 0.01, joint='revolute')
    assert kept(arm)[frozenset(('post', 'plate'))] == 0.0


@pytest.mark.parametrize(('multiplier', 'endless'), [(-1.0, True), (0.5, False)])
def test_an_endless_joint_is_looked_at_in_one_turn_if_all_that_follows_it_turns_by_whole_turns(multiplier, endless):
    arm = load_arm(f"""
<robot name="geared">
  <link name="base"/><link name="wheel"/>
  <link name="plate"><collision><geometry><box size="1 1 0.01"/></geometry></collision></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 0 1"/></joint>
  <joint name="gear" type="continuous"><parent link="wheel"/><child link="plate"/><axis xyz="0 0 1"/>
    <mimic joint="turn" multiplier="{multiplier}"/></joint>
</robot>""", base='base', tip='plate')
    assert np.all(np.isinf(arm.contacts._bounds)) == endless
    assert endless or np.all(np.abs(arm.contacts._bounds) < np.pi + 1e-3)
