"""DH tables: closed forms, the shipped robots, and every way a table can be wrong."""

from __future__ import annotations

import contextlib

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.loading import load_arm
from ros_ik_pkg.ik.model.dh import parse_dh
from ros_ik_pkg.ik.model.sources import robot_names
from ros_ik_pkg.share import share_path

EXACT = 1e-12
HEAD = """\
name: two
source: made up
convention: standard
angles: degrees
base_frame: base
tip_frame: tip
joints:
"""
ROWS = """\
  - {name: j1, type: revolute, a: 0.3, alpha: 90, d: 0.1, theta: 20, lower: -90, upper: 90, velocity: 60}
  - {name: j2, type: prismatic, a: 0.2, alpha: -90, d: 0.4, theta: 30, lower: 0.1, upper: 0.5}
"""
TABLE = HEAD + ROWS


def dh_matrix(convention, a, alpha, d, theta):
    """One link's matrix as the textbooks print it."""
    ca, sa, ct, st_ = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    if convention == 'standard':
        return np.array(
            [
                [ct, -st_ * ca, st_ * sa, a * ct],
                [st_, ct * ca, -ct * sa, a * st_],
                [0, sa, ca, d],
                [0, 0, 0, 1],
            ]
        )
    return np.array(
        [[ct, -st_, 0, a], [st_ * ca, ct * ca, -sa, -sa * d], [st_ * sa, ct * sa, ca, ca * d], [0, 0, 0, 1]]
    )


def write_table(convention, rows, kinds):
    lines = [
        f'  - {{name: j{k}, type: {kind}, a: {a!r}, alpha: {alpha!r}, d: {d!r}, theta: {theta!r}, '
        'lower: -2, upper: 2}'
        for k, (kind, (a, alpha, d, theta)) in enumerate(zip(kinds, rows))
    ]
    head = HEAD.replace('standard', convention).replace('degrees', 'radians')
    return head + '\n'.join(lines) + '\ntool: {xyz: [0.1, 0.2, 0.3], rpy: [0.4, 0.5, 0.6]}\n'


def load_table(tmp_path, text):
    path = tmp_path / 'table.yaml'
    path.write_text(text, encoding='utf-8')
    return load_arm(path)


@pytest.mark.parametrize('convention', ['standard', 'modified'])
@pytest.mark.parametrize('seed', range(8))
def test_a_random_table_gives_the_textbook_product(tmp_path, convention, seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 10))
    rows = [tuple(map(float, rng.uniform(-np.pi, np.pi, 4))) for _ in range(n)]
    kinds = [str(kind) for kind in rng.choice(['revolute', 'prismatic'], n)]
    arm = load_table(tmp_path, write_table(convention, rows, kinds))
    q = rng.uniform(-2, 2, n)
    expected = np.eye(4)
    frames = []
    for (a, alpha, d, theta), kind, value in zip(rows, kinds, q):
        shift = (0, value) if kind == 'revolute' else (value, 0)
        expected = expected @ dh_matrix(convention, a, alpha, d + shift[0], theta + shift[1])
        frames.append(expected)
    tool = pin.SE3(pin.rpy.rpyToMatrix(0.4, 0.5, 0.6), np.array([0.1, 0.2, 0.3])).homogeneous
    np.testing.assert_allclose(arm.forward(q), expected @ tool, atol=EXACT)
    positions = dict(zip(arm.joint_names, q))
    for k, frame in enumerate(frames):
        np.testing.assert_allclose(arm.base_from_frame(f'link{k + 1}', positions), frame, atol=EXACT)


def test_planar3r_has_its_closed_form():
    arm = load_arm('planar3r')
    q = np.array([0.3, -0.7, 1.1])
    angles = np.cumsum(q)
    lengths = np.array([0.4, 0.3, 0.2])
    expected = np.eye(4)
    expected[:3, :3] = pin.utils.rotate('z', angles[-1])
    expected[:2, 3] = lengths @ np.cos(angles), lengths @ np.sin(angles)
    np.testing.assert_allclose(arm.forward(q), expected, atol=EXACT)
    jacobian = np.zeros((6, 3))
    for i in range(3):
        jacobian[:2, i] = -lengths[i:] @ np.sin(angles[i:]), lengths[i:] @ np.cos(angles[i:])
    jacobian[5] = 1.0
    np.testing.assert_allclose(arm.jacobian(q), jacobian, atol=EXACT)


def test_puma560_passes_the_check_of_the_lecture_notes():
    pose = load_arm('puma560').forward(np.radians([2.8, -77.7, 6.8, 8.5, -19.3, 172.0]))
    np.testing.assert_allclose(pose[:3, 3], [0.5, 0.15, 0.3], atol=1e-3)
    apart = pose[:3, :3].T @ pin.rpy.rpyToMatrix(0.0, np.pi / 2, 0.0)
    assert np.degrees(np.linalg.norm(pin.log3(apart))) < 0.1


@pytest.mark.parametrize(
    ('name', 'reach'), [('iiwa14', 0.36 + 0.42 + 0.4 + 0.126), ('panda', 0.333 + 0.316 + 0.384 - 0.107)]
)
def test_seven_joint_arms_stand_as_high_as_their_makers_say(name, reach):
    assert load_arm(name).forward(np.zeros(7))[2, 3] == pytest.approx(reach, abs=EXACT)


def test_ur5_lies_stretched_out_at_zero():
    position = load_arm('ur5').forward(np.zeros(6))[:3, 3]
    np.testing.assert_allclose(
        position, [-0.425 - 0.39225, -0.10915 - 0.0823, 0.089159 - 0.09465], atol=EXACT
    )


@pytest.mark.parametrize('name', robot_names())
def test_every_shipped_table_says_where_its_numbers_come_from(name):
    text = (share_path() / 'config' / 'robots' / f'{name}.yaml').read_text(encoding='utf-8')
    assert 'source:' in text
    assert parse_dh(text).name == name


def test_units_follow_the_kind_of_joint(tmp_path):
    arm = load_table(tmp_path, TABLE + 'home: [45, 0.2]\n')
    np.testing.assert_allclose(arm.lower, [-np.pi / 2, 0.1])
    np.testing.assert_allclose(arm.upper, [np.pi / 2, 0.5])
    np.testing.assert_allclose(arm.home, [np.pi / 4, 0.2])
    np.testing.assert_allclose(arm.velocity_limits, [np.pi / 3, np.inf])
    assert arm.frame_names == ('base', 'link1', 'link2', 'tip')


def test_links_may_be_named_and_numbers_written_without_a_point(tmp_path):
    text = TABLE.replace('{name: j1,', '{name: j1, link: schulter-ä,').replace('a: 0.3', 'a: 3e-1')
    arm = load_table(tmp_path, text)
    assert arm.frame_names == ('base', 'schulter-ä', 'link2', 'tip')


def test_a_continuous_row_has_no_limits(tmp_path):
    arm = load_table(tmp_path, TABLE.replace('revolute', 'continuous').replace('lower: -90, upper: 90, ', ''))
    assert (arm.lower[0], arm.upper[0], arm.wraps[0]) == (-np.inf, np.inf, 1)


MALFORMED = [
    ('', [], 'the file is empty; expected the keys name, source, convention'),
    (TABLE, [('name: two', 'name: [two')], 'line 2, column 7: not well-formed YAML'),
    (TABLE, [('name: two', 'name: two\n<<: 3')], "line 2: unknown key '<<'"),
    ('- a\n- b\n', [], 'line 1: the file is not a mapping; expected the keys name, source'),
    (TABLE, [('angles:', 'angels:')], "line 4: unknown key 'angels'; did you mean angles?"),
    (TABLE, [('source: made up\n', '')], "line 1: the file: missing key 'source'"),
    (TABLE, [('source: made up', 'source: ""')], 'line 2: source is empty'),
    (TABLE, [('base_frame: base', 'base_frame: [base]')], 'line 5: base_frame is empty or no text'),
    (TABLE, [('source', 'name')], "line 2: key 'name' is given twice"),
    (TABLE, [('standard', 'craig')], "line 3: convention is 'craig'; expected one of standard, modified"),
    (TABLE, [('degrees', 'turns')], "line 4: angles is 'turns'; expected one of radians, degrees"),
    (HEAD, [('joints:', 'joints: []')], 'line 7: joints is empty'),
    (HEAD, [('joints:', 'joints: 6')], 'line 7: joints is not a list'),
    (HEAD, [('joints:', 'joints: [6]')], 'line 7: a joint is not a mapping; expected the keys name, type'),
    (
        TABLE,
        [('type: revolute', 'type: hinge')],
        "line 8: type is 'hinge'; expected one of revolute, continuous",
    ),
    (TABLE, [('d: 0.4, ', '')], "line 9: a joint: missing key 'd'"),
    (TABLE, [('d: 0.4', 'd: abc')], "line 9: d is 'abc'; expected a finite number"),
    (TABLE, [('d: 0.4', 'd: .nan')], "line 9: d is '.nan'"),
    (TABLE, [('d: 0.4', 'd: inf')], "line 9: d is 'inf'"),
    (TABLE, [('d: 0.4', 'd: {x: 1}')], 'line 9: d is no number'),
    (TABLE, [('d: 0.4', 'd: 1e9')], "joints: joint 'j2' is placed 1e+09 m away"),
    (TABLE, [('d: 0.4', 'd: 4_0')], "line 9: d is '4_0'; expected a finite number"),
    (TABLE, [('base_frame: base', f'base_frame: {"b" * 2000}')], 'line 5: base_frame: a name has 2000 characters'),
    (TABLE, [('lower: 0.1', 'lower: 0.5')], 'line 9: lower = 0.5, upper = 0.5 are equal'),
    (TABLE, [('lower: 0.1', 'lower: 0.7')], 'line 9: lower = 0.7, upper = 0.5 are reversed'),
    (TABLE, [('lower: 0.1, ', '')], "line 9: key 'lower' is missing; a prismatic joint needs lower < upper"),
    (TABLE, [(', upper: 0.5', '')], "line 9: key 'upper' is missing"),
    (TABLE, [('type: revolute', 'type: continuous')], 'line 8: a continuous joint has no lower'),
    (TABLE, [('velocity: 60', 'velocity: 0')], 'line 8: velocity is 0; expected a positive number'),
    (TABLE, [('velocity: 60', 'speed: 60')], "line 8: unknown key 'speed'"),
    (
        TABLE,
        [('velocity: 60', 'radius: -0.1')],
        'line 8: radius is -0.1; expected above 0, at most 10000 m, or leave it out',
    ),
    (TABLE, [('velocity: 60', 'radius: 0')], 'line 8: radius is 0; expected above 0'),
    (TABLE, [('velocity: 60', 'radius: .nan')], "line 8: radius is '.nan'; expected a finite number"),
    (TABLE, [('velocity: 60', 'radius: [0.1, 0.2]')], 'line 8: radius is no number; expected a finite number'),
    (TABLE, [('velocity: 60', 'radius: 1e5')], 'line 8: radius is 100000; expected above 0, at most 10000 m'),
    (TABLE, [('source: made up', 'source: made up\nshapes: [a]')], 'line 3: shapes is empty or no text'),
    (TABLE, [('name: j2', 'name: j1')], 'joints: joint name used more than once: j1'),
    (TABLE, [('tip_frame: tip', 'tip_frame: link1')], 'joints: link name used more than once: link1'),
    (TABLE + 'home: [0]\n', [], 'line 10: home has 1 numbers; expected 2'),
    (TABLE + 'home: [0, 0]\n', [], "line 10: home of joint 'j2' is 0, outside its limits"),
    (TABLE + 'home: 3\n', [], 'line 10: home is not a list'),
    (TABLE + 'tool: {xyz: [0, 0, 1]}\n', [], "line 10: tool: missing key 'rpy'"),
    (TABLE + 'tool: {xyz: [0, 0], rpy: [0, 0, 0]}\n', [], 'line 10: xyz has 2 numbers; expected 3'),
    ('[' * 5000, [], 'not well-formed YAML'),
    ('name: \x00', [], 'not well-formed YAML'),
    ('x' * 2_000_000, [], 'the file has 2000000 bytes'),
    ('a: 1\n---\nb: 2\n', [], 'line 2, column 1: not well-formed YAML'),
]


@pytest.mark.parametrize(('text', 'changes', 'words'), MALFORMED, ids=[case[2][:50] for case in MALFORMED])
def test_a_malformed_table_is_refused_with_line_key_and_what_was_expected(text, changes, words):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    with pytest.raises(ModelError) as caught:
        parse_dh(text)
    assert words in str(caught.value)


def test_bytes_that_are_no_text_are_refused():
    with pytest.raises(ModelError, match='not well-formed YAML'):
        parse_dh(b'\xff\xfe\xfa name: x')


@settings(max_examples=150, deadline=None, derandomize=True)  # the same cases in every run
@given(st.integers(0, len(TABLE)), st.integers(0, 40), st.text(max_size=12))
def test_a_table_with_a_piece_replaced_loads_or_is_refused(start, length, piece):
    with contextlib.suppress(ModelError):
        parse_dh(TABLE[:start] + piece + TABLE[start + length :])


@settings(max_examples=100, deadline=None, derandomize=True)  # the same cases in every run
@given(st.binary(max_size=200))
def test_any_bytes_load_or_are_refused(content):
    with contextlib.suppress(ModelError):
        parse_dh(content)
