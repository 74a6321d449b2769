"""Arms on a base that slides, a lift or a rail: reachable poses, with joint weights and without."""

from __future__ import annotations

import time

import numpy as np

from bench.cases import random_joints
from bench.judge import Judge
from bench.model import urdf_of
from ros_ik_pkg.ik import Arm, SolveOptions, load_arm, solve

HEAVY = 20.0  # weight of what carries the arm, whose own joints weigh 1
NEARBY = 0.3  # rad, m: how far targets that the arm could reach alone are from the seed, in joints of the arm
LIFT_HEAD = [
    'arm', 'joints', 'weights', 'solved %', 'wrong', 'median us', 'median ratio', 'carrier moves nearby', 'and the arm',
]  # fmt: skip
# Joints below the arm: type, axis, half of its range [m, rad]
CARRIERS = {
    'base that drives': (('prismatic', '1 0 0', 2.0), ('prismatic', '0 1 0', 2.0), ('revolute', '0 0 1', 3.1)),
    'gantry': (('prismatic', '1 0 0', 1.5), ('prismatic', '0 1 0', 1.5), ('prismatic', '0 0 1', 0.5)),
    'rail, lift and torso': (('prismatic', '0 1 0', 2.0), ('prismatic', '0 0 1', 0.4), ('revolute', '0 0 1', 2.5)),
}


def carried(robot: str, name: str) -> Arm:
    """Return an arm of config/robots on one of CARRIERS."""
    arm = load_arm(robot)
    links, joints = [], []
    for k, (kind, axis, half) in enumerate(CARRIERS[name]):
        child = f'carrier{k + 1}' if k + 1 < len(CARRIERS[name]) else 'base'
        links.append(f'<link name="carrier{k}"/>')
        joints.append(
            f'<joint name="c{k}" type="{kind}"><parent link="carrier{k}"/><child link="{child}"/>'
            f'<axis xyz="{axis}"/><limit lower="{-half}" upper="{half}" velocity="1" effort="1"/></joint>'
        )
    return load_arm(urdf_of(arm).replace('</robot>', ''.join((*links, *joints, '</robot>'))), tip='tip')


def lift_rows(count: int) -> list[list[str]]:
    """Return the table under LIFT_HEAD."""
    rows = []
    for robot, name in zip(('panda', 'iiwa14', 'panda'), CARRIERS):
        arm = carried(robot, name)
        judge, random = Judge(arm), np.random.default_rng(0)
        q, seeds = random_joints(arm, random, count), random_joints(arm, random, count)
        targets = judge.forward(q)
        beside = seeds + random.uniform(-NEARBY, NEARBY, seeds.shape) * (np.arange(arm.n) >= len(CARRIERS[name]))
        nearby = judge.forward(np.clip(beside, arm.lower, arm.upper))
        heavy = (HEAVY,) * len(CARRIERS[name]) + (1.0,) * (arm.n - len(CARRIERS[name]))
        weights = {'none': (), 'all 1': (1.0,) * arm.n, f'carrier {HEAVY:g}': heavy}
        settings = {key: SolveOptions(deadline=0.0, joint_weights=value) for key, value in weights.items()}
        found = {key: np.empty((2, count, arm.n)) for key in settings}
        times = {key: np.empty(count) for key in settings}
        claimed = {key: np.empty(count, bool) for key in settings}
        for k in range(count):  # in turns, so that all meet the same load of the machine
            for key, options in settings.items():
                began = time.perf_counter()
                solution = solve(arm, targets[k], seeds[k], options)
                times[key][k] = time.perf_counter() - began
                found[key][0, k], claimed[key][k] = solution.q, solution.converged
                found[key][1, k] = solve(arm, nearby[k], seeds[k], options).q
        for key in settings:
            good = judge.solved(targets, found[key][0])
            wrong = int((claimed[key] & ~good).sum())
            moved = np.abs(found[key][1] - seeds)
            carrier, own = np.split(moved, [len(CARRIERS[name])], axis=1)
            rows.append([
                f'{robot} on a {name}', str(arm.n), key, f'{100 * good.mean():.2f}', str(wrong),
                f'{1e6 * np.median(times[key]):.1f}', f'{np.median(times[key] / times["none"]):.2f}',
                f'{np.median(carrier.max(axis=1)):.4f}', f'{np.median(own.max(axis=1)):.3f}',
            ])  # fmt: skip
    return rows


