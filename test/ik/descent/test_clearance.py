"""Self-motion keeps redundant arms away from contact, and leads them out of it; coal judges."""

from __future__ import annotations

import numpy as np
import pytest

from bench.collision import boxes
from bench.published_robots import PANDA, configurations
from ros_ik_pkg.ik import SolveOptions, Status, World, load_arm, solve
from ros_ik_pkg.ik.collision.obstruction import MOST_TOUCHING, Obstruction
from ros_ik_pkg.ik.collision.proximity import INFLUENCE, proximity
from ros_ik_pkg.ik.collision.scene import contacts_of, scene_memory

WORLD = World(floor=-0.05, obstacles=boxes())
PLAIN, KEEP_CLEAR = SolveOptions(deadline=10.0), SolveOptions(null_space='clearance', deadline=10.0)
NOTHING = np.empty(0)


@pytest.fixture(scope='module')
def arm():
    return load_arm(PANDA[0], tip=PANDA[2], srdf=PANDA[1])


@pytest.fixture(scope='module')
def room(arm):
    return arm.contacts.room(WORLD)


@pytest.fixture(scope='module')
def obstruction(arm, room):
    memory = np.empty(scene_memory(room.packed))
    return Obstruction(room.packed, memory, np.empty((MOST_TOUCHING, arm.n)), np.empty(MOST_TOUCHING))


@pytest.fixture(scope='module')
def close(arm, room):
    """Return configurations in which something is near, and nothing touches."""
    q = configurations(arm, 2000, seed=3)
    q = q[contacts_of(room.packed, q, 1e-4) < 0]
    return [row for row in q if room.look(row).clearance < 0.05][:60]


@pytest.fixture(scope='module')
def touching(arm, room):
    q = configurations(arm, 1500, seed=4)
    return [row for row in q[contacts_of(room.packed, q, 0.0) >= 0] if room.look(row).touches][:100]


def test_the_cost_of_nearness_has_the_gradient_and_the_curvature_of_differences(obstruction, close):
    random, step, wrong = np.random.default_rng(0), 1e-5, 0
    for row in close:
        descent, direction = np.empty(7), random.normal(size=7)
        cost, curvature = proximity(obstruction, row, direction, descent)
        ahead, behind = (proximity(obstruction, row + s * step * direction, NOTHING, NOTHING)[0] for s in (1.0, -1.0))
        wrong += abs((ahead - behind) / (2.0 * step) + descent @ direction) > 1e-3 * (1.0 + abs(descent @ direction))
        assert cost > 0.0 and curvature > 0.0
    assert wrong <= 0.1 * len(close)  # where two points change places


def test_the_cost_is_that_of_what_coal_finds_near(room, obstruction, close):
    for row in close:
        cost, _ = proximity(obstruction, row, NOTHING, NOTHING)
        missing = INFLUENCE - room.look(row).clearance
        assert cost > 0.5 * (missing - 2e-3) ** 2  # of the nearest pair alone, whose bound is less by up to 1 mm


def test_with_the_objective_clearance_a_tracked_target_is_answered_further_from_contact(arm, room, close):
    plain, clear = [], []
    for row in close:
        target = arm.forward(row)
        one, other = (solve(arm, target, row, options, world=WORLD) for options in (PLAIN, KEEP_CLEAR))
        assert other.converged and other.position_error <= 1e-5
        plain.append(one.clearance)
        clear.append(other.clearance)
    assert np.median(clear) > np.median(plain) + 0.005
    assert min(clear) > 0.0


def test_along_a_line_the_objective_clearance_keeps_more_distance(arm, room, close):
    """Targets 2 mm apart, each solved from the answer before, as a tracked target is."""
    gains = []
    for row in close[:40]:
        clearances = []
        for options in (PLAIN, KEEP_CLEAR):
            target, kept = arm.forward(row), []
            q = solve(arm, target, row, options, world=WORLD).q
            for _ in range(25):
                target[2, 3] += 0.002
                solution = solve(arm, target, q, options, world=WORLD)
                if not solution.converged or np.abs(solution.q - q).max() > 0.5:
                    break  # out of reach, or an obstacle is in the way
                q = solution.q
                kept.append(room.look(q).clearance)
            clearances.append(kept)
        shared = min(map(len, clearances))
        if shared >= 15:
            gains.append(np.mean(clearances[1][5:shared]) - np.mean(clearances[0][5:shared]))
    assert len(gains) >= 15 and np.median(gains) > 0.004 and min(gains) > -0.005


def test_clearance_moves_nothing_where_contact_does_not_count(arm, close):
    options = SolveOptions(null_space='clearance', avoid_collisions=False, deadline=10.0)
    bare = SolveOptions(avoid_collisions=False, deadline=10.0)
    for row in close[:10]:
        one, other = (solve(arm, arm.forward(row), row + 0.1, opt) for opt in (options, bare))
        assert np.allclose(one.q, other.q, rtol=0.0, atol=1e-4)


def test_self_motion_leads_out_of_contact_before_the_only_attempt_is_given_up(arm, room, touching):
    lone = SolveOptions(max_attempts=1, deadline=10.0)
    solutions = [(row, solve(arm, arm.forward(row), row, lone, world=WORLD)) for row in touching]
    saved = [(row, solution) for row, solution in solutions if solution.converged]
    assert len(saved) >= 5
    for row, solution in saved:
        assert room.is_clear(solution.q) and np.abs(solution.q - row).max() > 1e-4
    assert {solution.status for _, solution in solutions} == {Status.CONVERGED, Status.COLLISION}


def test_an_answer_near_a_seed_that_touches_is_found_by_self_motion(arm, room, touching):
    nearest = SolveOptions(choice='nearest', deadline=10.0)
    solutions = [solve(arm, arm.forward(row), row, nearest, world=WORLD) for row in touching]
    gaps = [solution.joint_distance for solution in solutions if solution.converged]
    assert all(room.is_clear(solution.q) for solution in solutions if solution.converged)
    assert np.sum(np.array(gaps) < 0.3) >= 3
