"""The motion of one joint within its limits: stops by numerical integration, and states that can always stop."""

from __future__ import annotations

import numpy as np
import pytest

from ros_ik_pkg.ik.motion.jerk_limited import advance, can_stop, halt, stop_distance, time_to_rest

LIMITS = np.array([[-1.0], [1.0], [2.0], [10.0], [100.0]])
FREE = np.array([[-np.inf], [np.inf], [2.0], [10.0], [100.0]])
FINE = 1e-5  # s


@pytest.mark.parametrize('seed', range(20))
def test_the_shortest_stop_ends_where_and_when_it_is_said_to(seed):
    rng = np.random.default_rng(seed)
    v, a = rng.uniform(-2.0, 2.0), rng.uniform(-10.0, 10.0)
    state = np.array([[0.0], [v], [a]])
    duration = time_to_rest(state, FREE)
    path = []
    for _ in range(int(duration / FINE) + 1):
        halt(state, FREE, FINE)
        path.append(state[:, 0].copy())
    path = np.array(path)
    assert np.array_equal(path[-1, 1:], [0.0, 0.0])
    assert path[-2, 1] != 0.0
    velocities = np.array([v, *path[:, 1]])
    assert path[-1, 0] == pytest.approx(0.5 * FINE * np.sum(velocities[1:] + velocities[:-1]), abs=1e-7)
    assert path[-1, 0] == pytest.approx(stop_distance(v, a, 10.0, 100.0), abs=1e-10)
    assert np.abs(np.diff(path[:, 2])).max() <= 100.0 * FINE + 1e-9
    assert np.abs(path[:, 2]).max() <= 10.0 + 1e-9


def test_whatever_the_target_a_stop_within_the_limits_remains_possible():
    rng, state = np.random.default_rng(0), np.zeros((3, 1))
    for _ in range(20000):
        target = rng.choice([np.inf, -np.inf, 1e9, *rng.uniform(-2.0, 2.0, 5)])
        for _ in range(rng.integers(1, 60)):
            wild = rng.uniform(-1.0, 1.0, 3) * (9.0, 20.0, 200.0)
            advance(state, np.array([target, *wild]).reshape(4, 1), LIMITS, 0.004)
            assert can_stop(state, LIMITS)


@pytest.mark.parametrize(
    'state',
    [(1.1, 0.0, 0.0), (0.9, 1.9, 0.0), (0.0, 1.9, 9.0), (0.0, 0.0, 11.0), (-0.95, -1.0, 0.0), (0.0, -2.1, 0.0)],
)
def test_a_state_from_which_no_stop_is_within_the_limits_is_told(state):
    assert not can_stop(np.array(state).reshape(3, 1), LIMITS)
    assert can_stop(np.zeros((3, 1)), LIMITS)
