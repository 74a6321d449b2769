"""The node's parameters: declared from the options, checked as a whole, applied as a whole."""

from __future__ import annotations

import difflib
from array import array
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ros_ik_pkg.ik import (
    METHODS,
    OPTIONS,
    PATH_OPTIONS,
    ArgumentError,
    Arm,
    IkError,
    OptionError,
    PathOptions,
    SolveOptions,
)
from ros_ik_pkg.ik.model.joint_limits import LIMITS
from ros_ik_pkg.ik.model.tool import read_tool
from ros_ik_pkg.ik.options import Option
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.interface.health_limits import HEALTH_OPTIONS, HealthLimits
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds

SEED_SOURCES = ('joint_states', 'last_solution', 'home')
VELOCITY_LIMITING = ('none', 'whole', 'joint')
OUT_OF_REACH = ('hold', 'closest')


@dataclass(frozen=True)
class ListOption(Option):
    """A list of any of the `allowed` texts, or of any texts if none are named."""

    def check(self, value: Any) -> tuple[str, ...]:
        """Return the distinct entries in their order, or raise OptionError."""
        if not isinstance(value, (list, tuple, array)) or not all(map(self._takes, value)):
            raise self._refuse(value)
        return tuple(dict.fromkeys(value))

    def expected(self) -> str:
        """Say in words what values are allowed."""
        return f'a list of any of {", ".join(self.allowed)}' if self.allowed else 'a list of texts'

    def _takes(self, entry: Any) -> bool:
        return entry in self.allowed if self.allowed else isinstance(entry, str)


@dataclass(frozen=True)
class ToolOption(Option):
    """The pose of a tool as a list of numbers."""

    def check(self, value: Any) -> tuple[float, ...]:
        """Return the numbers, or raise OptionError."""
        numbers = super().check(value)
        try:
            read_tool(numbers)
        except ArgumentError as error:
            raise OptionError(str(error)) from error
        return numbers

    def expected(self) -> str:
        """Say in words what values are allowed."""
        return 'x y z roll pitch yaw [m, rad], x y z and a unit quaternion x y z w, or nothing'


def _node_option(name: str, default: Any, text: str, allowed: tuple[str, ...] = (), **spec: Any) -> Option:
    kind = ListOption if isinstance(default, tuple) else Option
    return kind(name=name, ros_name=name, default=default, text=text, allowed=allowed, **spec)


ARM_OPTIONS = (
    _node_option('robot', 'puma560', 'a name in config/robots, or the path or URI (package://, file://) of a .urdf, '
                 '.xacro or DH .yaml; empty: the URDF of the robot_description topic'),
    _node_option('robot_description', '', 'URDF text; used instead of robot if not empty'),
    _node_option('base_frame', '',
                 'frame of targets and solutions; empty: the root of the robot'),
    _node_option('tip_frame', '', 'frame that reaches the target; empty: the end of the robot, before a gripper'),
    _node_option('tip_frames', (), 'two frames that reach targets together, on first_target_pose and '
                 'second_target_pose; empty: one tip'),
    _node_option('limits', 'soft', 'whether the soft limits of the URDF (safety_controller) narrow the hard ones',
                 LIMITS),
    _node_option('joint_limits', '', "limits in the format of MoveIt's joint_limits.yaml that narrow those of the "
                 'robot: path or URI of a .yaml file, or its text'),
    _node_option('held_joints', (), 'joints that do not move, each NAME (at its home position) or NAME:=POSITION '
                 '[rad, m]'),
    _node_option('xacro_args', (), 'arguments of a .xacro file, each NAME:=VALUE'),
    _node_option('srdf', '', 'which links may touch: path, URI or text of an SRDF; empty: the topic '
                 'robot_description_semantic, else derived from the shapes'),
)  # fmt: skip
TOOL = 'tool'
TOOL_OPTION = ToolOption(
    TOOL, TOOL, (), 'pose in tip_frame of the tool, which targets, solutions and twists then refer to; the topics tool '
    'and tool_pose set it too; empty: no tool', minimum=-1000.0, maximum=1000.0,
)  # fmt: skip
NO_GROUND = -1000.0
ROOM_OPTIONS = (
    _node_option('ground', NO_GROUND, f'height of a floor in the base frame; {NO_GROUND:g}: none', unit='m',
                 minimum=NO_GROUND, maximum=1000.0),
    _node_option('obstacles_file', '', 'obstacles: path or URI of a .yaml file, or its text'),
    _node_option('check_motion', False, 'whether the straight line in joint space from the present joint positions to '
                 'the command must be clear of contact too'),
)  # fmt: skip
FRAME_OPTIONS = (
    Option('tf_timeout', 'tf_timeout', 0.1, 'longest wait for the transform of a target whose frame the robot does '
           'not have, if tf2_ros is installed; 0: do not listen to TF', 's', minimum=0.0, maximum=1.0),
)  # fmt: skip
SEED_OPTIONS = (
    _node_option('seed_source', 'joint_states', 'where a solve starts: the current joints, the last solution '
                 '(before the first: home), or home', SEED_SOURCES),
    _node_option('home_until_joint_states', False, 'start from home until the first joint state arrives, instead of '
                 'refusing targets'),
)  # fmt: skip
STREAM_OPTIONS = (
    _node_option('velocity_limiting', 'none', 'how a step to the solution is kept within the velocity limits: not '
                 'at all, shortened as a whole (a straight line in joint space), or each joint by itself',
                 VELOCITY_LIMITING),
    _node_option('velocity_scale', 1.0, "share of the arm's velocity limits that is used", minimum=0.01, maximum=1.0),
    _node_option('max_step_time', 0.1, 'longest time for which a limited step may move, also the first one and one '
                 'after a pause', unit='s', minimum=1e-3, maximum=10.0),
    _node_option('target_timeout', 0.0, 'refuse targets whose stamp is further than this from now; 0: never; stamp 0 '
                 'means now', unit='s', minimum=0.0, maximum=3600.0),
    _node_option('out_of_reach', 'hold', 'what is published for a target without a solution: nothing, or the closest '
                 'approach from the present joint positions', OUT_OF_REACH),
    _node_option('trajectory_time', 0.1, 'time of the point of ~/joint_trajectory, longer if the velocity limits need '
                 'it', unit='s', minimum=1e-3, maximum=60.0),
)  # fmt: skip
GROUP_OPTION = _node_option(
    'group_name', '', 'planning group that ~/compute_ik accepts, besides the name of the arm; empty: any'
)
COMPARE_OPTION = _node_option(
    'compare', (), 'methods that also solve every target, for comparison', (*METHODS, 'all')
)
NODE_OPTIONS = (
    *ARM_OPTIONS, TOOL_OPTION, *ROOM_OPTIONS, *FRAME_OPTIONS, *SEED_OPTIONS, *STREAM_OPTIONS, GROUP_OPTION,
    COMPARE_OPTION,
)  # fmt: skip
PARAMETERS = {option.ros_name: option for option in (
    *ARM_OPTIONS, *OPTIONS, *NODE_OPTIONS, *PATH_OPTIONS, *SERVO_OPTIONS, *CAUTION_OPTIONS, *HEALTH_OPTIONS,
)}  # fmt: skip
ARM_PARAMETERS = frozenset(option.ros_name for option in ARM_OPTIONS)


@dataclass(frozen=True)
class Settings:
    """All parameters at one moment."""

    options: SolveOptions
    robot: str
    robot_description: str
    base_frame: str
    tip_frame: str
    tip_frames: tuple[str, ...]
    limits: str
    joint_limits: str
    held_joints: tuple[str, ...]
    xacro_args: tuple[str, ...]
    srdf: str
    tool: tuple[float, ...]
    ground: float
    obstacles_file: str
    check_motion: bool
    tf_timeout: float
    seed_source: str
    home_until_joint_states: bool
    velocity_limiting: str
    velocity_scale: float
    max_step_time: float
    target_timeout: float
    out_of_reach: str
    trajectory_time: float
    group_name: str
    compare: tuple[str, ...]
    path: PathOptions
    health_limits: HealthLimits
    servo: ServoSettings
    thresholds: Thresholds

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> Settings:
        """Check values by parameter name, all of them; raise OptionError that names the first wrong one."""
        options = SolveOptions(**{option.name: values[option.ros_name] for option in OPTIONS})
        limits = HealthLimits(**_checked(HEALTH_OPTIONS, values))
        path = PathOptions(**_checked(PATH_OPTIONS, values))
        servo = ServoSettings(**_checked(SERVO_OPTIONS, values))
        thresholds = Thresholds(**_checked(CAUTION_OPTIONS, values))
        own = _checked(NODE_OPTIONS, values)
        return cls(options, **own, path=path, health_limits=limits, servo=servo, thresholds=thresholds)


def _checked(options: Iterable[Option], values: Mapping[str, Any]) -> dict[str, Any]:
    return {option.name: option.check(values[option.ros_name]) for option in options}


Prepare = Callable[[Settings, bool], Arm | None]
Apply = Callable[[Settings, Arm | None], None]


class Parameters:
    """Declares the parameters on a node, which must allow undeclared ones; a change is all or nothing.

    prepare(settings, arm_changes): loads the arm if it changes; an IkError refuses the change.
    apply(settings, arm): takes over; called for the values at the start too.

    Raises OptionError for a wrong value at the start, and ModelError for a robot that cannot be loaded.
    """

    def __init__(self, node: Node, prepare: Prepare, apply: Apply) -> None:
        self._node, self._prepare, self._take_over = node, prepare, apply
        self._complete = False
        self._values = _declare(node)
        settings = Settings.from_values(self._values)
        self._pending = (settings, prepare(settings, True))
        node.add_pre_set_parameters_callback(_convert)
        node.set_parameters_atomically([_parameter(*item) for item in self._values.items()])
        self._describe(PARAMETERS)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)
        self._apply([])

    def refuse_unknown(self) -> list[str]:
        """Refuse undeclared names from now on; return a warning for each that the node was started with.

        Until now, publishers and subscriptions declared their QoS overrides. ROS itself ignores misspelt names.
        """
        self._complete = True
        given = self._node._parameter_overrides  # rclpy has no public name for it
        return [f'parameter {name} is not known and ignored{_suggestion(name)}' for name in given
                if not self._node.has_parameter(name)]

    def _check(self, changes: list[Parameter]) -> SetParametersResult:
        """Accept or refuse a change; `_apply` uses what is loaded for it."""
        own = _own(changes)
        try:
            if self._complete:
                _refuse_unknown(self._node, changes)
            settings = Settings.from_values(self._values | own)
            self._pending = (settings, self._prepare(settings, not ARM_PARAMETERS.isdisjoint(own)))
        except IkError as error:
            self._describe(own)  # anew: rclpy has noted the type of the refused value already
            return SetParametersResult(successful=False, reason=shorten(str(error), 1000))
        return SetParametersResult(successful=True)

    def _apply(self, changes: list[Parameter]) -> None:
        self._values |= _own(changes)
        self._take_over(*self._pending)

    def _describe(self, names: Iterable[str]) -> None:
        for name in names:
            self._node.set_descriptor(name, descriptor(PARAMETERS[name]))


def _own(changes: list[Parameter]) -> dict[str, Any]:
    """Return the values of the parameters that are declared here; rclpy has a few of its own."""
    return {parameter.name: parameter.value for parameter in changes if parameter.name in PARAMETERS}


def _refuse_unknown(node: Node, changes: list[Parameter]) -> None:
    for parameter in changes:
        if not node.has_parameter(parameter.name):
            raise OptionError(f'parameter {parameter.name} is not known{_suggestion(parameter.name)}')


def _declare(node: Node) -> dict[str, Any]:
    """Declare every parameter and return the values at the start, by name; ranges are left for later."""
    undescribed = ParameterDescriptor(dynamic_typing=True)
    declared = node.declare_parameters(
        '', [(name, _plain(option.default), undescribed) for name, option in PARAMETERS.items()]
    )
    return {parameter.name: _value_at_start(parameter) for parameter in declared}


def _value_at_start(parameter: Parameter) -> Any:
    """Return the checked value; ROS reads an empty list in a file as nothing at all."""
    option = PARAMETERS[parameter.name]
    return option.check(option.default if parameter.value is None else parameter.value)


def descriptor(option: Option) -> ParameterDescriptor:
    """Describe a parameter: text, unit, what is allowed, and the range if ROS can represent it.

    Types are dynamic for rclpy, so that an integer may stand for a float and a refusal names the parameter.
    """
    described = ParameterDescriptor(
        description=option.text + (f' [{option.unit}]' if option.unit else ''),
        additional_constraints=option.expected(),
        dynamic_typing=True,
    )
    if isinstance(option.default, (bool, str, tuple)):
        return described
    low, high = option.minimum, option.maximum
    if isinstance(option.default, int):
        described.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    else:
        described.floating_point_range = [FloatingPointRange(from_value=float(low), to_value=float(high))]
    return described


def _convert(changes: list[Parameter]) -> list[Parameter]:
    """Turn 1 into 1.0 if a float is expected; wrong values are not changed, and are refused later by name."""
    return [_converted(parameter) if parameter.name in PARAMETERS else parameter for parameter in changes]


def _converted(parameter: Parameter) -> Parameter:
    try:
        value = PARAMETERS[parameter.name].check(parameter.value)
    except OptionError:
        return parameter
    return _parameter(parameter.name, value)


def _parameter(name: str, value: Any) -> Parameter:
    """Return a parameter of the declared type, which ROS cannot infer from an empty list."""
    default = PARAMETERS[name].default
    if isinstance(PARAMETERS[name], ListOption):
        kind = Parameter.Type.STRING_ARRAY
    elif isinstance(default, tuple):
        kind = Parameter.Type.DOUBLE_ARRAY
    else:
        kind = Parameter.Type.from_parameter_value(default)
    return Parameter(name, kind, _plain(value))


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _suggestion(name: str) -> str:
    near = difflib.get_close_matches(name, PARAMETERS, n=1)
    return f'; did you mean {near[0]}?' if near else ''
