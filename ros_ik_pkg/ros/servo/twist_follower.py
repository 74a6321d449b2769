"""From a twist of the tip, or a pose to go to, to joint positions: a pose that moves, and the joints that follow it.

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
from ros_ik_pkg.ik.motion.jerk_limited import advance
from ros_ik_pkg.ik.options import all_demanded
from ros_ik_pkg.ros.handling.final_check import fault_of, fault_of_command
from ros_ik_pkg.ros.interface.servo_settings import GO_ON, STOP
from ros_ik_pkg.ros.servo.caution import JOINTS_TOO_FAST, UNNOTICED, Caution, Posture, posture
from ros_ik_pkg.ros.servo.codes import FOLLOWING, Code, Finding
from ros_ik_pkg.ros.servo.damped import QUICKEST, fade
from ros_ik_pkg.ros.servo.limiter import Motion, MotionLimits
from ros_ik_pkg.ros.servo.self_motion import SelfMotion

TOLERANCE = 1e-8  # m, rad: the error of each solve is noise in velocity and jerk
STILL = 1e-6  # rad/s, m/s: speed at which a motion has ended
SHARE = 0.5  # of acceleration and jerk for a change of the twist; the rest is for the curves of the joints
TURN = 0.8  # of acceleration: the most by which a joint changes it from speeding up to braking
GENTLE = 0.4  # as above, on a line to a pose, whose joints may reach their top speed
MOST_HELD_BACK = 0.7  # allowed share of the twist below which the twist itself is reduced
GENTLE_SPEED = 0.5  # of the velocity limits, on such a line
GENTLE_CURVE = 0.2  # of acceleration, for the curve of such a line: the jerk of the curve grows as its power of 1.5
GENTLENESS = 6.0  # power of the mean that approximates the smaller of two speeds without a kink
STANDSTILL = 0.005  # share of the commanded twist below which the arm counts as halted
CLOSING = 4.0 / 27.0 * QUICKEST  # of a period: the greatest gain around the quickest change without overshoot
LEAST_PART = 0.1  # of each component of a twist that catches up
ARRIVED = 1e-7  # rad, m: how near to a pose the joints count as there
OFF = 1e-3  # m, rad: a pose that is further away, and to which no motion of the joints leads


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
        line_speeds: tuple[float, float] = (math.inf, math.inf),
    ) -> None:
        """blocked: whether the whole motion stops if the joints cannot follow, or goes on with those that can.

        line_speeds: the most [m/s, rad/s] at which the tip goes to a pose.
        """
        self._arm, self._limits, self._caution, self._period, self._blocked = arm, limits, caution, period, blocked
        self._line_speeds = line_speeds
        options = all_demanded(options)
        self._weights = np.array(options.task_weights)
        self._in_tip_axes = options.task_frame == 'tip'
        self._checked = options
        near = replace(
            options,
            choice='first', max_attempts=1, max_joint_jump=0.0, deadline=period,
            position_tolerance=min(options.position_tolerance, TOLERANCE),
            orientation_tolerance=min(options.orientation_tolerance, TOLERANCE),
        )  # fmt: skip
        self._options = replace(near, avoid_collisions=False, null_space='none')
        self._lead = TURN * float(np.min(limits.acceleration / limits.jerk))
        self._self_motion = SelfMotion(arm, limits, near, period)
        self.start(arm.home)

    def start(self, q: np.ndarray, velocity: np.ndarray | None = None) -> None:
        """Begin at q (n,) [rad, m] with a joint velocity (n,) [rad/s, m/s]; default: at rest."""
        self.goal = Motion.rest(q)
        self.base_from_goal = self._arm.forward(q)
        self._end: Posture | None = None
        self._rest()
        self._self_motion.rest()
        self._velocity = np.zeros_like(q) if velocity is None else velocity
        if velocity is not None:
            self._twist = self._arm.jacobian(q) @ velocity
            self._moving = self._twist

    def _rest(self) -> None:
        """Stand still. In base axes [m/s, rad/s]: the twist without the rules, its rate, and the twist with them."""
        self._twist, self._change, self._moving = np.zeros((3, 6))
        self._factor = 1.0  # of the twist, which gives the moving one

    @property
    def standing(self) -> bool:
        """Whether the goal has come to rest."""
        return not (self._twist.any() or self._self_motion.velocity.any())

    def step(self, command: TwistCommand) -> tuple[Motion, Finding]:
        """Follow a command for a period; return the motion of the joints over it, and the finding of the rules."""
        wanted, before = self._in_base_axes(command), self._moving
        here, rows = self._here()
        self._shape(wanted, here.joints_from_twist)
        finding = self._slow(self._caution.judge(here, self._coming(), rows), wanted)
        return self._move(before, finding, here, bool(wanted.any()))

    def approach(self, base_from_target: np.ndarray, twist: np.ndarray, q: np.ndarray) -> tuple[Motion, Finding]:
        """Go straight to a pose (4, 4) that moves with a twist (6,) in base axes; return the same as `step`.

        q: (n,) joints [rad, m] at the pose, at which braking for it is planned.
        """
        here, rows = self._here()
        if self._end is None or self._end.q is not q:
            self._end = posture(self._arm, q, rows)
        away = rows.T @ (rows @ way_between(self.base_from_goal, base_from_target))
        before = self._moving
        wanted = self._pursue(away, twist, here.joints_from_twist)
        finding = self._caution.judge(here, self._coming(), rows, GENTLE_CURVE)
        finding = self._slow(finding, wanted)
        motion, finding = self._move(before, finding, here, bool(wanted.any()))
        if finding.code in JOINTS_TOO_FAST:  # a pose asks for no speed
            finding = FOLLOWING
        if finding.code is Code.FOLLOWING and self.standing and np.abs(away).max() > OFF:
            finding = Finding(0.0, Code.HALTED_BLOCKED, 'no motion of the joints brings the tip nearer to the pose')
        return motion, finding

    def _coming(self) -> np.ndarray:
        """Return the twist (6,) to judge: that of the time when the joints, which now accelerate, could brake."""
        return self._twist + self._lead * self._change

    def _here(self) -> tuple[Posture, np.ndarray]:
        """Return the posture, and the rows (k, 6) of the task in base axes."""
        rows = self._rows()
        return posture(self._arm, self.goal.position, rows), rows

    def _move(self, before: np.ndarray, finding: Finding, here: Posture, going: bool) -> tuple[Motion, Finding]:
        """Move the goal for a period, at whose start its twist (6,) was `before`; return what `step` says.

        going: whether a command wants it to move, and so the joints that are left over may move too.
        """
        twist = 0.5 * (before + self._moving)
        contact = self._caution.contact_ahead
        seed = self.goal.position + self._self_motion.step(
            self.goal.position, self.base_from_goal, here.joints_from_twist @ twist, going,
            None if contact is None else contact.room.world,
        )  # fmt: skip
        q, fault = self._solve(twist, seed, here.joints_from_twist)
        if fault:
            finding = Finding(0.0, Code.HALTED_BLOCKED, fault)
            self._rest()
            self._self_motion.rest()
        velocity = (q - self.goal.position) / self._period
        motion = self.goal._replace(velocity=velocity, acceleration=(velocity - self._velocity) / self._period)
        self.goal, self._velocity = Motion.rest(q), velocity
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
        gap, self._change = self._fade(self._twist - wanted, self._change, joints_from_twist)
        self._twist = wanted + gap
        if not wanted.any() and np.abs(joints_from_twist @ self._twist).max() < STILL:
            self._rest()

    def _fade(
        self, twist: np.ndarray, change: np.ndarray, joints_from_twist: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return a twist (6,) and its rate (6,) a period later, on the way to nothing."""
        return fade(twist, change, np.abs(joints_from_twist @ twist), self._limits, self._period, SHARE)

    def _pursue(self, away: np.ndarray, twist: np.ndarray, joints_from_twist: np.ndarray) -> np.ndarray:
        """Change the twist so that the goal comes to where `away` (6,) leads, and goes on from there with `twist`.

        Return the twist (6,) that is wanted on the way. The last bit needs none of the limits, and is made up for in
        proportion.
        """
        gain, way = CLOSING / self._period, joints_from_twist @ away
        closest = SHARE * float(self._limits.jerk.min()) * (self._period / QUICKEST) ** 2  # a change at the quickest
        if max(np.abs(joints_from_twist @ (self._twist - twist)).max(), gain * np.abs(way).max()) <= closest:
            wanted = twist + gain * away if np.abs(way).max() > ARRIVED else twist
            self._shape(wanted, joints_from_twist)
            return wanted
        if not twist.any():
            return self._go_straight(away, way, joints_from_twist)
        self._catch_up(away, twist, joints_from_twist)
        return twist

    def _go_straight(self, away: np.ndarray, way: np.ndarray, joints_from_twist: np.ndarray) -> np.ndarray:
        """Change what of the twist leads along `away` (6,), and the joints along their way (n,), to stop where it ends.

        It changes as quickly as all joints can; the rest of the twist fades. Return the twist at full speed.
        """
        length = max(float(np.abs(way).max()), ARRIVED)
        square = max(float(way @ way), ARRIVED**2)
        along, quicker = (float(way @ (joints_from_twist @ t)) / square for t in (self._twist, self._change))
        there = self._end.joints_from_twist @ away  # where it brakes, the joints may have to go faster
        tip = np.linalg.norm(away.reshape(2, 3), axis=1)
        speed = min(limit * length / max(part, STILL) for limit, part in zip(self._line_speeds, tip))
        reach = np.maximum(np.abs(way), np.abs(there)) / length
        state = self._moved_on([[-length], [along * length], [quicker * length]], reach, speed)
        aside, change = self._fade(self._twist - along * away, self._change - quicker * away, joints_from_twist)
        self._twist = state[1, 0] / length * away + aside
        self._change = state[2, 0] / length * away + change
        fastest = GENTLE_SPEED * float(np.min(self._limits.velocity / np.maximum(reach, STILL)))
        return min(speed, fastest) / length * away

    def _catch_up(self, away: np.ndarray, twist: np.ndarray, joints_from_twist: np.ndarray) -> None:
        """Change each component of the twist by itself, to end with `twist` where `away` (6,) leads."""
        ahead = self._twist - twist
        parts = np.abs([away, ahead])
        weights = LEAST_PART + np.sum(parts / np.maximum(parts.max(axis=1, keepdims=True), STILL), axis=0)
        reach = np.abs(joints_from_twist) @ weights
        state = np.array([-away, ahead, self._change]) / weights
        _, ahead, change = self._moved_on(state, reach, math.inf, SHARE) * weights
        self._twist, self._change = twist + ahead, change

    def _moved_on(self, state: list | np.ndarray, reach: np.ndarray, speed: float, share: float = GENTLE) -> np.ndarray:
        """Return a state (3, k), seen from where it is to come to rest, a period later.

        reach: (n,) how much each joint moves at most with it. speed: the most beside what the joints allow.
        """
        reach = np.maximum(reach, STILL)
        most = [part * float(np.min(limit / reach)) for part, limit in (
            (GENTLE_SPEED, self._limits.velocity), (share, self._limits.acceleration), (share, self._limits.jerk)
        )]  # fmt: skip
        state = np.array(state)
        bounds = np.array([-math.inf, math.inf, min(most[0], speed), *most[1:]])
        columns = state.shape[1]
        advance(state, np.zeros((4, columns)), np.repeat(bounds[:, None], columns, axis=1), self._period)
        return state

    def _scale(self, share: float) -> None:
        self._twist, self._change = share * self._twist, share * self._change

    def _slow(self, finding: Finding, wanted: np.ndarray) -> Finding:
        """Slow the twist to the share that a finding allows, without a kink; return the finding to report.

        What is held back does not accumulate: when the rules allow more, the twist grows from its present value.
        """
        share = max(finding.share, MOST_HELD_BACK)
        gentle = (share**-GENTLENESS + 1.0) ** (-1.0 / GENTLENESS)
        if gentle > self._factor:
            self._scale(self._factor / gentle)
        self._scale(min(finding.share / MOST_HELD_BACK, 1.0))
        self._factor = gentle
        self._moving = gentle * self._twist
        if finding.share > UNNOTICED:
            return FOLLOWING
        left = _share_of(self._moving, wanted)
        return finding._replace(share=left, code=finding.code.at_standstill if left < STANDSTILL else finding.code)

    def _solve(self, twist: np.ndarray, seed: np.ndarray, joints_from_twist: np.ndarray) -> tuple[np.ndarray, str]:
        """Move the goal by a twist (6,), from a seed (n,); return its joints (n,), and why it does not move, or ''."""
        q = self.goal.position
        if not twist.any() and np.array_equal(seed, q):
            return q, ''
        if self._arm.n < np.count_nonzero(self._weights):  # too few joints for the whole twist: take the nearest motion
            return self._nearest(q + joints_from_twist @ twist * self._period)
        pose = moved(self.base_from_goal, twist * self._period)
        try:
            solution = solve(self._arm, pose, seed, self._options)
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


def way_between(base_from_start: np.ndarray, base_from_end: np.ndarray) -> np.ndarray:
    """Return the twist (6,) in base axes that leads from one pose (4, 4) straight to another in a second."""
    turn = pin.log3(base_from_end[:3, :3] @ base_from_start[:3, :3].T)
    return np.concatenate([base_from_end[:3, 3] - base_from_start[:3, 3], turn])


def moved(base_from_start: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return where a step (6,) in base axes [m, rad] leads from a pose (4, 4)."""
    pose = base_from_start.copy()
    pose[:3, 3] += step[:3]
    pose[:3, :3] = _orthogonal(pin.exp3(step[3:]) @ pose[:3, :3])
    return pose


def _share_of(twist: np.ndarray, wanted: np.ndarray) -> float:
    """Return the share, from 0 to 1, of the wanted twist (6,) that another one (6,) has."""
    return min(float(np.linalg.norm(twist) / max(np.linalg.norm(wanted), 1e-12)), 1.0)


def _orthogonal(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) nearest to a product of many rotations."""
    quaternion = pin.SE3ToXYZQUAT(pin.SE3(rotation, np.zeros(3)))
    quaternion[3:] /= np.linalg.norm(quaternion[3:])
    return pin.XYZQUATToSE3(quaternion).rotation
