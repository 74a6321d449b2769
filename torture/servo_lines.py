"""Lines of the tip by the servo: across the reach of an arm, and random ones, half of them from beside a singularity.
And how long an arm moves after the last twist."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import Arm, solve
from ros_ik_pkg.ros.interface import servo_settings
from ros_ik_pkg.ros.servo.codes import Code
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand
from torture.plan import Check, Plan, progress, unless
from torture.servo_arms import BASE, PER_COMMAND, PERIOD, RATE, SETTINGS, THRESHOLDS, Case

LINE = 1e-3  # m
BACK, REST = 1e-3, 2.0  # rad, s
SPEED = 0.2  # m/s
LINE_TIME = 12.0  # s outwards: further than any of these arms reaches
LINES, LENGTH = 50, 0.2  # random ones, and m to the pose at their end
RANDOM_TIME = 3.0  # s
MARGIN = 0.02  # rad, from a joint limit to where they begin


def line(name: str, case: Case, by: str) -> Check:
    """Lead the tip outwards beyond the reach, and back, by twists or poses; see how far it leaves its line, and why it
    halts; poses that have no solution are not sent, and the last one leads to the start."""
    arm, start, options, _ = case
    servo = Servo(arm, options, replace(SETTINGS, pose_motion=servo_settings.LINE), THRESHOLDS, 1.0, start)
    now, last, tips, half = 0.0, '', [], round(LINE_TIME * RATE)
    for k in range(2 * half + round(REST * RATE)):
        sign = 1.0 if k < half else -1.0
        if k == half:
            last = servo.finding.sentence
        if k % PER_COMMAND == 0 and k < 2 * half and by == 'twists':
            servo.twist(TwistCommand(np.array([sign * SPEED, 0.0, 0.0, 0.0, 0.0, 0.0]), BASE), now)
        elif k % PER_COMMAND == 0 and k < 2 * half:
            target = arm.forward(start)
            target[0, 3] += SPEED * PERIOD * min(k, 2 * half - k - PER_COMMAND)
            solution = solve(arm, target, servo.position, options)
            if solution.converged:
                servo.pose(solution.q, now)
        now += PERIOD
        tips.append(_tip(arm, servo.tick(now)))
    off = float(np.linalg.norm(np.array(tips)[:, 1:] - _tip(arm, start)[1:], axis=1).max())
    figure, fault = f'{1e3 * off:.3f} mm off; {last}', unless(off < LINE, f'{1e3 * off:.2f} mm off the line')
    if by == 'twists':
        fault = fault or unless(last.startswith('halted: '), 'no reason')
    elif arm.n <= np.count_nonzero(options.task_weights):  # others may come back in another posture
        back = float(np.abs(servo.position - start).max())
        figure, fault = f'{figure}; back {back:.1e} rad from the start', fault or unless(back < BACK, 'another posture')
    return Check(f'{name}: a line by {by} out to the edge of reach and back', figure, fault)


def random_lines(name: str, case: Case, by: str, plan: Plan) -> Check:
    """Lead the tip along random lines from random configurations, by twists or to one pose; see how far off it gets."""
    rng, off, odd = np.random.default_rng(plan.seed), [], []
    for _ in progress(range(LINES), f'{name}: lines by {by}'):
        start = _anywhere(case.arm, rng)
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        tips = np.array(_follow(case, start, direction, by, float(rng.choice([0.05, 0.1, 0.3]))))
        way = tips - tips[0]
        off.append(float(np.linalg.norm(way - np.outer(way @ direction, direction), axis=1).max()))
        if off[-1] > LINE:
            odd.append(f'{1e3 * off[-1]:.1f} mm from {np.round(start, 4).tolist()}')
    figure = f'at most {1e3 * max(off):.2f} mm off, median {1e3 * float(np.median(off)):.4f} mm'
    return Check(f'{name}: {LINES} random lines by {by}', figure, '; '.join(odd))


def _anywhere(arm: Arm, rng: np.random.Generator) -> np.ndarray:
    """Return joints (n,) within the limits, every other time with the joint nearly at zero that stretches many arms or
    lines up their wrists: the third or fourth, or the last but one."""
    low, high = np.maximum(arm.lower, -math.pi), np.minimum(arm.upper, math.pi)
    q = rng.uniform(low, high)
    if rng.random() < 0.5:
        q[rng.choice([arm.n // 2, arm.n - 2])] = 0.15 * rng.normal()
    return np.clip(q, low + MARGIN, high - MARGIN)


def _follow(case: Case, start: np.ndarray, direction: np.ndarray, by: str, speed: float) -> list[np.ndarray]:
    """Return the positions (k, 3) [m] of the tip along a line, until it stands or RANDOM_TIME ends."""
    servo = Servo(case.arm, case.options, replace(SETTINGS, pose_motion=servo_settings.LINE), THRESHOLDS, 1.0, start)
    now, tips, twist = 0.0, [_tip(case.arm, start)], np.concatenate([speed * direction, np.zeros(3)])
    if by == 'poses':
        target = case.arm.forward(start)
        target[:3, 3] += LENGTH * direction
        solution = solve(case.arm, target, start, case.options)
        if not solution.converged:
            return tips
        servo.pose(solution.q, now)
    for k in range(round(RANDOM_TIME * RATE)):
        if by == 'twists' and k % PER_COMMAND == 0:
            servo.twist(TwistCommand(twist, BASE), now)
        now += PERIOD
        tips.append(_tip(case.arm, servo.tick(now)))
        if k > PER_COMMAND and servo.at_rest:
            break
    return tips


def stop(name: str, case: Case) -> Check:
    """Measure the time from the last twist to standstill."""
    arm, start, options, _ = case
    servo, now = Servo(arm, options, SETTINGS, THRESHOLDS, 1.0, start), 0.0
    for k in range(round(0.8 * RATE)):
        if k % PER_COMMAND == 0:
            servo.twist(TwistCommand(np.array([0.0, 0.2, 0.1, 0.0, 0.0, 0.5]), BASE), now)
            last = now
        now += PERIOD
        servo.tick(now)
    while servo.finding.code is not Code.COMMANDS_STOPPED:
        needed = servo._limiter.time_to_rest
        now += PERIOD
        servo.tick(now)
    while not servo.at_rest:
        now += PERIOD
        servo.tick(now)
    took, allowed = now - last, SETTINGS.command_timeout + needed + 3.0 * PERIOD
    figure = f'{took:.3f} s, of which {SETTINGS.command_timeout:g} s is command_timeout and {needed:.3f} s the stop'
    return Check(f'{name}: last twist to standstill', figure, unless(took <= allowed, f'more than {allowed:.3f} s'))


def _tip(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return the position (3,) [m] of the tip by Pinocchio."""
    values = np.zeros(arm.model.nq)
    for joint, position in zip(arm.joint_names, q):
        values[arm.model.joints[arm.model.getJointId(joint)].idx_q] = position
    pin.framesForwardKinematics(arm.model, arm._data, values)
    base, tip = (arm._data.oMf[arm.model.getFrameId(frame)] for frame in (arm.base_frame, arm.tip_frame))
    return base.actInv(tip).translation.copy()
