"""Send the path of a file to the running IK node and print the result."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path as FilePath

import numpy as np
from builtin_interfaces.msg import Time
from nav_msgs.msg import Path

from ros_ik_pkg.ik import IkError, sample_arcs
from ros_ik_pkg.ros.client import IkClient, NodeError
from ros_ik_pkg.ros.interface.topics import NODE_NAME
from ros_ik_pkg.ros.reply import PathReply
from ros_ik_pkg.tools.path_files import read_path_file
from ros_ik_pkg.tools.processes import ros_node
from ros_ik_pkg.tools.send_target import pose_message

TIMEOUT = 60.0  # s; the first path on a machine compiles


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='send_path', description=__doc__)
    parser.add_argument('file', type=FilePath, help='.csv or .yaml, see docs/paths.md')
    parser.add_argument('--degrees', action='store_true', help='the angles are degrees')
    parser.add_argument('--frame', default='', help='frame of the poses (default: the base frame)')
    parser.add_argument('--node', default=NODE_NAME, help='name of the node (default: %(default)s)')
    parser.add_argument('--timeout', type=float, default=TIMEOUT, help='seconds to wait (default: %(default)s)')
    return parser


def main() -> int:
    """Send the path and print the result; 0 when it was solved whole, 2 when not, 1 without a result."""
    given = arguments().parse_args()
    try:
        file = read_path_file(given.file, given.degrees)
        poses, times, place = sample_arcs(file.poses, file.vias, file.times)
        path = path_message(poses, times, given.frame)
        with ros_node('send_path') as node, IkClient(node, given.node) as client:
            reply = client.solve_path(path, given.timeout)
    except (NodeError, IkError, ValueError, OSError) as error:
        print(f'send_path: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    print_reply(reply, place)
    return 0 if reply.solved else 2


def path_message(poses: np.ndarray, times: np.ndarray | None, frame: str = '') -> Path:
    """Return a message of poses (N, 4, 4) [m] and their times (N,) [s], if they have any."""
    message = Path()
    message.header.frame_id = frame
    message.poses = [pose_message(pose, frame) for pose in poses]
    if times is not None:
        for pose, nanoseconds in zip(message.poses, np.round(1e9 * (times - times[0])).astype(int).tolist()):
            pose.header.stamp = Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    return message


def print_reply(reply: PathReply, place: np.ndarray) -> None:
    """Print the sentence and the figures, and the row of the file that the tip reaches if arcs were sampled; `place`
    (N,) has the row of each pose that was sent."""
    print(reply.message)
    for key, value in reply.figures.items():
        print(f'  {key}: {value}')
    if 'reached_pose' in reply.figures and place[-1] < len(place) - 1:
        row = np.interp(float(reply.figures['reached_pose']), np.arange(len(place)), place)
        print(f'  reached_row: {row:.6g} (arcs were sampled: {len(place)} poses were sent)')


if __name__ == '__main__':
    sys.exit(main())
