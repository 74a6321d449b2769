"""Compile the solver before it is needed: first what most targets need, in the background the rest, then streams.

As a program (`scripts/compile`) it fills the cache, after the installation or for a node that already solves targets.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import numpy as np

from ros_ik_pkg.ik.collision.look_ahead import contact_of_stop, gaps_of
from ros_ik_pkg.ik.kernel.cache_folder import CACHE_FOLDER, count_functions, is_writable
from ros_ik_pkg.ik.kernel.compiled import NOT_SAVED, translated
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN
from ros_ik_pkg.ik.kinematics.pose_error import pose_matrix
from ros_ik_pkg.ik.loading import load_arm
from ros_ik_pkg.ik.motion.jerk_limited import advance, can_stop, halt, time_to_rest
from ros_ik_pkg.ik.path.solve_path import solve_path
from ros_ik_pkg.ik.search.entry import solve_one, solve_range, solve_usual
from ros_ik_pkg.ik.search.final_check import passes
from ros_ik_pkg.ik.search.ordered_entry import solve_in_order
from ros_ik_pkg.ik.solver import DEFAULT_OPTIONS, use_usual
from ros_ik_pkg.ik.world import World

NOTICE_AFTER = 2.0  # s
MOVE_EVERY = 0.2  # s
LOOK_EVERY = 0.5  # s
IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)  # position [m] and quaternion x y z w
LOW_PRIORITY = 10  # nice: a tenth of the time that others get of a processor
HELPER = f'import sys; from {__name__} import main; sys.exit(main(["--quiet", "--low-priority"]))'
STREAM = (advance, can_stop, halt, time_to_rest, gaps_of, contact_of_stop)  # what a stream of commands calls
Report = Callable[[str], object]
CYLINDER = '<collision><geometry><cylinder radius="0.1" length="0.1"/></geometry></collision>'
TWO_CYLINDERS = (
    f'<robot name="warm_up"><link name="a">{CYLINDER}</link><link name="b">{CYLINDER}</link>'
    '<joint name="j" type="continuous"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/></joint></robot>'
)


def warm_up(report: Report = print) -> float:
    """Compile everything, or load it from the cache; return the seconds that it took.

    `report` is called with a sentence if it takes long, as it does once per machine, and if the compiled code cannot
    be kept.
    """
    began = time.monotonic()
    with _Notice(report, 'a minute'):
        compile_kinematics()
        compile_contact()
        solve_one.prepare()
        solve_range.prepare()
        solve_in_order.prepare()
    _report_oddities(report)
    return time.monotonic() - began


class Compilation:
    """Compiles the solver while a node runs: the usual solve at once, the rest at low priority.

    complete: whether the whole solver is compiled. stream_ready: whether all that a stream of commands calls is.
    """

    def __init__(self, report: Report) -> None:
        """Compile, or load, what most targets need, and begin with the rest."""
        self._report = report
        self._helper: subprocess.Popen[bytes] | None = None
        self._thread: threading.Thread | None = None
        self._closed = False
        self.complete, self.stream_ready = all_cached(), stream_cached()
        if not (self.complete and self.stream_ready) and CACHE_FOLDER is not None and is_writable(CACHE_FOLDER):
            # In a session of its own: Ctrl-C is for the node, which ends its helper.
            self._helper = subprocess.Popen([sys.executable, '-c', HELPER], start_new_session=True)
        try:
            self._prepare_first()
        except BaseException:
            self.close()
            raise
        self._thread = threading.Thread(target=self._finish, name='compilation')
        self._thread.start()

    def close(self) -> None:
        """Stop compiling."""
        self._closed = True
        if self._helper is not None:
            self._helper.terminate()
            self._helper.wait()
        if self._thread is not None:
            self._thread.join()

    def _prepare_first(self) -> None:
        with _Notice(self._report, '10 s before the first targets are answered, 40 s more for all'):
            use_usual(not self.complete)
            compile_kinematics()
            if self.stream_ready:
                compile_stream()
        _report_oddities(self._report)

    def _finish(self) -> None:
        """Load the rest from the cache, where it is or the helper puts it, and use that from now on."""
        began = time.monotonic()
        try:
            if not self.complete and self._helped(solve_one.is_cached):
                use_usual(False, alone=True)
                self._report(f'all methods are compiled, {time.monotonic() - began:.0f} s after the usual solve')
            if self.complete or self._helped(all_cached):
                compile_contact()
                solve_range.prepare()
                solve_in_order.prepare()
            if not (self.complete or self._closed):
                use_usual(False)
                self.complete = True
                self._report(f'all of the solver is compiled, {time.monotonic() - began:.0f} s after the usual solve')
            if not self.stream_ready and self._helped(stream_cached):
                compile_stream()
                self.stream_ready = True
        except Exception as error:
            self._report(f'not all of the solver could be compiled, {error}; targets that need it are refused')

    def _helped(self, cached: Callable[[], bool]) -> bool:
        """Wait until the cache holds something, or the helper has ended; return whether the node goes on."""
        while not self._closed and self._helper is not None and self._helper.poll() is None and not cached():
            time.sleep(LOOK_EVERY)
        return not self._closed


def all_cached() -> bool:
    """Return whether the cache holds all searches for one tip."""
    return all(entry.is_cached() for entry in (solve_one, solve_range, solve_in_order))


def stream_cached() -> bool:
    """Return whether the cache holds all that a stream of commands calls."""
    return all(function.is_cached() for function in STREAM)


def compile_stream() -> None:
    """Compile, or load, what a stream of commands calls, so that it never waits for that."""
    for function in STREAM:
        function.prepare()


def compile_kinematics() -> None:
    """Compile, or load, what an arm and the check of its solutions need besides the search."""
    arm = load_arm('planar3r')
    arm.forward(arm.home)
    passes(arm.packed, DEFAULT_OPTIONS.numbers, pose_matrix(*IDENTITY), arm.home)
    arm.jacobian(arm.home)


def compile_contact() -> None:
    """Compile, or load, what an arm with shapes needs besides the search."""
    shaped = load_arm(TWO_CYLINDERS)
    shaped.contacts.room(World(floor=-9.0)).least_clearance(shaped.home)


def compile_paths() -> None:
    """Compile, or load, what a path needs besides the search; of a redundant arm, because only that is smoothed."""
    arm = load_arm('panda')
    poses = np.stack([arm.forward(arm.home)] * 2)
    poses[1, 2, 3] += 0.01
    solve_path(arm, poses, arm.home)


class _Notice:
    """Reports that a compilation takes long, and on a terminal its progress."""

    def __init__(self, report: Report, duration: str) -> None:
        kept = 'once, kept for later starts' if CACHE_FOLDER else 'at every start: nothing can be written to keep it'
        text = f'compiling the solver for this machine, {duration}: {kept}'
        self._report, self._text = report, text
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> None:
        if all_cached():  # even so a start may take long
            self._done.set()
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()

    def _watch(self) -> None:
        """Report after a while, then update the line of progress until the end."""
        if self._done.wait(NOTICE_AFTER):
            return
        self._report(self._text)
        if not sys.stderr.isatty():
            return
        total = count_functions()
        while not self._done.wait(MOVE_EVERY):
            count = min(len(translated), total)
            print(f'\r  {count} of {total} functions compiled', end='', file=sys.stderr, flush=True)
        print('\r\033[K', end='', file=sys.stderr, flush=True)


def _report_oddities(report: Report) -> None:
    if WHY_PLAIN:
        report(f'{WHY_PLAIN}: plain Numba is used, which is slower')
    if NOT_SAVED:
        report(f'compiled code stays in memory, the next start compiles again: {NOT_SAVED[0]}')


def main(arguments: list[str] | None = None) -> int:
    """Fill the cache; 0 if all of it could be kept."""
    parser = argparse.ArgumentParser(prog='compile', description='Compile the solver and keep it for later starts.')
    parser.add_argument('--quiet', action='store_true', help='print nothing')
    parser.add_argument('--low-priority', action='store_true', help='only while nothing else needs a processor')
    given = parser.parse_args(arguments)
    say: Report = (lambda text: None) if given.quiet else print
    if CACHE_FOLDER is None:
        say('nothing can be written to NUMBA_CACHE_DIR, XDG_CACHE_HOME or ~/.cache')
        return 1
    with (CACHE_FOLDER / 'lock').open('w') as lock:  # the second of two processes loads what the first compiled
        fcntl.flock(lock, fcntl.LOCK_EX)
        if given.low_priority:
            compile_kinematics()  # the node needs both too, and compiles only the usual solve itself
            compile_contact()
            os.nice(LOW_PRIORITY)
        began = time.monotonic()
        warm_up(say)
        compile_stream()
        solve_usual.prepare()
        compile_paths()
        if not (given.low_priority or WHY_PLAIN):  # a node solves no batches
            from ros_ik_pkg.ik.batch.entry import solve_lanes

            solve_lanes.prepare()
    say(f'compiled in {time.monotonic() - began:.0f} s, kept in {CACHE_FOLDER}')
    return 1 if NOT_SAVED else 0


if __name__ == '__main__':
    sys.exit(main())
