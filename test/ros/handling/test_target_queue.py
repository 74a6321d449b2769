"""Turns of targets, without DDS: an executor that keeps what it is to call, and timers that go off when told to."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest

from ros_ik_pkg.ros.handling import target_queue
from ros_ik_pkg.ros.handling.target_queue import TargetQueue

WITH_TRANSFORM = b'transform'  # in targets that need one


class Turns:
    """A queue, what it handled and answered, and what waits on the executor."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.tasks, self.looks, self.handled, self.answers = [], [], [], []
        self.transform_is_there = False
        monkeypatch.setattr(target_queue, 'OneShot', self._timer)
        node = SimpleNamespace(executor=SimpleNamespace(create_task=self.tasks.append))
        self.queue = TargetQueue(node, self._handle, self._answer, self._give_up)

    def _timer(self, node, delay, callback):
        return SimpleNamespace(start=lambda: self.looks.append(callback))

    def _handle(self, data: bytes, waited: float):
        assert waited >= 0.0
        self.handled.append(data)
        if WITH_TRANSFORM in data and not self.transform_is_there:
            return None
        return f'solved {data.decode()}'

    def _give_up(self, data: bytes, status: str, why: str) -> str:
        return f'{status} {data.decode()}'

    def _answer(self, result: str, arrived: float) -> bool:
        self.answers.append(result)
        return result.startswith('solved') and 'bad' not in result

    def put(self, *targets: bytes) -> None:
        for data in targets:
            self.queue.put(data)

    def all_else_has_its_turn(self) -> None:
        self.queue.all_had_their_turn(time.perf_counter())

    def look(self) -> None:
        (callback,) = self.looks
        self.looks.clear()
        callback()


@pytest.fixture
def turns(monkeypatch):
    return Turns(monkeypatch)


def test_a_target_is_handled_at_once_if_all_else_had_its_turn_since_the_last_one(turns):
    turns.put(b'1')
    turns.all_else_has_its_turn()
    turns.put(b'2')
    assert turns.answers == ['solved 1', 'solved 2'] and not turns.tasks


def test_else_the_newest_is_handled_once_behind_all_that_has_arrived(turns):
    turns.put(b'1', b'2', b'3')
    assert turns.answers == ['solved 1']
    (task,) = turns.tasks
    turns.put(b'4')
    task()
    assert turns.answers == ['solved 1', 'solved 4'] and len(turns.tasks) == 1


def test_what_had_its_turn_before_the_last_target_ended_does_not_count(turns):
    before = time.perf_counter()
    turns.put(b'1')
    turns.queue.all_had_their_turn(before)
    turns.put(b'2')
    assert turns.answers == ['solved 1'] and len(turns.tasks) == 1


def test_a_target_waits_for_its_transform_and_is_answered_once(turns):
    turns.put(b'transform 1')
    turns.look()
    assert not turns.answers
    turns.transform_is_there = True
    turns.look()
    assert turns.answers == ['solved transform 1'] and not turns.looks


def test_behind_a_target_that_waits_only_the_newest_that_must_wait_is_kept(turns):
    for data in (b'transform 1', b'transform 2', b'transform 3'):
        turns.put(data)
        turns.all_else_has_its_turn()
    assert len(turns.looks) == 1
    turns.transform_is_there = True
    turns.look()
    assert turns.answers == ['solved transform 1', 'solved transform 3']


def test_a_newer_command_refuses_the_target_that_waits_and_drops_those_behind_it(turns):
    for data in (b'transform 1', b'transform 2', b'3'):
        turns.put(data)
        turns.all_else_has_its_turn()
    assert turns.answers == ['solved 3', 'superseded transform 1']
    turns.transform_is_there = True
    turns.look()
    assert len(turns.answers) == 2


def test_a_newer_target_without_a_command_leaves_the_one_that_waits(turns):
    for data in (b'transform 1', b'bad 2'):
        turns.put(data)
        turns.all_else_has_its_turn()
    turns.transform_is_there = True
    turns.look()
    assert turns.answers == ['solved bad 2', 'solved transform 1']


def test_at_the_end_the_target_that_waits_is_refused(turns):
    turns.put(b'transform 1')
    turns.queue.close()
    assert turns.answers == ['shutdown transform 1']


def test_an_error_in_handling_does_not_stop_the_next_target(turns, monkeypatch):
    monkeypatch.setattr(turns.queue, '_handle', lambda data, waited: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        turns.put(b'1')
    monkeypatch.setattr(turns.queue, '_handle', turns._handle)
    turns.all_else_has_its_turn()
    turns.put(b'2')
    assert turns.answers == ['solved 2']
