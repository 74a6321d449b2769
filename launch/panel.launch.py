"""Start the panel, and an IK node for it: `ros2 launch ros_ik_pkg panel.launch.py robot:=panda`.

With `start_node:=false` the panel talks to a node that already runs. The panel needs viser and yourdfpy: install them
with pip, or use scripts/panel, which does.
"""

from launch import LaunchDescription
from launch.actions import OpaqueFunction

from ros_ik_pkg.tools import launch_arguments as shared
from ros_ik_pkg.tools.launch_arguments import Argument

ARGUMENTS = {
    'start_node': Argument('true', 'start an IK node too', (*shared.TRUE, *shared.FALSE)),
    'robot': Argument('puma560', 'a robot of config/robots, or the path or URI of a .urdf, .xacro or DH .yaml file'),
    'method': shared.METHOD,
    'seed_source': shared.SEED_SOURCE,
    'compare': shared.COMPARE,
    'params_file': shared.PARAMS_FILE,
    'use_sim_time': shared.USE_SIM_TIME,
    'host': Argument('127.0.0.1', 'address to serve on; 0.0.0.0 serves browsers on other machines'),
    'port': Argument('8080', 'first port to try'),
    'log_level': shared.LOG_LEVEL,
    'respawn': shared.RESPAWN,
}
# Descents long enough for the transpose method to arrive, and tolerances at the lower end of the plots.
NODE_PARAMETERS = {'max_iterations': 2000, 'position_tolerance': 1e-6, 'orientation_tolerance': 1e-6}


def generate_launch_description():
    """Declare the arguments and start the panel and its node."""
    return LaunchDescription([
        shared.checked(ARGUMENTS, __file__), *shared.declared(ARGUMENTS), OpaqueFunction(function=start),
    ])  # fmt: skip


def start(context):
    """Return the panel, and the node if it is wanted."""
    given = shared.values(ARGUMENTS, context)
    address = ['--host', given['host'], '--port', given['port']]
    actions = [shared.ros_node(given, executable='panel', name='panel', arguments=address)]
    if shared.is_true(given['start_node']):
        actions.append(shared.ik_node(given, {'robot': given['robot'], **NODE_PARAMETERS}))
    return actions
