"""What redundant joints do under a twist: they go where null_space wants them, and the tip stays on its line.

The tip and the objectives are judged by Pinocchio and coal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from smooth_commands import assert_within_limits

from bench.published_robots import PANDA
from ros_ik_pkg.ik import Arm, Obstacle, SolveOptions, World, load_arm, solve
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, LINE, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.contact_ahead import ContactAhead
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand

PERIOD = 0.002  # s
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=500.0)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})
START = np.array([0.3, -0.785, 0.5, -2.356, 0.3, 1.571, 0.785])
POSTURE = START + np.array([0.5, 0.0, -0.5, 0.0, 0.0, 0.0, 0.0])
ALONG_Y = np.array([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
POST = Obstacle('post', 'box', (0.1, 0.1, 0.4), pin.SE3(np.eye(3), np.array([-0.4, -0.05, 0.62])).homogeneous)
Measure = Callable[[Arm, np.ndarray], float]


def manipulability(arm: Arm, q: np.ndarray) -> float:
    """Return the root of det J J^T by Pinocchio, at joints (7,) of the panda."""
    full = pin.neutral(arm.model)
    full[: len(q)] = q
    frame = arm.model.getFrameId(arm.tip_frame)
    jacobian = pin.computeFrameJacobian(arm.model, arm.model.createData(), full, frame, pin.LOCAL_WORLD_ALIGNED)
    return float(np.sqrt(np.linalg.det(jacobian @ jacobian.T)))


def nearness(arm: Arm, q: np.ndarray) -> float:
    return -float(np.linalg.norm(q - POSTURE))


def centredness(arm: Arm, q: np.ndarray) -> float:
    """Return minus the sum of squares of how far joints are from their middles, in their ranges."""
    middle, reach = (arm.upper + arm.lower) / 2.0, (arm.upper - arm.lower) / 2.0
    return -float(np.sum(((q - middle) / reach) ** 2))


def run(options: SolveOptions, room=None, arm=None, pushed: float = 2.0) -> tuple[Arm, np.ndarray, Servo]:
    """Push a panda along y for a time [s], then let it stand for 1 s; return its commands (k, 7)."""
    arm = arm or load_arm('panda')
    ahead = None if room is None else ContactAhead(arm, room, THRESHOLDS, 0.0)
    servo, now, commands = Servo(arm, options, SETTINGS, THRESHOLDS, 1.0, START, ahead), 0.0, [START]
    for k in range(round((pushed + 1.0) / PERIOD)):
        if k % 5 == 0:
            servo.twist(TwistCommand(ALONG_Y if k * PERIOD < pushed else np.zeros(6), np.eye(3)), now)
        now += PERIOD
        commands.append(servo.tick(now))
    return arm, np.array(commands), servo


def assert_on_its_line(arm: Arm, commands: np.ndarray, servo: Servo) -> None:
    tips = np.array([pinocchio_tip(arm, q) for q in commands[::5]])
    assert np.abs(tips[:, [0, 2], 3] - tips[0, [0, 2], 3]).max() < 1e-4
    assert np.abs(tips[:, :3, :3] - tips[0, :3, :3]).max() < 1e-4
    assert tips[-1, 1, 3] - tips[0, 1, 3] == pytest.approx(0.1, abs=2e-3)
    assert_within_limits(commands, servo.limits, PERIOD)


@pytest.mark.parametrize(('objective', 'measure', 'gain'), [
    ('manipulability', manipulability, 0.01), ('posture', nearness, 0.1), ('limits', centredness, 0.008),
])  # fmt: skip
def test_under_a_twist_the_posture_becomes_better_and_the_tip_stays_on_its_line(objective, measure, gain):
    posture = tuple(POSTURE) if objective == 'posture' else ()
    arm, commands, servo = run(SolveOptions(null_space=objective, posture=posture))
    _, without, _ = run(SolveOptions())
    assert measure(arm, commands[-1]) > measure(arm, without[-1]) + gain
    assert_on_its_line(arm, commands, servo)
    assert servo.at_rest


def test_under_a_twist_a_redundant_arm_draws_its_elbow_away_from_an_obstacle():
    urdf, srdf, tip = PANDA
    arm = load_arm(urdf, tip=tip, srdf=srdf)
    room = arm.contacts.room(World(obstacles=(POST,)))
    _, commands, servo = run(SolveOptions(null_space='clearance'), room, arm, 1.0)
    _, without, _ = run(SolveOptions(), room, arm, 1.0)
    clearances = [min(room.look(q).clearance for q in runs[250::25]) for runs in (commands, without)]
    assert clearances[0] > clearances[1] + 0.002
    assert np.abs(pinocchio_tip(arm, commands[-1]) - pinocchio_tip(arm, without[-1])).max() < 1e-3
    assert servo.at_rest


def test_no_joint_moves_for_the_posture_before_a_command_or_after_it():
    _, commands, _ = run(SolveOptions(null_space='manipulability'), pushed=0.0)
    assert np.ptp(commands, axis=0).max() == 0.0
    _, commands, _ = run(SolveOptions(null_space='manipulability'), pushed=1.0)
    assert np.ptp(commands[-100:], axis=0).max() < 1e-7


def test_a_posture_that_is_not_given_is_that_of_the_start():
    arm = load_arm('panda')
    ends = []
    for options in (SolveOptions(null_space='posture'), SolveOptions(null_space='posture', posture=tuple(START))):
        ends.append(run(options, arm=arm)[1][-1])
    assert np.allclose(*ends, atol=1e-6)
    assert np.abs(ends[0] - run(SolveOptions(), arm=arm)[1][-1]).max() > 0.003


def test_on_a_line_to_a_pose_the_posture_becomes_better_too():
    arm, measures = load_arm('panda'), []
    target = arm.forward(START)
    target[1, 3] += 0.2
    for objective in ('none', 'manipulability'):
        settings = replace(SETTINGS, pose_motion=LINE)
        servo = Servo(arm, SolveOptions(null_space=objective), settings, THRESHOLDS, 1.0, START)
        servo.pose(arm_at(arm, target), 0.0)
        tips = [pinocchio_tip(arm, servo.tick(k * PERIOD)) for k in range(2000)]
        assert np.allclose(tips[-1], target, atol=5e-6) and servo.at_rest
        assert np.abs(np.array(tips)[:, [0, 2], 3] - target[[0, 2], 3]).max() < 2e-4
        measures.append(manipulability(arm, servo.position))
    assert measures[1] > measures[0] + 0.002


def arm_at(arm: Arm, target: np.ndarray) -> np.ndarray:
    """Return joints (n,) with the tip at a pose (4, 4), near START."""
    solution = solve(arm, target, START)
    assert solution.converged
    return solution.q
