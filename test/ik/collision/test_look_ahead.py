"""A stop that is called clear does not touch: judged by coal on the meshes of the URDF, at every period of the stop."""

from __future__ import annotations

import numpy as np
import pytest

from bench.published_robots import PANDA, UR5, UrdfJudge, configurations, moving_pairs
from ros_ik_pkg.ik import World, load_arm
from ros_ik_pkg.ik.collision.look_ahead import contact_of_stop, gaps_of
from ros_ik_pkg.ik.motion.jerk_limited import halt

PERIOD = 0.002  # s
FAR = 10.0  # m
ACCELERATION, JERK = 3.0, 30.0

BALL = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
SLIDES = f"""<robot name="slides"><link name="a">{BALL}</link><link name="b"/><link name="c"/>
<link name="d">{BALL}</link><link name="e">{BALL}</link>
<joint name="out" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/><origin xyz="0.3 0 0"/>
<limit lower="-0.2" upper="0.5" velocity="1" effort="1"/></joint>
<joint name="turn" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><origin xyz="0.2 0.1 0"/>
<limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
<joint name="twice" type="prismatic"><parent link="c"/><child link="d"/><axis xyz="0 1 0"/><origin xyz="0.1 0 0.2"/>
<limit lower="-0.5" upper="1" velocity="1" effort="1"/><mimic joint="out" multiplier="2" offset="0.1"/></joint>
<joint name="last" type="revolute"><parent link="d"/><child link="e"/><axis xyz="0 1 1"/><origin xyz="0.3 0 0"/>
<limit lower="-2" upper="2" velocity="1" effort="1"/></joint></robot>"""


def load(robot):
    if robot == 'slides':
        return load_arm(SLIDES, tip='e')
    urdf, srdf, tip = robot
    return load_arm(urdf, tip=tip, srdf=srdf)


@pytest.mark.parametrize('robot', [PANDA, UR5, 'slides'], ids=['panda', 'ur5', 'slides'])
def test_no_gap_changes_faster_than_its_levers_allow(robot):
    arm = load(robot)
    room = arm.contacts.room(World(floor=-0.5))
    levers = room.levers
    here, rng = configurations(arm, 400), np.random.default_rng(1)
    there = here + rng.choice([0.0, 1.0], here.shape) * rng.normal(size=here.shape) * 1e-3
    within = np.full(len(levers), FAR)
    before, after = (gaps_of(room.packed, np.ascontiguousarray(q), within) for q in (here, there))
    apart = (before > 0.0) & (after > 0.0)
    change, bound = np.abs(after - before), np.abs(there - here) @ levers.T + 5e-7
    assert np.all(change[apart] <= bound[apart])
    assert np.max(change[apart] / bound[apart]) > 0.5


def test_gaps_are_distances_of_spheres():
    arm = load('slides')
    room = arm.contacts.room(World(floor=-0.5))
    q = configurations(arm, 50)
    gaps = gaps_of(room.packed, q, np.full(len(room.levers), FAR))
    (k,) = (k for k in range(len(gaps[0])) if set(room.names(k)) == {'a', 'e'})
    expected = np.array([np.linalg.norm(arm.forward(row)[:3, 3]) - 0.1 for row in q])
    assert np.allclose(gaps[:, k], expected, atol=1e-6)
    assert np.isinf(gaps_of(room.packed, q, np.full(len(gaps[0]), -1.0))).all()


@pytest.mark.parametrize('robot', [PANDA, UR5], ids=['panda', 'ur5'])
def test_a_stop_that_is_called_clear_does_not_touch_and_the_others_do_not_stay_clear(robot):
    arm = load(robot)
    room = arm.contacts.room()
    judge = UrdfJudge(robot[0], moving_pairs(room), room.positions)
    full, rng = np.ones(arm.n), np.random.default_rng(0)
    limits = np.array([arm.lower, arm.upper, 3.0 * full, ACCELERATION * full, JERK * full])
    margins, where = np.zeros(len(room.levers)), np.empty(arm.n)
    verdicts = []
    for start in configurations(arm, 150):
        if not room.is_clear(start):
            continue
        state = np.array([start, rng.uniform(-2.0, 2.0, arm.n), rng.uniform(-2.0, 2.0, arm.n)])
        contact = contact_of_stop(room.packed, room.levers, margins, state, limits, PERIOD, where)
        touched = False
        while np.abs(state[1]).max() > 0.0 and not touched:
            halt(state, limits, PERIOD)
            touched = judge.touches(arm.joint_names, state[0])
        assert not (contact < 0 and touched)
        assert contact < 0 or not room.is_clear(where, 1e-3)
        verdicts.append((contact >= 0, touched))
    found, touched = np.sum(verdicts, axis=0)
    assert touched >= 5 and found <= touched + 3  # meshes are smaller than their hulls


def test_contacts_that_do_not_count_do_not_stop():
    arm = load('slides')
    room = arm.contacts.room(World(floor=0.0))
    state, limits = np.zeros((3, arm.n)), np.tile([[-9.0], [9.0], [1.0], [1.0], [1.0]], arm.n)
    margins, where = np.full(len(room.levers), 0.5), np.empty(arm.n)
    contact = contact_of_stop(room.packed, room.levers, margins, state, limits, PERIOD, where)
    assert contact >= 0
    margins[:] = -np.inf
    assert contact_of_stop(room.packed, room.levers, margins, state, limits, PERIOD, where) == -1
