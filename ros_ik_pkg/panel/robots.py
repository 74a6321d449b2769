"""The robots that the page offers: those that come along, the node's own, and those whose URDF was opened."""

from __future__ import annotations

from collections.abc import Mapping

from ros_ik_pkg.ik import ArgumentError, Arm, load_arm
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.input.robot_source import urdf_text

SHIPPED = ('puma560', 'ur5', 'panda', 'iiwa14')
ROBOT_PARAMETERS = ('robot', 'robot_description', 'base_frame', 'tip_frame')


def parameters_of(robot: str = '', robot_description: str = '') -> dict[str, str]:
    """Return the node's parameters for a robot by name, path or URDF text, from its root to its end."""
    return {'robot': robot, 'robot_description': robot_description, 'base_frame': '', 'tip_frame': ''}


def load(parameters: Mapping[str, str]) -> Arm:
    """Load the arm that the parameters mean, as the node does; raise an IkError where that cannot be done here."""
    description, robot = parameters['robot_description'], parameters['robot']
    if not robot and not description:
        raise ArgumentError('the node takes its robot from the topic robot_description')
    source = urdf_text(description, 'robot_description') if description else robot
    return load_arm(source, parameters['base_frame'] or None, parameters['tip_frame'] or None)


class Robots:
    """Parameters by the name that the page shows."""

    def __init__(self) -> None:
        self._parameters = {name: parameters_of(name) for name in SHIPPED}

    @property
    def names(self) -> tuple[str, ...]:
        """What can be chosen."""
        return tuple(self._parameters)

    def parameters(self, name: str) -> dict[str, str]:
        """Return the parameters of a robot; a page may send any text, a path too, which is refused."""
        if name not in self._parameters:
            raise ArgumentError(f'no robot {shorten(name, 60)!r}; expected one of {", ".join(self.names)}')
        return self._parameters[name]

    def add(self, parameters: Mapping[str, str], name: str) -> str:
        """Offer a robot from now on, and return the name for it: its own, or with a number where that is taken."""
        name, number = name or 'robot', 1
        label = name
        while self._parameters.get(label, parameters) != parameters:
            number += 1
            label = f'{name} ({number})'
        self._parameters[label] = dict(parameters)
        return label
