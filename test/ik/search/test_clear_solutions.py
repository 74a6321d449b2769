"""The search takes only answers that are clear; judged by coal on the meshes of the URDF, read by Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest

from bench.published_robots import PANDA, UR5, XARM7, UrdfJudge, configurations, moving_pairs
from ros_ik_pkg.ik import Obstacle, SolveOptions, Status, World, load_arm, solve, solve_batch
from ros_ik_pkg.ik.collision.scene import contacts_of
from ros_ik_pkg.ik.model.transforms import transform

COUNT = 400
NEARLY = 1e-4  # m
CALM = SolveOptions(deadline=10.0)
OFF = SolveOptions(deadline=10.0, avoid_collisions=False)


def at(x, y, z):
    return transform(np.eye(3), np.array([x, y, z]))


BOXES = tuple(Obstacle(f'box {k}', 'box', (0.12, 0.12, 0.12), at(0.55 * np.cos(k), 0.55 * np.sin(k), 0.1 * k))
              for k in range(8))
ROOM = World(floor=-0.05, obstacles=BOXES)


@pytest.fixture(scope='module', params=[PANDA, XARM7, UR5], ids=['panda', 'xarm7', 'ur5'])
def robot(request):
    urdf, srdf, tip = request.param
    return urdf, load_arm(urdf, tip=tip, srdf=srdf)


def clear_targets(arm, world, count=COUNT):
    """Return poses that a clear configuration reaches."""
    room = arm.contacts.room(world)
    q = configurations(arm, 4 * count, seed=5)
    q = q[contacts_of(room.packed, q, 1e-3) < 0][:count]
    return np.array([arm.forward(row) for row in q])


@pytest.mark.parametrize('world', [None, ROOM], ids=['alone', 'in a room'])
def test_answers_do_not_touch_and_clear_targets_have_one(robot, world):
    urdf, arm = robot
    targets = clear_targets(arm, world)
    found = solve_batch(arm, targets, options=CALM, world=world)
    room = arm.contacts.room(world)
    judge = UrdfJudge(urdf, moving_pairs(room), room.positions)
    assert np.mean(found.converged) >= 0.995
    for q in found.q[found.converged]:
        assert not judge.touches(arm.joint_names, q) and room.is_clear(q)
    heedless = solve_batch(arm, targets, options=OFF)
    assert sum(not room.is_clear(q) for q in heedless.q) >= 3


def test_alone_and_in_a_batch_the_answers_are_the_same(robot):
    _, arm = robot
    targets = clear_targets(arm, ROOM, 60)
    found = solve_batch(arm, targets, options=CALM, world=ROOM, workers=2)
    for k, target in enumerate(targets):
        alone = solve(arm, target, options=CALM, world=ROOM)
        assert np.array_equal(alone.q, found.q[k]) and alone.status == found.status[k]


@pytest.mark.parametrize('choice', ['first', 'nearest', 'all'])
def test_every_choice_ranks_clear_answers_alone(choice):
    arm = load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])
    options = SolveOptions(deadline=10.0, choice=choice)
    for target in clear_targets(arm, ROOM, 40):
        solution = solve(arm, target, options=options, world=ROOM)
        assert solution.converged
        answers = [solution.q] if solution.solutions is None else solution.solutions
        assert all(arm.contacts.is_clear(q, 0.0, ROOM) for q in answers)


def test_a_margin_is_kept():
    arm = load_arm(XARM7[0], srdf=XARM7[1])
    options = SolveOptions(deadline=10.0, collision_margin=0.03)
    targets = clear_targets(arm, ROOM, 100)
    clearances = [solution.clearance for solution in (solve(arm, target, options=options, world=ROOM)
                                                      for target in targets) if solution.converged]
    assert len(clearances) > 50 and min(clearances) > 0.03


def test_self_motion_does_not_lead_into_contact():
    arm = load_arm(PANDA[0], tip=PANDA[2], srdf=PANDA[1])
    options = SolveOptions(deadline=10.0, null_space='posture', posture=tuple(arm.home))
    room = arm.contacts.room(ROOM)
    free = SolveOptions(deadline=10.0, null_space='posture', posture=tuple(arm.home), avoid_collisions=False)
    targets = clear_targets(arm, ROOM, 60)
    assert any(not room.is_clear(solve(arm, target, options=free).q) for target in targets)
    for target in targets:
        solution = solve(arm, target, options=options, world=ROOM)
        assert solution.converged and room.is_clear(solution.q)


def test_where_every_answer_touches_the_failure_says_so():
    arm = load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])
    target = clear_targets(arm, None, 1)[0]
    ball = Obstacle('ball', 'sphere', 0.05, at(*target[:3, 3]))
    solution = solve(arm, target, options=CALM, world=World(obstacles=(ball,)))
    assert solution.status == Status.COLLISION and not solution.converged
    assert 'ball' in solution.nearest_links and solution.clearance < 0.0
    assert solution.position_error <= 1e-5
    again = solve_batch(arm, target[None], options=CALM, world=World(obstacles=(ball,)))
    assert again.status[0] == Status.COLLISION


def test_a_lone_descent_that_touches_is_no_answer():
    arm = load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])  # without self-motion that leads out of it
    q = configurations(arm, 500, seed=1)
    q = next(row for row in q if not arm.contacts.is_clear(row))
    lone = SolveOptions(max_attempts=1, deadline=10.0)
    assert solve(arm, arm.forward(q), q, lone).status == Status.COLLISION


def test_what_the_bound_is_not_sure_of_coal_decides():
    arm = load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])
    room = arm.contacts.room()
    q = configurations(arm, 30000, seed=2)
    suspects = q[contacts_of(room.packed, q, 0.0) >= 0]
    unsure = [row for row in suspects if room.is_clear(row)]
    assert unsure
    lone = SolveOptions(max_attempts=1, deadline=10.0)
    taken = 0
    for row in unsure[:20]:
        solution = solve(arm, arm.forward(row), row, lone)
        clearance = room.look(row).clearance
        assert solution.converged or clearance < 2.0 * NEARLY  # the answer is a little beside the row
        assert not solution.converged or clearance > 0.0
        taken += solution.converged
        if solution.converged:
            assert np.allclose(solution.q, row, atol=1e-3) and solution.position_error <= 1e-5
    assert taken


def test_nothing_changes_where_contact_does_not_count(robot):
    urdf, arm = robot
    bare = load_arm(urdf, tip=arm.tip_frame)
    for target in clear_targets(arm, None, 30):
        one = solve(arm, target, options=OFF)
        other = solve(bare, target, options=OFF)
        assert np.array_equal(one.q, other.q)
        assert np.isnan(one.clearance) and one.nearest_links == () and one.room is None
    assert 'contacts' not in vars(bare)  # its meshes are not even read


def test_triangles_allow_what_hulls_do_not():
    arm = load_arm(UR5[0], tip=UR5[2])
    room = arm.contacts.room()
    q = configurations(arm, 3000, seed=4)
    between = [row for row in q if not room.is_clear(row) and room.is_clear(row, 0.0, True)]
    assert between
    for row in between[:5]:
        lone = SolveOptions(max_attempts=1, deadline=10.0, collision_geometry='mesh')
        solution = solve(arm, arm.forward(row), row, lone)
        assert solution.converged == (room.look(row, True).clearance > NEARLY)


def test_coal_agrees_with_the_search_where_two_things_are_hardly_apart():
    shape = '<collision><origin xyz="1 0 0"/><geometry><sphere radius="0.1"/></geometry></collision>'
    arm = load_arm(f'<robot name="one"><link name="a"/><link name="b">{shape}</link><joint name="j" type="continuous">'
                   '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>')
    lone, q, found = SolveOptions(max_attempts=1, deadline=10.0), np.zeros(1), []
    for gap in (1e-3, 3e-5, 1.5e-5, 9e-6, 4e-6, 1e-6):
        world = World(obstacles=(Obstacle('ball', 'sphere', (0.1,), at(1.2 + gap, 0.0, 0.0)),))
        solution = solve(arm, arm.forward(q), q, lone, world=world)
        assert solution.converged == arm.contacts.is_clear(q, 0.0, world)
        found.append(solution.converged)
    assert found[:2] == [True, True] and not found[-1]
