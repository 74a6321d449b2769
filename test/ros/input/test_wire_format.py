"""The bytes of targets and solutions, judged by what rclpy reads and writes."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from numerics import law
from rclpy.serialization import deserialize_message, serialize_message
from ros_helpers import allow_lark
from sensor_msgs.msg import JointState

from ros_ik_pkg.ros.input import target_reader
from ros_ik_pkg.ros.input.target import Target
from ros_ik_pkg.ros.input.target_reader import read_target, reads_what_rclpy_writes
from ros_ik_pkg.ros.interface import wire_format
from ros_ik_pkg.ros.output import solution_writer
from ros_ik_pkg.ros.output.solution_writer import SolutionWriter

pytestmark = allow_lark

TEXTS = st.text(st.characters(exclude_characters='\0', exclude_categories=['Cs']), max_size=20)
SECONDS, NANOSECONDS = st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1)
NUMBERS = st.lists(st.floats(), min_size=7, max_size=7)


def pose_stamped(sec: int, nanosec: int, frame: str, numbers: list[float]) -> PoseStamped:
    message = PoseStamped()
    message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id = sec, nanosec, frame
    p, q = message.pose.position, message.pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = numbers
    return message


def bits(target: Target) -> tuple:
    """Return a target so that NaN is equal to itself."""
    return *target[:3], struct.pack('7d', *target.position, *target.orientation)


def big_endian(sec: int, nanosec: int, frame: str, numbers: list[float]) -> bytes:
    """Write a PoseStamped as the other kind of machine does."""
    text = frame.encode() + b'\0'
    fields = struct.pack('>iII', sec, nanosec, len(text)) + text
    return b'\0\0\0\0' + fields + bytes(-len(fields) % 8) + struct.pack('>7d', *numbers)


@law
@given(SECONDS, NANOSECONDS, TEXTS, NUMBERS)
def test_a_target_is_what_rclpy_reads(sec, nanosec, frame, numbers):
    message = pose_stamped(sec, nanosec, frame, numbers)
    data = serialize_message(message)
    assert data[:2] == wire_format.LITTLE_ENDIAN
    assert bits(read_target(data)) == bits(Target.of(message)) == (sec, nanosec, frame, struct.pack('7d', *numbers))


def test_a_stamp_goes_through_a_target():
    stamp = Target.of(pose_stamped(12, 34, 'tool', [0.0] * 7)).stamp
    assert (stamp.sec, stamp.nanosec) == (12, 34)


@pytest.mark.parametrize('frame', ['', 'a', 'base_link', 'zażółć'])
def test_a_target_of_a_big_endian_machine_is_read(frame):
    values = 12, 34, frame, [0.5, -1.25, 3.0, 0.0, 0.6, 0.0, 0.8]
    assert read_target(big_endian(*values)) == Target.of(pose_stamped(*values))


def test_a_text_that_is_not_utf8_does_not_keep_a_target_from_being_read():
    data = serialize_message(pose_stamped(0, 0, 'abc', [1.0] * 7)).replace(b'abc', b'a\xffc')
    target = read_target(data)
    assert target.position == (1.0, 1.0, 1.0)
    assert target.frame_id == deserialize_message(data, PoseStamped).header.frame_id == 'a\ufffdc'


def test_bytes_that_end_too_early_are_no_target():
    data = serialize_message(pose_stamped(1, 2, 'base_link', [0.5] * 7))
    for length in range(len(data)):
        with pytest.raises((struct.error, RuntimeError)):
            read_target(data[:length])


@pytest.mark.parametrize('length', [2**31, 2**32 - 1])
def test_a_text_longer_than_the_message_is_no_target(length):
    data = serialize_message(pose_stamped(1, 2, 'base_link', [0.5] * 7))
    with pytest.raises(struct.error):
        read_target(data[:12] + struct.pack('<I', length) + data[16:])


@law
@given(
    st.lists(st.tuples(TEXTS, st.floats(allow_nan=False)), min_size=1, max_size=9), TEXTS, SECONDS, NANOSECONDS
)
def test_a_solution_reads_back_as_what_was_written(joints, frame, sec, nanosec):
    names, positions = zip(*joints)
    message = JointState(name=list(names), position=[0.0] * len(names))
    message.header.frame_id = frame
    writer = SolutionWriter(message)
    assert writer._plain
    read = deserialize_message(writer.write(sec, nanosec, np.array(positions)), JointState)
    assert (read.header.stamp.sec, read.header.stamp.nanosec, read.header.frame_id) == (sec, nanosec, frame)
    assert (tuple(read.name), tuple(read.position)) == (names, positions)
    assert len(read.velocity) == len(read.effort) == 0


@pytest.mark.parametrize(
    'change',
    [
        lambda data: b'\0\7' + data[2:],  # another version
        lambda data: data[:4] + b'more' + data[4:],  # another order
        lambda data: data[:4] + data[:3:-1],  # no positions to be found
    ],
)
def test_what_is_encoded_in_another_way_is_written_by_rclpy(change, monkeypatch):
    monkeypatch.setattr(solution_writer, 'serialize_message', lambda message: change(serialize_message(message)))
    writer = SolutionWriter(JointState(name=['a', 'b'], position=[0.0, 0.0]))
    expected = JointState(name=['a', 'b'], position=[0.25, -1.5])
    expected.header.stamp.sec, expected.header.stamp.nanosec = 3, 4
    assert writer.write(3, 4, np.array([0.25, -1.5])) == change(serialize_message(expected))


@pytest.mark.parametrize('layout', ['<7f', '>7d', '<9d'])
def test_where_messages_are_laid_out_in_another_way_rclpy_reads_them(layout, monkeypatch):
    assert reads_what_rclpy_writes()
    monkeypatch.setattr(target_reader, 'POSE', struct.Struct(layout))
    reads_what_rclpy_writes.cache_clear()
    message = pose_stamped(3, 4, 'base', [1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8])
    assert not reads_what_rclpy_writes()
    assert read_target(bytes(serialize_message(message))) == Target.of(message)
    reads_what_rclpy_writes.cache_clear()
