"""The executable `ik_node`: the IK node as a process, until SIGINT or SIGTERM."""

from __future__ import annotations

import gc
import sys

from ros_ik_pkg.ros.runtime.stop_flag import StopFlag

BAD_ARGUMENT = 2  # exit code, as of argparse
HELP = """usage: ik_node [--help] [--ros-args ...]

Turns target poses (topic target_pose) into joint positions (topic ~/solution) until SIGINT or SIGTERM.

All settings are ROS parameters and remappings, for example:
  ik_node --ros-args -p robot:=panda -p method:=sdls
  ik_node --ros-args --params-file my.yaml -r target_pose:=/goal -r __ns:=/left

While it runs:
  ros2 param list /ik_node
  ros2 param describe /ik_node robot"""


def main(args: list[str] | None = None) -> int:
    """Run the node and return the exit code: 0 after a signal, 1 if it cannot start, 2 for a bad argument or parameter.

    args: the command line with the name of the program first, default sys.argv.
    """
    flag = StopFlag()
    try:
        gc.disable()  # until the node spins: nothing of what the imports make is garbage
        # These take a second to import, in which a signal must not end in a traceback.
        from ros_ik_pkg.ros.interface.parameters import PARAMETERS

        # Rules such as target_pose:=/goal are remappings even without --ros-args, but they cannot set parameters.
        unknown = [
            word for word in outside_ros_args((sys.argv if args is None else args)[1:])
            if ':=' not in word or word.partition(':=')[0].lstrip('_') in PARAMETERS
        ]  # fmt: skip
        if '-h' in unknown or '--help' in unknown:
            print(HELP)
            return 0
        if unknown:
            print(f'ik_node: {refusal_of(unknown)}', file=sys.stderr)
            return BAD_ARGUMENT
        from ros_ik_pkg.ros.node import IkNode
        from ros_ik_pkg.ros.runtime.spin import run

        return run(IkNode, flag, args)
    except (KeyboardInterrupt, Exception):
        if flag.stopped:  # inside the compiler an interrupt can surface as another error
            return 0
        raise


def outside_ros_args(words: list[str]) -> list[str]:
    """Return the words of a command line that are outside its sections from --ros-args to --."""
    outside, inside = [], False
    for word in words:
        if word == '--ros-args' or (inside and word == '--'):
            inside = word != '--'
        elif not inside:
            outside.append(word)
    return outside


def refusal_of(unknown: list[str]) -> str:
    """Return what to write instead of arguments that are not for ROS, such as `--robot panda` or `robot:=panda`."""
    name, _, value = unknown[0].lstrip('-_').partition(':=' if ':=' in unknown[0] else '=')
    value = value or (unknown[1] if len(unknown) > 1 and not unknown[1].startswith('-') else 'VALUE')
    return (
        f'unknown argument {unknown[0]!r}; a parameter is set by --ros-args -p {name.replace("-", "_")}:={value}; '
        '--help says more'
    )


if __name__ == '__main__':
    sys.exit(main())
