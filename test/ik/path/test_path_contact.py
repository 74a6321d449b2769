"""Paths keep clear of the arm and of the room: judged by coal on the meshes of the URDF, read by Pinocchio."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bench.published_robots import UR5, UrdfJudge, moving_pairs
from ros_ik_pkg.ik import Obstacle, PathOptions, SolveOptions, World, load_arm, solve_path
from ros_ik_pkg.ik.contacts.coal_library import coal
from ros_ik_pkg.ik.model.transforms import transform

START = np.array([0.3, -1.2, 1.5, -1.8, -1.5, 0.1])
STEPS = 5  # of each interval, that are judged
CHANGING = PathOptions(max_reconfigurations=20, deadline=0.0)


@pytest.fixture(scope='module')
def ur5():
    urdf, srdf, tip = UR5
    return load_arm(urdf, tip=tip, srdf=srdf)


def line(arm, y: float):
    start, end = arm.forward(START), arm.forward(START)
    end[1, 3] += y
    return [start, end]


def touches(arm, q: np.ndarray, world: World, ball: coal.Sphere, place: np.ndarray) -> bool:
    """Return whether any configuration on the way touches, by a model of its own."""
    room = arm.contacts.room(world)
    judge = UrdfJudge(UR5[0], moving_pairs(room), room.positions, base='base_link')
    judge.add('ball', ball, place, {other for pair in room.pairs if 'ball' in pair for other in pair} - {'ball'})
    shares = np.linspace(0.0, 1.0, STEPS, endpoint=False)
    rows = [a + share * (b - a) for a, b in pairwise(q) for share in shares] + [q[-1]]
    return any(judge.touches(arm.joint_names, row) for row in rows)


def test_a_path_through_a_ball_ends_before_it_and_says_contact(ur5):
    poses = line(ur5, 0.3)
    free = solve_path(ur5, poses, START, path=PathOptions(deadline=0.0))
    assert free.complete
    place = transform(np.eye(3), poses[1][:3, 3])
    world = World(obstacles=(Obstacle('ball', 'sphere', (0.05,), place),))
    stopped = solve_path(ur5, poses, START, path=PathOptions(deadline=0.0), world=world)
    assert not stopped.complete and len(stopped.q) > 1
    assert stopped.breaks[0].reason.value == 'contact'
    assert touches(ur5, free.q, world, coal.Sphere(0.05), place)
    assert not touches(ur5, stopped.q, world, coal.Sphere(0.05), place)
    blind = solve_path(
        ur5, poses, START, SolveOptions(avoid_collisions=False), PathOptions(deadline=0.0), world=world
    )
    assert blind.complete


def path_of_two_branches():
    """A line of the Puma that one reconfiguration leads along, and its solution."""
    arm, random = load_arm('puma560'), np.random.default_rng(0)
    while True:
        a, b = (arm.forward(random.uniform(arm.lower, arm.upper)) for _ in range(2))
        b[:3, 3] = a[:3, 3] + 0.3 * (b[:3, 3] - a[:3, 3])
        solution = solve_path(arm, [a, b], path=CHANGING)
        if solution.complete and len(solution.reconfigurations) == 1:
            return arm, [a, b], solution


def finely(q: np.ndarray) -> np.ndarray:
    """Rows of the straight motion of the joints between the rows of q, at most 0.005 rad apart."""
    parts = [np.linspace(a, b, 2 + int(np.abs(b - a).max() / 0.005)) for a, b in pairwise(q)]
    return np.concatenate(parts)


def test_a_reconfiguration_goes_round_what_it_would_touch():
    arm, poses, free = path_of_two_branches()
    row = free.reconfigurations[0]
    middle = 0.5 * (free.q[row] + free.q[row + 1])

    def clear(q):
        return np.linalg.norm(q - middle, axis=1) > 0.3

    assert not clear(finely(free.q)).all()
    other = solve_path(arm, poses, path=CHANGING, clear=clear)
    assert other.complete and len(other.reconfigurations) == 1
    assert clear(finely(other.q)).all()


def test_a_path_ends_before_a_reconfiguration_that_cannot_be_clear():
    arm, poses, free = path_of_two_branches()
    row = free.reconfigurations[0]
    joint = int(np.argmax(np.abs(free.q[row + 1] - free.q[row])))
    wall = 0.5 * (free.q[row, joint] + free.q[row + 1, joint])

    def clear(q):
        return np.abs(q[:, joint] - wall) > 0.05

    stopped = solve_path(arm, poses, path=CHANGING, clear=clear)
    assert not stopped.complete and 0.0 < stopped.place[-1] < stopped.breaks[0].place < 1.0
    assert stopped.breaks[0].reason.value == 'contact' and 'to another one' in stopped.breaks[0].text
    assert clear(finely(stopped.q)).all()


def test_a_thin_thing_between_two_samples_ends_the_path_too():
    arm = load_arm('ur5')
    poses = [arm.forward(START), arm.forward(START)]
    poses[1][1, 3] += 0.2
    coarse = PathOptions(step=0.1, tolerance=0.02, angle_tolerance=0.1, deadline=0.0)
    free = solve_path(arm, poses, START, path=coarse)
    a, b = free.q[:2]
    thin = a + 0.26 * (b - a)

    def clear(q):
        return np.linalg.norm(q - thin, axis=1) > 0.02

    other = solve_path(arm, poses, START, path=coarse, clear=clear)
    assert not clear(finely(free.q)).all() and clear(finely(other.q)).all()


def test_the_motion_to_the_start_begins_where_the_joints_are_and_is_free_of_contact():
    arm = load_arm('ur5')
    away = START + np.array([0.4, -0.2, 0.3, 0.1, -0.2, 0.5])
    poses = [arm.forward(START), arm.forward(START)]
    poses[1][1, 3] += 0.1
    led = solve_path(arm, poses, away, path=PathOptions(lead_in=True, deadline=0.0))
    plain = solve_path(arm, poses, away, path=PathOptions(deadline=0.0))
    assert led.complete and led.led and led.off_path == (0,) and not led.reconfigurations and not plain.led
    np.testing.assert_array_equal(led.q[0], away)
    np.testing.assert_allclose(led.q[1:], plain.q)
    np.testing.assert_allclose(led.base_from_tip[0], arm.forward(away))
    assert led.stops[:2] == (0, 1) and led.line_error <= 1e-4
    there = solve_path(arm, poses, plain.q[0], path=PathOptions(lead_in=True, deadline=0.0))
    assert not there.led and len(there.q) == len(plain.q)
    middle = 0.5 * (led.q[0] + led.q[1])
    touched = solve_path(arm, poses, away, path=PathOptions(lead_in=True, deadline=0.0),
                         clear=lambda q: np.abs(q - middle).max(axis=1) > 0.05)
    assert not touched.complete and len(touched.q) == 0
    assert touched.breaks[0].reason.value == 'contact' and 'from where they are to pose 0' in touched.breaks[0].text
    inside = solve_path(arm, poses, away, path=PathOptions(lead_in=True, deadline=0.0),
                        clear=lambda q: np.abs(q - away).max(axis=1) > 1e-3)
    assert len(inside.q) == 0 and inside.breaks[0].reason.value == 'contact'
    away[5] = 9.0
    beyond = solve_path(arm, poses, away, path=PathOptions(lead_in=True, deadline=0.0))
    assert len(beyond.q) == 0 and beyond.breaks[0].reason.value == 'limit'
