"""The thread for what is not urgent: all jobs where there is time, the newest where there is not, none lost unseen."""

from __future__ import annotations

import threading
import time

import pytest

from ros_ik_pkg.ros.runtime import background_worker as module
from ros_ik_pkg.ros.runtime.background_worker import BackgroundWorker

TIMEOUT = 20.0  # s
NEVER = 1e6  # s


class Log:
    """Stands where a node's logger would; the worker needs nothing else of a node."""

    def __init__(self) -> None:
        self.errors: list[str] = []

    def get_logger(self) -> Log:
        return self

    def error(self, text: str, throttle_duration_sec: float) -> None:
        self.errors.append(text)


class Jobs:
    """Jobs that were done, in their order, and when they began; the first may be held up."""

    def __init__(self) -> None:
        self.done, self.began = [], []
        self.begun, self.may_go_on = threading.Event(), threading.Event()
        self.may_go_on.set()
        self._changed = threading.Condition()

    def do(self, job) -> None:
        self.began.append(time.monotonic())
        self.begun.set()
        assert self.may_go_on.wait(TIMEOUT)
        if isinstance(job, Exception):
            raise job
        with self._changed:
            self.done.append(job)
            self._changed.notify()

    def wait_for(self, count: int) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.done) >= count, TIMEOUT), self.done


@pytest.fixture
def jobs():
    return Jobs()


@pytest.fixture
def log():
    return Log()


@pytest.fixture
def make(jobs, log):
    """Make workers that are closed in the end."""
    made: list[BackgroundWorker] = []

    def make(capacity: int) -> BackgroundWorker:
        made.append(BackgroundWorker(log, 'test', jobs.do, capacity))
        return made[-1]

    yield make
    jobs.may_go_on.set()
    for worker in made:
        worker.close()


def test_every_job_is_done_in_order_where_there_is_time(make, jobs):
    worker = make(capacity=1)
    for number in range(20):
        worker.submit(number)
        jobs.wait_for(number + 1)
    assert jobs.done == list(range(20))
    assert worker.take_dropped() == 0


def test_of_more_jobs_than_may_wait_the_newest_are_done_and_the_others_counted(make, jobs):
    jobs.may_go_on.clear()
    worker = make(capacity=3)
    worker.submit('first')
    assert jobs.begun.wait(TIMEOUT)
    for number in range(10):
        worker.submit(number)
    jobs.may_go_on.set()
    jobs.wait_for(4)
    assert jobs.done == ['first', 7, 8, 9]
    assert worker.take_dropped() == 7 and worker.take_dropped() == 0


def test_an_error_in_a_job_is_logged_and_ends_nothing(make, jobs, log):
    worker = make(capacity=2)
    worker.submit(ValueError('of a job'))
    worker.submit('next')
    jobs.wait_for(1)
    assert jobs.done == ['next']
    assert 'of a job' in log.errors[0]


def test_while_targets_leave_no_gap_jobs_keep_their_distance(make, jobs, monkeypatch):
    monkeypatch.setattr(module, 'QUIET', NEVER)
    worker = make(capacity=10)
    for number in range(4):
        worker.submit(number)
    jobs.wait_for(4)
    assert all(later - earlier >= module.PERIOD for earlier, later in zip(jobs.began, jobs.began[1:]))


def test_a_job_begins_in_the_first_gap(make, jobs, monkeypatch):
    monkeypatch.setattr(module, 'PERIOD', NEVER)
    worker = make(capacity=10)
    for number in range(4):
        submitting = time.monotonic()
        worker.submit(number)
    jobs.wait_for(4)
    assert jobs.began[-1] >= submitting + module.QUIET


def test_closing_ends_the_thread_and_leaves_what_waits(make, jobs):
    jobs.may_go_on.clear()
    worker = make(capacity=3)
    worker.submit('first')
    assert jobs.begun.wait(TIMEOUT)
    worker.submit('second')
    closing = threading.Thread(target=worker.close)
    closing.start()
    jobs.may_go_on.set()
    closing.join(TIMEOUT)
    assert not closing.is_alive() and not [thread for thread in threading.enumerate() if thread.name == 'test']


def test_a_worker_without_jobs_has_no_thread(make):
    make(capacity=1).close()
    assert not [thread for thread in threading.enumerate() if thread.name == 'test']
