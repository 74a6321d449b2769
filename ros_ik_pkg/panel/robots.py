"""The robots that the page offers: the shipped ones, the node's own, and opened URDFs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ros_ik_pkg.ik import ArgumentError, Arm, load_arm
from ros_ik_pkg.ik.model.joint_limits import parse_held
from ros_ik_pkg.ik.model.sources import parse_xacro_args
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.input.robot_source import urdf_text
from ros_ik_pkg.ros.interface.parameters import ARM_OPTIONS, TOOL_OPTION

SHIPPED = ('puma560', 'ur5', 'panda', 'iiwa14')
ROBOT_OPTIONS = (*ARM_OPTIONS, TOOL_OPTION)
ROBOT_PARAMETERS = tuple(option.ros_name for option in ROBOT_OPTIONS)


def parameters_of(robot: str = '', robot_description: str = '') -> dict[str, Any]:
    """Return the node's parameters for a robot by name, path or URDF text, from its root to its end."""
    defaults = {option.ros_name: option.default for option in ROBOT_OPTIONS}
    return defaults | {'robot': robot, 'robot_description': robot_description}


def robot_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of the robot among those of a node, whose lists may be lists or tuples."""
    robot = {name: values[name] for name in ROBOT_PARAMETERS}
    return {name: tuple(value) if isinstance(value, list) else value for name, value in robot.items()}


def load(parameters: Mapping[str, Any]) -> Arm:
    """Return the arm of the parameters, as the node loads it; raises IkError if that is impossible here."""
    description, robot = parameters['robot_description'], parameters['robot']
    if not robot and not description:
        raise ArgumentError('the node takes its robot from the topic robot_description')
    source = urdf_text(description, 'robot_description') if description else robot
    return load_arm(
        source, parameters['base_frame'] or None, parameters['tip_frame'] or None, limits=parameters['limits'],
        joint_limits=parameters['joint_limits'], held=parse_held(parameters['held_joints']),
        xacro_args=parse_xacro_args(parameters['xacro_args']),
    ).with_tool(parameters['tool'])  # fmt: skip


class Robots:
    """Parameters by the name that the page shows."""

    def __init__(self) -> None:
        self._parameters = {name: parameters_of(name) for name in SHIPPED}

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names to choose from."""
        return tuple(self._parameters)

    def parameters(self, name: str) -> dict[str, Any]:
        """Return the parameters of a robot; a page may send any text, a path too, which is refused."""
        if name not in self._parameters:
            raise ArgumentError(f'no robot {shorten(name, 60)!r}; expected one of {", ".join(self.names)}')
        return self._parameters[name]

    def add(self, parameters: Mapping[str, Any], name: str) -> str:
        """Add a robot and return its name, with a number if the name is taken."""
        name, number = name or 'robot', 1
        label = name
        while self._parameters.get(label, parameters) != parameters:
            number += 1
            label = f'{name} ({number})'
        self._parameters[label] = dict(parameters)
        return label
