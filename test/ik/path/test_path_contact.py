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
