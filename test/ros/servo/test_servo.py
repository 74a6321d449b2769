"""Who has the arm, when it halts, and what comes out, by a clock that the tests set."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from smooth_commands import assert_within_limits

from ros_ik_pkg.ik import SolveOptions, load_arm, solve
from ros_ik_pkg.ros.interface.servo_settings import CAUTION_OPTIONS, SERVO_OPTIONS, ServoSettings, Thresholds
from ros_ik_pkg.ros.servo.codes import Code
from ros_ik_pkg.ros.servo.limiter import Motion, make_limiter
from ros_ik_pkg.ros.servo.servo import Owner, Servo, motion_limits
from ros_ik_pkg.ros.servo.twist_follower import TwistCommand

ARM = load_arm('panda')
PERIOD = 0.002  # s
SETTINGS = replace(ServoSettings(**{option.name: option.default for option in SERVO_OPTIONS}), command_rate=500.0)
THRESHOLDS = Thresholds(**{option.name: option.default for option in CAUTION_OPTIONS})
ALONG_Y = TwistCommand(np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0]), np.eye(3))
STILL = TwistCommand(np.zeros(6), np.eye(3))


class Run:
    """A servo with its clock, and every command that came out."""

    def __init__(self, start=ARM.home, **settings) -> None:
        self.settings = replace(SETTINGS, **settings)
        self.servo = Servo(ARM, SolveOptions(), self.settings, THRESHOLDS, 1.0, start)
        self.now, self.commands = 10.0, [start]

    def ticks(self, count: int) -> None:
        for _ in range(count):
            self.now += PERIOD
            self.commands.append(self.servo.tick(self.now))

    def twist(self, command: TwistCommand, time: float, joint_state=None) -> None:
        """Send a twist every fifth period for a time [s]."""
        for _ in range(round(time / (5 * PERIOD))):
            self.servo.twist(command, self.now, joint_state)
            self.ticks(5)

    def assert_smooth(self) -> None:
        assert_within_limits(self.commands, self.servo.limits, PERIOD)

    @property
    def code(self) -> Code:
        return self.servo.finding.code


def pose_goal(x=0.0, y=0.0, z=0.0) -> np.ndarray:
    """Return the joints of a pose that is moved from home [m]."""
    target = ARM.forward(ARM.home)
    target[:3, 3] += x, y, z
    solution = solve(ARM, target, ARM.home)
    assert solution.converged
    return solution.q


def test_nothing_moves_before_the_first_command():
    run = Run()
    run.ticks(20)
    assert all(np.array_equal(command, ARM.home) for command in run.commands)
    assert run.code == Code.STANDING


def test_a_twist_moves_the_arm_from_the_next_command_on():
    run = Run()
    run.servo.twist(ALONG_Y, run.now)
    run.ticks(1)
    assert pinocchio_tip(ARM, run.commands[-1])[1, 3] > pinocchio_tip(ARM, ARM.home)[1, 3]
    assert run.code == Code.FOLLOWING and run.servo.owner is Owner.TWIST


def test_when_commands_stop_the_arm_stands_no_later_than_the_limits_need():
    run = Run()
    run.twist(ALONG_Y, 0.8)
    last = run.now
    run.ticks(int(run.settings.command_timeout / PERIOD) - 6)
    assert run.code == Code.FOLLOWING
    needed = run.servo._limiter.time_to_rest
    while not run.servo.at_rest:
        run.ticks(1)
        assert run.now - last < run.settings.command_timeout + needed + 3 * PERIOD
    assert run.code == Code.COMMANDS_STOPPED and 'no twist' in run.servo.finding.sentence
    run.assert_smooth()


def test_a_twist_of_zero_that_ends_is_no_fault():
    run = Run()
    run.twist(ALONG_Y, 0.3)
    run.twist(STILL, 0.6)
    run.ticks(200)
    assert run.code == Code.STANDING
    run.assert_smooth()


def test_when_commands_come_again_the_arm_goes_on_from_where_it_is():
    run = Run()
    for _ in range(4):
        run.twist(ALONG_Y, 0.3)
        run.ticks(75)  # in the middle of the halt
    run.assert_smooth()
    way = pinocchio_tip(ARM, run.commands[-1])[:3, 3] - pinocchio_tip(ARM, ARM.home)[:3, 3]
    assert way[1] > 0.1 and np.abs(way[[0, 2]]).max() < 3e-3


def test_a_pause_halts_and_what_comes_meanwhile_moves_nothing():
    run = Run()
    run.twist(ALONG_Y, 0.4)
    run.servo.pause(True)
    run.twist(ALONG_Y, 0.6)
    stood = run.commands[-1]
    assert run.servo.at_rest and run.code == Code.PAUSED
    assert 'paused' in run.servo.pose(pose_goal(0.1), run.now)
    run.ticks(50)
    run.servo.pause(False)
    run.ticks(50)
    assert np.allclose(run.commands[-1], stood, atol=1e-6)
    run.twist(ALONG_Y, 0.2)
    assert not np.allclose(run.commands[-1], stood, atol=1e-3)
    run.assert_smooth()


def test_when_joint_states_stop_the_arm_halts_and_goes_on_when_they_come_again():
    run = Run()
    run.servo.hear_joint_states(run.now)
    run.twist(ALONG_Y, 1.0)
    assert run.servo.at_rest and run.code == Code.JOINT_STATES_STOPPED
    run.servo.hear_joint_states(run.now)
    run.twist(ALONG_Y, 0.2)
    assert run.code == Code.FOLLOWING
    run.assert_smooth()


def test_a_pose_is_reached_and_held():
    run, goal = Run(), pose_goal(0.1, -0.1, 0.05)
    assert run.servo.pose(goal, run.now) == ''
    run.ticks(1500)
    assert np.allclose(run.commands[-1], goal, atol=1e-6)
    assert run.code == Code.STANDING and run.servo.at_rest
    run.assert_smooth()


def test_on_the_way_to_a_pose_all_joints_leave_and_arrive_together():
    run, goal = Run(), ARM.home + np.array([0.9, 0.05, -0.4, 0.2, 0.0, -0.3, 0.6])
    run.servo.pose(goal, run.now)
    run.ticks(1500)
    shares = (np.array(run.commands) - ARM.home)[:, [0, 1, 2, 3, 5, 6]] / (goal - ARM.home)[[0, 1, 2, 3, 5, 6]]
    assert np.all(np.abs(shares - shares[:, :1]) < 1e-6)
    assert shares[-1] == pytest.approx(np.ones(6)) and run.code == Code.STANDING
    run.assert_smooth()


def test_a_move_to_a_pose_takes_little_longer_than_its_slowest_joint_alone():
    run, goal = Run(), ARM.home + np.array([0.9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    alone = make_limiter('own', run.servo.limits, PERIOD, ARM.home)
    while np.abs(alone.position - goal).max() > 1e-6:
        alone.advance(Motion.rest(goal))
        run.commands.append(alone.position)
    fastest = len(run.commands)
    run.commands = run.commands[:1]
    run.servo.pose(goal, run.now)
    while np.abs(run.commands[-1] - goal).max() > 1e-6:
        run.ticks(1)
    assert len(run.commands) < 1.15 * fastest


def test_a_second_pose_in_motion_takes_over_smoothly():
    run = Run()
    run.servo.pose(pose_goal(0.1), run.now)
    run.ticks(200)
    run.servo.pose(goal := pose_goal(-0.1, 0.1), run.now)
    run.ticks(1500)
    assert np.allclose(run.commands[-1], goal, atol=1e-6)
    run.assert_smooth()


def test_a_stream_of_poses_of_which_some_are_lost_is_followed():
    run, lags, start = Run(), [], ARM.forward(ARM.home)
    speed = 0.1  # m/s
    rng = np.random.default_rng(0)
    for k in range(600):
        if k % 5 == 0 and rng.random() > 0.05:
            run.servo.pose(pose_goal(0.0, speed * k * PERIOD), run.now)
        run.ticks(1)
        lags.append(speed * k * PERIOD - (pinocchio_tip(ARM, run.commands[-1]) - start)[1, 3])
    run.assert_smooth()
    assert np.max(np.abs(lags[300:])) / speed < 0.05  # s, of poses at 100 Hz of which some are lost


def test_poses_at_the_rate_of_the_stream_are_followed_within_a_hundredth_of_a_second():
    run, start, speed = Run(), ARM.forward(ARM.home), 0.1
    tips = []
    for k in range(500):
        run.servo.pose(pose_goal(0.0, speed * k * PERIOD), run.now)
        run.ticks(1)
        tips.append((pinocchio_tip(ARM, run.commands[-1]) - start)[1, 3])
    lags = speed * np.arange(500) * PERIOD - np.array(tips)
    assert np.max(np.abs(lags[250:])) / speed < 0.01
    assert np.all(np.abs(np.diff(tips)[250:] / PERIOD - speed) < 0.02 * speed)
    jerk = np.diff(np.array(run.commands[250:]), n=3, axis=0) / PERIOD**3
    assert np.sqrt(np.mean(jerk**2, axis=0)).max() < 60.0
    run.assert_smooth()


def test_the_newest_kind_of_command_has_the_arm_and_a_change_is_smooth():
    run = Run()
    run.servo.pose(pose_goal(0.1), run.now)
    run.ticks(100)
    run.twist(ALONG_Y, 0.3)
    assert run.servo.owner is Owner.TWIST
    run.servo.pose(pose_goal(0.0, 0.1), run.now)
    run.ticks(60)
    run.twist(ALONG_Y, 0.1)
    run.servo.pose(goal := pose_goal(0.05), run.now)
    run.ticks(1500)
    assert run.servo.owner is Owner.POSE
    assert np.allclose(run.commands[-1], goal, atol=1e-6)
    run.assert_smooth()


def test_a_clutch_that_is_taken_up_with_a_still_hand_moves_nothing():
    run, goal = Run(), pose_goal(0.05)
    run.servo.pose(goal, run.now)
    run.ticks(1500)
    run.servo.pause(True)
    run.ticks(200)
    run.servo.pause(False)
    run.servo.pose(run.servo.position, run.now, run.servo.position)
    before = run.commands[-1]
    run.ticks(10)
    assert np.allclose(run.commands[-1], before, atol=1e-9)


def test_an_arm_that_was_moved_by_others_starts_from_where_it_is():
    run = Run()
    run.servo.pose(pose_goal(0.05), run.now)
    run.ticks(1500)
    moved = run.commands[-1] + 0.2
    run.servo.pause(True)
    run.ticks(300)
    run.servo.pause(False)
    run.servo.twist(ALONG_Y, run.now, moved)
    run.ticks(1)
    assert np.allclose(run.commands[-1], moved, atol=1e-4)


def test_a_joint_state_of_a_moment_ago_does_not_pull_the_stream_back():
    run = Run()
    run.twist(ALONG_Y, 2.0)
    run.servo.pause(True)
    run.ticks(120)
    run.servo.pause(False)
    assert run.servo.at_rest
    run.twist(ALONG_Y, 0.2, joint_state=run.commands[-1] - 0.1)
    run.assert_smooth()


def test_a_stream_that_got_no_processor_for_a_while_does_not_leap_to_an_old_joint_state():
    run = Run()
    run.twist(ALONG_Y, 0.6)
    assert not run.servo.at_rest
    run.now += 1.0  # without a command
    run.servo.pose(pose_goal(0.0, 0.1), run.now, joint_state=run.commands[-1] - 0.1)
    run.ticks(1000)
    run.assert_smooth()


def test_a_controller_that_lags_a_little_does_not_pull_the_stream_back():
    run = Run()
    run.twist(ALONG_Y, 0.4, joint_state=ARM.home)
    assert np.abs(run.commands[-1] - ARM.home).max() > 0.01
    run.assert_smooth()


def test_a_tool_that_changes_in_motion_leaves_it_smooth_and_then_moves_along_the_line():
    run, tool = Run(), pin.SE3(pin.rpy.rpyToMatrix(0.3, 0.4, -0.5), np.array([0.05, 0.0, 0.2]))
    turn = TwistCommand(np.array([0.0, 0.0, 0.05, 0.0, 0.0, 0.2]), np.eye(3))
    run.twist(turn, 0.5)
    run.servo.use(SolveOptions(), ARM.with_tool(tool))
    run.twist(turn, 0.5)
    run.assert_smooth()
    tips = [(pin.SE3(pinocchio_tip(ARM, q)) * tool).translation for q in (run.commands[-50], run.commands[-1])]
    moved = (tips[1] - tips[0]) / (49 * PERIOD)
    np.testing.assert_allclose(moved, [0.0, 0.0, 0.05], atol=1e-4)


def test_a_twist_is_over_when_the_tool_changes():
    """Its axes may have been those of the tool: about 180 degrees turned it would drive the arm backwards."""
    run = Run()
    run.twist(ALONG_Y, 0.5)
    run.servo.use(SolveOptions(), ARM.with_tool(pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, np.pi), np.zeros(3))))
    run.ticks(500)
    assert run.servo.at_rest
    run.assert_smooth()


def test_other_options_change_the_solves_and_not_the_motion():
    run = Run()
    run.twist(ALONG_Y, 0.3)
    run.servo.use(SolveOptions(method='sdls'))
    run.twist(ALONG_Y, 0.3)
    run.servo.use(SolveOptions(task_weights=(1, 1, 1, 0, 0, 0)))
    run.twist(ALONG_Y, 0.3)
    run.assert_smooth()


def test_a_closed_servo_comes_to_rest():
    run = Run()
    run.twist(ALONG_Y, 0.4)
    run.servo.close()
    run.twist(ALONG_Y, 0.6)
    assert run.servo.at_rest and run.code == Code.WAITING
    run.assert_smooth()


@pytest.mark.parametrize('seed', range(3))
def test_whatever_comes_no_command_breaks_a_limit(seed):
    rng, run = np.random.default_rng(seed), Run()
    for _ in range(60):
        kind = rng.integers(6)
        if kind < 3:
            run.twist(TwistCommand(rng.uniform(-1.0, 1.0, 6) * rng.choice([0.3, 2.0]), np.eye(3)), 0.1)
        elif kind == 3:
            run.servo.pose(rng.uniform(ARM.lower, ARM.upper), run.now)
            run.ticks(int(rng.integers(1, 100)))
        elif kind == 4:
            run.servo.pause(True)
            run.ticks(int(rng.integers(1, 60)))
            run.servo.pause(False)
        else:
            run.ticks(int(rng.integers(1, 100)))
    run.assert_smooth()


def test_a_command_that_leaps_is_not_let_out():
    run = Run()
    run.twist(ALONG_Y, 0.1)
    run.servo._limiter._state[0] += 1.0
    run.servo._limiter.advance = lambda smooth: ARM.home + 3.0
    with pytest.raises(RuntimeError, match='leaps'):
        run.ticks(1)


def test_limits_that_the_robot_does_not_have_come_from_the_settings():
    limits = motion_limits(load_arm('puma560'), SETTINGS, 0.5)
    assert np.all(limits.velocity == 0.5 * SETTINGS.max_velocity)
    assert np.all(limits.acceleration == SETTINGS.max_acceleration) and np.all(limits.jerk == SETTINGS.max_jerk)
    assert np.allclose(motion_limits(ARM, SETTINGS, 0.5).velocity, 0.5 * ARM.velocity_limits)


class Controller:
    """Joints that lag behind the commands they get, saturate in velocity and lose some commands."""

    def __init__(self, start, lag=0.05, saturation=0.4, lost=0.1) -> None:
        self.q, self._heard, self._lag, self._lost = start.copy(), start, lag, lost
        self._fastest, self._rng = saturation * ARM.velocity_limits, np.random.default_rng(0)

    def obey(self, command) -> None:
        """Move on for a period towards the last command that was heard."""
        if self._rng.random() >= self._lost:
            self._heard = command
        self.q = self.q + PERIOD * np.clip((self._heard - self.q) / self._lag, -self._fastest, self._fastest)


@pytest.mark.parametrize('smoothing', ['own', 'ruckig', 'none'])
def test_joints_that_lag_saturate_and_lose_commands_end_where_they_were_told_to_be(smoothing):
    pytest.importorskip('ruckig') if smoothing == 'ruckig' else None
    run, rng = Run(smoothing=smoothing), np.random.default_rng(1)
    controller = Controller(ARM.home)

    def go_on(count: int) -> None:
        for _ in range(count):
            run.ticks(1)
            run.servo.hear_joint_states(run.now)
            controller.obey(run.commands[-1])

    for _ in range(6):
        goal = np.clip(ARM.home + rng.uniform(-0.8, 0.8, ARM.n), ARM.lower, ARM.upper)
        run.servo.pose(goal, run.now, controller.q)
        go_on(1500)
        assert np.allclose(controller.q, goal, atol=1e-4)
        for _ in range(60):
            run.servo.twist(ALONG_Y, run.now, controller.q)
            go_on(5)
        go_on(800)
        assert np.allclose(controller.q, run.commands[-1], atol=1e-4) and run.servo.at_rest
    if smoothing != 'none':
        run.assert_smooth()
