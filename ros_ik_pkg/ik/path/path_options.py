"""The options of a path, each declared once: default, range, unit and text."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

from ros_ik_pkg.ik.exceptions import OptionError
from ros_ik_pkg.ik.options import Option, option
from ros_ik_pkg.ik.text import suggest


@dataclass(frozen=True)
class PathOptions:
    """Options of one path, checked when the object is made.

    Raises OptionError that names the option, its value and the allowed range.
    """

    step: float = option(
        0.005, 'longest distance between two samples of the path', unit='m', minimum=1e-5, maximum=10.0
    )
    angle_step: float = option(
        0.05, 'largest rotation between two samples of the path', unit='rad', minimum=1e-4, maximum=math.pi
    )
    tolerance: float = option(
        1e-4, 'largest distance of the tip from its line, also between samples', unit='m', minimum=1e-7, maximum=1.0
    )
    angle_tolerance: float = option(
        1e-3, 'largest angle of the tip from its line, also between samples', unit='rad', minimum=1e-7,
        maximum=math.pi,
    )
    tool_speed: float = option(
        0.0, 'speed of the tip, 0 for as fast as the joints allow', unit='m/s', minimum=0.0, maximum=100.0
    )
    keep_speed: bool = option(
        False,
        'if joints cannot keep tool_speed or the stamps within their velocity limits: true, the path breaks or takes '
        'another branch; false, the tip slows down',
    )
    max_reconfigurations: int = option(
        0, 'how often the joints may leave the path to continue in another branch', minimum=0, maximum=10000
    )
    lead_in: bool = option(
        False, 'true: the motion begins where the joints are and leads them to the start of the path in a straight line'
    )
    samples: int = option(
        64, 'solutions of a pose that a redundant arm considers; three times as many before the path breaks or '
        'reconfigures', minimum=2, maximum=1024,
    )
    deadline: float = option(5.0, 'time for one path, 0 for none', unit='s', minimum=0.0, maximum=3600.0)
    acceleration_limits: tuple[float, ...] = option(
        (),
        'of each joint, besides those of joint_limits; a joint without one reaches its velocity limit in half a second',
        unit='rad/s^2 or m/s^2', minimum=1e-6, maximum=1e6,
    )

    def __new__(cls, *_: Any, **values: Any) -> PathOptions:
        """Refuse an unknown name, and suggest similar ones."""
        names = [spec.name for spec in PATH_OPTIONS]
        for name in values:
            if name not in names:
                raise OptionError(f'path option {name!r} is not known; {suggest(name, names)}')
        return super().__new__(cls)

    def __post_init__(self) -> None:
        for spec in PATH_OPTIONS:
            object.__setattr__(self, spec.name, spec.check(getattr(self, spec.name)))


PATH_OPTIONS = tuple(
    Option(name=item.name, ros_name=f'path.{item.name}', default=item.default, **item.metadata)
    for item in fields(PathOptions)
)
