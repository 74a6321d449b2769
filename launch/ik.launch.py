"""Start the IK node: `ros2 launch ros_ik_pkg ik.launch.py robot:=panda method:=sdls`.

With `robot_from_topic:=true tip_frame:=tool0` the robot is the URDF that a robot_state_publisher publishes. Arguments
given here win over the parameters file; an empty argument leaves the file's value.
"""

from launch import LaunchDescription
from launch.actions import OpaqueFunction

from ros_ik_pkg.tools import launch_arguments as shared
from ros_ik_pkg.tools.launch_arguments import Argument

TOPICS = ('target_pose', 'joint_states', 'robot_description')
ARGUMENTS = {
    'robot': Argument('', 'a robot of config/robots, or the path or URI of a .urdf, .xacro or DH .yaml file; '
                          'empty: that of params_file, else puma560'),
    'robot_from_topic': Argument('false', 'take the robot from the URDF on the topic robot_description; '
                                          'robot is then ignored', (*shared.TRUE, *shared.FALSE)),
    'base_frame': Argument('', 'frame of targets and solutions; empty: that of params_file, else the root of the '
                               'robot'),
    'tip_frame': Argument('', 'frame that reaches the targets, required if the robot has several tips; '
                              'empty: that of params_file, else the end of the robot, before a gripper'),
    'method': shared.METHOD,
    'seed_source': shared.SEED_SOURCE,
    'compare': shared.COMPARE,
    'params_file': shared.PARAMS_FILE,
    'use_sim_time': shared.USE_SIM_TIME,
    'namespace': Argument('', 'namespace of the node, for several arms'),
    'target_pose': Argument('target_pose', 'topic of the targets (geometry_msgs/PoseStamped)'),
    'joint_states': Argument('joint_states', 'topic of the joint states (sensor_msgs/JointState)'),
    'robot_description': Argument('robot_description', 'topic of the URDF (std_msgs/String), for robot_from_topic'),
    'log_level': shared.LOG_LEVEL,
    'respawn': shared.RESPAWN,
}  # fmt: skip


def generate_launch_description():
    """Declare the arguments and start one node."""
    return LaunchDescription([
        shared.checked(ARGUMENTS, __file__), *shared.declared(ARGUMENTS), OpaqueFunction(function=start_node),
    ])  # fmt: skip


def start_node(context):
    """Return the node, with the parameters that were given."""
    given = shared.values(ARGUMENTS, context)
    parameters = {name: given[name] for name in ('robot', 'base_frame', 'tip_frame') if given[name]}
    if shared.is_true(given['robot_from_topic']):
        parameters |= {'robot': '', 'robot_description': ''}
    remappings = [(topic, given[topic]) for topic in TOPICS]
    return [shared.ik_node(given, parameters, namespace=given['namespace'], remappings=remappings)]
