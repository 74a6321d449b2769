"""Whether the servo gives the right reason: hands that run a UR5 into one trouble each, made and judged by geometry.

The judge knows the closed form of the arm's singularities alone: det J is the product of sin(elbow), sin(wrist) and the
distance of the wrist from the plane through the first axis; besides, its joint limits, and coal's distances.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin

from bench.published_robots import UR5
from ros_ik_pkg.ik import Arm, Obstacle, SolveOptions, World, load_arm
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.contact_ahead import ContactAhead
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand

REASONS_HEAD = ('trouble', 'runs', 'right', 'right about another one that came first', 'wrong')
RATE = 100.0  # Hz
LONGEST = 20.0  # s
SPEED = 0.2  # m/s, rad/s
UPPER_ARM, FOREARM, WRIST = 0.425, 0.39225, 0.09465  # m, of the UR5: a2, a3, d5
KINDS = ('too far', 'too near', 'shoulder', 'elbow', 'wrist', 'limit', 'contact')
NEAR_ZERO = {'elbow': 0.15, 'wrist': 0.05, 'shoulder': 0.1}  # rad, rad, m: what counts as singular
SAID = {
    'too far': ('nearly stretched',), 'too near': ('nearly folded',), 'wrist': ('nearly parallel',),
    'limit': ('limit',), 'shoulder': ('wrist is nearly on the axis',), 'contact': ('mm between', 'would touch'),
}  # fmt: skip
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=RATE)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})

Push = Callable[[np.ndarray], np.ndarray]  # joints (n,) -> twist (6,)


def reason_rows(count: int) -> list[tuple[str, ...]]:
    """Return a row of each kind of trouble, of `count` runs in all."""
    arm = load_arm('ur5')
    urdf, srdf, tip = UR5
    shaped = load_arm(urdf, tip=tip, srdf=srdf)
    rng, rows = np.random.default_rng(0), []
    for kind in KINDS:
        runs = count // len(KINDS) + (kind == KINDS[0]) * (count % len(KINDS))
        seen: Counter[str] = Counter()
        for _ in range(runs):
            seen[_run(shaped if kind == 'contact' else arm, kind, rng)] += 1
        rows.append((kind, *map(str, (runs, seen['right'], seen['other'], seen['wrong']))))
    return rows


def _run(arm: Arm, kind: str, rng: np.random.Generator) -> str:
    """Push an arm into trouble; return 'right', 'other' if it met another trouble and named that, or 'wrong'."""
    start = _start(arm, rng, kind)
    room = _room(arm, start, rng) if kind == 'contact' else None
    ahead = None if room is None else ContactAhead(arm, room, THRESHOLDS, 0.0)
    push = _push(arm, kind, start, rng)
    servo, now = Servo(arm, SolveOptions(), SETTINGS, THRESHOLDS, 1.0, start, ahead), 0.0
    while now < LONGEST and not (servo.finding.code.halted and servo.at_rest and now > 0.5):
        servo.twist(TwistCommand(push(servo.position), np.eye(3)), now)
        now += 1.0 / RATE
        servo.tick(now)
    true = _troubles(arm, servo.position, room)
    said = {name for name, words in SAID.items() if any(word in servo.finding.text for word in words)}
    if not servo.finding.code.halted or len(said) != 1 or not said <= true:
        return 'wrong'
    # A folded UR5 has its wrist at its shoulder, near the first axis too.
    meant = {'elbow': {'too far'}, 'too near': {'too near', 'shoulder'}}.get(kind, {kind})
    return 'right' if said <= meant else 'other'


def _troubles(arm: Arm, q: np.ndarray, room: Room | None) -> set[str]:
    """Return the troubles that a UR5 is in at q (6,), by closed forms and coal."""
    elbow = math.remainder(q[2], 2.0 * math.pi)
    found = {
        'too far': abs(elbow) < NEAR_ZERO['elbow'],
        'too near': abs(elbow) > math.pi - NEAR_ZERO['elbow'],
        'wrist': abs(math.sin(q[4])) < NEAR_ZERO['wrist'],
        'shoulder': abs(_off_first_axis(q)) < NEAR_ZERO['shoulder'],
        'limit': bool(np.min([q - arm.lower, arm.upper - q]) < 2.0 * THRESHOLDS.limit_margin),
        'contact': room is not None and room.look(q).clearance < 2.0 * THRESHOLDS.contact_halt,
    }
    return {name for name, holds in found.items() if holds}


def _off_first_axis(q: np.ndarray) -> float:
    """Return how far the wrist is from the first axis, in the plane of the arm [m]."""
    return (UPPER_ARM * math.cos(q[1]) + FOREARM * math.cos(q[1] + q[2])
            - WRIST * math.sin(q[1] + q[2] + q[3]))


def _start(arm: Arm, rng: np.random.Generator, kind: str) -> np.ndarray:
    """Return a configuration (6,) [rad] that is in no trouble, nearer to the one that is meant than to the others."""
    while True:
        q = rng.uniform(-2.5, 2.5, 6)
        q[1] = rng.uniform(-2.4, -0.7)
        q[2] = rng.choice([-1.0, 1.0]) * rng.uniform(*{'too near': (1.8, 2.5)}.get(kind, (0.6, 1.4)))
        q[4] = rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 2.4)
        if abs(_off_first_axis(q)) > 0.2 and (kind != 'contact' or arm.contacts.look(q).clearance > 0.015):
            return q


def _push(arm: Arm, kind: str, start: np.ndarray, rng: np.random.Generator) -> Push:
    """Return what the hand does."""
    if kind in ('elbow', 'wrist', 'limit'):  # one joint alone turns
        joint = {'elbow': 2, 'wrist': 4}.get(kind, int(rng.choice([0, 5])))
        sign = rng.choice([-1.0, 1.0]) if kind == 'limit' else -np.sign(start[joint])
        if kind == 'limit':
            start[joint] = sign * (arm.upper[joint] - rng.uniform(0.1, 0.4))
        return lambda q: SPEED * sign * arm.jacobian(q)[:, joint]
    if kind == 'contact':
        direction = np.array([0.0, 0.0, -1.0])  # to the table
    else:
        shoulder, wrist = _points(arm, start)
        direction = wrist - shoulder
        direction *= (1.0, 1.0, 0.0) if kind == 'shoulder' else 1.0
        direction *= 1.0 if kind == 'too far' else -1.0
    twist = np.concatenate([SPEED * direction / np.linalg.norm(direction), np.zeros(3)])
    return lambda q: twist


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
