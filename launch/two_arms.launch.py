"""Start an IK node for each of two arms of one robot, which share `joint_states` and the URDF.

    ros2 launch ros_ik_pkg two_arms.launch.py left_tip:=left_hand right_tip:=right_hand

Targets go to /left/target_pose and /right/target_pose, solutions come on /left/ik_node/solution and
/right/ik_node/solution. Arguments given here win over the parameters file; an empty argument leaves the file's value.
"""

from launch import LaunchDescription
from launch.actions import OpaqueFunction

from ros_ik_pkg.tools import launch_arguments as shared
from ros_ik_pkg.tools.launch_arguments import Argument

SIDES = ('left', 'right')
SHARED_TOPICS = ('joint_states', 'robot_description')
ARGUMENTS = {
    'left_tip': Argument('', 'frame of the left arm that reaches the targets, required if the robot has several tips'),
    'right_tip': Argument('', 'frame of the right arm that reaches the targets'),
    'left_base': Argument('', 'frame of targets and solutions of the left arm; empty: the root of the robot'),
    'right_base': Argument('', 'frame of targets and solutions of the right arm; empty: the root of the robot'),
    'robot': Argument('', 'path or URI of a .urdf or .xacro file; empty: the URDF on the topic robot_description'),
    'method': shared.METHOD,
    'seed_source': shared.SEED_SOURCE,
    'compare': shared.COMPARE,
    'params_file': shared.PARAMS_FILE,
    'use_sim_time': shared.USE_SIM_TIME,
    'joint_states': Argument('/joint_states', 'topic of the joint states of the robot (sensor_msgs/JointState)'),
    'robot_description': Argument('/robot_description', 'topic of the URDF of the robot (std_msgs/String)'),
    'log_level': shared.LOG_LEVEL,
    'respawn': shared.RESPAWN,
}


def generate_launch_description():
    """Declare the arguments and start both nodes."""
    return LaunchDescription([
        shared.checked(ARGUMENTS, __file__), *shared.declared(ARGUMENTS), OpaqueFunction(function=start_nodes),
    ])  # fmt: skip


def start_nodes(context):
    """Return one node per side, each in the namespace of that name."""
    given = shared.values(ARGUMENTS, context)
    remappings = [(topic, given[topic]) for topic in SHARED_TOPICS]
    nodes = []
    for side in SIDES:
        frames = {'base_frame': given[f'{side}_base'], 'tip_frame': given[f'{side}_tip']}
        parameters = {'robot': given['robot'], **{name: frame for name, frame in frames.items() if frame}}
        nodes.append(shared.ik_node(given, parameters, namespace=side, remappings=remappings))
    return nodes
