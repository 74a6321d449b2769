"""Where descents for wished rows begin, and what they must not miss: configurations that are known to be near.

A configuration of the arm whose pose is turned by an angle holds the position and misses the orientation by that angle,
so a solution misses it by no more. This judge needs no optimiser.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from numerics import random_configurations

from ros_ik_pkg.ik import SolveOptions, load_arm, solve
from ros_ik_pkg.ik.search.ordered_starts import COUNT, POSE, SLOPES, score_ordered_starts

CALM = SolveOptions(deadline=0.0)
AS_NEAR = 1.01
# A waist, three parallel axes and a roll; the same without the last axis; and on a base far from the origin, with
# a roll that is far from symmetric.
DESK = """name: desk
source: made up
convention: standard
angles: degrees
base_frame: base
tip_frame: tip
home: [0, 60, -60, 0, 0]
joints:
  - {name: waist, type: revolute, a: 0, alpha: 90, d: 0.12, theta: 0, lower: -170, upper: 170}
  - {name: shoulder, type: revolute, a: 0.25, alpha: 0, d: 0, theta: 0, lower: -20, upper: 180}
  - {name: elbow, type: revolute, a: 0.22, alpha: 0, d: 0, theta: 0, lower: -150, upper: 150}
  - {name: wrist, type: revolute, a: 0, alpha: 90, d: 0, theta: 90, lower: -110, upper: 110}
  - {name: roll, type: revolute, a: 0, alpha: 0, d: 0.15, theta: 0, lower: -175, upper: 175}
"""
# No two axes are parallel, and none of the last three meet in a point.
SKEW = """name: skew
source: made up
convention: standard
angles: degrees
base_frame: base
tip_frame: tip
home: [0, 30, -40, 20, 0]
joints:
  - {name: a, type: revolute, a: 0.05, alpha: 80, d: 0.2, theta: 0, lower: -170, upper: 170}
  - {name: b, type: revolute, a: 0.3, alpha: 20, d: 0.05, theta: 0, lower: -120, upper: 120}
  - {name: c, type: revolute, a: 0.25, alpha: -70, d: 0, theta: 0, lower: -150, upper: 150}
  - {name: d, type: revolute, a: 0.08, alpha: 60, d: 0.1, theta: 0, lower: -170, upper: 170}
  - {name: e, type: revolute, a: 0.02, alpha: 10, d: 0.1, theta: 0, lower: -170, upper: 170}
"""


@pytest.fixture(scope='module')
def arms(tmp_path_factory):
    """Return arms of four kinds by name."""
    folder = tmp_path_factory.mktemp('arms')
    tables = {'desk': DESK, 'skew': SKEW}
    tables['aside'] = DESK.replace('lower: -175', 'lower: -40') + 'base: {xyz: [0.3, -0.8, 0.2], rpy: [20, 35, -50]}\n'
    tables['four'] = ''.join(line for line in DESK.splitlines(True) if 'roll' not in line)
    tables['four'] = tables['four'].replace('home: [0, 60, -60, 0, 0]', 'home: [0, 60, -60, 0]')
    for name, table in tables.items():
        (folder / f'{name}.yaml').write_text(table)
    return {'so101': load_arm('so101')} | {name: load_arm(folder / f'{name}.yaml') for name in tables}


def error_of(arm, q, target):
    """Return the errors of position [m] and orientation [rad] by Pinocchio."""
    data, whole = arm.model.createData(), np.zeros(arm.model.nq)
    whole[: arm.n] = q
    pin.framesForwardKinematics(arm.model, data, whole)
    tip = data.oMf[arm.model.getFrameId(arm.tip_frame)]
    return np.linalg.norm(target[:3, 3] - tip.translation), np.linalg.norm(pin.log3(target[:3, :3] @ tip.rotation.T))


def missed(arm, configurations, turns):
    """Return how many solutions miss the pose of a configuration, turned by a rotation vector in its tip frame, by more
    than that configuration does."""
    count = 0
    for q, turn in zip(configurations, turns):
        target = arm.forward(q)
        target[:3, :3] = target[:3, :3] @ pin.exp3(turn)
        solution = solve(arm, target, options=CALM)
        position, orientation = error_of(arm, solution.q, target)
        assert solution.converged and position <= 1e-5
        count += orientation > AS_NEAR * np.linalg.norm(turn) + 1e-5
    return count


def turns_by(rng, angle, count):
    """Draw rotation vectors of one length [rad]."""
    axes = rng.normal(size=(count, 3))
    return angle * axes / np.linalg.norm(axes, axis=1, keepdims=True)


@pytest.mark.parametrize('name', ['so101', 'desk', 'aside', 'four', 'skew'])
def test_what_is_near_is_found(arms, name):
    rng = np.random.default_rng(20)
    assert missed(arms[name], random_configurations(arms[name], rng, 200), turns_by(rng, 0.5, 200)) == 0


@pytest.mark.parametrize('name', ['so101', 'desk', 'four', 'skew'])
def test_what_is_near_at_a_joint_limit_is_found(arms, name):
    arm, rng = arms[name], np.random.default_rng(21)
    configurations = np.array(random_configurations(arm, rng, 200))
    for k, q in enumerate(configurations):
        q[k % arm.n] = (arm.lower, arm.upper)[k // arm.n % 2][k % arm.n]
    assert missed(arm, configurations, turns_by(rng, 0.5, 200)) <= 1


def test_the_best_orientation_of_a_stretched_elbow_is_found(arms):
    # The wrist cannot be further out, so the tool cannot turn further: the position bends the motion most there.
    arm, rng = arms['desk'], np.random.default_rng(22)
    configurations = np.array(random_configurations(arm, rng, 100))
    configurations[:, 2] = 0.0
    pitch = np.array([0.0, 0.6, 0.0]) * np.where(np.arange(100) % 2, 1.0, -1.0)[:, None]
    roll = configurations[:, 4]
    turns = np.array([pin.exp3(np.array([0.0, 0.0, -angle])) @ turn for angle, turn in zip(roll, pitch)])
    assert missed(arm, configurations, turns) == 0


@pytest.mark.parametrize('end', ['lower', 'upper'])
def test_the_last_joint_ends_at_the_limit_that_is_nearer(arms, end):
    arm, rng = arms['so101'], np.random.default_rng(23)
    configurations = np.array(random_configurations(arm, rng, 100))
    configurations[:, 4] = getattr(arm, end)[4]
    axis = np.array([0.0, 0.0, 0.3 if end == 'upper' else -0.3])  # beyond the limit; the other one is 0.4 rad further
    assert missed(arm, configurations, np.tile(axis, (100, 1))) == 0


@pytest.mark.parametrize('name', ['so101', 'skew'])
def test_a_start_knows_how_the_tip_turns_on_its_way_to_a_position(arms, name):
    arm = arms[name]
    starts, free = arm.ordered_starts
    n, step = arm.n, np.array([1e-3, 0.0 if free[0] else 1e-3, -1e-3])
    origin = arm.geometry.placements[0, 9:]
    turned = arm.geometry.placements[0, :9].reshape(3, 3)

    def ahead(q):
        """Return position and rotation in the frame of the first joint, turned to the azimuth 0."""
        pose = arm.forward(q)
        if not free[0]:
            return pose[:3, 3], pose[:3, :3]
        x, y, z = turned.T @ (pose[:3, 3] - origin)
        back = pin.exp3(np.array([0.0, 0.0, -np.arctan2(y, x)]))
        return np.array([np.hypot(x, y), 0.0, z]), back @ turned.T @ pose[:3, :3]

    led = 0
    for k in range(0, COUNT, 37):
        q = starts[:n, k].astype(float)
        slopes = starts[n + POSE + SLOPES :, k].reshape(3, n).astype(float)
        p, R = ahead(q)
        if free[0] and p[0] < 0.1:  # near the first axis a small motion is a large turn
            continue
        moved, other = ahead(q + step @ slopes)
        if np.linalg.norm(moved - p - step) > 2e-4:  # nearly singular: it does not trust its slopes
            continue
        w, x, y, z = starts[n + 3 : n + 7, k] + step @ starts[n + POSE : n + POSE + SLOPES, k].reshape(3, 4)
        said = pin.Quaternion(w, x, y, z).normalized().toRotationMatrix()
        assert np.linalg.norm(pin.log3(said @ other.T)) < 0.02 * np.linalg.norm(pin.log3(other @ R.T)) + 2e-4
        led += 1
    assert led > 20


@pytest.mark.parametrize('name', ['so101', 'aside', 'four', 'skew'])
def test_the_score_is_the_angle_that_is_left_and_how_far_the_position_is(arms, name):
    arm, rng = arms[name], np.random.default_rng(24)
    starts, free = arm.ordered_starts
    n, whole = arm.n, starts.astype(float)
    ranges, middles = 0.5 * (arm.upper - arm.lower), 0.5 * (arm.upper + arm.lower)
    scores = np.empty(starts.shape[1], np.float32)
    slopes = whole[n + POSE : n + POSE + SLOPES].reshape(3, 4, -1)
    for k in range(0, COUNT, 50):
        p, azimuth = whole[n : n + 3, k] + rng.normal(scale=0.03, size=3), rng.uniform(-4.0, 4.0)
        a, b = np.linalg.qr(rng.normal(size=(4, 2)))[0].T
        goal = tuple(p), tuple(a), tuple(b if free[1] else 0.0 * b), azimuth
        score_ordered_starts(arm.geometry, starts, free, goal, scores)
        dp = p[:, None] - whole[n : n + 3]
        led = whole[n + 3 : n + 7] + np.einsum('im,ijm->jm', dp, slopes)
        u, v = a @ led, goal[2] @ led
        angle = np.arctan2(np.abs(v), np.abs(u))  # of the last joint, halved, from the middle of its range
        spare = 0.5 * ranges[-1] if free[1] and ranges[-1] < np.pi else 0.5 * np.pi
        cosine = np.hypot(u, v) * np.cos(np.maximum(angle - spare, 0.0)) / np.linalg.norm(led, axis=0)
        beyond = np.zeros(len(scores))
        if free[0] and 2.0 * ranges[0] < 2.0 * np.pi:
            sign = arm.geometry.multiplier[0]
            gap = azimuth - sign * (middles[0] - whole[0]) - whole[n + 7]
            gap -= 2.0 * np.pi * np.floor(gap / (2.0 * np.pi) + 0.5)
            beyond = p[0] * np.maximum(np.abs(gap) - ranges[0], 0.0)
        far = ((dp**2).sum(axis=0) + beyond**2) / free[3] ** 2
        np.testing.assert_allclose(scores, far**2 + 1.0 - cosine**2, rtol=2e-3, atol=2e-4)
