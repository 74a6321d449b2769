"""The node with simulated time, whatever that does."""

from __future__ import annotations

import pytest
from ros_helpers import allow_lark

from ros_ik_pkg.ik import load_arm
from torture.clock import clock_jumps


@pytest.mark.newest
@allow_lark
def test_simulated_time_may_stand_still_and_jump_back():
    checks = list(clock_jumps(load_arm('puma560')))
    assert checks
    assert [check for check in checks if check.fault] == []
