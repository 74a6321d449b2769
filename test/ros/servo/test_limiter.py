"""Limiters of commands, judged by differences of what they put out and by Ruckig's own trajectories."""

from __future__ import annotations

import numpy as np
import pytest
from smooth_commands import ROUNDING, assert_within_limits

from ros_ik_pkg.ros.servo import limiter as limiters
from ros_ik_pkg.ros.servo.limiter import Motion, MotionLimits, make_limiter

PERIODS = (0.001, 0.002, 0.02)  # s
STILL = np.zeros(3)


def limits(joints=3, reach=2.5, velocity=2.0, acceleration=10.0, jerk=100.0) -> MotionLimits:
    return MotionLimits(*(np.full(joints, value) for value in (-reach, reach, velocity, acceleration, jerk)))


@pytest.fixture(params=['own', 'ruckig'])
def smoothing(request) -> str:
    if request.param == 'ruckig':
        pytest.importorskip('ruckig')
    return request.param


def moving(position, velocity) -> Motion:
    """Return a target of constant velocity."""
    return Motion(position, velocity, *np.zeros((2, len(position))))


def wild_commands(limiter, limits, rng, count: int) -> np.ndarray:
    """Return commands (count, n) for targets that leap, run, tremble, leave the limits, and pauses in between."""
    n = len(limits.lower)
    target, velocity, commands = np.zeros(n), np.zeros(n), [limiter.position]
    halting = False
    for _ in range(count):
        if rng.random() < 0.01:
            target = rng.uniform(1.2 * limits.lower, 1.2 * limits.upper)
            velocity = rng.uniform(-1.3, 1.3, n) * limits.velocity * (rng.random() < 0.5)
        if rng.random() < 0.2:
            target = target + rng.normal(size=n) * 10.0 ** rng.uniform(-9, -2)
        if rng.random() < 0.003:
            halting = not halting
        commands.append(limiter.halt() if halting else limiter.advance(moving(target, velocity)))
        target = target + velocity * limiter.period
    return np.array(commands)


@pytest.mark.parametrize('period', PERIODS)
@pytest.mark.parametrize('jerk', [20.0, 100.0, 5000.0])
def test_no_target_makes_a_command_break_a_limit(smoothing, period, jerk):
    bounds = limits(jerk=jerk)
    limiter = make_limiter(smoothing, bounds, period, STILL)
    assert_within_limits(wild_commands(limiter, bounds, np.random.default_rng(0), 6000), bounds, period)


def test_limits_of_every_size_are_kept(smoothing):
    rng = np.random.default_rng(1)
    for _ in range(20):
        size = 10.0 ** rng.uniform(-1.5, 1.5, (4, 3))
        bounds = MotionLimits(-size[0], size[0], *size[1:])
        limiter = make_limiter(smoothing, bounds, 0.005, STILL)
        assert_within_limits(wild_commands(limiter, bounds, rng, 500), bounds, 0.005)


@pytest.mark.parametrize('distance', [1e-6, 1e-3, 0.1, 1.0, 4.0])
def test_a_target_at_rest_is_reached_and_never_passed(smoothing, distance):
    bounds = limits()
    limiter = make_limiter(smoothing, bounds, 0.002, np.full(3, -2.0))
    target = np.full(3, -2.0 + distance)
    commands = np.array([limiter.advance(Motion.rest(target)) for _ in range(1500)])
    assert np.all(commands <= target + 1e-8)
    assert np.all(np.abs(commands[-1] - target) <= 1e-9)
    assert np.abs(limiter.velocity).max() <= 1e-9


@pytest.mark.parametrize('seed', range(30))
def test_the_own_limiter_needs_no_longer_than_ruckig(seed):
    ruckig = pytest.importorskip('ruckig')
    rng = np.random.default_rng(seed)
    bounds, period = limits(1, *10.0 ** rng.uniform(-1, 1, 4)), 0.001
    limiter = make_limiter('own', bounds, period, np.zeros(1))
    for _ in range(rng.integers(0, 300)):  # a state in motion
        limiter.advance(Motion.rest(0.9 * bounds.upper))
    target = rng.uniform(0.8 * bounds.lower, 0.8 * bounds.upper)
    asked = ruckig.InputParameter(1)
    asked.current_position, asked.current_velocity = limiter.position.tolist(), limiter.velocity.tolist()
    asked.current_acceleration, asked.target_position = limiter.acceleration.tolist(), target.tolist()
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = (
        bounds.velocity.tolist(), bounds.acceleration.tolist(), bounds.jerk.tolist()
    )  # fmt: skip
    trajectory = ruckig.Trajectory(1)
    assert ruckig.Ruckig(1).calculate(asked, trajectory) == ruckig.Result.Working
    most = int(trajectory.duration / period) + 4  # a period at each change of jerk
    steps = 0
    while np.abs(limiter.advance(Motion.rest(target)) - target).max() > 1e-9 or not limiter.at_rest:
        steps += 1
        assert steps <= most


def test_a_moving_target_is_followed_without_stop_and_go(smoothing):
    limiter = make_limiter(smoothing, limits(), 0.002, STILL)
    velocity = np.array([0.1, -0.5, 1.2])
    for k in range(700):
        command = limiter.advance(moving(velocity * k * 0.002, velocity))
        if k > 500:
            assert np.allclose(limiter.velocity, velocity, rtol=0.0, atol=1e-8)
            assert np.allclose(command, velocity * (k + 1) * 0.002, rtol=0.0, atol=1e-8)


def test_a_target_within_the_limits_is_copied_once_it_is_reached(smoothing):
    period, rate = 0.002, 2.0 * np.pi * np.array([0.2, 0.5, 0.9])
    limiter, target, worst = make_limiter(smoothing, limits(), period, STILL), Motion.rest(STILL), 0.0
    for k in range(1500):
        jerk = -0.1 * rate**3 * np.cos(rate * k * period)
        command = limiter.advance(target._replace(jerk=jerk))
        target = target._replace(jerk=jerk).after(period)
        worst = max(worst, np.abs(command - target.position).max()) if k > 500 else 0.0
    assert worst < 1e-8 and np.abs(limiter.velocity).max() > 0.01


def test_a_halt_ends_in_the_time_that_it_names(smoothing):
    bounds, rng = limits(), np.random.default_rng(2)
    for _ in range(20):
        limiter = make_limiter(smoothing, bounds, 0.002, STILL)
        wild_commands(limiter, bounds, rng, int(rng.integers(10, 400)))
        for _ in range(int(np.ceil(limiter.time_to_rest / 0.002)) + 1):
            limiter.halt()
        assert limiter.at_rest


def test_a_halt_is_the_shortest_within_acceleration_and_jerk():
    limiter = make_limiter('own', limits(1), 0.001, np.zeros(1))
    while limiter.velocity[0] < 2.0 - 1e-3 or limiter.acceleration[0] > 1e-3:
        limiter.advance(Motion.rest(np.array([2.5]))) if limiter.position[0] < 1 else pytest.fail('not fast enough')
    assert limiter.time_to_rest == pytest.approx(2.0 / 10.0 + 10.0 / 100.0, rel=1e-2)  # v/a + a/j


def test_a_target_beyond_a_limit_leaves_the_joint_at_the_limit(smoothing):
    bounds = limits()
    limiter = make_limiter(smoothing, bounds, 0.002, STILL)
    for _ in range(1500):
        limiter.advance(moving(np.full(3, 3.0), np.full(3, 1.0)))
    assert np.allclose(limiter.position, bounds.upper, rtol=0.0, atol=1e-8)
    assert np.abs(limiter.velocity).max() <= 1e-6


def test_a_joint_outside_its_limits_moves_inwards_alone(smoothing):
    limiter = make_limiter(smoothing, limits(), 0.002, np.array([2.7, -2.6, 0.0]))
    commands = np.array([limiter.advance(Motion.rest(np.array([3.0, -3.0, 0.0]))) for _ in range(500)])
    assert np.all(commands[:, 0] <= 2.7) and np.all(commands[:, 1] >= -2.6)
    inwards = np.array([limiter.advance(Motion.rest(STILL)) for _ in range(1500)])
    assert np.all(np.diff(inwards[:, 0]) <= ROUNDING) and np.all(np.diff(inwards[:, 1]) >= -ROUNDING)
    assert np.allclose(inwards[-1], 0.0, rtol=0.0, atol=1e-9)


def test_without_smoothing_the_command_is_the_target_within_the_position_limits():
    limiter = make_limiter('none', limits(), 0.002, STILL)
    assert np.allclose(limiter.advance(Motion.rest(np.array([1.0, 3.0, -3.0]))), [1.0, 2.5, -2.5], rtol=0.0, atol=1e-8)
    assert np.array_equal(limiter.halt(), limiter.position) and limiter.at_rest


def test_without_ruckig_the_own_limiter_stands_in_and_says_so(monkeypatch):
    monkeypatch.setattr(limiters, 'ruckig', None)
    assert make_limiter('ruckig', limits(), 0.002, STILL).name == 'own'
