"""Arguments of the launch files, their checks, and the launch action that starts the IK node.

`ros2 launch` runs on the system's Python, which may lack Numba, so this module imports nothing that needs it; a test
compares its lists with the node's own.
"""

from __future__ import annotations

import difflib
import itertools
import os
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from ros_ik_pkg.methods import DEFAULT, METHODS
from ros_ik_pkg.ros.runtime.stop_flag import LAUNCHER_VARIABLE

PACKAGE = 'ros_ik_pkg'
SEED_SOURCES = ('joint_states', 'last_solution', 'home')
LOG_LEVELS = ('debug', 'info', 'warn', 'error', 'fatal')
TRUE, FALSE = ('true', 'True', '1'), ('false', 'False', '0')
RESPAWN_DELAY = 2.0  # s
# Arguments that launch itself reads for every process.
LAUNCH_OWN = ('launch-prefix', 'launch-prefix-filter', 'emulate_tty', 'sigterm_timeout', 'sigkill_timeout')


class Argument(NamedTuple):
    """A launch argument: its default, what it does, and the values it takes if they can be listed."""

    default: str
    text: str
    choices: tuple[str, ...] = ()


def optional_choice(text: str, choices: tuple[str, ...], otherwise: str) -> Argument:
    """Return an argument whose empty default leaves the value to the parameters file, else to `otherwise`."""
    return Argument('', f'{text}; empty: that of params_file, else {otherwise}', ('', *choices))


METHOD = optional_choice('step rule of the solver', METHODS, DEFAULT)
SEED_SOURCE = optional_choice('where a solve starts', SEED_SOURCES, 'joint_states')
COMPARE = Argument('', f'methods to compare on every target, separated by commas: {", ".join(METHODS)}, or all; '
                       'empty: those of params_file, else none')  # fmt: skip
PARAMS_FILE = Argument('', 'YAML file with parameters, such as a copy of config/ik_node.yaml; empty: none')
USE_SIM_TIME = optional_choice('take the time from /clock', (*TRUE, *FALSE), 'false')
LOG_LEVEL = Argument('info', 'lowest level of messages that are logged', LOG_LEVELS)
RESPAWN = Argument('false', f'start the node again {RESPAWN_DELAY:g} s after it ends', (*TRUE, *FALSE))


def declared(arguments: Mapping[str, Argument]) -> list[Any]:
    """Return the launch actions that declare arguments."""
    return [
        DeclareLaunchArgument(
            name, default_value=argument.default, description=argument.text, choices=list(argument.choices) or None
        )
        for name, argument in arguments.items()
    ]


def checked(arguments: Mapping[str, Argument], launch_file: str) -> Any:
    """Return the launch action that refuses arguments on the command line that the launch file does not have.

    `ros2 launch` accepts any name. A file that includes this one passes its own arguments on, so they are checked only
    if the command line names this file.
    """

    def check(context: Any) -> None:
        if not _is_on_command_line(launch_file, sys.argv):
            return
        for word in context.argv:
            name = word.partition(':=')[0]
            if name not in arguments and name not in LAUNCH_OWN:
                near = difflib.get_close_matches(name, arguments, 1)
                hint = f'did you mean {near[0]}?' if near else f'expected one of {", ".join(arguments)}'
                raise RuntimeError(f'unknown launch argument {name!r}; {hint}')

    return OpaqueFunction(function=check)


def _is_on_command_line(launch_file: str, words: list[str]) -> bool:
    path = Path(launch_file)
    by_package = (PACKAGE, path.name) in itertools.pairwise(words)
    return by_package or any(Path(word).name == path.name and Path(word).resolve() == path.resolve() for word in words)


def values(arguments: Iterable[str], context: Any) -> dict[str, str]:
    """Return the text of each argument."""
    return {name: LaunchConfiguration(name).perform(context) for name in arguments}


def is_true(text: str) -> bool:
    """Return the value of a true/false argument, whose text launch has checked against its choices."""
    return text in TRUE


def ik_node(given: Mapping[str, str], parameters: Mapping[str, Any], **options: Any) -> Any:
    """Return the launch action of an IK node.

    given: texts of the arguments method, seed_source, compare, params_file, use_sim_time, log_level and respawn; those
    that are absent or empty leave the parameters file alone. parameters: more parameters, which win over that file.
    options: passed to launch_ros.actions.Node.

    Raises RuntimeError if params_file does not exist or compare names an unknown method.
    """
    files = [_existing(given['params_file'])] if given.get('params_file') else []
    chosen: dict[str, Any] = {name: given[name] for name in ('method', 'seed_source') if given.get(name)}
    if given.get('compare'):
        chosen['compare'] = _methods(given['compare'])
    if given.get('use_sim_time'):
        chosen['use_sim_time'] = is_true(given['use_sim_time'])
    chosen |= parameters
    return ros_node(
        given,
        executable='ik_node',
        name='ik_node',
        parameters=[*files, *([_typed(chosen)] if chosen else [])],
        **options,
    )


def ros_node(given: Mapping[str, str], **options: Any) -> Any:
    """Return the launch action of a node of this package, which ends when `ros2 launch` does, however that ends."""
    return Node(
        package=PACKAGE,
        ros_arguments=['--log-level', given['log_level']],
        respawn=is_true(given['respawn']),
        respawn_delay=RESPAWN_DELAY,
        additional_env={LAUNCHER_VARIABLE: str(os.getpid())},
        output='screen',
        emulate_tty=True,
        **options,
    )


def _typed(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters whose texts stay texts: launch would read '1' as a number."""
    return {
        name: ParameterValue(value, value_type=str) if isinstance(value, str) else value
        for name, value in parameters.items()
    }


def _existing(text: str) -> str:
    path = Path(text).expanduser()
    if not path.is_file():
        raise RuntimeError(f'params_file {str(path)!r} does not exist')
    return str(path)


def _methods(text: str) -> list[str]:
    names = [name.strip() for name in text.strip('[] ').split(',')]
    unknown = [name for name in names if name not in (*METHODS, 'all')]
    if unknown:
        raise RuntimeError(f'compare: {unknown[0]!r} is not a method; expected any of {", ".join(METHODS)}, or all')
    return names
