"""Steps within the velocity limits: never further than they may go, within the limits, on the way to the goal."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numerics import law
from rclpy.clock import ROSClock
from rclpy.time import Time

from ros_ik_pkg.ros.handling.velocity_limiting import StepError, StepTimer, limited_step, reach_of_step, travel_time

ROUNDING = 1e-14
INF = np.inf
MODES = ('whole', 'joint')


@st.composite
def steps(draw):
    """Draw limits, a start and a goal within them, and how far each joint may go; sizes from nothing to huge."""
    n = draw(st.integers(1, 8))
    ranges = (-10, 0), (0, 10), (0, 1), (0, 1)
    lower, upper, start, goal = (
        np.array(draw(st.lists(st.floats(*ends), min_size=n, max_size=n))) for ends in ranges
    )
    reach = st.one_of(st.floats(0.0, 2.0), st.just(INF), st.floats(0.0, 1e-300))
    width = upper - lower
    clipped = [np.clip(lower + share * width, lower, upper) for share in (start, goal)]
    return *clipped, np.array(draw(st.lists(reach, min_size=n, max_size=n))), lower, upper


@law
@given(step=steps(), mode=st.sampled_from(MODES))
def test_a_step_stays_within_reach_and_limits_and_leads_to_the_goal(step, mode):
    start, goal, reach, lower, upper = step
    q, fraction = limited_step(start, goal, reach, lower, upper, mode)
    assert (np.abs(q - start) <= reach + ROUNDING * (1.0 + np.abs(start))).all()
    assert (lower <= q).all() and (q <= upper).all()
    assert 0.0 <= fraction <= 1.0
    assert ((q - start) * (goal - start) >= 0.0).all()
    assert (np.abs(goal - q) <= np.abs(goal - start) + ROUNDING).all()
    if fraction == 1.0:
        np.testing.assert_array_equal(q, goal)


@law
@given(step=steps())
def test_a_step_as_a_whole_is_the_longest_on_the_straight_line(step):
    start, goal, reach, lower, upper = step
    q, fraction = limited_step(start, goal, reach, lower, upper, 'whole')
    np.testing.assert_allclose(q, start + fraction * (goal - start), atol=1e-12)
    if fraction < 1.0:
        assert (np.abs(q - start) >= reach * (1.0 - 1e-12) - 1e-12).any()


@law
@given(step=steps())
def test_a_step_joint_by_joint_takes_each_as_far_as_it_may_go(step):
    start, goal, reach, lower, upper = step
    q, _ = limited_step(start, goal, reach, lower, upper, 'joint')
    np.testing.assert_allclose(np.abs(q - start), np.minimum(reach, np.abs(goal - start)), atol=1e-12)


@law
@given(step=steps(), mode=st.sampled_from(MODES))
def test_steps_one_after_the_other_arrive_where_every_joint_may_move(step, mode):
    q, goal, reach, lower, upper = step
    reach = np.maximum(reach, 0.5)
    for _ in range(int(20.0 / 0.5) + 2):
        q, fraction = limited_step(q, goal, reach, lower, upper, mode)
    assert fraction == 1.0
    np.testing.assert_array_equal(q, goal)


@pytest.mark.parametrize('mode', MODES)
def test_from_outside_the_limits_a_step_leads_back_inside_or_there_is_none(mode):
    lower, upper, reach = np.zeros(2), np.ones(2), np.array([0.1, 0.1])
    q, _ = limited_step(np.array([1.05, 0.5]), np.array([0.5, 0.5]), reach, lower, upper, mode)
    assert 0.95 <= q[0] <= 1.0 and q[1] == 0.5
    with pytest.raises(StepError) as caught:
        limited_step(np.array([0.5, -0.2]), np.array([0.5, 0.5]), reach, lower, upper, mode)
    assert caught.value.joint == 1


def test_reach_is_limit_times_time_and_unbounded_without_a_limit():
    np.testing.assert_array_equal(reach_of_step(np.array([2.0, INF]), 0.5), [1.0, INF])
    np.testing.assert_array_equal(reach_of_step(np.array([2.0, INF]), 0.0), [0.0, INF])


def test_the_travel_time_is_that_of_the_slowest_joint():
    start, goal = np.zeros(3), np.array([1.0, -3.0, 100.0])
    assert travel_time(start, goal, np.array([1.0, 2.0, INF])) == 1.5
    assert travel_time(start, goal, np.full(3, INF)) == 0.0


@pytest.fixture
def clock():
    return ROSClock()


def test_the_first_step_and_one_after_a_pause_count_the_longest_time(clock):
    timer = StepTimer(clock)
    assert timer.elapsed(5.0, 0.1) == 0.1
    timer.step_taken(5.0)
    assert timer.elapsed(5.02, 0.1) == pytest.approx(0.02)
    assert timer.elapsed(50.0, 0.1) == 0.1
    timer.restart()
    assert timer.elapsed(5.02, 0.1) == 0.1


def test_time_is_steady_unless_it_is_simulated(clock):
    timer = StepTimer(clock)
    before = time.monotonic()
    assert before <= timer.now() <= time.monotonic()
    clock._set_ros_time_is_active(True)
    clock.set_ros_time_override(Time(seconds=7.5, clock_type=clock.clock_type))
    assert timer.now() == 7.5


def test_where_simulated_time_stands_still_no_time_has_gone_by_and_a_jump_back_begins_anew(clock):
    timer = StepTimer(clock)
    timer.step_taken(7.5)
    assert timer.elapsed(7.5, 0.1) == 0.0
    assert timer.elapsed(0.5, 0.1) == 0.1
