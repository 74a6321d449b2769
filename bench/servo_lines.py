"""Lines of the tip through trouble: the servo beside a single-step pseudoinverse servo, as MoveIt Servo does it.

The other servo is written from its description: each period the twist, times the pseudoinverse of the Jacobian at the
last command, is added; it is scaled down between two condition numbers, and halted at the second; all joints are slowed
alike within their velocity limits, and halted before a position limit. It has no memory of the line.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from bench.bare_arm import bare_arm
from ros_ik_pkg.ik import Arm, SolveOptions, solve
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.servo import Servo, motion_limits
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand

LINES_HEAD = ('line', 'servo', 'off the line', 'turned', 'travelled', 'fastest joint, of its limit',
              'jerk, of its limit', 'at the end')  # fmt: skip
SPEED, TIME, STEP = 0.1, 6.0, 0.005  # m/s, s, m
RATE = 500.0  # Hz
PERIOD = 1.0 / RATE
SLOW_CONDITION, HALT_CONDITION = 17.0, 30.0  # defaults of MoveIt Servo
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=RATE)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})


class Line(NamedTuple):
    """A line of the tip at SPEED: an arm, a configuration (n,) [rad] near which it leads by, its direction (3,), and
    how far [m] before that it starts."""

    name: str
    arm: str
    by: tuple[float, ...]
    direction: tuple[float, float, float]
    before: float

    def start(self, arm: Arm) -> np.ndarray:
        """Return the configuration (n,) [rad] at which the line starts."""
        q, target = np.array(self.by), arm.forward(self.by)
        for _ in range(round(self.before / STEP)):
            target[:3, 3] -= STEP * np.array(self.direction)
            q = solve(arm, target, q).q
        return q


LINES = (
    Line('across a wrist singularity, ur5', 'ur5', (0.2, -1.2, 1.6, -1.9, 0.0, 0.2), (0.0, 1.0, 0.0), 0.2),
    Line('by a wrist singularity, ur5', 'ur5', (0.2, -1.2, 1.6, -1.9, 0.15, 0.2), (1.0, 0.0, 0.0), 0.2),
    Line('across a wrist singularity, puma560', 'puma560', (0.3, 0.6, -0.9, 0.3, 0.0, 0.4), (0.0, 1.0, 0.0), 0.2),
    Line('along the edge of reach, ur5', 'ur5', (0.0, -0.7, 0.45, -1.3, 1.57, 0.0), (0.0, 1.0, 0.0), 0.0),
    Line('out beyond the edge of reach, panda', 'panda', (0.0, -0.3, 0.0, -1.8, 0.0, 1.57, 0.8), (1.0, 0.0, 0.0), 0.0),
)  # fmt: skip


def line_rows(picture: Path | None = None) -> list[tuple[str, ...]]:
    """Return a row for each line and servo; draw them if a picture's path is given."""
    rows, drawn = [], []
    for line in LINES:
        arm = bare_arm(line.arm)
        limits = motion_limits(arm, SETTINGS, 1.0)
        for name, follow in (('this', _ours), ('single-step pseudoinverse', _single_step)):
            commands, said = follow(arm, line)
            tips = np.array([_tip(arm, q) for q in commands])
            off, turned, along = _off(tips, line.direction)
            steps = [commands]
            for _ in range(3):
                steps.append(np.diff(steps[-1], axis=0) / PERIOD)
            fastest, jerk = (np.abs(steps[k]).max(axis=0) / limit
                             for k, limit in ((1, limits.velocity), (3, limits.jerk)))
            rows.append((line.name, name, f'{1e3 * off.max():.2f} mm', f'{turned.max():.4f} rad',
                         f'{along.max():.3f} m', f'{fastest.max():.2f}', f'{jerk.max():.3g}', said))
            drawn.append((line, name, off, along))
    if picture is not None:
        _draw(drawn, picture)
    return rows


def _ours(arm: Arm, line: Line) -> tuple[np.ndarray, str]:
    """Return the commands (k, n) of the servo of this package on a line, and what it says at the end."""
    commands, now = [line.start(arm)], 0.0
    servo = Servo(arm, SolveOptions(), SETTINGS, THRESHOLDS, 1.0, commands[0])
    for k in range(round(TIME * RATE)):
        if k % 5 == 0:
            servo.twist(TwistCommand(_twist(line), np.eye(3)), now)
        now += PERIOD
        commands.append(servo.tick(now))
    return np.array(commands), servo.finding.sentence


def _single_step(arm: Arm, line: Line) -> tuple[np.ndarray, str]:
    """Return the commands (k, n) of the other servo, and what it does at the end."""
    limits = motion_limits(arm, SETTINGS, 1.0)
    commands, said = [line.start(arm)], ''
    for _ in range(round(TIME * RATE)):
        q = commands[-1]
        jacobian = arm.jacobian(q)
        velocity = np.linalg.pinv(jacobian) @ _twist(line)
        share = _scale(arm, q, velocity, float(np.linalg.cond(jacobian)))
        velocity *= share
        velocity /= max(1.0, float(np.max(np.abs(velocity) / limits.velocity)))
        step = q + velocity * PERIOD
        halted = not velocity.any() or bool(np.any((step < limits.lower) | (step > limits.upper)))
        said = 'halts' if halted else f'at {100.0 * share:.2g} % of its speed'
        commands.append(q if halted else step)
    return np.array(commands), said


def _scale(arm: Arm, q: np.ndarray, velocity: np.ndarray, condition: float) -> float:
    """Return how much of a velocity (n,) the other servo lets through: less towards a singularity, none at it."""
    ahead = float(np.linalg.cond(arm.jacobian(q + velocity * 1e-2 / max(float(np.linalg.norm(velocity)), 1e-9))))
    if condition < SLOW_CONDITION or ahead < condition:
        return 1.0
    return max(1.0 - (condition - SLOW_CONDITION) / (HALT_CONDITION - SLOW_CONDITION), 0.0)


def _twist(line: Line) -> np.ndarray:
    return np.concatenate([SPEED * np.array(line.direction), np.zeros(3)])


def _off(tips: np.ndarray, direction: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return distances from the line [m], angles from the first pose [rad] and ways along the line [m], (k,) each."""
    way = tips[:, :3, 3] - tips[0, :3, 3]
    along = way @ np.array(direction)
    off = np.linalg.norm(way - np.outer(along, direction), axis=1)
    return off, np.array([np.linalg.norm(pin.log3(tip[:3, :3] @ tips[0, :3, :3].T)) for tip in tips]), along


def _tip(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return the pose (4, 4) of the tip by Pinocchio."""
    values = np.zeros(arm.model.nq)
    for joint, position in zip(arm.joint_names, q):
        values[arm.model.joints[arm.model.getJointId(joint)].idx_q] = position
    data = arm.model.createData()
    pin.framesForwardKinematics(arm.model, data, values)
    base, tip = (data.oMf[arm.model.getFrameId(frame)] for frame in (arm.base_frame, arm.tip_frame))
    return base.actInv(tip).homogeneous


def _draw(drawn: list[tuple], picture: Path) -> None:
    """Draw how far the tip is off each line, over the way along it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 2.2 * len(LINES)), layout='constrained')
    panes: dict[str, Callable] = {}
    for axes, line in zip(figure.subplots(len(LINES), 1), LINES):
        axes.set(title=line.name, xlabel='along the line [m]', ylabel='off the line [mm]', yscale='log')
        axes.set_ylim(1e-4, 1e3)
        axes.axhline(1.0, color='0.6', linewidth=0.8)
        panes[line.name] = axes
    for line, name, off, along in drawn:
        height = np.maximum(1e3 * off, 1e-4)
        (curve,) = panes[line.name].plot(along, height, label=name, linewidth=1.5)
        panes[line.name].plot(along[-1:], height[-1:], 'o', color=curve.get_color(), clip_on=False)  # where it ends
        panes[line.name].legend(loc='upper right')
    figure.savefig(picture, dpi=100)
