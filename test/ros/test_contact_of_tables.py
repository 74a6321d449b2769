"""The real node over DDS with robots from DH tables: shapes of a shipped one, and capsules of rows with a radius."""

from __future__ import annotations

import numpy as np
import pytest
from numerics import random_configurations
from ros_helpers import Client, allow_lark, connected, joint_state, pose_of

from ros_ik_pkg.ik import World, load_arm

pytestmark = allow_lark
PATIENCE = 60.0  # s
TABLE = '''name: two
source: made up
convention: standard
angles: radians
base_frame: base
tip_frame: tip
joints:
  - {name: a, type: revolute, a: 0.0, alpha: 1.5707963267948966, d: 0.3, theta: 0, lower: -3, upper: 3, radius: 0.05}
  - {name: b, type: revolute, a: 0.4, alpha: 0, d: 0, theta: 0, lower: -2, upper: 2, radius: 0.04}
  - {name: c, type: revolute, a: 0.3, alpha: 0, d: 0, theta: 0, lower: -2.9, upper: 2.9, radius: 0.03}
'''


@pytest.fixture(scope='module')
def client(tmp_path_factory):
    folder = tmp_path_factory.mktemp('tables')
    with connected(Client, folder / 'log', '-p', 'robot:=panda', '-p', 'seed_source:=joint_states') as found:
        yield found


def touching(arm, count):
    """Return configurations in which the arm touches itself by a centimetre or more."""
    rows = random_configurations(arm, np.random.default_rng(5), 40 * count)
    return [q for q in rows if arm.contacts.look(q).clearance < -0.01][:count]


def positions(arm, reply):
    """Return the joint positions of a reply (n,)."""
    return np.array([reply.joints[name] for name in arm.joint_names])


def test_a_target_of_a_panda_that_touches_itself_is_solved_elsewhere_or_refused_by_name(client):
    arm, solved = load_arm('panda'), 0
    for q in touching(arm, 20):
        pose, state = pose_of(arm.forward(q)), joint_state(arm.joint_names, q)
        client.set_parameters({'avoid_collisions': False})
        there = client.settle(pose, lambda reply, q=q: reply.joints and np.allclose(positions(arm, reply), q), state)
        assert not arm.contacts.is_clear(positions(arm, there))
        client.set_parameters({'avoid_collisions': True})
        reply = client.solve(pose, PATIENCE)
        if reply.joints:
            solved += 1
            assert arm.contacts.is_clear(positions(arm, reply))
        else:
            assert reply.figures['status'] == 'collision' and 'panda_link' in reply.message
    assert solved >= 5


def test_a_target_that_a_ur5e_reaches_only_by_touching_itself_is_refused_with_the_links(client):
    client.set_parameters({'robot': 'ur5e', 'seed_source': 'home'})
    arm, refused = load_arm('ur5e'), 0
    for q in touching(arm, 40):
        reply = client.solve(pose_of(arm.forward(q)), PATIENCE)
        if reply.joints:
            assert arm.contacts.is_clear(positions(arm, reply))
        else:
            refused += 1
            assert reply.figures['status'] == 'collision'
            assert all(link in reply.message for link in reply.figures['touching'].split(', '))
    assert refused >= 3


def test_capsules_of_rows_with_a_radius_keep_the_arm_above_the_floor(client, tmp_path):
    path = tmp_path / 'two.yaml'
    path.write_text(TABLE)
    position = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    client.set_parameters({'robot': str(path), 'seed_source': 'home', 'ground': -0.2, 'task_weights': position})
    arm, world, counts = load_arm(path), World(floor=-0.2), {'solved': 0, 'itself': 0, 'floor': 0}
    for q in random_configurations(arm, np.random.default_rng(6), 60):
        reply = client.solve(pose_of(arm.forward(q)), PATIENCE)
        if reply.joints:
            counts['solved'] += 1
            assert arm.contacts.is_clear(positions(arm, reply), 0.0, world)
        else:
            counts['floor' if 'floor' in reply.message else 'itself'] += 1
            assert reply.figures['status'] == 'collision'
    assert counts['solved'] >= 5 and counts['floor'] >= 5


def test_a_table_whose_radius_makes_no_sense_is_refused_and_the_old_robot_stays(client, tmp_path):
    path = tmp_path / 'wrong.yaml'
    path.write_text(TABLE.replace('radius: 0.04', 'radius: -0.04'))
    assert 'line 9: radius is -0.04; expected above 0' in client.refusal_of(robot=str(path))
    assert client.parameter('robot') != str(path)
