"""The parameters of the stream of commands: its smoothing, and the thresholds at which it slows and halts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ros_ik_pkg.ik.options import Option

SMOOTHINGS = ('none', 'own', 'ruckig')
BLOCKED = STOP, GO_ON = ('stop', 'go_on')
POSE_MOTIONS = JOINTS, LINE = ('joints', 'line')


@dataclass(frozen=True)
class Thresholds:
    """Thresholds of the rules of caution."""

    singularity_slow: float  # of the smallest singular value of the task's Jacobian
    singularity_halt: float
    contact_slow: float  # m, of the clearance
    contact_halt: float  # m
    limit_margin: float  # rad, m: how far from a joint limit the arm stops
    leaving_share: float  # of the top speed, allowed at least away from a singularity or a contact
    hysteresis: float  # share of a threshold by which a rule ends later than it begins


@dataclass(frozen=True)
class ServoSettings:
    """Settings of the stream of commands, without the rules of caution."""

    command_rate: float  # Hz; 0: there is no stream
    command_timeout: float  # s
    smoothing: str
    blocked: str
    pose_motion: str
    line_speed: float  # m/s
    line_turning: float  # rad/s
    max_velocity: float  # rad/s, m/s, of joints whose limit is not known
    max_acceleration: float  # rad/s^2, m/s^2, as above
    max_jerk: float  # rad/s^3, m/s^3, as above
    response_time: float  # s
    joint_states_timeout: float  # s; 0: never
    resync: float  # rad, m


def _servo_option(name: str, default: Any, text: str, unit: str = '', **spec: Any) -> Option:
    return Option(name, f'servo.{name}', default, text, unit, **spec)


SERVO_OPTIONS = (
    Option('command_rate', 'command_rate', 0.0, 'rate of a steady stream of commands, smooth and within all limits, '
           'which also follows target_twist; 0: no stream, each target has one command', 'Hz', minimum=0.0,
           maximum=1000.0),
    Option('command_timeout', 'command_timeout', 0.1, 'time without a twist after which the arm halts; twists with an '
           'older stamp are refused, stamp 0 means now', 's', minimum=0.001, maximum=10.0),
    Option('smoothing', 'smoothing', 'own', 'what keeps the stream within velocity, acceleration and jerk: nothing, '
           'the limiter of this package, or Ruckig (if it is not installed, the limiter of this package)',
           allowed=SMOOTHINGS),
    _servo_option('blocked', STOP, 'what happens if the joints cannot follow a twist: the whole motion stops, or goes '
                  'on with the joints that can, off the line', allowed=BLOCKED),
    _servo_option('pose_motion', JOINTS, 'how the stream goes to a target pose: all joints in step, or the tip on a '
                  'straight line under the rules of caution', allowed=POSE_MOTIONS),
    _servo_option('line_speed', 0.25, 'the most at which the tip catches up with a pose on such a line', 'm/s',
                  minimum=0.001, maximum=100.0),
    _servo_option('line_turning', 1.0, 'the most at which it turns meanwhile', 'rad/s', minimum=0.001, maximum=100.0),
    _servo_option('max_velocity', 1.0, 'velocity limit of joints for which the robot has none', 'rad/s or m/s',
                  minimum=0.001, maximum=100.0),
    _servo_option('max_acceleration', 10.0, 'acceleration limit of joints for which the robot has none',
                  'rad/s^2 or m/s^2', minimum=0.01, maximum=1e4),
    _servo_option('max_jerk', 100.0, 'jerk limit of joints for which the robot has none', 'rad/s^3 or m/s^3',
                  minimum=0.1, maximum=1e6),
    _servo_option('response_time', 0.01, 'time constant that smooths a stream of target poses', 's', minimum=0.0,
                  maximum=1.0),
    _servo_option('joint_states_timeout', 0.5, 'time without joint states after which the arm halts, if seeds are '
                  'joint states; 0: never', 's', minimum=0.0, maximum=60.0),
    _servo_option('resync', 0.05, 'distance of a joint from its last command from which a motion starts at the joint '
                  'instead of the command', 'rad or m', minimum=0.0, maximum=10.0),
)  # fmt: skip
CAUTION_OPTIONS = (
    _servo_option('singularity_slow', 0.03, 'smallest singular value below which the arm slows down', minimum=0.0,
                  maximum=10.0),
    _servo_option('singularity_halt', 0.005, 'smallest singular value at which it halts, unless it moves away',
                  minimum=0.0, maximum=10.0),
    _servo_option('contact_slow', 0.05, 'clearance below which the arm slows down', 'm', minimum=0.0, maximum=10.0),
    _servo_option('contact_halt', 0.01, 'clearance at which it halts, unless it moves away', 'm', minimum=0.0,
                  maximum=10.0),
    _servo_option('limit_margin', 0.01, 'distance from a joint limit at which it halts, unless it moves away',
                  'rad or m', minimum=0.0, maximum=1.0),
    _servo_option('leaving_share', 0.5, 'share of the top speed that is always allowed away from a singularity or a '
                  'contact', minimum=0.0, maximum=1.0),
    _servo_option('hysteresis', 0.2, 'share of a threshold by which a rule ends later than it begins', minimum=0.0,
                  maximum=10.0),
)  # fmt: skip
