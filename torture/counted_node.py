"""The IK node, which writes how many targets and joint states it has taken so far into a file that is mapped to memory.

Nothing that it publishes says so: joint states are only kept, and a target without a result would not be seen.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from ros_ik_pkg.ros import ik_node, node
from ros_ik_pkg.ros.input import joint_states
from torture.running import COUNTS_FILE, JOINT_STATES, TARGETS, map_counts


def main() -> int:
    """Run the node."""
    counts = map_counts(os.environ[COUNTS_FILE], 'r+')
    node.IkNode._answer = _counted(node.IkNode._answer, counts, TARGETS)
    joint_states.JointStates.keep = _counted(joint_states.JointStates.keep, counts, JOINT_STATES)
    return ik_node.main()


def _counted(method: Callable[..., Any], counts: np.ndarray, place: int) -> Callable[..., Any]:
    def count(self: object, *arguments: object) -> Any:
        counts[place] += 1
        return method(self, *arguments)

    return count


if __name__ == '__main__':
    sys.exit(main())
