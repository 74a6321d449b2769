"""When two configurations count as one solution."""

from __future__ import annotations

import numpy as np
from numerics import get_arm

from ros_ik_pkg.ik.search.solutions import SAME_SOLUTION, same_solution

TURN = 2.0 * np.pi


def test_solutions_that_differ_by_whole_turns_are_one_where_joints_may_turn_round():
    arm = get_arm('ur5')
    assert arm.wraps.all()
    for i in range(arm.n):
        for turns in (-2, -1, 0, 1, 2):
            for gap in (-0.9 * SAME_SOLUTION, 0.0, 0.9 * SAME_SOLUTION):
                other = arm.home.copy()
                other[i] += turns * TURN + gap
                assert same_solution(arm.geometry, arm.home, other) and same_solution(arm.geometry, other, arm.home)


def test_other_differences_make_two_solutions():
    for name in ('ur5', 'panda'):
        arm = get_arm(name)
        for i in range(arm.n):
            for gap in (1.1 * SAME_SOLUTION, 0.1, np.pi, TURN - 0.1, *(() if arm.wraps[i] else (TURN,))):
                for sign in (-1.0, 1.0):
                    other = arm.home.copy()
                    other[i] += sign * gap
                    assert not same_solution(arm.geometry, arm.home, other)
