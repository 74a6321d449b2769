"""The node with simulated time, whatever that does."""

from __future__ import annotations

import pytest
from ros_helpers import allow_lark

from ros_ik_pkg.ik import load_arm
from torture import faults


@pytest.mark.newest
@allow_lark
def test_simulated_time_may_stand_still_and_jump_back():
    assert faults.clock_jumps(load_arm('puma560')).fault == ''
