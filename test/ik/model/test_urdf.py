"""Reading URDF: what is refused and in what words, what is tolerated, and no surprise from mutated text."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from chains import chain, joint_xml, pinocchio_pose, random_urdf, urdf
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.loading import load_arm
from ros_ik_pkg.ik.model.urdf import parse_urdf

GOOD = urdf(
    ('base', 'a', 'tip'),
    [
        joint_xml('shoulder', 'revolute', 'base', 'a', (0, 0, 0.5)),
        joint_xml('elbow', 'revolute', 'a', 'tip', (1, 0, 0), (0.1, 0, 0)),
    ],
)
LIMIT = '<limit lower="-2.0" upper="2.0" velocity="1.5" effort="1"/>'

MALFORMED = [
    (
        'not XML',
        '<robot>\n  <link name="a">\n</robot>',
        'line 3, column 3: not well-formed XML (mismatched tag)',
    ),
    ('cut off', GOOD[:200], 'not well-formed XML'),
    ('a null', '<robot>\0</robot>', 'line 1, column 8: not well-formed XML'),
    ('a lone surrogate', '<robot name="\ud800"/>', 'cannot be decoded'),
    ('an unknown encoding', b'<?xml version="1.0" encoding="klingon"?><robot/>', 'XML'),
    ('a DOCTYPE', '<!DOCTYPE robot [<!ENTITY a "b">]><robot/>', 'declares a DOCTYPE (robot)'),
    ('an outside DTD', '<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot/>', 'declares a DOCTYPE'),
    ('an unknown entity', '<robot name="&x;"/>', 'not well-formed XML (undefined entity'),
    ('too long a text', '<robot>' + ' ' * (33 * 2**20), 'at most 33554432 are read'),
    ('another root', '<sdf><model/></sdf>', 'the root element is <sdf>; expected <robot>'),
    (
        'macros',
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>',
        'holds xacro macros',
    ),
    ('no links', '<robot name="r"/>', 'the robot has no links'),
    ('too many links', urdf(map(str, range(5001)), []), 'has 5001 links; at most 5000'),
    ('a link without a name', '<robot><link/></robot>', 'a <link> has no name'),
    ('a joint without a name', GOOD.replace('name="elbow"', ''), 'a <joint> has no name'),
    ('one link twice', GOOD.replace('name="a"', 'name="base"'), 'link name used more than once: base'),
    ('one joint twice', GOOD.replace('elbow', 'shoulder'), 'joint name used more than once: shoulder'),
    (
        'no type',
        GOOD.replace('type="revolute"', '', 1),
        "joint 'shoulder' has type ''; expected one of revolute",
    ),
    ('an unknown type', GOOD.replace('revolute', 'ball', 1), "joint 'shoulder' has type 'ball'"),
    ('no parent', GOOD.replace('<parent link="a"/>', ''), "joint 'elbow': no <parent link"),
    ('no child', GOOD.replace('<child link="tip"/>', '<child/>'), "joint 'elbow': no <child link"),
    (
        'an unknown parent',
        GOOD.replace('parent link="a"', 'parent link="bass"'),
        "joint 'elbow': parent link 'bass' does not exist; did you mean base?",
    ),
    (
        'an unknown child',
        GOOD.replace('child link="tip"', 'child link="q"'),
        "child link 'q' does not exist; known: ",
    ),
    (
        'two parents',
        GOOD.replace('child link="tip"', 'child link="a"'),
        "'a' is the child of two joints: 'shoulder'",
    ),
    (
        'two roots',
        GOOD.replace('<link name="a"/>', '<link name="a"/><link name="b"/>'),
        '2 root links: base, b',
    ),
    (
        'only a loop',
        urdf('ab', [joint_xml('j', 'fixed', 'a', 'b'), joint_xml('k', 'fixed', 'b', 'a')]),
        'no root link, expected exactly one link without a parent; joints form a closed loop: j, k',
    ),
    (
        'only a loop, and what hangs on it',
        urdf('cab', [joint_xml(name, 'fixed', *links) for name, links in (('i', 'ac'), ('j', 'ab'), ('k', 'ba'))]),
        'no root link, expected exactly one link without a parent; joints form a closed loop: j, k',
    ),
    (
        'a loop beside',
        urdf('abc', [joint_xml('j', 'fixed', 'a', 'b'), joint_xml('k', 'fixed', 'b', 'a')]),
        'joints form a closed loop: j, k',
    ),
    ('a joint to itself', urdf('ab', [joint_xml('j', 'fixed', 'b', 'b')]), 'closed loop: j'),
    (
        'a zero axis',
        GOOD.replace('axis xyz="0.0 0.0 1.0"', 'axis xyz="0 0 0"', 1),
        "'shoulder': <axis xyz> is zero",
    ),
    (
        'a short axis',
        GOOD.replace('axis xyz="0.0 0.0 1.0"', 'axis xyz="0 1"', 1),
        "is '0 1'; expected three numbers",
    ),
    (
        'an axis of NaN',
        GOOD.replace('axis xyz="0.0 0.0 1.0"', 'axis xyz="0 0 nan"', 1),
        "is 'nan'; expected a finite",
    ),
    ('an infinite origin', GOOD.replace('0.0 0.0 0.5', '0 0 inf'), "joint 'shoulder': <origin xyz> is 'inf'"),
    ('a word in an origin', GOOD.replace('0.1 0.0 0.0', 'a 0 0'), "joint 'elbow': <origin rpy> is 'a'"),
    ('a far origin', GOOD.replace('0.0 0.0 0.5', '0 0 1e300'), "joint 'shoulder' is placed 1e+300 m away"),
    (
        'an unknown attribute of an origin',
        GOOD.replace('rpy="0.1', 'quat_wxyz="1 0 0 0" rpy="0.1'),
        "joint 'elbow': <origin> has the unknown attribute 'quat_wxyz'; did you mean quat_xyzw",
    ),
    ('an unknown attribute of an axis', GOOD.replace('<axis xyz', '<axis frame="base" xyz', 1), "attribute 'frame'"),
    ('an unknown version', GOOD.replace('<robot ', '<robot version="2.0" '), "<robot version> is '2.0'"),
    (
        'a quaternion before URDF 1.1',
        GOOD.replace('rpy="0.1 0.0 0.0"', 'quat_xyzw="0 0 0 1"'),
        "joint 'elbow': <origin quat_xyzw> needs <robot version=\"1.1\">",
    ),
    (
        'a bad multiplier',
        GOOD.replace(LIMIT, LIMIT + '<mimic joint="elbow" multiplier="x"/>', 1),
        "joint 'shoulder': <mimic multiplier> is 'x'",
    ),
]

BAD_LIMITS = [
    ('', "joint 'elbow': no <limit>; a revolute joint needs lower < upper"),
    ('<limit velocity="1"/>', "joint 'elbow': <limit> has neither lower nor upper"),
    ('<limit lower="2" upper="-1"/>', "joint 'elbow': limits lower = 2 and upper = -1 are reversed"),
    ('<limit lower="2"/>', '<limit> has lower = 2, but upper is missing and counts as 0; expected lower < upper'),
    ('<limit upper="-1"/>', '<limit> has upper = -1, but lower is missing and counts as 0'),
    ('<limit lower="0" upper="1_0"/>', "joint 'elbow': <limit upper> is '1_0'; expected a finite number"),
    ('<limit lower="nan" upper="1"/>', "joint 'elbow': <limit lower> is 'nan'; expected a finite number"),
    ('<limit lower="-1" upper="inf"/>', "joint 'elbow': <limit upper> is 'inf'"),
    ('<limit lower="-1" upper="1" velocity="fast"/>', "joint 'elbow': <limit velocity> is 'fast'"),
    ('<limit lower="-1" upper="1" velocity="nan"/>', "<limit velocity> is 'nan'; expected a finite number"),
]


def with_limit(limit):
    """Give the elbow another <limit>."""
    before, after = GOOD.rsplit(LIMIT, 1)
    return before + limit + after


@pytest.mark.parametrize(
    ('text', 'words'), [case[1:] for case in MALFORMED], ids=[case[0] for case in MALFORMED]
)
def test_a_malformed_robot_is_refused_in_plain_words(text, words):
    with pytest.raises(ModelError) as caught:
        parse_urdf(text)
    assert words in str(caught.value)


@pytest.mark.parametrize(('limit', 'words'), BAD_LIMITS)
def test_bad_limits_are_refused_where_the_chain_needs_the_joint(limit, words):
    with pytest.raises(ModelError) as caught:
        load_arm(with_limit(limit))
    assert words in str(caught.value)


@pytest.mark.parametrize(('limit', 'words'), BAD_LIMITS)
def test_bad_limits_elsewhere_do_not_matter(limit, words):
    arm = load_arm(with_limit(limit), tip='a')
    assert arm.joint_names == ('shoulder',)
    assert arm.base_from_frame('tip', {'shoulder': 0.1, 'elbow': 0.2}).shape == (4, 4)


def test_all_bad_limits_of_a_chain_are_told_at_once():
    with pytest.raises(ModelError, match=r"'shoulder': no <limit>.*; joint 'elbow': no <limit>"):
        load_arm(GOOD.replace(LIMIT, ''))


@pytest.mark.parametrize('kind', ['planar', 'floating'])
def test_an_unsupported_joint_on_the_chain_is_named_with_its_type(kind):
    with pytest.raises(
        ModelError, match=f"joint 'elbow' is of type {kind}; a chain takes revolute, continuous, pris"
    ):
        load_arm(GOOD.replace('<joint name="elbow" type="revolute"', f'<joint name="elbow" type="{kind}"'))


@pytest.mark.parametrize('kind', ['planar', 'floating'])
def test_a_joint_that_lets_the_whole_robot_move_is_refused_with_a_base_frame_below_it(kind):
    joint = f'<joint name="world_joint" type="{kind}"><parent link="world"/><child link="base"/></joint>'
    text = chain(('j', 'revolute', {})).replace('</robot>', f'<link name="world"/>{joint}</robot>')
    with pytest.raises(ModelError, match=r"'world_joint' is of type .*: choose a base frame below it, such as 'base'"):
        load_arm(text)
    assert load_arm(text, base='base').n == 1


@pytest.mark.parametrize(('old', 'new'), [('type="revolute"', 'type="hinge"'), ('0.0 0.0 1.0', '0 0 0'),
                                          ('child link="tip"', 'child link="tap"')])  # fmt: skip
def test_what_is_wrong_inside_a_robot_is_told_with_its_name(old, new):
    text = chain(('j', 'revolute', {}))
    assert old in text
    with pytest.raises(ModelError, match=r"^robot 'made_up': joint"):
        load_arm(text.replace(old, new))


def test_the_upper_limit_alone_is_enough():
    assert load_arm(with_limit('<limit upper="1.5"/>')).lower.tolist() == [-2.0, 0.0]


def test_a_joint_without_axis_and_origin_turns_about_x():
    text = (
        '<robot><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/>'
        '</joint></robot>'
    )
    pose = load_arm(text).forward([np.pi / 2])
    np.testing.assert_allclose(pose[:3, :3], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-12)


@pytest.mark.parametrize('axis', ['0 0 1e-200', '0 0 1e200', '0 0 5'])
def test_the_length_of_an_axis_does_not_matter(axis):
    text = GOOD.replace('axis xyz="0.0 0.0 1.0"', f'axis xyz="{axis}"')
    np.testing.assert_allclose(
        load_arm(text).forward([0.3, 0.4]), load_arm(GOOD).forward([0.3, 0.4]), atol=1e-12
    )


def test_meshes_masses_and_foreign_elements_are_not_looked_at():
    extra = (
        '<visual><geometry><mesh filename="package://nowhere/a.stl" scale="nan"/></geometry></visual>'
        '<inertial><mass value="-1"/></inertial>'
    )
    text = GOOD.replace('<link name="a"/>', f'<link name="a">{extra}</link><gazebo/><ros2_control name="x"/>')
    np.testing.assert_array_equal(load_arm(text).forward([0.3, 0.4]), load_arm(GOOD).forward([0.3, 0.4]))


def test_prefixes_need_not_be_declared():
    text = GOOD.replace('effort', 'drake:acceleration="2.5" effort').replace(
        '</robot>', '<drake:tag/></robot>'
    )
    np.testing.assert_array_equal(load_arm(text).forward([0.3, 0.4]), load_arm(GOOD).forward([0.3, 0.4]))


def test_names_need_not_be_ascii_and_may_be_shared_by_links_and_joints():
    text = GOOD.replace('shoulder', '肩').replace('elbow', 'łokieć').replace('"tip"', '"universe"')
    for source in (text, '<?xml version="1.0" encoding="utf-8"?>\n' + text):
        assert load_arm(source).joint_names == ('肩', 'łokieć')
    assert load_arm(GOOD.replace('elbow', 'tip')).joint_names == ('shoulder', 'tip')
    positions = dict(zip(('肩', 'łokieć'), (0.1, 0.2)))
    np.testing.assert_allclose(
        load_arm(text).base_from_frame('universe', positions), load_arm(GOOD).forward([0.1, 0.2]), atol=1e-12
    )


def test_another_encoding_is_read_from_a_file(tmp_path):
    path = tmp_path / 'arm.urdf'
    path.write_bytes(
        ('<?xml version="1.0" encoding="iso-8859-1"?>' + GOOD.replace('elbow', 'coudé')).encode('latin-1')
    )
    assert load_arm(path).joint_names == ('shoulder', 'coudé')


def test_nothing_is_printed_whatever_the_text(capfd):
    load_arm(GOOD)
    with pytest.raises(ModelError):
        load_arm(GOOD.replace(LIMIT, ''))
    assert capfd.readouterr() == ('', '')


def test_a_long_chain_of_links_is_no_trouble():
    links = [f'l{k}' for k in range(1500)]
    joints = [
        joint_xml(f'j{k}', 'fixed' if k % 200 else 'revolute', links[k], links[k + 1], (0, 0, 0.001))
        for k in range(1499)
    ]
    arm = load_arm(urdf(links, joints))
    assert arm.n == 8
    assert arm.forward(np.zeros(8))[2, 3] == pytest.approx(1.499)


FUZZED = random_urdf(np.random.default_rng(3), joints=4, branches=2, mimics=1)


def load_or_refuse(text):
    """Load an arm and use it, or get a ModelError."""
    with contextlib.suppress(ModelError):
        arm = load_arm(text)
        assert np.isfinite(arm.forward(arm.home)).all()


@settings(max_examples=150, deadline=None, derandomize=True)  # the same cases in every run
@given(st.integers(0, len(FUZZED)), st.integers(0, 60), st.text(max_size=12))
def test_a_robot_with_a_piece_replaced_loads_or_is_refused(start, length, piece):
    load_or_refuse(FUZZED[:start] + piece + FUZZED[start + length :])


@settings(max_examples=150, deadline=None, derandomize=True)  # the same cases in every run
@given(
    st.integers(1, 500),
    st.sampled_from(
        [
            '0',
            '1',
            '-1',
            '1e308',
            '-1e-308',
            'nan',
            'inf',
            '',
            'x',
            '0 0 0',
            '٣',
            'base',
            'tip',
            'joint1',
            'revolute',
            'floating',
            'fixed',
            'prismatic',
        ]
    ),
)
def test_a_robot_with_an_attribute_replaced_loads_or_is_refused(place, value):
    words = FUZZED.split('"')
    place = 2 * (place % (len(words) // 2)) + 1
    load_or_refuse('"'.join([*words[:place], value, *words[place + 1 :]]))


@settings(max_examples=100, deadline=None, derandomize=True)  # the same cases in every run
@given(st.integers(1, len(FUZZED)))
def test_a_robot_cut_short_is_refused(length):
    with pytest.raises(ModelError):
        parse_urdf(FUZZED[:-length])


def test_pinocchio_reads_the_same_robot():
    positions = {'shoulder': 0.3, 'elbow': -0.4}
    np.testing.assert_allclose(
        load_arm(GOOD).forward([0.3, -0.4]), pinocchio_pose(GOOD, 'base', 'tip', positions), atol=1e-12
    )


@pytest.mark.parametrize('version', ['1.1', '1.2'])
@pytest.mark.parametrize('quaternion', ['0 0.6 0 0.8', '0.2 -0.4 0.6 1.2'])
def test_a_quaternion_of_urdf_1_1_is_read_as_pinocchio_reads_it(version, quaternion):
    text = GOOD.replace('<robot ', f'<robot version="{version}" ')
    text = text.replace('rpy="0.1 0.0 0.0"', f'quat_xyzw="{quaternion}"')
    arm = load_arm(text)
    try:
        expected = pinocchio_pose(text, 'base', 'tip', {'shoulder': 0.3, 'elbow': -0.4})
    except ValueError:
        pytest.skip('the URDF parser below this Pinocchio reads URDF 1.0 only')
    np.testing.assert_allclose(arm.forward([0.3, -0.4]), expected, atol=1e-12)


@pytest.mark.parametrize('velocity', ['-1', 'inf', '0'])
def test_a_velocity_limit_that_is_none_is_read_as_no_limit_with_a_warning(velocity):
    arm = load_arm(with_limit(f'<limit lower="-1" upper="1" velocity="{velocity}"/>'))
    assert arm.velocity_limits[1] == np.inf
    assert arm.warnings == (f"joint 'elbow': <limit velocity> is {velocity}; it is read as no limit",)


def test_limits_that_look_like_degrees_are_read_as_radians_with_a_warning():
    arm = load_arm(with_limit('<limit lower="-180" upper="180" velocity="1"/>'))
    assert (arm.lower[1], arm.upper[1]) == (-180.0, 180.0)
    assert 'lower = -180 and upper = 180 are probably degrees' in arm.warnings[0]
