"""Poses that the tip goes to on straight lines (`servo.pose_motion: line`); Pinocchio says where the tip is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from smooth_commands import assert_within_limits

from bench.published_robots import UR5
from ros_ik_pkg.ik import SolveOptions, load_arm, solve
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, LINE, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.codes import Code
from ros_ik_pkg.ros.servo.servo import Servo
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand

PERIOD = 0.002  # s
SETTINGS = replace(
    ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=500.0, pose_motion=LINE
)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})
UR5_BY_URDF = 'ur5 by its URDF'
UR5_START = np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
WRIST_SINGULAR = np.array([0.2, -1.2, 1.6, -1.9, 0.0, 0.2])  # of a UR5: its fourth and sixth axes are parallel
HALF = 0.1  # m from there to either end of the lines across it


class Run:
    """A servo with its clock, and every command that came out."""

    def __init__(self, name: str, start=None, options=None, **settings) -> None:
        self.arm = load_arm(UR5[0], tip=UR5[2]) if name == UR5_BY_URDF else load_arm(name)
        self.options = options or SolveOptions()
        start = self.arm.home if start is None else start
        self.servo = Servo(self.arm, self.options, replace(SETTINGS, **settings), THRESHOLDS, 1.0, start)
        self.now, self.commands = 10.0, [start]

    def ticks(self, count: int) -> None:
        for _ in range(count):
            self.now += PERIOD
            self.commands.append(self.servo.tick(self.now))

    def send(self, pose: np.ndarray) -> bool:
        """Send a pose (4, 4) as the node does: its solution from the last command, if it has one."""
        solution = solve(self.arm, pose, self.servo.position, self.options)
        if solution.converged:
            self.servo.pose(solution.q, self.now)
        return solution.converged

    def tips(self) -> np.ndarray:
        """Poses (k, 4, 4) of the tip at every command."""
        return np.array([pinocchio_tip(self.arm, q) for q in self.commands])

    def assert_smooth(self) -> None:
        assert_within_limits(self.commands, self.servo.limits, PERIOD)


def moved(pose: np.ndarray, way=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Return a pose (4, 4) moved along the axes of the base [m] and turned about them [rad]."""
    pose = pose.copy()
    pose[:3, 3] += way
    pose[:3, :3] = pin.exp3(np.array(turn)) @ pose[:3, :3]
    return pose


def off_line(tips: np.ndarray, direction) -> float:
    """Return the greatest distance [m] of the tips from a line through the first one."""
    way, direction = tips[:, :3, 3] - tips[0, :3, 3], np.array(direction) / np.linalg.norm(direction)
    return float(np.linalg.norm(way - np.outer(way @ direction, direction), axis=1).max())


@pytest.mark.parametrize(('name', 'start'), [('panda', None), ('ur5', UR5_START), ('iiwa14', None)])
def test_the_tip_goes_straight_to_a_pose_and_no_further(name, start):
    run, way = Run(name, start), np.array([0.05, 0.2, -0.1])
    target = moved(pinocchio_tip(run.arm, run.commands[0]), way, (0.0, 0.3, 0.0))
    assert run.send(target)
    run.ticks(1500)
    tips = run.tips()
    assert np.allclose(tips[-1], target, atol=2e-6) and run.servo.finding.code == Code.STANDING
    assert off_line(tips, way) < 1e-4
    along = (tips[:, :3, 3] - tips[0, :3, 3]) @ way / (way @ way)
    assert np.all((along > -1e-4) & (along < 1.0 + 1e-4))
    speed = np.linalg.norm(np.diff(tips[:, :3, 3], axis=0), axis=1) / PERIOD
    assert 0.9 * SETTINGS.line_speed < speed.max() < 1.01 * SETTINGS.line_speed
    run.assert_smooth()


def test_the_tip_turns_along_the_shortest_way_as_it_moves():
    run, turn = Run('panda'), np.array([0.3, -0.2, 0.5])
    start = pinocchio_tip(run.arm, run.commands[0])
    assert run.send(moved(start, (0.0, 0.1, 0.0), turn))
    run.ticks(1500)
    for tip in run.tips()[::25]:
        turned = pin.log3(tip[:3, :3] @ start[:3, :3].T)
        share = (tip - start)[1, 3] / 0.1
        assert np.allclose(turned, share * turn, atol=2e-3)


def test_all_joints_in_step_leave_the_line_that_the_tip_keeps_by_option():
    run = Run('ur5', UR5_START, pose_motion='joints')
    assert run.send(moved(pinocchio_tip(run.arm, UR5_START), (0.05, 0.2, -0.1)))
    run.ticks(1500)
    assert off_line(run.tips(), (0.05, 0.2, -0.1)) > 1e-3


def across() -> tuple[Run, np.ndarray]:
    """Return a UR5 before a wrist singularity, and the pose beyond it on a straight line along y."""
    arm = load_arm('ur5')
    middle, q = pinocchio_tip(arm, WRIST_SINGULAR), WRIST_SINGULAR
    for k in range(20):
        q = solve(arm, moved(middle, (0.0, -HALF * (k + 1) / 20.0, 0.0)), q).q
    return Run('ur5', q), moved(middle, (0.0, HALF, 0.0))


def test_before_a_wrist_singularity_a_pose_beyond_it_halts_on_the_line_and_a_pose_behind_leads_back():
    run, beyond = across()
    start = run.tips()[0]
    assert run.send(beyond)
    run.ticks(3000)
    assert off_line(run.tips(), (0.0, 1.0, 0.0)) < 1e-3
    assert run.servo.finding.code == Code.HALTED_SINGULARITY
    assert 'wrist_1_joint and wrist_3_joint are nearly parallel' in run.servo.finding.sentence
    assert run.send(start)
    run.ticks(3000)
    assert np.allclose(run.tips()[-1], start, atol=2e-6)
    assert off_line(run.tips(), (0.0, 1.0, 0.0)) < 1e-3
    run.assert_smooth()


@pytest.mark.parametrize(('name', 'start', 'weights', 'way'), [
    # The smallest singular value rises and falls along it, below the threshold at which the arm halts
    (UR5_BY_URDF, (2.2799, -2.4447, 0.9768, -0.1553, 0.0409, -2.6032), (1,) * 6, (0.1002, -0.0808, 0.1531)),
    (UR5_BY_URDF, (0.0097, 0.2224, -2.0591, -1.0949, 0.2856, 1.6472), (1,) * 6, (-0.1616, 0.1085, 0.0459)),
    # It falls below the threshold at which the arm slows down, and rises again
    ('so101', (1.4017, -1.3282, -0.6918, 0.3637, 2.2303), (1, 1, 1, 0, 0, 0), (-0.0102, -0.196, 0.0385)),
    # A joint comes to its limit
    ('so101', (-0.4341, 0.8543, 0.5206, 0.6242, -0.2843), (1, 1, 1, 0, 0, 0), (-0.1716, 0.0631, 0.0811)),
])  # fmt: skip
def test_beside_trouble_the_tip_keeps_to_its_line(name, start, weights, way):
    run = Run(name, np.array(start), SolveOptions(task_weights=weights))
    assert run.send(moved(run.tips()[0], way))
    run.ticks(3000)
    assert off_line(run.tips(), way) < 1e-3
    run.assert_smooth()


@pytest.mark.parametrize('every', [1, 5])
def test_a_stream_of_poses_across_a_wrist_singularity_keeps_the_tip_on_its_line(every):
    run, _ = across()
    start = run.tips()[0]
    for k in range(1000):
        if k % every == 0:
            run.send(moved(start, (0.0, min(0.1 * k * PERIOD, 2.0 * HALF), 0.0)))
        run.ticks(1)
    run.ticks(1500)
    assert off_line(run.tips(), (0.0, 1.0, 0.0)) < 1e-3
    assert run.servo.finding.code == Code.HALTED_SINGULARITY
    run.assert_smooth()


def test_a_stream_of_poses_is_followed_at_its_pace_on_a_circle():
    run, radius, rate, behind = Run('panda'), 0.1, 1.2, []
    start = run.tips()[0]
    for k in range(1500):
        angle = rate * k * PERIOD
        target = moved(start, (0.0, radius * np.sin(angle), radius * (1.0 - np.cos(angle))))
        if k % 5 == 0:
            assert run.send(target)
        run.ticks(1)
        behind.append(np.linalg.norm((pinocchio_tip(run.arm, run.commands[-1]) - target)[:3, 3]))
    assert max(behind[500:]) < 2.5e-3  # at 0.12 m/s, poses at 100 Hz
    run.assert_smooth()


def test_a_pose_beside_the_line_of_a_moving_arm_is_reached_smoothly():
    run = Run('ur5', UR5_START)
    start = run.tips()[0]
    run.send(moved(start, (0.0, 0.2, 0.0)))
    run.ticks(250)
    run.send(target := moved(start, (0.1, 0.0, -0.1)))
    run.ticks(200)
    for _ in range(20):
        run.servo.twist(TwistCommand(np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0]), np.eye(3)), run.now)
        run.ticks(5)
    run.send(target)
    run.ticks(2500)
    assert np.allclose(run.tips()[-1], target, atol=2e-6) and run.servo.finding.code == Code.STANDING
    run.assert_smooth()


def test_rows_that_are_left_free_do_not_keep_the_tip_from_the_pose():
    run = Run('panda', options=SolveOptions(task_weights=(1, 1, 1, 0, 0, 0)))
    target = moved(run.tips()[0], (0.1, -0.2, 0.05), (0.5, 0.5, 0.0))
    assert run.send(target)
    run.ticks(2000)
    assert np.allclose(run.tips()[-1][:3, 3], target[:3, 3], atol=2e-6)
    assert off_line(run.tips(), (0.1, -0.2, 0.05)) < 1e-4
    assert run.servo.finding.code == Code.STANDING


def test_a_pose_at_the_last_command_moves_nothing():
    run = Run('panda')
    run.servo.pose(run.servo.position, run.now)
    run.ticks(50)
    assert np.ptp(run.commands, axis=0).max() < 1e-9


def test_random_poses_in_any_rhythm_break_no_limit():
    rng, run = np.random.default_rng(3), Run('ur5', UR5_START)
    lower, upper = np.maximum(run.arm.lower, -3.0), np.minimum(run.arm.upper, 3.0)
    for _ in range(60):
        near = run.servo.position + rng.normal(size=6) * rng.choice([0.005, 0.1])
        q = near if rng.random() < 0.8 else rng.uniform(lower, upper)
        for _ in range(rng.integers(1, 5)):
            run.servo.pose(np.clip(q, run.arm.lower, run.arm.upper), run.now)
            run.ticks(int(rng.choice([1, 5, 60])))
    run.assert_smooth()
