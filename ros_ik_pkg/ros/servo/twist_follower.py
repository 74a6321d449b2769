"""From a twist of the tip to joint positions: a pose that moves with the twist, and the joints that follow it.

The pose moves on from the last pose, not from that of the joints, so the tip stays on its line. If the joints cannot
follow, the pose waits: the whole motion stops instead of continuing without the blocked joint.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import Arm, NotCompiledError, SolveOptions, Status, solve
from ros_ik_pkg.ik.options import all_demanded
from ros_ik_pkg.ros.handling.final_check import fault_of, fault_of_command
from ros_ik_pkg.ros.interface.servo_settings import GO_ON, STOP
from ros_ik_pkg.ros.servo.caution import UNNOTICED, Caution, posture
from ros_ik_pkg.ros.servo.codes import FOLLOWING, Code, Finding
from ros_ik_pkg.ros.servo.limiter import Motion, MotionLimits

TOLERANCE = 1e-8  # m, rad: the error of each solve is noise in velocity and jerk
STILL = 1e-6  # rad/s, m/s: speed at which a motion has ended
SHARE = 0.5  # of acceleration and jerk for a change of the twist; the rest is for the curves of the joints
QUICKEST = 0.5  # of a period: the smallest time constant of a change of the twist
MOST_HELD_BACK = 0.7  # allowed share of the twist below which the twist itself is reduced
GENTLENESS = 6.0  # power of the mean that approximates the smaller of two speeds without a kink
STANDSTILL = 0.005  # share of the commanded twist below which the arm counts as halted
PEAK = 1.0 / math.e  # of rate * change: the greatest acceleration of a critically damped change


class TwistCommand(NamedTuple):
    """Velocity of the tip: `twist` (6,) is its linear [m/s] and angular [rad/s] velocity in the axes `base_from_axes`
    (3, 3), or in those of the tip if that is None."""

    twist: np.ndarray
    base_from_axes: np.ndarray | None = None


class TwistFollower:
    """Follows twists from a start, one period at a time."""

    def __init__(
        self,
        arm: Arm,
        limits: MotionLimits,
        options: SolveOptions,
        caution: Caution,
        period: float,
        blocked: str = STOP,
    ) -> None:
        """blocked: whether the whole motion stops if the joints cannot follow, or goes on with those that can."""
        self._arm, self._limits, self._caution, self._period, self._blocked = arm, limits, caution, period, blocked
        options = all_demanded(options)
        self._weights = np.array(options.task_weights)
        self._in_tip_axes = options.task_frame == 'tip'
        self._checked = options
        self._options = replace(
            options,
            choice='first', max_attempts=1, max_joint_jump=0.0, avoid_collisions=False,
            position_tolerance=min(options.position_tolerance, TOLERANCE),
            orientation_tolerance=min(options.orientation_tolerance, TOLERANCE),
            deadline=period,
            null_space_step=SHARE * period * float(limits.velocity.min()),
        )  # fmt: skip
        self.start(arm.home)

    def start(self, q: np.ndarray, velocity: np.ndarray | None = None) -> None:
        """Begin at q (n,) [rad, m] with a joint velocity (n,) [rad/s, m/s]; default: at rest."""
        self.goal = Motion.rest(q)
        self.base_from_goal = self._arm.forward(q)
        self._rest()
        if velocity is not None:
            self._twist = self._arm.jacobian(q) @ velocity
            self._moving = self._twist

    def _rest(self) -> None:
        """Stand still. In base axes [m/s, rad/s]: the twist without the rules, its rate, and the twist with them."""
        self._twist, self._change, self._moving = np.zeros((3, 6))

    @property
    def standing(self) -> bool:
        """Whether the goal has come to rest."""
        return not self._twist.any()

    def step(self, command: TwistCommand) -> tuple[Motion, Finding]:
        """Follow a command for a period; return the motion of the joints over it, and the finding of the rules."""
        wanted, rows = self._in_base_axes(command), self._rows()
        here = posture(self._arm, self.goal.position, rows)
        before = self._moving
        self._shape(wanted, here.joints_from_twist)
        finding = self._slow(self._caution.judge(here, self._twist, rows), wanted)
        q, fault = self._solve(0.5 * (before + self._moving), here.joints_from_twist)
        if fault:
            finding = Finding(0.0, Code.HALTED_BLOCKED, fault)
            self._rest()
        motion = self.goal._replace(velocity=(q - self.goal.position) / self._period)
        self.goal = Motion.rest(q)
        return motion, finding

    def _in_base_axes(self, command: TwistCommand) -> np.ndarray:
        """Return the commanded twist (6,) in base axes."""
        axes = self.base_from_goal[:3, :3] if command.base_from_axes is None else command.base_from_axes
        return (command.twist.reshape(2, 3) @ axes.T).ravel()

    def _rows(self) -> np.ndarray:
        """Return the rows (k, 6) of the task that count, in base axes."""
        task_from_base = np.kron(np.eye(2), self.base_from_goal[:3, :3].T) if self._in_tip_axes else np.eye(6)
        return task_from_base[self._weights > 0.0]

    def _shape(self, wanted: np.ndarray, joints_from_twist: np.ndarray) -> None:
        """Change the twist towards the wanted one, as quickly as all joints can.

        All six components change alike, critically damped, so a twist keeps its direction from start to stop.
        """
        gap = self._twist - wanted
        joints = np.abs(joints_from_twist @ gap)
        with np.errstate(divide='ignore'):
            rate = min(
                QUICKEST / self._period,
                math.sqrt(SHARE * float(np.min(self._limits.jerk / joints))),
                SHARE * float(np.min(self._limits.acceleration / joints)) / PEAK,
            )
        decay, slope = math.exp(-rate * self._period), self._change + rate * gap
        self._twist = wanted + (gap + slope * self._period) * decay
        self._change = (slope - rate * (gap + slope * self._period)) * decay
        if not wanted.any() and np.abs(joints_from_twist @ self._twist).max() < STILL:
            self._rest()

    def _slow(self, finding: Finding, wanted: np.ndarray) -> Finding:
        """Slow the twist to the share that a finding allows, without a kink; return the finding to report.

        What is held back does not accumulate: when the rules allow more, the twist grows from its present value.
        """
        excess = min(finding.share / MOST_HELD_BACK, 1.0)
        self._twist, self._change = excess * self._twist, excess * self._change
        share = max(finding.share, MOST_HELD_BACK) if finding.share > 0.0 else 0.0
        self._moving = self._twist * (share**-GENTLENESS + 1.0) ** (-1.0 / GENTLENESS) if share else self._twist
        if share > UNNOTICED:
            return FOLLOWING
        left = _share_of(self._moving, wanted)
        return finding._replace(share=left, code=finding.code.at_standstill if left < STANDSTILL else finding.code)

    def _solve(self, twist: np.ndarray, joints_from_twist: np.ndarray) -> tuple[np.ndarray, str]:
        """Move the goal by a twist (6,); return its joints (n,), and why it does not move, or ''."""
        q = self.goal.position
        if not twist.any():
            return q, ''
        if self._arm.n < np.count_nonzero(self._weights):  # too few joints for the whole twist: take the nearest motion
            return self._nearest(q + joints_from_twist @ twist * self._period)
        pose = self._moved(twist)
        try:
            solution = solve(self._arm, pose, q, self._options)
        except NotCompiledError as error:
            return q, str(error)
        if solution.converged and not (fault := fault_of(solution.q, pose, self._arm, self._checked)):
            self.base_from_goal = self._without_drift(pose, solution.q)
            return solution.q, ''
        if self._blocked == GO_ON and solution.status != Status.NOT_FINITE:
            return self._nearest(solution.q)
        return q, fault if solution.converged else solution.status.text

    def _nearest(self, q: np.ndarray) -> tuple[np.ndarray, str]:
        """Take q (n,), clipped to the limits, as the goal, whatever pose of the tip that is."""
        q = np.clip(q, self._arm.lower, self._arm.upper) if self._checked.respect_limits else q
        if fault := fault_of_command(q, self._arm, self._checked):
            return self.goal.position, fault
        self.base_from_goal = self._arm.forward(q)
        return q, ''

    def _moved(self, twist: np.ndarray) -> np.ndarray:
        """Return the goal's pose (4, 4) a period later."""
        pose = self.base_from_goal.copy()
        pose[:3, 3] += twist[:3] * self._period
        pose[:3, :3] = _orthogonal(pin.exp3(twist[3:] * self._period) @ pose[:3, :3])
        return pose

    def _without_drift(self, pose: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return the pose, with the rows that the task leaves free replaced by those at q (n,)."""
        if np.all(self._weights > 0.0):
            return pose
        reached = self._arm.forward(q)
        base_from_task = pose[:3, :3] if self._in_tip_axes else np.eye(3)
        kept = np.diag(self._weights[:3] > 0.0), np.diag(self._weights[3:] > 0.0)
        away = base_from_task @ kept[0] @ base_from_task.T @ (pose - reached)[:3, 3]
        turned = base_from_task @ kept[1] @ base_from_task.T @ pin.log3(pose[:3, :3] @ reached[:3, :3].T)
        reached[:3, 3] += away
        reached[:3, :3] = _orthogonal(pin.exp3(turned) @ reached[:3, :3])
        return reached


def _share_of(twist: np.ndarray, wanted: np.ndarray) -> float:
    """Return the share, from 0 to 1, of the wanted twist (6,) that another one (6,) has."""
    return min(float(np.linalg.norm(twist) / max(np.linalg.norm(wanted), 1e-12)), 1.0)


def _orthogonal(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) nearest to a product of many rotations."""
    quaternion = pin.SE3ToXYZQUAT(pin.SE3(rotation, np.zeros(3)))
    quaternion[3:] /= np.linalg.norm(quaternion[3:])
    return pin.XYZQUATToSE3(quaternion).rotation
