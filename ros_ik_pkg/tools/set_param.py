"""Set a parameter of the running IK node."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any, NoReturn

import yaml
from rcl_interfaces.msg import ParameterType

from ros_ik_pkg.ros.client import IkClient, NodeError
from ros_ik_pkg.ros.interface.topics import NODE_NAME
from ros_ik_pkg.tools.processes import ros_node


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='set_param', description=__doc__)
    parser.add_argument('name', metavar='NAME', help='such as method, max_iterations, dls.damping')
    parser.add_argument('value', metavar='VALUE', help='a value, lists as in YAML')
    parser.add_argument('--node', default=NODE_NAME, help='name of the node (default: %(default)s)')
    return parser


def main() -> int:
    """Set the parameter and print its new value, or the reason of a refusal."""
    given = arguments().parse_args()
    try:
        with ros_node('set_param') as node, IkClient(node, given.node) as client:
            client.connect()
            set_from_text(client, given.name, given.value)
            print(f'{given.name} = {client.parameter(given.name)!r}')
    except (NodeError, ValueError) as error:
        print(f'set_param: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def set_from_text(client: IkClient, name: str, text: str) -> None:
    """Set a parameter from text, read by its type; raises NodeError with the reason of a refusal."""
    client.set_parameters({name: read(text, client.parameter_type(name))})


def read(text: str, kind: int) -> Any:
    """Return the value of a text for a parameter type; text that does not fit stays text, and the node refuses it."""
    if kind not in READERS:
        return text
    try:
        return READERS[kind](yaml.safe_load(text))
    except (yaml.YAMLError, TypeError, ValueError, OverflowError, RecursionError):
        return text


def _flag(value: Any) -> bool:
    return value if isinstance(value, bool) else _refuse()


def _whole(value: Any) -> int | float:
    """Return an integer, or a float if it does not fit in a message."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        _refuse()
    return value if abs(value) < 2**63 else float(value)


def _number(value: Any) -> float:
    """Return a number; YAML 1.1 takes 1e-3 for a text, and 1 for a whole number."""
    return float(value) if isinstance(value, (int, float, str)) and not isinstance(value, bool) else _refuse()


def _numbers(value: Any) -> list[float]:
    return [_number(entry) for entry in value] if isinstance(value, list) else _refuse()


def _texts(value: Any) -> list[str]:
    good = isinstance(value, list) and all(isinstance(entry, str) for entry in value)
    return value if good else _refuse()


def _refuse() -> NoReturn:
    raise TypeError


READERS: dict[int, Callable[[Any], Any]] = {
    ParameterType.PARAMETER_BOOL: _flag,
    ParameterType.PARAMETER_INTEGER: _whole,
    ParameterType.PARAMETER_DOUBLE: _number,
    ParameterType.PARAMETER_DOUBLE_ARRAY: _numbers,
    ParameterType.PARAMETER_STRING_ARRAY: _texts,
}


if __name__ == '__main__':
    sys.exit(main())
