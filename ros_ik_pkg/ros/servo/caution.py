"""Rules of caution: how fast the arm may go near a singularity, a joint limit, a contact, and at its top speed.

Every rule judges the commanded motion, not the slowed one, so that a halted arm moves again as soon as a command leads
away.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.ros.interface.servo_settings import Thresholds
from ros_ik_pkg.ros.servo.codes import FOLLOWING, Code, Finding, strictest
from ros_ik_pkg.ros.servo.contact_ahead import ContactAhead
from ros_ik_pkg.ros.servo.limiter import MotionLimits
from ros_ik_pkg.ros.servo.singularity import name_singularity

LOOK_AHEAD = 1e-3  # rad, m: motion of the fastest joint after which a measure is compared with its value here
FAR = 1e6  # rad, m: room without bound
TOP_SPEED = 0.95  # of the velocity limits: the rest is for catching up
BRAKE = 0.3  # of acceleration and jerk, reserved for stopping; the rest is for the curve of the line
TURN = 0.6  # of acceleration: how much a joint changes it as it begins to brake
CURVE = 0.4  # of the acceleration limits, for the curve of the joints along a straight line
SMOOTHNESS = 2.0  # power of the sum over joints, so that there is no kink if another joint becomes the hardest
ROOM_WHERE_HALTED = 0.03  # rad, m: room in which a motion that leads away from below the halting threshold can stop
LEAST_LOOK = 0.04  # rad, m: how far ahead a peak of the smallest singular value is looked for, at least
PEAK_IS_NEAR = 0.01  # rad, m: a motion to a peak that near does not count as one that leads away
LOOKS = 5  # at postures along a stop, for a peak of the smallest singular value
UNNOTICED = 1.3  # share of the allowed speed above which a rule is not reported
NAMED_FOR = 0.01  # rad, m: motion of a joint after which a singularity is named again
STILL = 1e-9  # rad/s, m/s: no motion
DAMPING = 1e-4  # of the judged joint velocities: near a singularity they exceed every limit, and are slowed
JOINTS_TOO_FAST = (Code.SLOWED_VELOCITY, Code.SLOWED_ACCELERATION)
AXES = ('x', 'y', 'z')


class Allowance(NamedTuple):
    """How fast the joints may go: at `least`, and at `most` of their top speed if they can stop within `room`."""

    least: float
    most: float
    room: float  # rad, m; of the fastest joint
    away: bool  # whether the motion leads away from what the rule is about


class Approach:
    """A rule about a measure that must not become small, such as a clearance: slow below `slow`, no motion at `halt`.

    Between the two the top speed falls in proportion. The joints can always stop before `halt`.
    """

    def __init__(self, slow: float, halt: float, thresholds: Thresholds) -> None:
        self._slow, self._halt = max(slow, halt), halt
        self._leaving_share, self._wider = thresholds.leaving_share, 1.0 + thresholds.hysteresis
        self._slowed = self._halted = False

    @property
    def widest(self) -> float:
        """The measure below which the rule can apply."""
        return self._slow * self._wider

    def judge(self, now: float, ahead: float, room_to_peak: float = FAR) -> Allowance:
        """Return how fast a motion may go.

        now, ahead: the measure here, and LOOK_AHEAD further on. room_to_peak: how far [rad, m] the fastest joint can go
        until a measure that rises falls again.
        """
        self._slowed = now < (self._slow * self._wider if self._slowed else self._slow)
        halt = min(self._halt * self._wider, self._slow) if self._halted else self._halt
        self._halted = now <= halt
        share = 1.0
        if self._slowed:
            share = 0.0 if self._halted else min((now - self._halt) / max(self._slow - self._halt, 1e-12), 1.0)
        if ahead > now:
            room = min(room_to_peak, ROOM_WHERE_HALTED) if self._halted else room_to_peak
            return Allowance(share, max(share, self._leaving_share), room, room_to_peak > PEAK_IS_NEAR)
        # If a singular value is the sine of a joint, the linear estimate is its tangent: the arctangent corrects that.
        return Allowance(0.0, share, math.atan(max(now - halt, 0.0) * LOOK_AHEAD / max(now - ahead, 1e-12)), False)


class Posture(NamedTuple):
    """A configuration q (n,) and the task's Jacobian there."""

    q: np.ndarray
    joints_from_twist: np.ndarray  # (n, 6) joint velocity for a twist of the tip in base axes
    jacobian: np.ndarray  # (6, n)
    sigma: float  # the smallest singular value
    idle: np.ndarray  # (n,) the joint velocity that goes with it
    lost: np.ndarray  # (6,) the twist in base axes that goes with it


def posture(arm: Arm, q: np.ndarray, rows: np.ndarray) -> Posture:
    """Return the posture at q (n,), for the rows (k, 6) of the task."""
    jacobian = arm.jacobian(q)
    left, sigmas, right = np.linalg.svd(rows @ jacobian, full_matrices=False)
    joints_from_twist = right.T @ ((sigmas / (sigmas**2 + DAMPING**2))[:, None] * (left.T @ rows))
    return Posture(q, joints_from_twist, jacobian, float(sigmas[-1]), right[-1], rows.T @ left[:, -1])


class Caution:
    """All rules for one arm. They remember what they slowed, so each motion from rest needs a new Caution."""

    def __init__(
        self,
        arm: Arm,
        limits: MotionLimits,
        thresholds: Thresholds,
        contact: ContactAhead | None = None,
    ) -> None:
        """contact: None if contact does not count."""
        self._arm, self._limits, self._thresholds, self.contact_ahead = arm, limits, thresholds, contact
        self._named_at: np.ndarray | None = None
        self._singularity_name = ''
        self._singularity = Approach(thresholds.singularity_slow, thresholds.singularity_halt, thresholds)
        self._contact = Approach(thresholds.contact_slow, thresholds.contact_halt, thresholds)

    def judge(self, here: Posture, twist: np.ndarray, rows: np.ndarray, curve: float = CURVE) -> Finding:
        """Return the strictest finding about a twist (6,) of the tip in a posture, with the rows (k, 6) of the task.

        Its share is the allowed speed over the commanded one: 2 if the tip may be twice as fast. curve: share of the
        acceleration limits for the curve of the joints along the line.
        """
        velocity = here.joints_from_twist @ twist
        fastest = float(np.abs(velocity).max())
        if fastest < STILL:
            return FOLLOWING
        time = LOOK_AHEAD / fastest
        ahead = posture(self._arm, here.q + velocity * time, rows)
        acceleration = (ahead.joints_from_twist @ twist - velocity) / time
        found = [
            self._near_limit(here.q, velocity),
            self._near_singularity(here, ahead, velocity, twist, rows),
            self._at_top_speed(velocity),
            self._at_top_acceleration(acceleration, curve),
        ]
        if self.contact_ahead is not None:
            found.append(self._near_contact(self.contact_ahead, here.q, ahead.q, velocity))
        finding = strictest(found)
        if finding.code in JOINTS_TOO_FAST and here.sigma < self._thresholds.singularity_slow:
            return found[1]._replace(share=finding.share)  # the singularity is the cause of the high joint speeds
        return finding

    def _near_limit(self, q: np.ndarray, velocity: np.ndarray) -> Finding:
        upwards = velocity > 0.0
        distance = np.where(upwards, self._limits.upper - q, q - self._limits.lower)
        shares = _shares(self._stoppable(distance - self._thresholds.limit_margin), velocity)
        worst = int(np.argmin(shares))
        side = 'upper' if upwards[worst] else 'lower'
        text = f'{self._arm.joint_names[worst]} is {max(distance[worst], 0.0):.2g} from its {side} limit'
        return Finding(float(shares[worst]), Code.SLOWED_JOINT_LIMIT, text)

    def _near_singularity(
        self, here: Posture, ahead: Posture, velocity: np.ndarray, twist: np.ndarray, rows: np.ndarray
    ) -> Finding:
        room = FAR
        if here.sigma < min(ahead.sigma, self._singularity.widest):
            slope = (ahead.sigma - here.sigma) / LOOK_AHEAD
            room = self._room_to_peak(here, slope, velocity, twist, rows)
        share, away = self._share(self._singularity.judge(here.sigma, ahead.sigma, room), velocity)
        text = ''
        if share < UNNOTICED or here.sigma < self._thresholds.singularity_slow:
            text = f'{self._name(here)}, sigma_min {here.sigma:.2g}: the tip can hardly {_motion(here.lost)}'
        slowed = Code.LEAVING_SINGULARITY if away else Code.SLOWED_SINGULARITY
        return Finding(share, slowed, text)

    def _name(self, here: Posture) -> str:
        """Return the name of a singularity, kept for NAMED_FOR because naming takes longer than all rules together."""
        if self._named_at is None or np.abs(here.q - self._named_at).max() > NAMED_FOR:
            self._named_at = here.q
            self._singularity_name = name_singularity(here.jacobian, here.idle, here.lost, self._arm.joint_names)
        return self._singularity_name

    def _near_contact(
        self, contact: ContactAhead, q: np.ndarray, ahead: np.ndarray, velocity: np.ndarray
    ) -> Finding:
        nearing = contact.nearing(q, ahead, LOOK_AHEAD)
        if nearing is None:
            return FOLLOWING
        share, away = self._share(self._contact.judge(nearing.now, nearing.ahead), velocity)
        slowed = Code.LEAVING_CONTACT if away else Code.SLOWED_CONTACT
        return Finding(share, slowed, nearing.text)

    def _at_top_speed(self, velocity: np.ndarray) -> Finding:
        shares = _shares(TOP_SPEED * self._limits.velocity, velocity)
        worst = int(np.argmin(shares))
        text = f'{self._arm.joint_names[worst]} would have to move at {abs(velocity[worst]):.2g}, beyond its limit'
        return Finding(float(shares[worst]), Code.SLOWED_VELOCITY, text)

    def _at_top_acceleration(self, acceleration: np.ndarray, curve: float) -> Finding:
        """Limit the speed so that the joint accelerations along the line, which grow as its square, stay in limits."""
        needed = np.abs(acceleration) / (curve * self._limits.acceleration)
        worst = int(np.argmax(needed))
        text = (f'{self._arm.joint_names[worst]} would have to accelerate at {abs(acceleration[worst]):.2g}, '
                'too near to its limit')
        together = max(float(np.sum(needed**SMOOTHNESS)), STILL**SMOOTHNESS)
        return Finding(together ** (-0.5 / SMOOTHNESS), Code.SLOWED_ACCELERATION, text)

    def _room_to_peak(
        self, here: Posture, slope: float, velocity: np.ndarray, twist: np.ndarray, rows: np.ndarray
    ) -> float:
        """Return how far [rad, m] the fastest joint can go until the smallest singular value has its peak; FAR if that
        value leaves the range of the rule first, or if the joints can stop before.

        slope: its rise per rad or m of that joint.
        """
        stop = float(np.max(self._stop(np.abs(velocity))))
        step = max(stop, LEAST_LOOK) / (LOOKS - 2)  # further than that, so that no peak is seen late
        before = here.sigma - slope * step  # as if it had risen evenly
        for k in range(LOOKS):
            ahead = posture(self._arm, here.q + velocity * (step / np.abs(velocity).max()), rows)
            if ahead.sigma < here.sigma:  # the peak of the parabola through three values
                bend = 2.0 * here.sigma - before - ahead.sigma
                return max(k + 0.5 * (ahead.sigma - before) / bend, 0.0) * step
            if ahead.sigma > self._singularity.widest:
                break
            before, here, velocity = here.sigma, ahead, ahead.joints_from_twist @ twist
        return FAR

    def _share(self, allowed: Allowance, velocity: np.ndarray) -> tuple[float, bool]:
        """Return the allowed share of the velocity (n,), and whether it leads away."""
        rooms = allowed.room * np.abs(velocity) / np.abs(velocity).max()
        most = np.minimum(allowed.most * self._limits.velocity, self._stoppable(rooms))
        most = np.maximum(allowed.least * self._limits.velocity, most)
        return float(_shares(most, velocity).min()), allowed.away

    def _stoppable(self, room: np.ndarray) -> np.ndarray:
        """Return the velocity (n,) from which each joint stops within a room (n,), at BRAKE of its limits.

        It uses v^2 / 2a + v (a / 2j + t): the length of a stop that reaches both limits, and of the motion in the time
        t in which the joint changes its acceleration by TURN of its limit.
        """
        a, ramp = self._braking()
        room = np.clip(room, 0.0, FAR)
        return 2.0 * room / (np.sqrt(ramp**2 + 2.0 * room / a) + ramp)

    def _stop(self, speed: np.ndarray) -> np.ndarray:
        """Return the length (n,) of a stop from a speed (n,) of each joint: the inverse of `_stoppable`."""
        a, ramp = self._braking()
        return speed**2 / (2.0 * a) + speed * ramp

    def _braking(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the acceleration a (n,) of a stop, and a / 2j + t (n,)."""
        j = BRAKE * self._limits.jerk
        a = np.minimum(BRAKE * self._limits.acceleration, np.sqrt(j * self._limits.velocity))  # a stop needs no more
        return a, a / (2.0 * j) + TURN * self._limits.acceleration / self._limits.jerk


def _shares(most: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return the share of each velocity (n,) that is within the largest allowed one (n,)."""
    speed = np.abs(velocity)
    return np.where(speed < STILL, np.inf, most / np.maximum(speed, STILL))


def _motion(direction: np.ndarray) -> str:
    """Return words for the motion of the tip along a direction (6,) in base axes: the larger of its two halves."""
    half, verb = (direction[:3], 'move along') if np.linalg.norm(direction[:3]) >= np.linalg.norm(direction[3:]) else (
        direction[3:], 'turn about')  # fmt: skip
    half = half / np.linalg.norm(half)
    largest = int(np.argmax(np.abs(half)))
    if abs(half[largest]) > 0.98:
        return f'{verb} {AXES[largest]}'
    half = half * np.sign(half[largest])
    return f'{verb} ({", ".join(f"{value:.2f}" for value in half)})'
