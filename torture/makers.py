"""Messages and values that nobody should send, made by a random.Random: hypothesis' own, or a seeded one."""

from __future__ import annotations

import math
import sys
from random import Random
from typing import Any, TypeVar

from geometry_msgs.msg import PoseStamped
from rcl_interfaces.msg import Parameter, ParameterValue
from sensor_msgs.msg import JointState

from ros_ik_pkg.ik import Arm, robot_names
from ros_ik_pkg.ik.options import Option
from ros_ik_pkg.ros.interface.parameters import PARAMETERS
from ros_ik_pkg.tools.send_target import pose_message

T = TypeVar('T')
FLOATS = (
    0.0, -0.0, 1.0, -1.0, 0.3, math.pi, 5e-324, -2.2e-308, 1e-200, 1e-9, 1e6, 1e200, sys.float_info.max,
    math.inf, -math.inf, math.nan,
)  # fmt: skip
WHOLE = (0, 1, -1, 2, 77, 2**31, -(2**31), 2**62, 2**63 - 1, -(2**63))
TEXTS = (
    '', ' ', '/', '//', '~', 'a/b', 'łokieć', '肩', '\u202eabc', 'a\nb\nc', 'tab\t', '%s%n', "'", '"', '\x01', 'x\0y',
)  # fmt: skip
LENGTHS, LONG_LENGTHS = (0, 1, 2, 5, 6, 7, 12, 100), (1000, 10000)
SOUND = 0.3  # share of the joint states
LONG = 100_000  # characters
TYPES = range(10)  # of ParameterValue; the first is NOT_SET
NO_TYPE = 77
MOST_SECONDS = 0.2  # a longer deadline is allowed, and no hang


def any_float(random: Random) -> float:
    """Return a number, often one at an edge."""
    return random.choice(FLOATS) if random.random() < 0.5 else random.uniform(-4.0, 4.0)


def any_length(random: Random) -> int:
    """Return the length of an array, seldom a long one."""
    return random.choice(LONG_LENGTHS if random.random() < 0.04 else LENGTHS)


def any_text(random: Random, known: tuple[str, ...] = ()) -> str:
    """Return a text: one that means something, an odd one, or a long one."""
    if known and random.random() < 0.4:
        return random.choice(known)
    return random.choice(TEXTS) * (random.randrange(LONG) if random.random() < 0.02 else 1)


def any_pose(random: Random, good: PoseStamped, frames: tuple[str, ...]) -> PoseStamped:
    """Return a target: a good one with some fields changed."""
    pose = PoseStamped()
    _set_stamp(pose.header.stamp, random)
    pose.header.frame_id = any_text(random, frames) if random.random() < 0.5 else ''
    for part in ('position', 'orientation'):
        source, target = getattr(good.pose, part), getattr(pose.pose, part)
        for name in source.get_fields_and_field_types():
            setattr(target, name, any_float(random) if random.random() < 0.1 else getattr(source, name))
    return pose


def any_joint_state(random: Random, known: tuple[str, ...]) -> JointState:
    """Return a joint state whose arrays may have any lengths, 0 to 10000, and anything in them; or a sound one."""
    if random.random() < SOUND:
        return JointState(name=list(known), position=[random.uniform(-1.0, 1.0) for _ in known])
    message = JointState()
    _set_stamp(message.header.stamp, random)
    message.header.frame_id = any_text(random)
    message.name = _names(random, known)
    for name in ('position', 'velocity', 'effort'):
        empty = name != 'position' and random.random() < 0.7
        length = len(message.name) if random.random() < 0.7 else any_length(random)
        setattr(message, name, [] if empty else _stretched([any_float(random) for _ in range(8)], length))
    return message


def _names(random: Random, known: tuple[str, ...]) -> list[str]:
    """Return names: those of the arm, perhaps shuffled or repeated, with others."""
    if random.random() < 0.5:
        return random.sample(known, len(known))
    return _stretched([any_text(random, known)[:1000] for _ in range(8)], any_length(random))


def _stretched(values: list[T], length: int) -> list[T]:
    return [values[k % len(values)] for k in range(length)]


def _set_stamp(stamp: Any, random: Random) -> None:
    stamp.sec = random.choice((0, 1, -1, 2**31 - 1, -(2**31)))
    stamp.nanosec = random.choice((0, 1, 10**9, 2**32 - 1))


def any_change(random: Random, arm: Arm) -> Parameter:
    """Return a parameter with a value of its type and range, of its type, or of any type."""
    name = random.choice((*PARAMETERS, 'use_sim_time', 'no_such_parameter', ''))
    value = _sensible(random, PARAMETERS[name], arm) if name in PARAMETERS else None
    message = Parameter(name=name, value=any_value(random) if value is None else value)
    deadline = message.value.double_value
    if name == 'deadline' and not 0.0 < deadline <= MOST_SECONDS and PARAMETERS[name].maximum >= deadline >= 0.0:
        message.value.double_value = MOST_SECONDS
    return message


def _sensible(random: Random, option: Option, arm: Arm) -> ParameterValue | None:
    """Return a value that may be allowed, or None."""
    chance = random.random()
    if chance > 0.6:
        return None
    if isinstance(option.default, bool):
        return ParameterValue(type=1, bool_value=chance < 0.3)
    if isinstance(option.default, int):
        return ParameterValue(type=2, integer_value=random.choice((0, 1, 10, 100, 500)))
    if isinstance(option.default, float):
        return ParameterValue(type=3, double_value=random.choice((option.default, option.minimum, option.maximum, 0.1)))
    if isinstance(option.default, str):
        known = option.allowed or (*robot_names(), *arm.frame_names, '')
        return ParameterValue(type=4, string_value=random.choice(known))
    if option.allowed:
        return ParameterValue(type=9, string_array_value=random.sample(option.allowed, 2))
    values = [random.choice((0.0, 1.0, 0.5)) for _ in range(len(option.default) or arm.n)]
    return ParameterValue(type=8, double_array_value=values)


def any_value(random: Random) -> ParameterValue:
    """Return a value of any type that ROS has."""
    length = any_length(random)
    return ParameterValue(
        type=random.choice(TYPES),
        bool_value=random.random() < 0.5,
        integer_value=random.choice(WHOLE),
        double_value=any_float(random),
        string_value=any_text(random),
        byte_array_value=[b'\x00'] * length,
        bool_array_value=[True] * length,
        integer_array_value=_stretched(list(WHOLE), length),
        double_array_value=_stretched(list(FLOATS), length),
        string_array_value=_stretched(list(TEXTS), length),
    )


def good_pose(arm: Arm) -> PoseStamped:
    """Return the tip's pose at home as a target."""
    return pose_message(arm.forward(arm.home))
