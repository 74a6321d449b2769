"""Timers: each is called once when it is due, whatever others do."""

from __future__ import annotations

import time

from ros_helpers import allow_lark

from ros_ik_pkg.ros.runtime.spin import make_executor
from ros_ik_pkg.ros.runtime.timers import OneShot, steady_timer
from ros_ik_pkg.tools.processes import ros_node

pytestmark = allow_lark

PERIOD = 0.5  # s


def test_a_timer_that_is_late_is_called_once_however_often_another_is_started_meanwhile():
    periodic, once = [], []
    with ros_node('timers') as node:
        steady_timer(node, PERIOD, lambda: periodic.append(time.monotonic()))
        one_shot = OneShot(node, 0.0005, lambda: once.append(time.monotonic()))
        executor = make_executor()
        executor.add_node(node)

        def keep_busy() -> None:
            for _ in range(20):  # as targets do that come one after the other
                time.sleep(1.2 * PERIOD / 20)
                one_shot.start()

        executor.spin_once(timeout_sec=0.0)
        executor.create_task(keep_busy)
        began = time.monotonic()
        while not periodic or time.monotonic() < periodic[0] + 0.2 * PERIOD:
            assert time.monotonic() < began + 60.0
            executor.spin_once(timeout_sec=0.01)
        executor.shutdown()
    # A busy machine may be so late that the next period has begun.
    assert len(periodic) <= 1 + int((time.monotonic() - began - PERIOD) / PERIOD)
    assert 1 <= len(once) <= 20


def test_a_one_shot_timer_calls_once_for_each_start_and_not_after_a_cancel():
    calls = []
    with ros_node('timers') as node:
        one_shot = OneShot(node, 0.001, lambda: calls.append(one_shot.overdue()))
        executor = make_executor()
        executor.add_node(node)

        def spin(seconds: float) -> None:
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                executor.spin_once(timeout_sec=0.01)

        spin(0.1)
        assert not calls
        for count in (1, 2):
            one_shot.start()
            while len(calls) < count:
                executor.spin_once(timeout_sec=0.01)
            spin(0.05)
            assert len(calls) == count
        one_shot.start()
        one_shot.cancel()
        spin(0.1)
        assert len(calls) == 2
        executor.shutdown()
