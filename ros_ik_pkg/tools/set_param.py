"""Set a parameter of the running IK node."""

from __future__ import annotations

import argparse
import sys
from typing import Any

import yaml
from rcl_interfaces.msg import ParameterType

from ros_ik_pkg.ros.client import IkClient, NodeError
from ros_ik_pkg.ros.interface import NODE_NAME
from ros_ik_pkg.tools.processes import ros_node


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='set_param', description=__doc__)
    parser.add_argument('name', metavar='NAME', help='such as method, max_iterations, dls.damping')
    parser.add_argument('value', metavar='VALUE', help='a value, lists as in YAML')
    parser.add_argument('--node', default=NODE_NAME, help='name of the node (default: %(default)s)')
    return parser


def main() -> int:
    """Set the parameter and say what it is now, or why not."""
    given = arguments().parse_args()
    try:
        with ros_node('set_param') as node, IkClient(node, given.node) as client:
            client.connect()
            set_from_text(client, given.name, given.value)
            print(f'{given.name} = {client.parameter(given.name)!r}')
    except NodeError as error:
        print(f'set_param: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def set_from_text(client: IkClient, name: str, text: str) -> None:
    """Set a parameter to what the text means for its type; raises NodeError with the reason of a refusal."""
    names = client.parameter_names()
    if name not in names:
        raise NodeError(f'{client.name} has no parameter {name!r}; it has {", ".join(names)}')
    client.set_parameters({name: read(text, client.parameter_type(name))})


def read(text: str, kind: int) -> Any:
    """Read a value for a parameter type; 1 is a number where 1.0 is meant, and texts need no quotes."""
    if kind == ParameterType.PARAMETER_STRING:
        return text
    value = yaml.safe_load(text)
    if kind == ParameterType.PARAMETER_DOUBLE and type(value) is int:
        return float(value)
    if kind == ParameterType.PARAMETER_DOUBLE_ARRAY and isinstance(value, list):
        return [float(item) if type(item) is int else item for item in value]
    return value


if __name__ == '__main__':
    sys.exit(main())
