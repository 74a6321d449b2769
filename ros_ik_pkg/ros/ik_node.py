"""The executable `ik_node`: the IK node as a process, until SIGINT or SIGTERM."""

from __future__ import annotations

import sys

from ros_ik_pkg.ros.runtime.stop_flag import StopFlag


def main(args: list[str] | None = None) -> int:
    """Run the node and return the exit code: 0 after a signal, 1 if it cannot start, 2 for a bad parameter."""
    flag = StopFlag()
    try:
        # These take a second to import, in which a signal must not end in a traceback.
        from ros_ik_pkg.ros.node import IkNode
        from ros_ik_pkg.ros.runtime.spin import run

        return run(IkNode, flag, args)
    except (KeyboardInterrupt, Exception):
        if flag.stopped:  # inside the compiler an interrupt can come out as another error
            return 0
        raise


if __name__ == '__main__':
    sys.exit(main())
