"""Messages become arrays, arrays become messages, and what makes no sense is refused with its reason."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from numerics import law
from ros_helpers import joint_state, pose_of
from sensor_msgs.msg import JointState

from ros_ik_pkg.ik import TRACE_COLUMNS, Solution, Status, Trace, load_arm
from ros_ik_pkg.ik.solution import FIGURES
from ros_ik_pkg.ik.text import shorten
from ros_ik_pkg.ros.handling.result import CLOSEST, Command, Result
from ros_ik_pkg.ros.input.joint_states import MAX_SOURCES, JointStates
from ros_ik_pkg.ros.input.pose import target_pose
from ros_ik_pkg.ros.input.refusal import RefusedError
from ros_ik_pkg.ros.input.target import Target
from ros_ik_pkg.ros.output.messages import (
    commands_message,
    motion_trajectory_message,
    path_message,
    positions_message,
    trace_message,
    trajectory_message,
)
from ros_ik_pkg.ros.output.statuses import MAX_ITERATION_STATUSES, iterations_message, result_message
from ros_ik_pkg.ros.servo.limiter import Motion

ROUNDING = 1e-12
VECTORS = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


def answer_with(rows: int = 3) -> Result:
    """Make an answer of the puma560 with a trace of so many rows."""
    arm = load_arm('puma560')
    trace = Trace(
        rows=np.arange(rows * len(TRACE_COLUMNS), dtype=float).reshape(rows, -1),
        joint_positions=np.arange(rows * arm.n, dtype=float).reshape(rows, -1) + 0.5,
        tip_positions=np.arange(rows * 3, dtype=float).reshape(rows, -1),
    )
    figures = {
        'status': Status.CONVERGED, 'found': 1, 'iterations': rows - 1, 'attempts': 1, 'position_error': 1e-7,
        'orientation_error': 2e-7, 'joint_distance': 0.25, 'sigma_min': 0.5, 'limits_mask': 0b10010,
        'seed_clipped': 0, 'completeness': 3, 'solve_time': 3e-5, 'wished_rows': 0, 'wished_position_error': math.nan,
        'wished_orientation_error': math.nan,
    }  # fmt: skip
    row = np.concatenate([np.linspace(0.0, 0.5, arm.n), [figures[name] for name in FIGURES]])
    solution = Solution(row, solutions=np.zeros((1, arm.n)), trace=trace)
    target = Target(12, 34, 'elsewhere', (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    command = Command(solution.q, start=np.zeros(arm.n), velocity_limits=np.full(arm.n, 2.0))  # 0.25 s away
    return Result(target, 'solved', 'converged', 'fine', 'dls', arm, solution, ('one', 'two'), command=command)


def values_of(status) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


@law
@given(p=VECTORS, axis=VECTORS, angle=st.floats(-3.1, 3.1))
def test_a_pose_is_the_rotation_of_rodrigues_and_its_position(p, axis, angle):
    length = math.hypot(*axis)
    unit = np.array(axis) / length if length > 1e-3 else np.array([0.0, 0.0, 1.0])
    K = np.cross(np.eye(3), unit)  # K v = unit x v
    expected = np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K
    message = PoseStamped()
    message.pose.position.x, message.pose.position.y, message.pose.position.z = p
    orientation = message.pose.orientation
    orientation.x, orientation.y, orientation.z = (math.sin(angle / 2) * unit).tolist()
    orientation.w = math.cos(angle / 2)
    pose, notes = target_pose(Target.of(message))
    np.testing.assert_allclose(pose[:3, :3], expected, atol=ROUNDING)
    np.testing.assert_array_equal(pose[:3, 3], p)
    np.testing.assert_array_equal(pose[3], [0, 0, 0, 1])
    assert notes == ()


def test_a_quaternion_slightly_off_is_normalised_with_a_note():
    message = pose_of(np.eye(4))
    message.pose.orientation.z, message.pose.orientation.w = 0.6 * 1.009, 0.8 * 1.009
    pose, notes = target_pose(Target.of(message))
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=ROUNDING)
    assert notes == ('quaternion of norm 1.009 normalised',)


@pytest.mark.parametrize(
    ('field', 'value', 'status', 'words'),
    [
        ('position.x', math.nan, 'not_finite', 'target position is [nan, 0.0, 0.0]'),
        ('position.z', -math.inf, 'not_finite', '-inf'),
        ('position.y', 1e9, 'position', 'beyond 1e+06 m'),
        ('orientation.w', math.nan, 'not_finite', 'target orientation'),
        ('orientation.w', 0.0, 'quaternion', 'norm 0;'),
        ('orientation.w', 1.02, 'quaternion', 'norm 1.02;'),
        ('orientation.x', 1e300, 'quaternion', 'norm 1e+300;'),
        ('orientation.w', 5e-324, 'quaternion', 'expected a unit quaternion'),
    ],
)
def test_a_pose_that_makes_no_sense_is_refused(field, value, status, words):
    message = pose_of(np.eye(4))
    part, name = field.split('.')
    setattr(getattr(message.pose, part), name, value)
    with pytest.raises(RefusedError) as refused:
        target_pose(Target.of(message))
    assert refused.value.status == status
    assert words in str(refused.value)


def kept(*messages: JointState) -> JointStates:
    states = JointStates()
    for message in messages:
        states.keep(message)
    return states


def test_joints_are_found_by_name_in_any_order_among_others():
    states = kept(joint_state('xcbya', [9, 3, 2, 9, 1]))
    np.testing.assert_array_equal(states.seed('abc'), [1, 2, 3])


def test_partial_joint_states_fill_in_and_the_newest_wins():
    states = kept(joint_state('ab', [1, 2]), joint_state('bc', [5, 6]))
    np.testing.assert_array_equal(states.seed('abc'), [1, 5, 6])
    states.keep(joint_state('ab', [7, 8]))
    np.testing.assert_array_equal(states.seed('abc'), [7, 8, 6])


def test_a_joint_state_of_velocities_alone_leaves_positions_as_they_were():
    states = kept(joint_state('abc', [1, 2, 3]), JointState(name=['a', 'b'], velocity=[1.0, 1.0]))
    np.testing.assert_array_equal(states.seed('abc'), [1, 2, 3])


@pytest.mark.parametrize('order', [1, -1])
def test_positions_and_velocities_of_the_same_joints_may_come_in_messages_of_their_own(order):
    states = JointStates()
    for message in [joint_state('abc', [1, 2, 3]), JointState(name=['a', 'b', 'c'], velocity=[1.0] * 3)][::order]:
        states.keep(message)
        states.keep(message)
    np.testing.assert_array_equal(states.seed('abc'), [1, 2, 3])
    assert states.positions('bc') == {'b': 2, 'c': 3}


def test_velocities_alone_do_not_make_positions_new(monkeypatch):
    states, clock = JointStates(), iter((10.0, 20.0, 30.0, 31.0))
    monkeypatch.setattr('time.monotonic', lambda: next(clock))
    states.keep(joint_state('ab', [1, 2]))
    states.keep(JointState(name=['a', 'b'], velocity=[1.0, 1.0]))
    states.keep(JointState(name=['c'], velocity=[1.0]))
    assert states.age('ab') == 21.0
    assert states.age('abc') == math.inf


@pytest.mark.parametrize(
    ('messages', 'words'),
    [
        ([], 'no message on joint_states yet'),
        ([joint_state('xy', [1, 2])], 'none of the joints: expected a, b; got x, y'),
        ([joint_state('', [])], 'got no names'),
        ([joint_state('a', [1])], 'no position yet of b'),
        ([joint_state('ab', [1])], '2 names, 1 positions'),
        ([joint_state('', [1, 2])], '0 names, 2 positions'),
        ([joint_state('ab', [1, math.nan])], 'position nan of b'),
        ([joint_state('ab', [-math.inf, 1])], 'position -inf of a'),
        ([joint_state('aba', [1, 2, 3])], 'joint_states has a more than once'),
        ([joint_state('ab', [1, 2]), joint_state('ba', [1, math.nan])], 'position nan of a'),
    ],
)
def test_joint_states_that_cannot_be_used_say_why(messages, words):
    with pytest.raises(RefusedError) as refused:
        kept(*messages).seed('ab')
    assert words in str(refused.value)


def test_faults_of_joints_that_are_not_the_arms_do_not_matter():
    states = kept(joint_state('abx', [1, 2, math.nan]), joint_state('yz', [1]))
    np.testing.assert_array_equal(states.seed('ab'), [1, 2])


def test_a_sound_joint_state_makes_up_for_a_faulty_one():
    states = kept(joint_state('abx', [1]), joint_state('ab', [1, 2]))
    np.testing.assert_array_equal(states.seed('ab'), [1, 2])


def test_ever_new_names_do_not_fill_the_memory():
    names = [f'joint{i}' for i in range(3 * MAX_SOURCES)]
    states = kept(*(joint_state([name], [1.0]) for name in names))
    assert list(states.positions(names)) == names[: -MAX_SOURCES - 1 : -1]


def test_positions_have_names_and_the_base_frame():
    result = answer_with()
    message = positions_message(result.arm, result.solution.q)
    assert tuple(message.name) == result.arm.joint_names
    np.testing.assert_array_equal(message.position, result.solution.q)
    assert message.header.frame_id == result.arm.base_frame


def test_a_command_of_the_stream_is_a_trajectory_of_one_point_with_its_velocity():
    arm = answer_with().arm
    motion = Motion(*np.arange(4.0 * arm.n).reshape(4, arm.n))
    message = motion_trajectory_message(arm, motion, 0.002)
    (point,) = message.points
    assert tuple(message.joint_names) == arm.joint_names
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (0, 0)
    for values, expected in zip((point.positions, point.velocities, point.accelerations), motion):
        np.testing.assert_array_equal(values, expected)
    assert (point.time_from_start.sec, point.time_from_start.nanosec) == (0, 2_000_000)


@pytest.mark.parametrize(('asked', 'expected'), [(0.1, (0, 250_000_000)), (2.5, (2, 500_000_000))])
def test_a_trajectory_has_one_point_that_is_not_due_before_the_limits_allow(asked, expected):
    result = answer_with()
    message = trajectory_message(result, asked)
    (point,) = message.points
    assert tuple(message.joint_names) == result.arm.joint_names
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (0, 0)
    np.testing.assert_array_equal(point.positions, result.command.q)
    assert (point.time_from_start.sec, point.time_from_start.nanosec) == expected
    assert list(point.velocities) == list(point.accelerations) == list(point.effort) == []


def test_commands_are_the_positions_in_the_order_of_the_arm():
    result = answer_with()
    np.testing.assert_array_equal(commands_message(result).data, result.command.q)


def test_a_result_says_what_was_published_and_how_far_off_that_is():
    result = answer_with()
    assert values_of(result_message(result, 'ik_node').status[0])['published'] == 'solution'
    command = replace(result.command, published=CLOSEST, errors=(0.25, 0.5), fraction=0.125, step_time=0.02)
    figures = values_of(result_message(replace(result, command=command), 'ik_node').status[0])
    assert (figures['published'], figures['velocity_limited'], figures['step_time']) == ('closest', '0.125', '0.02')
    assert (figures['published_position_error'], figures['published_orientation_error']) == ('0.25', '0.5')
    assert values_of(result_message(replace(result, command=None), 'ik_node').status[0])['published'] == 'nothing'


def test_the_trace_is_a_matrix_with_labelled_columns():
    result = answer_with(rows=4)
    message = trace_message(result, result.solution.trace, 'dls', 'solve')
    rows, columns = message.layout.dim
    assert rows.label == 'rows method=dls run=solve stamp=12.000000034'
    assert rows.size == 4 and rows.stride == 4 * columns.size
    assert columns.label.split(',') == [*TRACE_COLUMNS, *result.arm.joint_names]
    matrix = np.array(message.data).reshape(rows.size, columns.size)
    np.testing.assert_array_equal(matrix[:, : len(TRACE_COLUMNS)], result.solution.trace.rows)
    np.testing.assert_array_equal(matrix[:, len(TRACE_COLUMNS) :], result.solution.trace.joint_positions)


def test_the_path_is_where_the_tip_was():
    result = answer_with()
    points = [pose.pose.position for pose in path_message(result).poses]
    np.testing.assert_array_equal([[p.x, p.y, p.z] for p in points], result.solution.trace.tip_positions)


def test_a_result_has_the_figures_of_the_solution_as_exact_text():
    status = result_message(answer_with(), 'ik_node').status[0]
    figures = values_of(status)
    assert (status.name, status.level, status.message) == ('ik_node: solved', b'\x00', 'fine')
    assert status.hardware_id == 'puma560'
    assert (figures['outcome'], figures['method'], figures['status']) == ('solved', 'dls', 'converged')
    assert float(figures['position_error']) == 1e-7 and figures['iterations'] == '2'
    assert figures['joints_at_limits'] == 'joint2 joint5'
    assert figures['notes'] == 'one; two'
    assert (figures['target_frame'], figures['target_stamp']) == ('elsewhere', '12.000000034')


def test_each_iteration_has_the_numbers_of_its_row():
    result = answer_with(rows=5)
    message = iterations_message(result, 'ik_node')
    numbers = [[float(text) for text in values_of(status).values()] for status in message.status]
    np.testing.assert_array_equal(numbers, result.solution.trace.rows)
    assert list(values_of(message.status[0])) == list(TRACE_COLUMNS)


def test_very_long_traces_are_cut_for_people():
    rows = MAX_ITERATION_STATUSES + 5
    assert len(iterations_message(answer_with(rows), 'ik_node').status) == MAX_ITERATION_STATUSES


def test_texts_from_outside_are_cut():
    assert shorten('a' * 1000, 5) == 'aaaaa... (1000 characters)'
