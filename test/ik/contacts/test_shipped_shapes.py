"""Shapes of the shipped robots: where their publishers have them, around the meshes, and clear at home."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from numerics import random_configurations

from bench.published_robots import PANDA, ROBOTS, SHARE, UrdfJudge
from ros_ik_pkg.ik import Obstacle, SolveOptions, Status, World, load_arm, robot_names, solve

SHAPED = ('fr3', 'iiwa14', 'panda', 'ur10e', 'ur3e', 'ur5e')
X, Y, Z = np.eye(3)
ROUNDED = 2e-3  # m: the publishers of the UR's shapes round its offsets to millimetres
STICKS_OUT = {'panda_link0': 0.011}  # m, of the meshes of the Panda; those of its other links are inside


def at(xyz=(0.0, 0.0, 0.0), quaternion=(1.0, 0.0, 0.0, 0.0)) -> pin.SE3:
    """Return a placement; quaternion w x y z, of any length, as MuJoCo has it."""
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    return pin.SE3(pin.Quaternion(w, x, y, z).matrix(), np.array(xyz, dtype=float))


def ball(radius, *xyz):
    return 'sphere', (radius,), at(xyz)


def capsule(radius, half, xyz=(0, 0, 0), quaternion=(1, 0, 0, 0)):
    return 'capsule', (radius, 2 * half), at(xyz, quaternion)


def cylinder(radius, length, xyz=(0, 0, 0), quaternion=(1, 0, 0, 0)):
    return 'cylinder', (radius, length), at(xyz, quaternion)


def balls(text):
    return [ball(*map(float, entry.split())) for entry in text.split(';')]


TURNED, FOLDED, ACROSS = (1, 0, 1, 0), (0, 0, 1, 1), (1, 1, 0, 0)
# Of each body: its placement in the one before, the axis of its joint, and its shapes; the base first
PUBLISHED = {
    # MuJoCo Menagerie, universal_robots_ur5e/ur5e.xml; the base is turned by half a turn against the table's
    'ur5e': [
        (at(quaternion=(0, 0, 0, 1)), None, []),
        (at((0, 0, 0.163)), Z, [capsule(0.06, 0.06, (0, 0, -0.04))]),
        (at((0, 0.138, 0), TURNED), Y, [capsule(0.06, 0.06, (0, -0.04, 0), ACROSS), capsule(0.05, 0.2, (0, 0, 0.2))]),
        (at((0, -0.131, 0.425)), Y, [capsule(0.055, 0.06, (0, 0.08, 0), ACROSS), capsule(0.038, 0.19, (0, 0, 0.2))]),
        (at((0, 0, 0.392), TURNED), Y, [capsule(0.04, 0.07, (0, 0.05, 0), ACROSS)]),
        (at((0, 0.127, 0)), Z, [capsule(0.04, 0.06, (0, 0, 0.04)), capsule(0.04, 0.04, (0, 0.02, 0.1), ACROSS)]),
        (at((0, 0, 0.1)), Y, [cylinder(0.04, 0.04, (0, 0.08, 0), ACROSS)]),
    ],
    # MuJoCo Menagerie, universal_robots_ur10e/ur10e.xml
    'ur10e': [
        (at(quaternion=(0, 0, 0, 1)), None, []),
        (at((0, 0, 0.181)), Z, [capsule(0.078, 0.08, (0, 0, -0.05))]),
        (at((0, 0.176, 0), TURNED), Y, [capsule(0.078, 0.08, (0, -0.05, 0), ACROSS), capsule(0.06, 0.3, (0, 0, 0.3))]),
        (at((0, -0.137, 0.613)), Y, [capsule(0.058, 0.065, (0, 0.08, 0), ACROSS),
                                     capsule(0.043, 0.28, (0, 0, 0.29))]),
        (at((0, 0, 0.571), TURNED), Y, [capsule(0.05, 0.07, (0, 0.06, 0), ACROSS)]),
        (at((0, 0.135, 0)), Z, [capsule(0.046, 0.065, (0, 0, 0.05)),
                                capsule(0.046, 0.043, (0, 0.028, 0.12), ACROSS)]),
        (at((0, 0, 0.12)), Y, [cylinder(0.046, 0.04, (0, 0.097, 0), ACROSS)]),
    ],
    # Drake, manipulation/models/ur3e/ur3e_cylinders_collision.urdf.xacro
    'ur3e': [
        (at(quaternion=(0, 0, 0, 1)), None, [ball(0.07, 0, 0, 0.012), ball(0.03, 0, -0.08, 0.02)]),
        (at((0, 0, 0.152)), Z, [cylinder(0.05, 0.16, (0, 0, -0.02))]),
        (at((0, 0.12, 0), TURNED), Y, [
            cylinder(0.05, 0.16, (0, -0.02, 0), ACROSS), cylinder(0.05, 0.051, (0, 0, 0.045)),
            cylinder(0.04, 0.21, (0, 0, 0.127)), cylinder(0.041, 0.11, (0, 0.005, 0.243), ACROSS)]),
        (at((0, -0.093, 0.244)), Y, [ball(0.05, 0, 0.02, 0.005), cylinder(0.034, 0.185, (0, 0, 0.1115)),
                                     cylinder(0.034, 0.14, (0, 0.022, 0.213), ACROSS)]),
        (at((0, 0, 0.213), TURNED), Y, [cylinder(0.034, 0.12, (0, 0.105, 0.012))]),
        (at((0, 0.104, 0)), Z, [cylinder(0.034, 0.092, (0, -0.001, 0.086), ACROSS)]),
        (at((0, 0, 0.085)), Y, [cylinder(0.034, 0.05, (0, 0.07, 0), ACROSS)]),
    ],
    # MuJoCo Menagerie, kuka_iiwa_14/iiwa14.xml: radius and centre of each sphere
    'iiwa14': [
        (at(), None, balls('.12 0 0 .03; .08 -.08 0 .103; .08 -.08 0 .04; .1 0 0 .14')),
        (at((0, 0, 0.1575)), Z, balls(
            '.08 0 0 -.0005; .075 .01 -.025 .0425; .075 -.01 -.025 .0425; .07 .01 -.045 .1025; .07 -.01 -.045 .1025')),
        (at((0, 0, 0.2025), FOLDED), Z, balls(
            '.095 0 0 -.01; .09 0 0 .045; .07 -.01 .04 .054; .065 -.01 .09 .04; .065 -.01 .13 .02; .07 .01 .04 .054;'
            '.065 .01 .09 .04; .065 .01 .13 .02; .075 0 .18 0')),
        (at((0, 0.2045, 0), FOLDED), Z, balls(
            '.075 0 0 .0355; .06 .01 .023 .0855; .055 .01 .048 .1255; .06 .01 .056 .1755; .06 -.01 .023 .0855;'
            '.055 -.01 .048 .1255; .06 -.01 .056 .1755; .075 0 .045 .2155; .075 0 0 .2155')),
        (at((0, 0, 0.2155), ACROSS), Z, balls(
            '.078 0 .01 .046; .06 .01 .06 .052; .065 .01 .12 .034; .06 -.01 .06 .052; .065 -.01 .12 .034;'
            '.075 0 .184 0')),
        (at((0, 0.1845, 0), FOLDED), Z, balls(
            '.075 0 0 .0335; .05 -.012 .031 .0755; .05 .012 .031 .0755; .04 -.012 .06 .1155; .04 .012 .06 .1155;'
            '.04 -.01 .065 .1655; .04 .01 .065 .1655; .035 -.012 .065 .1855; .035 .012 .065 .1855')),
        (at((0, 0, 0.2155), ACROSS), Z, balls('.055 0 0 -.059; .065 0 -.03 .011; .08 0 0 0')),
        (at((0, 0.081, 0), FOLDED), Z, balls('.06 0 0 .001')),
    ],
}  # fmt: skip


def placed(arm, q):
    """Return (kind, size, base_from_shape) of all shapes of an arm, in the order of the file."""
    positions = dict(zip(arm.joint_names, q))
    return [(shape.kind, tuple(shape.size), arm.base_from_frame(link, positions) @ shape.frame_from_shape)
            for link, shapes in arm.tree.shapes.items() for shape in shapes]


def same_place(one, other, apart):
    """Assert that two poses of a body of revolution about z agree, one end being as good as the other."""
    np.testing.assert_allclose(one[:3, 3], other[:3, 3], atol=apart)
    assert abs(one[:3, 2] @ other[:3, 2]) > 1.0 - 1e-9


@pytest.mark.parametrize('name', sorted(PUBLISHED))
def test_shapes_are_where_their_publisher_has_them(name):
    arm = load_arm(name)
    for q in random_configurations(arm, np.random.default_rng(1), 20):
        pose, expected = pin.SE3.Identity(), []
        for (placement, axis, shapes), value in zip(PUBLISHED[name], [0.0, *q], strict=True):
            turn = at() if axis is None else pin.SE3(pin.exp3(axis * value), np.zeros(3))
            pose = pose * placement * turn
            expected += [(kind, size, (pose * place).homogeneous) for kind, size, place in shapes]
        for ours, theirs in zip(placed(arm, q), expected, strict=True):
            assert ours[0] == theirs[0] and ours[1] == pytest.approx(theirs[1])
            if ours[0] == 'sphere':
                np.testing.assert_allclose(ours[2][:3, 3], theirs[2][:3, 3], atol=ROUNDED)
            else:
                same_place(ours[2], theirs[2], ROUNDED)


def test_capsules_of_the_panda_are_those_of_its_description():
    """Its last one is newer than the description that is installed, and has the numbers of Drake's panda_arm.urdf."""
    arm, urdf = load_arm('panda'), ROBOTS / 'panda_description/urdf/panda_collision.urdf'
    model = pin.buildModelFromUrdf(str(urdf))
    geometry = pin.buildGeomFromUrdf(model, str(urdf), pin.GeometryType.COLLISION)
    theirs: dict[str, list] = {}
    for item in geometry.geometryObjects:
        frame = model.frames[item.parentFrame]
        if 'Sphere' in type(item.geometry).__name__:
            center = frame.placement.actInv(item.placement).translation
            theirs.setdefault(frame.name, []).append((item.geometry.radius, *center))
    theirs['panda_link7'][2:] = [(0.06, 0.0424, 0.0424, 0.082)]
    compared = 0
    for link, shapes in arm.tree.shapes.items():
        for number, shape in enumerate(shapes):
            half = 0.5 * shape.size[1] * shape.frame_from_shape[:3, 2]
            if (link, number) == ('panda_link7', 1):
                half = np.zeros(3)
            ends = [shape.frame_from_shape[:3, 3] + sign * half for sign in (1, -1)]
            wanted = np.array(theirs[link][2 * number : 2 * number + 2])
            for end in ends:
                assert np.abs(wanted - [shape.size[0], *end]).max(axis=1).min() < 1e-4
            compared += 1
    assert compared == 10
    fr3 = load_arm('fr3')
    for (link, ours), (other, same) in zip(arm.tree.shapes.items(), fr3.tree.shapes.items(), strict=True):
        assert link.removeprefix('panda') == other.removeprefix('fr3')
        for one, two in zip(ours, same, strict=True):
            assert np.array_equal(one.size, two.size) and np.array_equal(one.frame_from_shape, two.frame_from_shape)


def test_the_meshes_of_the_panda_are_inside_its_capsules():
    arm = load_arm('panda')
    model = pin.buildModelFromUrdf(str(PANDA[0]))
    geometry = pin.buildGeomFromUrdf(model, str(PANDA[0]), pin.GeometryType.COLLISION, package_dirs=[str(SHARE)])
    data, placements = model.createData(), geometry.createData()
    seen = set()
    for q in random_configurations(arm, np.random.default_rng(2), 30):
        capsules = placed(arm, q)
        pin.updateGeometryPlacements(model, data, geometry, placements, np.append(q, [0.0, 0.0]))
        for item, pose in zip(geometry.geometryObjects, placements.oMg):
            link = model.frames[item.parentFrame].name
            if link in arm.tree.shapes:
                seen.add(link)
                corners = np.array(item.geometry.vertices()) @ pose.rotation.T + pose.translation
                outside = np.min([gaps(corners, size, frame) for _, size, frame in capsules], axis=0)
                assert outside.max() <= STICKS_OUT.get(link, 0.0)
    assert seen == set(arm.tree.shapes)


def gaps(points, size, frame):
    """Return the distances (k,) of points (k, 3) from a capsule; negative inside."""
    local = (points - frame[:3, 3]) @ frame[:3, :3]
    local[:, 2] -= np.clip(local[:, 2], -0.5 * size[1], 0.5 * size[1])
    return np.linalg.norm(local, axis=1) - size[0]


def test_what_the_capsules_of_the_panda_call_clear_is_clear_by_its_meshes():
    arm, whole = load_arm('panda'), load_arm(PANDA[0], tip='panda_link8', srdf=PANDA[1])
    links = set(arm.tree.shapes)
    judge = UrdfJudge(PANDA[0], {pair for pair in whole.contacts.room().pairs if set(pair) <= links})
    q = random_configurations(arm, np.random.default_rng(3), 3000)
    touching = [row for row in q if judge.touches(arm.joint_names, row)]
    assert len(touching) > 20
    assert not any(arm.contacts.is_clear(row) for row in touching)


@pytest.mark.parametrize('name', SHAPED)
def test_a_shipped_robot_with_shapes_is_clear_at_home_and_solves_for_what_is_clear(name):
    arm = load_arm(name)
    assert arm.contacts.known and not arm.contacts.warnings
    assert arm.contacts.look(arm.home).clearance > 0.01
    assert all(pair.reason.startswith('file of shapes') for pair in arm.contacts.left_out)
    for q in random_configurations(arm, np.random.default_rng(4), 100):
        found = solve(arm, arm.forward(q), arm.home)
        if found.status == Status.CONVERGED:
            assert arm.contacts.is_clear(found.q)
        else:
            assert not arm.contacts.is_clear(q)


def test_every_other_shipped_robot_has_no_shapes():
    assert {name for name in robot_names() if load_arm(name).tree.shapes} == set(SHAPED)


@pytest.mark.parametrize('name', ['ur3e', 'ur5e'])
def test_all_lists_each_branch_that_coal_calls_clear_if_it_says_so_by_proof(name):
    arm = load_arm(name)
    every = SolveOptions(choice='all', deadline=0.0)
    unchecked = replace(every, avoid_collisions=False)
    near_contact = 0
    for q in random_configurations(arm, np.random.default_rng(5), 800):
        target = arm.forward(q)
        found, branches = solve(arm, target, arm.home, every), solve(arm, target, arm.home, unchecked)
        if found.completeness != 'proof' or branches.completeness != 'proof':
            continue
        gaps = np.array([arm.contacts.look(branch).clearance for branch in branches.solutions])
        if np.any(np.abs(gaps) < 2e-5):  # coal's tolerance decides
            continue
        clear = branches.solutions[gaps > 0.0]
        near_contact += np.any((gaps > 0.0) & (gaps < 1e-3))
        np.testing.assert_allclose(found.solutions, clear, atol=1e-3)
        if len(clear):
            np.testing.assert_array_equal(found.q, found.solutions[0])
            assert found.converged
            np.testing.assert_allclose(arm.forward(found.q), target, atol=1e-4)
        else:
            assert found.status == Status.COLLISION
    assert near_contact > 2


@pytest.mark.parametrize('name', SHAPED)
def test_a_shipped_robot_stands_on_a_floor_and_on_a_table(name):
    arm = load_arm(name)
    table = np.eye(4)
    table[2, 3] = -0.0251
    q = arm.home + 0.1
    for world in (World(floor=0.0), World(obstacles=(Obstacle('table', 'box', (2.0, 2.0, 0.05), table),))):
        assert solve(arm, arm.forward(q), q, world=world).converged
        elbow_down = q.copy()
        elbow_down[1] = arm.upper[1]
        assert arm.contacts.look(np.minimum(elbow_down, 2.6), world).touches
