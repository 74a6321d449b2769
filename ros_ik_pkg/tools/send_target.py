"""Send one target pose to the running IK node and print the result."""

from __future__ import annotations

import argparse
import sys

import numpy as np
import pinocchio
from geometry_msgs.msg import PoseStamped

from ros_ik_pkg.ros.client import DISCOVERY_TIMEOUT, IkClient, NodeError
from ros_ik_pkg.ros.interface.topics import NODE_NAME
from ros_ik_pkg.ros.reply import Reply
from ros_ik_pkg.tools.processes import ros_node


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='send_target', description=__doc__)
    for name in ('x', 'y', 'z'):
        parser.add_argument(name, type=float, help='metres')
    for name in ('roll', 'pitch', 'yaw'):
        parser.add_argument(name, type=float, help='about fixed axes, radians')
    parser.add_argument('--degrees', action='store_true', help='the angles are degrees')
    parser.add_argument('--frame', default='', help='frame of the pose (default: the base frame)')
    parser.add_argument('--node', default=NODE_NAME, help='name of the node (default: %(default)s)')
    parser.add_argument(
        '--timeout', type=float, default=DISCOVERY_TIMEOUT, help='seconds to wait (default: %(default)s)'
    )
    return parser


def shielded(words: list[str]) -> list[str]:
    """Return the words of a command line so that argparse takes -1e-3 for a number and not for an option."""
    return [f' {word}' if word.startswith('-') and _is_number(word) else word for word in words]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def main() -> int:
    """Send the target and print the answer; 0 when it was solved, 2 when not, 1 without an answer."""
    given = arguments().parse_args(shielded(sys.argv[1:]))
    pose = given_pose(given)
    try:
        with ros_node('send_target') as node, IkClient(node, given.node) as client:
            client.connect(given.timeout)
            reply = client.solve(pose_message(pose, given.frame), given.timeout)
    except (NodeError, ValueError) as error:
        print(f'send_target: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    print_reply(reply)
    return 0 if reply.solved else 2


def given_pose(given: argparse.Namespace) -> np.ndarray:
    """Return the (4, 4) pose of a command line."""
    angles = np.array([given.roll, given.pitch, given.yaw])
    rotation = pinocchio.rpy.rpyToMatrix(np.radians(angles) if given.degrees else angles)
    return pinocchio.SE3(rotation, np.array([given.x, given.y, given.z])).homogeneous


def pose_message(pose: np.ndarray, frame: str = '') -> PoseStamped:
    """Make a message of a (4, 4) pose; `frame` empty means the base frame."""
    message = PoseStamped()
    message.header.frame_id = frame
    x, y, z, qx, qy, qz, qw = map(float, pinocchio.SE3ToXYZQUAT(pinocchio.SE3(pose)))
    position, orientation = message.pose.position, message.pose.orientation
    position.x, position.y, position.z = x, y, z
    orientation.x, orientation.y, orientation.z, orientation.w = qx, qy, qz, qw
    return message


def print_reply(reply: Reply) -> None:
    """Print the sentence, the figures and the joint positions."""
    print(reply.message)
    for key, value in reply.figures.items():
        print(f'  {key}: {value}')
    if reply.joints:
        print('joint positions [rad, m]')
    for name, position in reply.joints.items():
        print(f'  {name}: {position:.9f}')


if __name__ == '__main__':
    sys.exit(main())
