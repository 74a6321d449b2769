"""Times along a joint path: limits kept between the rows too, and about as fast as toppra."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from scipy.interpolate import BPoly

from ros_ik_pkg.ik.path.timing import time_path

VELOCITY, ACCELERATION = np.array([1.0, 2.0, 0.5]), np.array([3.0, 2.0, 4.0])


def curve(count, random):
    s = np.linspace(0.0, 1.0, count)[:, None]
    return sum(random.normal(size=3) * np.sin(k * s + random.uniform(0.0, 6.0, 3)) for k in (1, 2, 4))


def time_curve(q, least=None, stops=()):
    rests = np.zeros(len(q), bool)
    rests[[0, -1, *stops]] = True
    return time_path(q, rests, np.zeros(len(q) - 1) if least is None else least, VELOCITY, ACCELERATION)


def trajectory(q, durations, v, a):
    """The motion as joint trajectory controllers see it, by SciPy."""
    times = np.concatenate([[0.0], np.cumsum(durations)])
    return times, BPoly.from_derivatives(times, np.stack([q, v, a], axis=1))


@pytest.mark.parametrize('count', [2, 3, 5, 300])
@pytest.mark.parametrize('seed', range(5))
def test_limits_hold_on_a_grid_ten_times_as_fine(count, seed):
    q = curve(count, np.random.default_rng(seed))
    times, motion = trajectory(q, *time_curve(q))
    grid = np.interp(np.arange(10 * count - 9) / 10.0, np.arange(count), times)
    assert (np.abs(motion(grid, 1)) <= VELOCITY * (1.0 + 1e-6)).all()
    assert (np.abs(motion(grid, 2)) <= ACCELERATION * (1.0 + 1e-6)).all()
    # and close to one of them somewhere: it could not all be faster
    assert max((np.abs(motion(grid, 1)) / VELOCITY).max(), (np.abs(motion(grid, 2)) / ACCELERATION).max()) > 0.95


def test_velocities_and_accelerations_are_continuous_and_zero_at_rests():
    q = curve(50, np.random.default_rng(3))
    durations, v, a = time_curve(q, stops=[20])
    assert (v[[0, 20, -1]] == 0.0).all() and (a[[0, 20, -1]] == 0.0).all()
    times, motion = trajectory(q, durations, v, a)
    # In the inside of a stretch it is a cubic spline: the polynomial of the third degree is the same.
    inside = np.concatenate([np.arange(2, 18), np.arange(23, 47)])
    middle = 0.5 * (times[inside] + times[inside + 1])
    cubic = BPoly.from_derivatives(times, np.stack([q, v], axis=1))
    np.testing.assert_allclose(motion(middle), cubic(middle), atol=1e-9)


@pytest.mark.parametrize('seed', range(5))
def test_the_time_is_that_of_toppra_within_a_tenth(seed):
    toppra = pytest.importorskip('toppra')
    logging.getLogger('toppra').setLevel(logging.ERROR)
    q = curve(400, np.random.default_rng(seed))
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    limits = [
        toppra.constraint.JointVelocityConstraint(np.stack([-VELOCITY, VELOCITY], axis=1)),
        toppra.constraint.JointAccelerationConstraint(np.stack([-ACCELERATION, ACCELERATION], axis=1)),
    ]
    judge = toppra.algorithm.TOPPRA(
        limits, toppra.SplineInterpolator(s, q), gridpoints=s, parametrizer='ParametrizeConstAccel'
    )
    expected = judge.compute_trajectory(0.0, 0.0).duration
    assert 0.99 * expected <= time_curve(q)[0].sum() <= 1.1 * expected


def test_a_step_between_two_rests_takes_as_long_as_alone():
    q = curve(60, np.random.default_rng(2))
    q[30:] += (2.0, -1.0, 0.5)
    durations, v, a = time_curve(q, stops=[29, 30])
    expected, _, _ = time_curve(q[29:31])
    np.testing.assert_allclose(durations[29], expected[0], rtol=0.1)
    times, motion = trajectory(q, durations, v, a)
    grid = np.linspace(0.0, times[-1], 2000)
    assert (np.abs(motion(grid, 1)) <= VELOCITY * (1.0 + 1e-3)).all()


def test_no_interval_is_shorter_than_it_may_be():
    q = curve(100, np.random.default_rng(1))
    least = np.full(99, 0.2)
    durations, _, _ = time_curve(q, least)
    assert (durations >= least).all()
    assert np.median(durations) < 0.21
