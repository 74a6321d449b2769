"""Prints docs/parameters.md and config/ik_node.yaml from the declarations."""

from __future__ import annotations

import sys

import yaml

from ros_ik_pkg.ik import OPTIONS, PATH_OPTIONS
from ros_ik_pkg.ik.options import Option
from ros_ik_pkg.ros.interface.health_limits import HEALTH_OPTIONS
from ros_ik_pkg.ros.interface.parameters import (
    ARM_OPTIONS,
    COMPARE_OPTION,
    FRAME_OPTIONS,
    GROUP_OPTION,
    ROOM_OPTIONS,
    SEED_OPTIONS,
    STREAM_OPTIONS,
    TOOL_OPTION,
)
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS

SECTIONS = {
    'Robot': ARM_OPTIONS,
    'Tool': (TOOL_OPTION,),
    'Room': ROOM_OPTIONS,
    'Frames': FRAME_OPTIONS,
    'Solve': OPTIONS,
    'Seed': SEED_OPTIONS,
    'Streaming': STREAM_OPTIONS,
    'Path': PATH_OPTIONS,
    'Servo': SERVO_OPTIONS,
    'Caution': CAUTION_OPTIONS,
    'Services': (GROUP_OPTION,),
    'Comparison': (COMPARE_OPTION,),
    'Diagnostics': HEALTH_OPTIONS,
}
GENERATED = 'python -m ros_ik_pkg.ros.interface.generate_reference'
INTRODUCTION = f"""# Parameters of `ik_node`

Made from the declarations in the code by `{GENERATED} parameters.md`; a test compares the two.

Every parameter can be set while the node runs and applies from the next target on. A change is checked as a whole:
all of it is accepted, or none, and the refusal names the parameter, the value and what is allowed. An integer is
accepted for a number, and so is text that is a number, as `ros2 param load` sends 1e-05. `ros2 param set` sends one
parameter at a time; use `/ik_node/set_parameters_atomically` to change several at once.
"""
ROBOT_CHANGES = """## Changing the robot

A change of a parameter of the section Robot loads the arm again, even if the value is the same, because a file may
have changed. If the change is refused, the old arm is kept. The first of these sources that is not empty counts: the
parameter `robot_description`, the parameter `robot`, the topic `robot_description`. The newest valid URDF of the topic
counts; invalid text, also empty text, is an error in the log and in `/diagnostics`. If a parameter names a robot and
the topic has another one, the log says once that it is ignored.

If you set the parameters one at a time, each step must be valid by itself, because frames are looked up in the robot:

1. The new robot has the default frames: set `tip_frame` and `base_frame` to `''` first, then `robot`.
2. It needs frames of its own (a URDF with several tips): set `robot_description` and `robot` to `''`. Without
   a robot the node refuses targets and accepts any frame names. Then set `base_frame` and `tip_frame`, then
   `robot`. If the topic `robot_description` has a publisher, use `/ik_node/set_parameters_atomically`.

`posture` and `joint_weights` have a number for each joint of the arm. If the new arm has more or fewer joints,
set them to `[]` before, or to the values for the new arm in the same call.
"""


def parameters_markdown() -> str:
    """Return docs/parameters.md."""
    tables = [_table(title, options) for title, options in SECTIONS.items()]
    return '\n'.join([INTRODUCTION, *tables, ROBOT_CHANGES])


def _table(title: str, options: tuple[Option, ...]) -> str:
    rows = [
        f'| `{option.ros_name}` | `{_yaml(option.default)}` | {option.expected()} | {_cell(option.text)} |'
        for option in options
    ]
    return '\n'.join([f'## {title}\n', '| name | default | allowed | what |', '|---|---|---|---|', *rows, ''])


def parameters_yaml() -> str:
    """Return config/ik_node.yaml: every parameter at its default, with its text, unit and range."""
    lines = [
        '# Parameters of ik_node at their defaults; start the node with --params-file and a changed copy.',
        f'# Made by `{GENERATED} ik_node.yaml`; docs/parameters.md says more.',
        '/**/ik_node:',
        '  ros__parameters:',
    ]
    for options in SECTIONS.values():
        for option in options:
            lines += [
                f'    # {option.text}:',
                f'    # {option.expected()}',
                f'    {option.ros_name}: {_yaml(option.default)}',
            ]
    return '\n'.join(lines) + '\n'


def _yaml(value: object) -> str:
    """Write a default as YAML would, on one line; 1e-5 as 1.0e-05, which YAML 1.1 takes for a number."""
    plain = list(value) if isinstance(value, tuple) else value
    return yaml.safe_dump(plain, default_flow_style=True, width=1000).removesuffix('...\n').strip()


def _cell(text: str) -> str:
    return text.replace('|', '\\|')


def main() -> None:
    """Print the file that the one argument names."""
    files = {'parameters.md': parameters_markdown, 'ik_node.yaml': parameters_yaml}
    if len(sys.argv) != 2 or sys.argv[1] not in files:
        sys.exit(f'usage: {GENERATED} {"|".join(files)}')
    print(files[sys.argv[1]](), end='')


if __name__ == '__main__':
    main()
