"""The best route is the one that dynamic programming in NumPy over all pairs of nodes finds."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numerics import get_arm

from ros_ik_pkg.ik import SolveOptions
from ros_ik_pkg.ik.path import routing
from ros_ik_pkg.ik.path.edges import count_parts
from ros_ik_pkg.ik.path.joint_path import MOST_BRANCHES, _find_candidates
from ros_ik_pkg.ik.path.path_options import PathOptions
from ros_ik_pkg.ik.path.routing import find_route
from ros_ik_pkg.ik.path.solve_path import _make_problem

TURN = 2.0 * np.pi


def turning_path(arm, random, count):
    """Poses between which the tip turns by more than the last joint can, as it moves a little."""
    q = random.uniform(np.maximum(arm.lower, -1.5), np.minimum(arm.upper, 1.5))
    pose = arm.forward(q)
    poses = []
    for k in range(count):
        step = pose.copy()
        angle = 0.15 * k
        step[:3, :3] = pose[:3, :3] @ [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        step[:3, 3] += 0.002 * k
        poses.append(step)
    return np.array(poses), q


def all_routes(problem, candidates, counts, most):
    """Fewest reconfigurations and least cost to each pose, as far as they go, over all nodes."""
    arm, (lower, upper) = problem.arm, problem.limits
    digits = [range(2 if wraps else 1) for wraps in arm.wraps]
    layers = []
    for k, count in enumerate(counts):
        nodes = [q + TURN * np.array(turns) for q in candidates[k, :count] for turns in itertools.product(*digits)]
        layers.append(np.array([q for q in nodes if (q <= upper).all() and (q >= lower).all()]).reshape(-1, arm.n))
    jumps = np.zeros(len(layers[0]), int)
    costs = np.linalg.norm(layers[0] - problem.seed, axis=1)
    out = []
    for k, layer in enumerate(layers):
        if k:
            gaps = layer[:, None] - layers[k - 1][None]
            linked = np.abs(gaps).max(axis=2) <= problem.bounds[2]
            for i, j in np.argwhere(linked):
                parts = np.empty(1, np.int64)
                rows = np.ascontiguousarray([layers[k - 1][j], layer[i]])
                count_parts(problem.model, problem.solve, problem.continuing, problem.poses[4 * k - 4 : 4 * k + 4],
                            problem.turns[k - 1 : k], rows, problem.bounds, parts)
                linked[i, j] = parts[0] > 0
            length = np.linalg.norm(gaps, axis=2)
            key = np.where(linked, 1e6 * jumps[None] + costs[None] + length, np.inf)
            parent = key.argmin(axis=1)
            reached = np.isfinite(key.min(axis=1))
            costs = np.where(reached, costs[parent] + length[np.arange(len(layer)), parent], np.inf)
            jumps = np.where(reached, jumps[parent], 1 << 30)
        if not len(layer) or jumps.min() >= 1 << 30:
            return out
        if most > jumps.min():
            few = np.flatnonzero(jumps == jumps.min())
            length = np.linalg.norm(layer[:, None] - layer[None, few], axis=2) + costs[None, few]
            better = (jumps > jumps.min()) & (
                (jumps > jumps.min() + 1) | (length.min(axis=1) < costs))
            costs = np.where(better, length.min(axis=1), costs)
            jumps = np.where(better, jumps.min() + 1, jumps)
        best = np.lexsort((costs, jumps))[0]
        out.append((int(jumps[best]), float(costs[best])))
    return out


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize(('name', 'most'), [('ur5', 0), ('ur5', 3), ('puma560', 5)])
def test_no_route_has_fewer_reconfigurations_or_less_motion(name, most, seed, monkeypatch):
    arm, random = get_arm(name), np.random.default_rng(seed)
    poses, q = turning_path(arm, random, 60)
    path = PathOptions(step=10.0, angle_step=3.0, deadline=0.0, max_reconfigurations=most)
    problem = _make_problem(arm, poses, q + random.uniform(-0.3, 0.3, arm.n), SolveOptions(), path, None, (), None,
                            None, 0.0)
    candidates, counts, _ = _find_candidates(problem, MOST_BRANCHES)
    monkeypatch.setattr(routing, 'CHUNK', 7)  # routes go on from piece to piece
    route = find_route(problem, candidates, counts)
    wanted = all_routes(problem, candidates, counts, most)
    assert route.reached == len(wanted)
    cost = np.linalg.norm(route.q[0] - problem.seed) + np.linalg.norm(np.diff(route.q, axis=0), axis=1).sum()
    assert (len(route.jumps), cost) == (wanted[-1][0], pytest.approx(wanted[-1][1]))
