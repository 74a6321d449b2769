"""Start the IK node: `ros2 launch ros_ik_pkg ik.launch.py robot:=panda method:=sdls`.

Arguments given here win over the parameters file; those left empty leave it alone.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    'robot': ('', 'a robot of config/robots, or the path or URI of a .urdf, .xacro or DH .yaml file'),
    'method': ('', 'transpose, pinv, dls, adaptive_dls or sdls'),
    'params_file': ('', 'YAML file with parameters, such as a copy of config/ik_node.yaml'),
    'namespace': ('', 'namespace of the node, for several arms'),
    'target_pose': ('target_pose', 'topic of the targets (geometry_msgs/PoseStamped)'),
    'joint_states': ('joint_states', 'topic of the joint states (sensor_msgs/JointState)'),
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
    parameters = [given['params_file']] if given['params_file'] else []
    for name in ('robot', 'method'):
        if given[name]:
            parameters.append({name: ParameterValue(given[name], value_type=str)})
    node = Node(
        package='ros_ik_pkg',
        executable='ik_node',
        name='ik_node',
        namespace=given['namespace'],
        parameters=parameters,
        remappings=[(topic, given[topic]) for topic in ('target_pose', 'joint_states')],
        output='screen',
        emulate_tty=True,
    )
    return [node]
