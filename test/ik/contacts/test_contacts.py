"""Where the bound says clear, nothing touches: judged by coal on the meshes of the URDF, read by Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest

from bench.published_robots import BAXTER, PANDA, ROBOTS, SO100, UR5, XARM7, Z1, UrdfJudge, configurations, moving_pairs
from ros_ik_pkg.ik import ArgumentError, ModelError, Obstacle, World, load_arm
from ros_ik_pkg.ik.collision.scene import clearances_of, contacts_of
from ros_ik_pkg.ik.contacts.coal_library import coal
from ros_ik_pkg.ik.model.transforms import rotation_from_rpy, transform

COUNT = 1500
ALARMS = 0.01  # of the clear configurations, in which the bound is not sure


def load(robot):
    urdf, srdf, tip = robot
    return load_arm(urdf, tip=tip, srdf=srdf)


@pytest.mark.parametrize('robot', [PANDA, XARM7, UR5, Z1, SO100], ids=['panda', 'xarm7', 'ur5', 'z1', 'so100'])
def test_what_the_bound_calls_clear_does_not_touch(robot):
    arm = load(robot)
    room = arm.contacts.room()
    judge = UrdfJudge(robot[0], moving_pairs(room), room.positions)
    q = configurations(arm, COUNT)
    suspect = contacts_of(room.packed, q, 0.0) >= 0
    touches = np.array([judge.touches(arm.joint_names, row) for row in q])
    convex = np.array([not room.is_clear(row) for row in q])
    assert touches.sum() > 20
    assert not np.any(touches & ~suspect)
    assert not np.any(touches & ~convex)
    assert np.mean(suspect[~convex]) <= ALARMS


def test_the_room_is_seen_where_it_is():
    arm = load(PANDA)
    names = [f'thing {k}' for k in range(6)]
    rng = np.random.default_rng(3)
    poses = [transform(rotation_from_rpy(rng.uniform(-3, 3, 3)), np.append(rng.choice([-0.5, 0.5], 2), 0.4))
             for _ in names]
    kinds = [('box', (0.2, 0.1, 0.3)), ('sphere', (0.1,)), ('cylinder', (0.05, 0.4)), ('capsule', (0.05, 0.3))]
    obstacles = tuple(Obstacle(name, *kinds[k % 4], pose) for k, (name, pose) in enumerate(zip(names, poses)))
    room = arm.contacts.room(World(floor=0.0, obstacles=obstacles))
    judge = UrdfJudge(PANDA[0], moving_pairs(room), room.positions, base='panda_link0')
    makers = {'box': coal.Box, 'sphere': coal.Sphere, 'cylinder': coal.Cylinder, 'capsule': coal.Capsule}
    moving = [link for link in arm.contacts.links if link != 'panda_link0']
    for name, pose, (kind, size) in zip(names, poses, [kinds[k % 4] for k in range(6)]):
        judge.add(name, makers[kind](*size), pose, moving)
    judge.add('ground', coal.Box(10.0, 10.0, 2.0), transform(np.eye(3), np.array([0.0, 0.0, -1.0])), moving)
    q = configurations(arm, COUNT)
    suspect = contacts_of(room.packed, q, 0.0) >= 0
    touches = np.array([judge.touches(arm.joint_names, row) for row in q])
    convex = np.array([not room.is_clear(row) for row in q])
    assert 0.1 < touches.mean() < 0.9
    assert not np.any(touches & ~suspect) and not np.any(touches & ~convex)
    assert np.mean(suspect[~convex]) <= ALARMS


def test_an_object_in_the_hand_moves_with_it_and_may_touch_the_fingers():
    arm = load(PANDA)
    rod = Obstacle('rod', 'cylinder', (0.02, 0.5), transform(np.eye(3), np.array([0.0, 0.0, 0.33])), 'panda_hand',
                   ('panda_leftfinger', 'panda_rightfinger'))
    room = arm.contacts.room(World(obstacles=(rod,)))
    judge = UrdfJudge(PANDA[0], moving_pairs(room), room.positions)
    partners = {other for pair in moving_pairs(room) if 'rod' in pair for other in pair} - {'rod'}
    assert 'panda_link1' in partners and not partners & {'panda_hand', 'panda_leftfinger'}
    judge.add('rod', coal.Cylinder(0.02, 0.5), rod.shape.frame_from_shape, partners, frame='panda_hand')
    q = configurations(arm, COUNT)
    suspect = contacts_of(room.packed, q, 0.0) >= 0
    touches = np.array([judge.touches(arm.joint_names, row) for row in q])
    assert touches.sum() > np.sum(contacts_of(arm.contacts.room().packed, q, 0.0) >= 0)
    assert not np.any(touches & ~suspect)


@pytest.mark.parametrize('side', ['left', 'right'])
def test_the_other_arm_is_where_its_joints_are(side):
    arm = load_arm(BAXTER[0], base='torso', tip=f'{side}_hand_link', srdf=BAXTER[1])
    other = 'right' if side == 'left' else 'left'
    inwards = 1.0 if other == 'right' else -1.0
    joints = {f'{other}_s0': 0.9 * inwards, f'{other}_s1': -0.4, f'{other}_e1': 0.6, f'{other}_w1': 0.3}
    room = arm.contacts.room(World(positions=joints))
    pairs = moving_pairs(room)
    assert any(all(name.startswith(('left', 'right')) for name in pair) and len({name[:4] for name in pair}) == 2
               for pair in pairs)
    judge = UrdfJudge(BAXTER[0], pairs, room.positions)
    q = configurations(arm, 600)
    assert room.positions[f'{other}_s1'] == -0.4
    suspect = contacts_of(room.packed, q, 0.0) >= 0
    touches = np.array([judge.touches(arm.joint_names, row) for row in q])
    assert touches.sum() > 20 and not np.any(touches & ~suspect)
    at_rest = contacts_of(arm.contacts.room().packed, q, 0.0) >= 0
    assert np.any(at_rest != suspect)


def test_clearance_is_never_more_than_the_distance_of_the_meshes():
    arm = load(XARM7)
    room = arm.contacts.room(World(floor=-0.1))
    q = configurations(arm, 200)
    bounds = clearances_of(room.packed, q)[:, 0]
    exact = np.array([room.look(row, meshes=True).clearance for row in q])
    convex = np.array([room.look(row).clearance for row in q])
    clear = convex > 1e-3
    assert clear.sum() > 50
    assert np.all(bounds[clear] <= exact[clear] + 1e-6)
    assert np.all(bounds[clear] >= convex[clear] - 0.01)


def test_a_margin_counts_as_contact():
    arm = load(PANDA)
    room = arm.contacts.room()
    q = configurations(arm, 2000)
    bounds = clearances_of(room.packed, q)[:, 0]
    for margin in (0.01, 0.05):
        found = contacts_of(room.packed, q, margin) >= 0
        assert not np.any(~found & (bounds <= margin - 1e-6))
        assert found.sum() > (contacts_of(room.packed, q, 0.0) >= 0).sum()
        for row in q[~found][:100]:
            assert room.is_clear(row, margin)


def test_a_contact_says_what_touches_how_deep_and_where():
    arm, q = load(PANDA), np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    ball = Obstacle('ball', 'sphere', 0.1, transform(np.eye(3), arm.forward(q)[:3, 3]))
    contact = arm.contacts.look(q, World(obstacles=(ball,)))
    assert contact.touches and 'ball' in contact.links and contact.clearance < -0.02
    far = Obstacle('ball', 'sphere', 0.1, transform(np.eye(3), arm.forward(q)[:3, 3] + [0.13, 0.0, 0.0]))
    contact = arm.contacts.look(q, World(obstacles=(far,)))
    assert not contact.touches and 'ball' in contact.links
    assert contact.clearance == pytest.approx(np.linalg.norm(contact.points[0] - contact.points[1]), abs=1e-6)
    assert np.linalg.norm(contact.points - far.shape.frame_from_shape[:3, 3], axis=1).min() == pytest.approx(0.1)


@pytest.mark.parametrize('world', [
    {'floor': 0.2},
    {'obstacles': (Obstacle('pillar', 'box', (1.0, 1.0, 1.0), transform(np.eye(3), np.array([0.0, 0.0, 0.5]))),)},
], ids=['floor', 'obstacle'])
def test_what_cuts_through_the_arm_wherever_it_is_is_refused(world):
    with pytest.raises(ArgumentError, match=r'touches link .* in every configuration'):
        load(PANDA).contacts.room(World(**world))


@pytest.mark.parametrize(('make', 'reason'), [
    (lambda: Obstacle('a', 'box', (0.1, 0.0, 0.1)), 'length along y of a box is 0'),
    (lambda: Obstacle('a', 'sphere', -1.0), 'radius of a sphere is -1'),
    (lambda: Obstacle('a', 'sphere', np.nan), 'radius of a sphere is nan'),
    (lambda: Obstacle('a', 'cylinder', (0.1,)), 'has 1 numbers; expected 2'),
    (lambda: Obstacle('a', 'cone', (0.1,)), "shape 'cone' is not known"),
    (lambda: Obstacle('a', 'mesh', (1, 1, 1)), 'is a mesh'),
    (lambda: Obstacle('a', 'sphere', 0.1, np.full((4, 4), np.nan)), 'pose is not a finite'),
    (lambda: Obstacle('a', 'sphere', 0.1, np.diag([1.0, 1.0, -1.0, 1.0])), 'no right-handed rotation'),
    (lambda: World(obstacles=(Obstacle('a', 'sphere', 0.1), Obstacle('a', 'sphere', 0.2))), 'more than once: a'),
    (lambda: World(floor=np.inf), 'floor is inf'),
    (lambda: World(positions={'j': np.nan}), 'joint j is not finite'),
])  # fmt: skip
def test_a_room_that_makes_no_sense_is_refused(make, reason):
    with pytest.raises(ArgumentError, match=reason):
        make()


@pytest.mark.parametrize(('world', 'reason'), [
    (World(obstacles=(Obstacle('a', 'sphere', 0.1, link='panda_lnk7'),)), "'panda_lnk7' does not exist; did you mean"),
    (World(obstacles=(Obstacle('panda_link1', 'sphere', 0.1),)), 'has the name of a link'),
    (World(positions={'elbow': 0.0}), 'joint elbow, which the robot does not have'),
])
def test_a_room_for_another_robot_is_refused(world, reason):
    with pytest.raises(ArgumentError, match=reason):
        load(PANDA).contacts.room(world)


def test_a_thousand_obstacles_are_all_looked_at():
    arm = load(PANDA)
    rng = np.random.default_rng(0)
    obstacles = tuple(Obstacle(f'o{k}', 'sphere', 0.02, transform(np.eye(3), rng.uniform(-1.0, 1.0, 3)))
                      for k in range(1000))
    room = arm.contacts.room(World(obstacles=obstacles))
    q = configurations(arm, 50)
    found = contacts_of(room.packed, q, 0.0) >= 0
    assert not np.any(~found & ~np.array([room.is_clear(row) for row in q]))


def test_an_srdf_says_what_may_touch_by_path_uri_and_text():
    urdf, srdf, tip = PANDA
    ways = [srdf, str(srdf), srdf.as_uri(), srdf.read_text()]
    found = [load_arm(urdf, tip=tip, srdf=way).contacts.left_out for way in ways]
    assert all(left_out == found[0] for left_out in found)
    assert ('panda_link0', 'panda_link1', 'SRDF: Adjacent') in found[0]
    assert all(pair.reason.startswith('SRDF') for pair in found[0])


def test_a_link_that_may_touch_the_floor_may_touch_all_that_does_not_move():
    urdf, srdf, tip = PANDA
    text = srdf.read_text().replace(
        '</robot>', '<disable_collisions link1="floor" link2="panda_link1" reason="Stands"/></robot>')
    arm = load_arm(urdf, tip=tip, srdf=text)
    assert ('panda_link1', 'floor', 'SRDF: Stands') in arm.contacts.left_out
    pose = np.eye(4)
    pose[:3, 3] = 0.8, 0.0, 0.3
    still, held = (Obstacle(name, 'box', (0.1, 0.1, 0.1), pose, link) for name, link in
                   (('still', ''), ('held', 'panda_link7')))
    pairs = arm.contacts.room(World(floor=-0.5, obstacles=(still, held))).pairs
    for thing in ('floor', 'still'):
        assert frozenset(('panda_link1', thing)) not in pairs and frozenset(('panda_link2', thing)) in pairs
    assert frozenset(('panda_link1', 'held')) in pairs
    assert frozenset(('panda_link1', 'floor')) in load_arm(urdf, tip=tip, srdf=srdf).contacts.room(World(-0.5)).pairs


def test_an_empty_srdf_is_as_none():
    urdf, srdf, _ = Z1
    assert load_arm(urdf, srdf=srdf).contacts.left_out == load_arm(urdf).contacts.left_out


@pytest.mark.parametrize(('srdf', 'reason'), [
    (XARM7[1], "for robot 'UF_ROBOT'; expected one for 'panda'"),
    ('<robot name="panda"><disable_collisions link1="a" link2="b"/></robot>', 'names 2 of 2 links'),
    ('<robot name="panda"><disable_collisions link1="a"/></robot>', 'needs link1 and link2'),
    ('<semantics/>', 'root element is <semantics>'),
    ('<robot', 'not well-formed'),
    ('/nowhere/panda.srdf', 'cannot read the SRDF'),
])
def test_an_srdf_of_another_robot_is_refused(srdf, reason):
    with pytest.raises(ModelError, match=reason):
        load_arm(PANDA[0], tip=PANDA[2], srdf=srdf)


def test_without_an_srdf_neighbours_and_what_always_touches_is_left_out():
    left_out = {frozenset(pair[:2]): pair.reason for pair in load_arm(PANDA[0], tip=PANDA[2]).contacts.left_out}
    assert left_out[frozenset(('panda_link3', 'panda_link4'))] == 'neighbours in the tree'
    assert frozenset(('panda_link1', 'panda_link7')) not in left_out
    assert len(left_out) < 16


def test_meshes_are_found_in_the_folders_given(tmp_path):
    text = PANDA[0].read_text().replace('package://example-robot-data/robots/', 'package://')
    urdf = tmp_path / 'panda.urdf'
    urdf.write_text(text)
    lost = load_arm(urdf, tip=PANDA[2]).contacts
    assert any("mesh 'package://panda_description/meshes/collision/link3.stl' is not found" in text
               for text in lost.warnings)
    for folder in (ROBOTS, ROBOTS / 'panda_description'):
        found = load_arm(urdf, tip=PANDA[2], meshes=[folder]).contacts
        assert not found.warnings and len(found.links) > len(lost.links)
