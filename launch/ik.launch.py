"""Start the IK node: `ros2 launch ros_ik_pkg ik.launch.py robot:=panda method:=sdls`.

With `robot_from_topic:=true tip_frame:=tool0` the robot is the URDF that a robot_state_publisher publishes. Arguments
given here win over the parameters file; those left empty leave it alone.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    'robot': ('', 'a robot of config/robots, or the path or URI of a .urdf, .xacro or DH .yaml file'),
    'robot_from_topic': ('false', 'true: the robot is the URDF on the topic robot_description, whatever robot says'),
    'base_frame': ('', 'frame that targets and solutions speak of; empty: the root of the robot'),
    'tip_frame': ('', 'frame that shall reach the targets; needed where the robot has several tips'),
    'method': ('', 'transpose, pinv, dls, adaptive_dls or sdls'),
    'params_file': ('', 'YAML file with parameters, such as a copy of config/ik_node.yaml'),
    'namespace': ('', 'namespace of the node, for several arms'),
    'target_pose': ('target_pose', 'topic of the targets (geometry_msgs/PoseStamped)'),
    'joint_states': ('joint_states', 'topic of the joint states (sensor_msgs/JointState)'),
    'robot_description': ('robot_description', 'topic of the URDF (std_msgs/String), for robot_from_topic'),
}


def generate_launch_description():
    """Declare the arguments and start one node."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start_node)])


def start_node(context):
    """Return the node with those parameters only that were given."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    values = {name: given[name] for name in ('robot', 'base_frame', 'tip_frame', 'method') if given[name]}
    if given['robot_from_topic'].lower() == 'true':
        values |= {'robot': '', 'robot_description': ''}
    chosen = {name: ParameterValue(text, value_type=str) for name, text in values.items()}
    node = Node(
        package='ros_ik_pkg',
        executable='ik_node',
        name='ik_node',
        namespace=given['namespace'],
        parameters=[*([given['params_file']] if given['params_file'] else []), *([chosen] if chosen else [])],
        remappings=[(topic, given[topic]) for topic in ('target_pose', 'joint_states', 'robot_description')],
        output='screen',
        emulate_tty=True,
    )
    return [node]
