"""Whether the servo gives the right reason: hands that run arms into one trouble each, made and judged by geometry.

Of a UR5 the judge knows the closed form of its singularities: det J is the product of sin(elbow), sin(wrist) and the
distance of the wrist from the plane through the first axis. Of a Panda and an SO-101, of which the position of the tip
alone counts, it knows by Pinocchio where their joints are, and how much the arm is bent there. Besides, it knows joint
limits, and coal's distances.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from bench.published_robots import PANDA, UR5
from ros_ik_pkg.ik import Arm, Obstacle, SolveOptions, World, load_arm
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.contact_ahead import ContactAhead
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand

REASONS_HEAD = ('arm', 'trouble', 'runs', 'right', 'right about another one that came first', 'wrong')
RATE = 100.0  # Hz
LONGEST = 20.0  # s
SPEED = 0.2  # m/s, rad/s
UPPER_ARM, FOREARM, WRIST = 0.425, 0.39225, 0.09465  # m, of the UR5: a2, a3, d5
KINDS = {
    'ur5': ('too far', 'too near', 'shoulder', 'elbow', 'wrist', 'limit', 'contact'),
    'panda': ('too far', 'elbow', 'limit', 'wrist limit', 'contact'),
    'so101': ('too far', 'shoulder', 'limit'),
}
CHAINS = {  # joints at the shoulder, the elbow and the wrist
    'panda': ('panda_joint2', 'panda_joint4', 'panda_joint6'),
    'so101': ('shoulder_lift', 'elbow_flex', 'wrist_flex'),
}
RANGES = {  # of starts [rad]
    'panda': ((-1.2, 1.2), (-0.8, 0.8), (-1.0, 1.0), (-2.3, -1.3), (-1.0, 1.0), (1.0, 2.6), (-1.2, 1.2)),
    'so101': ((-1.0, 1.0), (-1.0, 0.3), (0.3, 1.2), (0.2, 1.2), (-1.0, 1.0)),
}
SEED = 7
STRETCHED = 0.35  # rad of both bends of an SO-101
STRAIGHT = {'ur5': 0.0, 'panda': -0.466}  # rad, of the elbow; of the wrist of a UR5, too
TURNED = {  # which joints, of which one turns
    ('elbow', 'ur5'): (2,), ('elbow', 'panda'): (3,), ('wrist', 'ur5'): (4,), ('limit', 'ur5'): (0, 5),
    ('limit', 'panda'): (6,), ('wrist limit', 'panda'): (4, 5, 6), ('limit', 'so101'): (0, 2),
}  # fmt: skip
NEAR_ZERO = {'elbow': 0.15, 'wrist': 0.05, 'shoulder': 0.1}  # rad, rad, m: what counts as singular
SAID = {
    'too far': ('nearly stretched',), 'too near': ('nearly folded',), 'wrist': ('nearly parallel',),
    'limit': ('limit',), 'shoulder': ('wrist is nearly on the axis',), 'contact': ('mm between', 'would touch'),
}  # fmt: skip
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=RATE)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})

Push = Callable[[np.ndarray], np.ndarray]  # joints (n,) -> twist (6,)


class Robot(NamedTuple):
    """An arm with and without shapes, and how it solves."""

    name: str
    arm: Arm
    shaped: Arm | None
    options: SolveOptions


def robots() -> list[Robot]:
    """Return the arms."""
    shaped = {name: load_arm(urdf, tip=tip, srdf=srdf) for name, (urdf, srdf, tip) in (('ur5', UR5), ('panda', PANDA))}
    return [
        Robot('ur5', load_arm('ur5'), shaped['ur5'], SolveOptions()),
        Robot('panda', shaped['panda'], shaped['panda'], SolveOptions()),
        Robot('so101', load_arm('so101'), None, SolveOptions(task_weights=(1, 1, 1, 0, 0, 0))),
    ]


def reason_rows(count: int, seed: int = SEED) -> list[tuple[str, ...]]:
    """Return a row of each arm and kind of trouble, of `count` runs in all for each arm."""
    rows = []
    for robot in robots():
        rng, kinds = np.random.default_rng(seed), KINDS[robot.name]
        for kind in kinds:
            runs = count // len(kinds) + (kind == kinds[0]) * (count % len(kinds))
            seen = Counter(_run(robot, kind, rng) for _ in range(runs))
            rows.append((robot.name, kind, *map(str, (runs, seen['right'], seen['other'], seen['wrong']))))
    return rows


def _run(robot: Robot, kind: str, rng: np.random.Generator) -> str:
    """Push an arm into trouble; return 'right', 'other' if it met another trouble and named that, or 'wrong'."""
    arm = robot.shaped if kind == 'contact' and robot.shaped is not None else robot.arm
    start = _start(robot, arm, rng, kind)
    room = _room(arm, start, rng) if kind == 'contact' else None
    ahead = None if room is None else ContactAhead(arm, room, THRESHOLDS, 0.0)
    push = _push(robot, arm, kind, start, rng)
    servo, now = Servo(arm, robot.options, SETTINGS, THRESHOLDS, 1.0, start, ahead), 0.0
    while now < LONGEST and not (servo.finding.code.halted and servo.at_rest and now > 0.5):
        servo.twist(TwistCommand(push(servo.position), np.eye(3)), now)
        now += 1.0 / RATE
        servo.tick(now)
    true = _troubles(robot, arm, servo.position, room)
    said = {name for name, words in SAID.items() if any(word in servo.finding.text for word in words)}
    if not servo.finding.code.halted or len(said) != 1 or not said <= true:
        return 'wrong'
    # A folded UR5 has its wrist at its shoulder, near the first axis too.
    meant = {'elbow': {'too far'}, 'too near': {'too near', 'shoulder'}, 'wrist limit': {'limit'}}.get(kind, {kind})
    return 'right' if said <= meant else 'other'


def _troubles(robot: Robot, arm: Arm, q: np.ndarray, room: Room | None) -> set[str]:
    """Return the troubles that an arm is in at q (n,), by closed forms, Pinocchio and coal."""
    found = _ur5_troubles(q) if robot.name == 'ur5' else _bends(robot, arm, q)
    found |= {
        'limit': bool(np.min([q - arm.lower, arm.upper - q]) < 2.0 * THRESHOLDS.limit_margin),
        'contact': room is not None and room.look(q).clearance < 2.0 * THRESHOLDS.contact_halt,
    }
    return {name for name, holds in found.items() if holds}


def _ur5_troubles(q: np.ndarray) -> dict[str, bool]:
    elbow = math.remainder(q[2], 2.0 * math.pi)
    return {
        'too far': abs(elbow) < NEAR_ZERO['elbow'],
        'too near': abs(elbow) > math.pi - NEAR_ZERO['elbow'],
        'wrist': abs(math.sin(q[4])) < NEAR_ZERO['wrist'],
        'shoulder': abs(_off_first_axis(q)) < NEAR_ZERO['shoulder'],
    }


def _bends(robot: Robot, arm: Arm, q: np.ndarray) -> dict[str, bool]:
    """Return whether a Panda, or an SO-101 with its tip, is stretched, folded, or above its first axis."""
    points = _joint_points(robot, arm, q)
    bend, wrist_bend = (_bend(*points[k : k + 3]) for k in (0, 1))
    if robot.name == 'panda':
        return {'too far': bend < NEAR_ZERO['elbow'], 'too near': bend > math.pi - NEAR_ZERO['elbow']}
    axis = _joint_points(robot, arm, q, ('shoulder_pan',))[0]
    return {
        'too far': max(bend, wrist_bend) < STRETCHED,
        'shoulder': float(np.linalg.norm((points[3] - axis)[:2])) < NEAR_ZERO['shoulder'],
    }


def _bend(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Return the angle [rad] between the ways from a to b and from b to c."""
    return float(np.arctan2(np.linalg.norm(np.cross(b - a, c - b)), (b - a) @ (c - b)))


def _joint_points(robot: Robot, arm: Arm, q: np.ndarray, names: tuple[str, ...] = ()) -> list[np.ndarray]:
    """Return where joints are, by default those of the chain, and the tip last (3,) [m], by Pinocchio."""
    model, values = arm.model, pin.neutral(arm.model)
    for joint, position in zip(arm.joint_names, q):
        values[model.joints[model.getJointId(joint)].idx_q] = position
    data = model.createData()
    pin.framesForwardKinematics(model, data, values)
    joints = [data.oMi[model.getJointId(name)].translation.copy() for name in names or CHAINS[robot.name]]
    return [*joints, data.oMf[model.getFrameId(arm.tip_frame)].translation.copy()]


def _off_first_axis(q: np.ndarray) -> float:
    """Return how far the wrist is from the first axis, in the plane of the arm [m]."""
    return (UPPER_ARM * math.cos(q[1]) + FOREARM * math.cos(q[1] + q[2])
            - WRIST * math.sin(q[1] + q[2] + q[3]))


def _start(robot: Robot, arm: Arm, rng: np.random.Generator, kind: str) -> np.ndarray:
    """Return a configuration (n,) [rad] that is in no trouble, nearer to the one that is meant than to the others."""
    while True:
        if robot.name == 'ur5':
            q = rng.uniform(-2.5, 2.5, 6)
            q[1] = rng.uniform(-2.4, -0.7)
            q[2] = rng.choice([-1.0, 1.0]) * rng.uniform(*{'too near': (1.8, 2.5)}.get(kind, (0.6, 1.4)))
            q[4] = rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 2.4)
            apart = abs(_off_first_axis(q)) > 0.2
        else:
            q = rng.uniform(*np.transpose(RANGES[robot.name]))
            apart = not _troubles(robot, arm, q, None)
        if apart and (kind != 'contact' or arm.contacts.look(q).clearance > 0.015):
            return q


def _push(robot: Robot, arm: Arm, kind: str, start: np.ndarray, rng: np.random.Generator) -> Push:
    """Return what the hand does; the start is brought near to the limit that is meant."""
    if kind in ('elbow', 'wrist', 'limit', 'wrist limit'):  # one joint alone turns
        joint = int(rng.choice(TURNED[kind, robot.name]))
        sign = rng.choice([-1.0, 1.0]) if 'limit' in kind else math.copysign(1.0, STRAIGHT[robot.name] - start[joint])
        if 'limit' in kind:
            bound = arm.upper[joint] if sign > 0.0 else arm.lower[joint]
            start[joint] = bound - sign * rng.uniform(0.1, 0.4)
        return lambda q: SPEED * sign * arm.jacobian(q)[:, joint]
    if kind == 'contact':
        direction = np.array([0.0, 0.0, -1.0])  # to the table
    else:
        shoulder, wrist = _points(arm, start) if robot.name == 'ur5' else _ends(robot, arm, start, kind)
        direction = wrist - shoulder
        direction *= (1.0, 1.0, 0.0) if kind == 'shoulder' else 1.0
        direction *= 1.0 if kind == 'too far' else -1.0
    twist = np.concatenate([SPEED * direction / np.linalg.norm(direction), np.zeros(3)])
    return lambda q: twist


def _ends(robot: Robot, arm: Arm, q: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return between which points (3,) an arm is stretched: its shoulder and its wrist, of an SO-101 its tip."""
    shoulder, _, wrist, tip = _joint_points(robot, arm, q)
    if robot.name == 'panda':
        return shoulder, wrist
    return _joint_points(robot, arm, q, ('shoulder_pan',))[0] if kind == 'shoulder' else shoulder, tip


def _points(arm: Arm, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shoulder and wrist (3,), in the plane of the arm: on the second and fourth axis, next to each other."""
    jacobian, tip = arm.jacobian(q), arm.forward(q)[:3, 3]
    axis = jacobian[3:, 1]
    second, fourth = (tip + np.cross(jacobian[3:, k], jacobian[:3, k]) for k in (1, 3))
    way = fourth - second
    return second, second + way - (way @ axis) * axis


def _room(arm: Arm, q: np.ndarray, rng: np.random.Generator) -> Room:
    """Return a room with a table below the tip."""
    place = arm.forward(q)[:3, 3] - (0.0, 0.0, rng.uniform(0.12, 0.25))
    table = Obstacle('table', 'box', [0.3, 0.3, 0.02], pin.SE3(np.eye(3), place))
    return arm.contacts.room(World(obstacles=(table,)))
