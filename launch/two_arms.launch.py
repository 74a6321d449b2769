"""Start an IK node for each of two arms of one robot, which share `joint_states` and the URDF.

    ros2 launch ros_ik_pkg two_arms.launch.py left_tip:=left_hand right_tip:=right_hand

Targets go to /left/target_pose and /right/target_pose, solutions come on /left/ik_node/solution and
/right/ik_node/solution. Arguments given here win over the parameters file; those left empty leave it alone.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    'left_tip': ('', 'frame of the left arm that shall reach the targets; needed where the robot has several tips'),
    'right_tip': ('', 'the same of the right arm'),
    'left_base': ('', 'frame that targets and solutions of the left arm speak of; empty: the root of the robot'),
    'right_base': ('', 'the same of the right arm'),
    'robot': ('', 'path or URI of a .urdf or .xacro file; empty: the URDF on the topic robot_description'),
    'method': ('', 'transpose, pinv, dls, adaptive_dls or sdls'),
    'params_file': ('', 'YAML file with parameters of both nodes, such as a copy of config/ik_node.yaml'),
    'joint_states': ('/joint_states', 'topic of the joint states of the whole robot (sensor_msgs/JointState)'),
    'robot_description': ('/robot_description', 'topic of the URDF of the whole robot (std_msgs/String)'),
}


def generate_launch_description():
    """Declare the arguments and start both nodes."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start_nodes)])


def start_nodes(context):
    """Return a node for each side."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    return [ik_node(side, given) for side in ('left', 'right')]


def ik_node(side, given):
    """Return the node of one side, in the namespace of that name."""
    values = {
        'robot': given['robot'],
        'base_frame': given[f'{side}_base'],
        'tip_frame': given[f'{side}_tip'],
        'method': given['method'],
    }
    chosen = {name: ParameterValue(text, value_type=str) for name, text in values.items() if text or name == 'robot'}
    return Node(
        package='ros_ik_pkg',
        executable='ik_node',
        name='ik_node',
        namespace=side,
        parameters=[*([given['params_file']] if given['params_file'] else []), chosen],
        remappings=[(topic, given[topic]) for topic in ('joint_states', 'robot_description')],
        output='screen',
        emulate_tty=True,
    )
