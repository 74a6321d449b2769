"""Start the panel, and an IK node for it: `ros2 launch ros_ik_pkg panel.launch.py robot:=panda`.

With `start_node:=false` the panel talks to a node that runs already. The panel needs viser and yourdfpy: pip install
them, or use scripts/panel, which does.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    'start_node': ('true', 'whether to start an IK node too'),
    'robot': ('puma560', 'a robot of config/robots, or the path or URI of a .urdf, .xacro or DH .yaml file'),
    'host': ('127.0.0.1', 'address to serve on; 0.0.0.0 for browsers of other machines'),
    'port': ('8080', 'first port to try'),
}


def generate_launch_description():
    """Declare the arguments and start panel and node."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    ik_node = Node(
        package='ros_ik_pkg',
        executable='ik_node',
        name='ik_node',
        parameters=[{
            'robot': ParameterValue(LaunchConfiguration('robot'), value_type=str),
            'max_iterations': 2000,
            'position_tolerance': 1e-6,
            'orientation_tolerance': 1e-6,
        }],
        condition=IfCondition(LaunchConfiguration('start_node')),
        output='screen',
    )  # fmt: skip
    panel = Node(
        package='ros_ik_pkg',
        executable='panel',
        name='panel',
        arguments=['--host', LaunchConfiguration('host'), '--port', LaunchConfiguration('port')],
        output='screen',
    )
    return LaunchDescription([*declared, ik_node, panel])
