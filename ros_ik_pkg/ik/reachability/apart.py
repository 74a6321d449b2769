"""A reach map made by another process, at low priority: neither its work nor its compiling holds up this one."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys

from ros_ik_pkg.ik.exceptions import IkError
from ros_ik_pkg.ik.reachability.reach_map import ReachMap, ReachProblem, solve_reach_problem

LOW_PRIORITY = 10  # nice: a tenth of the time that others get of a processor


class ReachProcess:
    """Makes the map of a problem; `result` waits for it, `end` ends it before."""

    def __init__(self, problem: ReachProblem) -> None:
        self._process = subprocess.Popen(
            [sys.executable, '-m', __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        )
        self._sent = pickle.dumps(problem)

    def result(self) -> ReachMap:
        """Return the map; raises IkError if the process ended without one."""
        output, _ = self._process.communicate(self._sent)
        if self._process.returncode:
            raise IkError(f'the process that maps the reach ended with code {self._process.returncode}')
        found = pickle.loads(output)
        assert isinstance(found, ReachMap)
        return found

    def end(self) -> None:
        """End the process; `result`, in another thread, raises."""
        self._process.kill()


def main() -> None:
    """Read a problem from the standard input and write its map to the standard output."""
    os.nice(LOW_PRIORITY)
    problem = pickle.load(sys.stdin.buffer)
    sys.stdout.buffer.write(pickle.dumps(solve_reach_problem(problem)))


if __name__ == '__main__':
    main()
