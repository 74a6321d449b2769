"""Every tunable of a solve, declared once: default, range, unit and text."""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass, fields, make_dataclass, replace
from dataclasses import field as dataclass_field
from functools import lru_cache
from typing import Any

import numpy as np

from ros_ik_pkg.ik.exceptions import OptionError
from ros_ik_pkg.ik.kernel.data_layout import METHOD_COLUMNS, Tuning
from ros_ik_pkg.ik.solution import ROW_NAMES
from ros_ik_pkg.ik.task_rows import AUTO, SECONDARIES, names_of_rows, wishes_of
from ros_ik_pkg.ik.text import suggest, to_number
from ros_ik_pkg.methods import BY_NAME, DEFAULT, METHODS, TABLE

CHOICES = ('first', 'nearest', 'all')
TASK_FRAMES = ('base', 'tip')
GEOMETRIES = ('convex', 'mesh')
# [m] added to the margin in the search, so that coal agrees with it in spite of its tolerance
FURTHER = 2e-5
# Options that say what is demanded: with values of their own, 'auto' wishes for nothing.
SAID_OTHERWISE = ('position_tolerance', 'orientation_tolerance', 'task_weights', 'task_tolerances')
NULL_SPACES = ('none', 'posture', 'limits', 'manipulability', 'clearance')


@dataclass(frozen=True)
class Option:
    """Declaration of one tunable; `ros_name` differs from `name` if a method owns it (dls.damping)."""

    name: str
    ros_name: str
    default: Any
    text: str
    unit: str = ''
    minimum: float | None = None
    maximum: float | None = None
    allowed: tuple[str, ...] = ()
    listed: tuple[str, ...] = ()  # words of which a list, separated by blanks, is allowed too

    def check(self, value: Any) -> Any:
        """Return the value in the declared type, or raise OptionError naming option, value and what is allowed.

        Text that is a number stands for the number: YAML 1.1, and `ros2 param load` with it, reads 1e-05 as text.
        """
        if isinstance(self.default, bool):
            return self._check_bool(value)
        if isinstance(self.default, tuple):
            return self._check_tuple(value)
        if isinstance(self.default, str):
            return self._check_text(value)
        return self._check_number(value)

    def expected(self) -> str:
        """Say in words what values are allowed."""
        if isinstance(self.default, bool):
            return 'true or false'
        if self.allowed:
            words = f', or some of {" ".join(self.listed)}' if self.listed else ''
            return f'one of {", ".join(self.allowed)}{words}'
        if isinstance(self.default, str):
            return 'a text'
        kind = 'whole number' if isinstance(self.default, int) else 'number'
        count = f'a {kind} '
        if isinstance(self.default, tuple):
            how_many = f'{len(self.default)} numbers' if self.default else 'one number for each joint, or none'
            count = f'{how_many}, each '
        return f'{count}from {self.minimum:g} to {self.maximum:g}' + (f' [{self.unit}]' if self.unit else '')

    def _refuse(self, value: Any) -> OptionError:
        shown = value.tolist() if isinstance(value, array) else value
        return OptionError(f'{self.ros_name} = {shown!r} is not allowed: expected {self.expected()}')

    def _check_bool(self, value: Any) -> bool:
        if not isinstance(value, (bool, np.bool_)):
            raise self._refuse(value)
        return bool(value)

    def _check_text(self, value: Any) -> str:
        if not isinstance(value, str):
            raise self._refuse(value)
        words = value.split()
        is_list = bool(words) and len(set(words)) == len(words) and set(words) <= set(self.listed)
        if self.allowed and value not in self.allowed and not is_list:
            raise self._refuse(value)
        return value

    def _check_tuple(self, value: Any) -> tuple[float, ...]:
        try:
            entries = _entries(value) if isinstance(value, str) else tuple(value)
            numbers = tuple(to_number(entry) if isinstance(entry, str) else float(entry) for entry in entries)
        except (TypeError, ValueError, OverflowError):
            raise self._refuse(value) from None
        if isinstance(value, bytes) or any(isinstance(entry, (bool, np.bool_, bytes)) for entry in entries):
            raise self._refuse(value)
        count_fits = len(numbers) == len(self.default) or not self.default
        if not count_fits or not all(self._in_range(v) for v in numbers):
            raise self._refuse(value)
        return numbers

    def _check_number(self, value: Any) -> float | int:
        number = to_number(value) if isinstance(value, str) else value
        if isinstance(number, (bool, np.bool_)) or not isinstance(number, (int, float, np.integer, np.floating)):
            raise self._refuse(value)
        whole = isinstance(self.default, int)
        if not self._in_range(float(number)) or (whole and int(number) != number):
            raise self._refuse(value)
        return int(number) if whole else float(number)

    def _in_range(self, value: float) -> bool:
        assert self.minimum is not None and self.maximum is not None
        return self.minimum <= value <= self.maximum  # false for NaN


def _entries(text: str) -> list[str]:
    """Return the entries of a list written as text, '[1e-05, 1]': `ros2 param load` sends such lists.

    Raises ValueError if the text is not a list.
    """
    inner = text.strip()
    if not (inner.startswith('[') and inner.endswith(']')):
        raise ValueError(text)
    return [entry.strip(' \'"') for entry in inner[1:-1].split(',')] if inner[1:-1].strip() else []


def option(default: Any, text: str, **spec: Any) -> Any:
    """Declare one field of SolveOptions."""
    return dataclass_field(default=default, metadata={'text': text, **spec})


def _own_caps() -> str:
    return ', '.join(f'{method.name} {method.step_cap:g}' for method in TABLE if method.step_cap < math.inf)


def _method_options() -> Any:
    """Return a dataclass with the options that methods own, from the table of methods."""
    declared = [
        (f'{method.name}_{own.name}', float, option(
            own.default, f'{method.name}: {own.text}', ros_name=f'{method.name}.{own.name}', unit=own.unit,
            minimum=own.minimum, maximum=own.maximum,
        ))
        for method in TABLE for own in method.options
    ]  # fmt: skip
    return make_dataclass('MethodOptions', declared, frozen=True, kw_only=True)


MethodOptions = _method_options()


@dataclass(frozen=True)
class SolveOptions(MethodOptions):  # type: ignore[valid-type,misc]  # made from the table of methods
    """Options of one solve, and those of the methods (dls_damping, ...); every value is checked when it is made.

    Raises OptionError that names the option, the value got and what is allowed.
    """

    method: str = option(
        DEFAULT, 'the step rule, which turns a pose error into a joint step', allowed=METHODS
    )
    max_iterations: int = option(100, 'largest number of steps of one attempt', minimum=0, maximum=100000)
    max_attempts: int = option(
        500,
        'largest number of descents: the first from the seed, the others from well-spread starts; 0: no descent, only '
        'the closest approach from the seed',
        minimum=0,
        maximum=1000000,
    )
    deadline: float = option(
        0.05, 'time limit of one solve, checked inside the loop; 0: none', unit='s', minimum=0.0, maximum=3600.0
    )
    position_tolerance: float = option(
        1e-5, 'largest distance of the tip from the target', unit='m', minimum=1e-12, maximum=1.0
    )
    orientation_tolerance: float = option(
        1e-5, 'largest angle between the tip and the target', unit='rad', minimum=1e-12, maximum=math.pi
    )
    step_size: float = option(1.0, 'factor on every step: q <- q + step_size * dq', minimum=1e-6, maximum=2.0)
    max_joint_step: float = option(
        0.0,
        f"cap on each joint's step; 0: that of the method ({_own_caps()}, others only by their own options)",
        unit='rad or m',
        minimum=0.0,
        maximum=10.0,
    )
    respect_limits: bool = option(True, 'keep every iterate and every solution within the joint limits')
    choice: str = option(
        'first',
        'which solution: the first one found, the nearest to the reference, or all distinct ones',
        allowed=CHOICES,
    )
    max_joint_jump: float = option(
        0.0,
        'refuse solutions with a joint further than this from the reference; 0: no bound',
        unit='rad or m',
        minimum=0.0,
        maximum=1000.0,
    )
    task_weights: tuple[float, ...] = option(
        (1.0,) * 6,
        'weights of the rows x y z rx ry rz of the task in the axes of task_frame; 0 drops a row',
        minimum=0.0,
        maximum=1e6,
    )
    task_tolerances: tuple[float, ...] = option(
        (0.0,) * 6,
        'error of each row that counts as zero; position_tolerance and orientation_tolerance apply to the rest',
        unit='m or rad',
        minimum=0.0,
        maximum=100.0,
    )
    task_frame: str = option(
        'base', 'axes of the rows of the task: those of the base frame, or of the tip frame at the target',
        allowed=TASK_FRAMES,
    )
    secondary: str = option(
        AUTO,
        'rows of the task that are wished for only: the others are held within the tolerances, and these come as near '
        'as that allows; auto: the orientation, if the arm has fewer than six joints, and task_weights, '
        'task_tolerances and both tolerances have their defaults',
        allowed=(AUTO, *SECONDARIES),
        listed=ROW_NAMES,
    )
    null_space: str = option(
        'none',
        'what redundant joints are used for: nothing, nearness to the posture, distance from the joint limits, '
        'manipulability, or clearance (distance from contact)',
        allowed=NULL_SPACES,
    )
    null_space_step: float = option(
        0.0,
        'largest motion of a joint for null_space in one solve; 0: no bound',
        unit='rad or m',
        minimum=0.0,
        maximum=1000.0,
    )
    posture: tuple[float, ...] = option(
        (),
        'desired joint positions of null_space = posture; none: the seed, or the reference if there is one; in the '
        'node: the first seed after a change of null_space, posture or the arm',
        unit='rad or m',
        minimum=-1e6,
        maximum=1e6,
    )
    avoid_collisions: bool = option(
        True,
        'accept only solutions in which the robot touches neither itself nor the room; needs shapes: <collision> of '
        'the URDF, radius or shapes of the DH table',
    )
    collision_margin: float = option(
        0.0, 'distance that counts as contact', unit='m', minimum=0.0, maximum=1.0
    )
    collision_geometry: str = option(
        'convex', 'geometry of meshes: the convex hulls of their parts, or their triangles', allowed=GEOMETRIES
    )
    joint_weights: tuple[float, ...] = option(
        (),
        "weight of each joint in the distance by which 'nearest' and 'all' rank solutions, and in the norm that each "
        'step minimises: a heavy joint moves only if it must; none: all 1',
        minimum=0.0,
        maximum=1e6,
    )

    numbers: np.ndarray = dataclass_field(init=False, repr=False, compare=False)
    # Below so many joints rows are wished for only (bit r of the mask is row r), or one call of the search will not do
    wishes_below: float = dataclass_field(init=False, repr=False, compare=False)
    wished_mask: int = dataclass_field(init=False, repr=False, compare=False)
    at_length_below: float = dataclass_field(init=False, repr=False, compare=False)

    def __new__(cls, *_: Any, **values: Any) -> SolveOptions:
        """Refuse an unknown name, with similar ones as a suggestion."""
        names = [spec.name for spec in OPTIONS]
        for name in values:
            if name not in names:
                raise OptionError(f'option {name!r} is not known; {suggest(name, names)}')
        return super().__new__(cls)

    def __post_init__(self) -> None:
        for spec in OPTIONS:
            object.__setattr__(self, spec.name, spec.check(getattr(self, spec.name)))
        if not any(self.task_weights):
            raise OptionError('task_weights drops all six rows: expected at least one weight above 0')
        object.__setattr__(self, 'numbers', self._numbers())
        usual = all(getattr(self, spec.name) == spec.default for spec in OPTIONS if spec.name in SAID_OTHERWISE)
        below, mask = wishes_of(self.secondary, self.task_weights, usual and self.max_attempts > 1)
        object.__setattr__(self, 'wishes_below', below)
        object.__setattr__(self, 'wished_mask', mask)
        object.__setattr__(self, 'at_length_below', math.inf if self.choice == 'all' else below)

    def wished_rows(self, joints: int) -> tuple[str, ...]:
        """Return the names of the rows that are wished for only if an arm has this many joints."""
        return names_of_rows(self.wished_mask) if joints < self.wishes_below else ()

    def demanded_rows(self, joints: int) -> tuple[str, ...]:
        """Return the names of the rows that every solution holds."""
        wished = self.wished_rows(joints)
        return tuple(name for name, weight in zip(ROW_NAMES, self.task_weights) if weight > 0.0 and name not in wished)

    def _numbers(self) -> np.ndarray:
        """Return the options for compiled code: the fields of `Tuning`, then the lists."""
        words: dict[str, tuple[str, ...]] = {
            'method': METHODS, 'choice': CHOICES, 'task_frame': TASK_FRAMES, 'null_space': NULL_SPACES
        }  # fmt: skip
        method = BY_NAME[self.method]
        columns = {name: getattr(method, name) for name in METHOD_COLUMNS}
        columns['collision_margin'] = self.collision_margin + FURTHER
        names: tuple[str, ...] = Tuning._fields
        values = [
            words[name].index(getattr(self, name)) if name in words
            else columns[name] if name in columns else getattr(self, name)
            for name in names
        ]  # fmt: skip
        lists = [*self.task_weights, *self.task_tolerances, len(self.joint_weights), *self.joint_weights, *self.posture]
        return np.array([*values, *lists], dtype=np.float64)

    def check_lengths(self, joints: int) -> None:
        """Raise OptionError if a list with a number for each joint does not fit the number of joints of the arm."""
        for name in ('joint_weights', 'posture'):
            count = len(getattr(self, name))
            if count not in (0, joints):
                raise OptionError(f'{name} has {count} numbers; expected {joints}, one for each joint, or none')


def all_demanded(options: SolveOptions) -> SolveOptions:
    """Return the options with all rows of the task demanded."""
    return options if options.wishes_below == 0 else replace(options, secondary='none')


@lru_cache(maxsize=64)
def demanded_alone(options: SolveOptions) -> SolveOptions:
    """Return the options with the demanded rows of the task only."""
    weights = tuple(0.0 if options.wished_mask >> r & 1 else weight for r, weight in enumerate(options.task_weights))
    return replace(options, task_weights=weights, secondary='none')


def _declared() -> tuple[Option, ...]:
    out = []
    for item in fields(SolveOptions):
        if not item.init:
            continue
        spec = dict(item.metadata)
        ros_name = spec.pop('ros_name', item.name)
        out.append(Option(name=item.name, ros_name=ros_name, default=item.default, **spec))
    return tuple(out)


OPTIONS = _declared()
