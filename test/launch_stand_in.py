"""Stand-ins for launch and launch_ros of Jazzy, which are not on PyPI, and `ros2 launch` made of them.

They do what the real classes were seen to do: an argument has its default unless it is given, its choices are enforced
when its declaration is executed, `ros2 launch` accepts names that nobody declared, and `--show-args` prints the
description with the choices and the default.
"""

from __future__ import annotations

import runpy
import shlex
import sys
import types
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[1]


class Context:
    """launch.LaunchContext: the words of the command line, and the values of the arguments."""

    def __init__(self, argv: list[str]) -> None:
        self.argv = argv
        self.launch_configurations = dict(word.split(':=', 1) for word in argv)


class DeclareLaunchArgument:
    def __init__(self, name, *, default_value=None, description=None, choices=None) -> None:
        if choices is not None and default_value not in choices:
            raise RuntimeError(f'Provided default_value "{default_value}" is not in provided choices "{choices}".')
        self.name, self.default_value, self.choices = name, default_value, choices
        self.description = description + (f'. Valid choices are: {choices}' if choices else '')

    def execute(self, context: Context) -> None:
        value = context.launch_configurations.setdefault(self.name, self.default_value)
        if self.choices is not None and value not in self.choices:
            raise RuntimeError(f'Argument "{self.name}" provided value "{value}" is not valid. '
                               f'Valid options are: {self.choices}')  # fmt: skip


class OpaqueFunction:
    def __init__(self, *, function) -> None:
        self.function = function

    def execute(self, context: Context) -> list | None:
        return self.function(context)


class LaunchConfiguration:
    def __init__(self, name: str) -> None:
        self.name = name

    def perform(self, context: Context) -> str:
        return context.launch_configurations[self.name]


class ParameterValue:
    def __init__(self, value, *, value_type) -> None:
        assert isinstance(value, value_type)
        self.value = value


class Node:
    def __init__(self, *, package, executable, name=None, namespace=None, parameters=(), remappings=(),
                 ros_arguments=(), arguments=(), output='log', emulate_tty=False, respawn=False, respawn_delay=None,
                 additional_env=None) -> None:  # fmt: skip
        self.package, self.executable, self.name, self.namespace = package, executable, name, namespace
        self.remappings, self.arguments, self.ros_arguments = dict(remappings), list(arguments), list(ros_arguments)
        self.respawn, self.environment = respawn, additional_env
        self.files = [entry for entry in parameters if isinstance(entry, str)]
        self.parameters = {}
        for entry in parameters:
            if isinstance(entry, dict):
                self.parameters |= {key: evaluated(value) for key, value in entry.items()}

    def execute(self, _context: Context) -> None:
        return None


def evaluated(value):
    """Return a parameter as launch_ros writes it: a text without a type is read as YAML."""
    if isinstance(value, ParameterValue):
        return value.value
    return yaml.safe_load(value) if isinstance(value, str) else value


class LaunchDescription:
    def __init__(self, entities) -> None:
        self.entities = entities


def install(monkeypatch) -> None:
    """Put the stand-ins where launch files import from."""
    modules = {
        'launch': (LaunchDescription,),
        'launch.actions': (DeclareLaunchArgument, OpaqueFunction),
        'launch.substitutions': (LaunchConfiguration,),
        'launch_ros': (),
        'launch_ros.actions': (Node,),
        'launch_ros.parameter_descriptions': (ParameterValue,),
    }
    for name, classes in modules.items():
        module = types.ModuleType(name)
        for each in classes:
            setattr(module, each.__name__, each)
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.delitem(sys.modules, 'ros_ik_pkg.tools.launch_arguments', raising=False)


def ros2_launch(monkeypatch, file: str, command: str = '', parent: str = '') -> list[Node]:
    """Return the nodes that `ros2 launch ros_ik_pkg FILE COMMAND` starts, or `parent` if that includes the file."""
    install(monkeypatch)
    words = shlex.split(command)
    monkeypatch.setattr(sys, 'argv', ['ros2', 'launch', *(('robot_bringup', parent) if parent else
                                                          ('ros_ik_pkg', file)), *words])
    context, nodes = Context(words), []
    for entity in description(file).entities:
        nodes += entity.execute(context) or []
    return nodes


def description(file: str) -> LaunchDescription:
    """Return the launch description of a file in launch/; the stand-ins must be installed."""
    return runpy.run_path(str(ROOT / 'launch' / file))['generate_launch_description']()


def show_args(monkeypatch, file: str) -> dict[str, DeclareLaunchArgument]:
    """Return the arguments that `ros2 launch --show-args` prints, by name."""
    install(monkeypatch)
    entities = description(file).entities
    return {entity.name: entity for entity in entities if isinstance(entity, DeclareLaunchArgument)}
