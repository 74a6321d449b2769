"""Arms from every kind of source: chains, flat arrays, limits and frames, judged by Pinocchio."""

from __future__ import annotations

import os
import pickle

import numpy as np
import pinocchio as pin
import pytest
from chains import chain, flat_pose, joint_positions, joint_xml, pinocchio_jacobian, pinocchio_pose, random_urdf, urdf

from ros_ik_pkg.ik.exceptions import ArgumentError, ModelError
from ros_ik_pkg.ik.loading import load_arm
from ros_ik_pkg.ik.model.sources import robot_names
from ros_ik_pkg.share import share_path

ROBOTS = (
    'fr3', 'gen3', 'iiwa14', 'openarm', 'panda', 'planar3r', 'puma560', 'so100', 'so101', 'stanford', 'ur10e', 'ur3e',
    'ur5', 'ur5e', 'xarm7',
)  # fmt: skip
EXACT = 1e-12


def random_q(arm, rng):
    return rng.uniform(np.maximum(arm.lower, -7.0), np.minimum(arm.upper, 7.0))


@pytest.mark.parametrize('seed', range(25))
def test_random_chains_agree_with_pinocchio(seed):
    rng = np.random.default_rng(seed)
    text = random_urdf(
        rng, joints=int(rng.integers(1, 10)), branches=int(rng.integers(0, 4)), mimics=seed % 3
    )
    arm = load_arm(text, 'base', 'tip')
    q = random_q(arm, rng)
    expected = pinocchio_pose(text, 'base', 'tip', joint_positions(arm, q))
    np.testing.assert_allclose(flat_pose(arm, q), expected, atol=EXACT)
    np.testing.assert_allclose(arm.forward(q), expected, atol=EXACT)


@pytest.mark.parametrize('seed', range(10))
def test_the_jacobian_is_pinocchios(seed):
    rng = np.random.default_rng(300 + seed)
    arm = load_arm(random_urdf(rng, joints=7, mimics=2), 'link2', 'tip')
    q = random_q(arm, rng)
    expected = pinocchio_jacobian(arm.model, arm, q)
    np.testing.assert_allclose(arm.jacobian(q), expected, atol=EXACT)


@pytest.mark.parametrize('seed', range(5))
def test_the_chain_may_begin_at_any_link(seed):
    rng = np.random.default_rng(100 + seed)
    text = random_urdf(rng, joints=6, branches=0, kinds=('revolute', 'continuous'))
    arm = load_arm(text, 'link2', 'link5')
    assert arm.joint_names == ('joint2', 'joint3', 'joint4')
    q = random_q(arm, rng)
    expected = pinocchio_pose(text, 'link2', 'link5', joint_positions(arm, q))
    np.testing.assert_allclose(arm.forward(q), expected, atol=EXACT)


@pytest.mark.parametrize('seed', range(10))
def test_any_frame_is_placed_as_pinocchio_places_it(seed):
    rng = np.random.default_rng(200 + seed)
    text = random_urdf(rng, joints=5, branches=4)
    arm = load_arm(text, 'link1', 'tip')
    names = [joint.name for joint in arm.tree.joints if joint.movable]
    positions = {name: float(rng.uniform(-2, 2)) for name in names}
    for frame in arm.frame_names:
        expected = pinocchio_pose(text, 'link1', frame, positions)
        np.testing.assert_allclose(arm.base_from_frame(frame, positions), expected, atol=EXACT)


@pytest.mark.parametrize('name', ROBOTS)
def test_a_shipped_robot_is_ready_to_use(name):
    arm = load_arm(name)
    assert arm.name == name
    assert np.all(arm.lower < arm.upper)
    assert np.all((arm.lower < arm.home) & (arm.home < arm.upper))
    np.testing.assert_allclose(arm.forward(arm.home), flat_pose(arm, arm.home), atol=EXACT)
    assert np.linalg.svd(arm.jacobian(arm.home), compute_uv=False)[min(arm.n, 6) - 1] > 0.05, (
        'home is singular'
    )


def test_the_shipped_robots_are_the_ones_that_are_known():
    assert robot_names() == ROBOTS
    assert (share_path() / 'config' / 'robots').is_dir()


def test_flat_arrays_are_what_compiled_code_takes():
    arm = load_arm('stanford')
    for values, dtype, shape in (
        (arm.placements, np.float64, (7, 12)),
        (arm.prismatic, np.int64, (6,)),
        (arm.variable, np.int64, (6,)),
        (arm.multiplier, np.float64, (6,)),
        (arm.offset, np.float64, (6,)),
        (arm.lower, np.float64, (6,)),
        (arm.upper, np.float64, (6,)),
        (arm.velocity_limits, np.float64, (6,)),
        (arm.home, np.float64, (6,)),
        (arm.wraps, np.int64, (6,)),
    ):
        assert values.dtype == dtype
        assert values.shape == shape
        assert values.flags.c_contiguous
    assert arm.prismatic.tolist() == [0, 0, 1, 0, 0, 0]


def test_the_model_has_one_q_per_joint_and_the_links_as_frames():
    text = chain(('j1', 'continuous', {}), ('j2', 'prismatic', {'axis': (1, 1, 0)}))
    model = load_arm(text).model
    assert (model.nq, model.nv) == (2, 2)
    assert list(model.names)[1:] == ['j1', 'j2']
    assert [frame.name for frame in model.frames if frame.type == pin.FrameType.BODY] == ['base', 'a', 'tip']


TWO_ARMS = urdf(
    ('base', 'l1', 'l2', 'left', 'r1', 'right', 'camera', 'ball'),
    [
        joint_xml('lj1', 'revolute', 'base', 'l1'),
        joint_xml('lj2', 'revolute', 'l1', 'l2'),
        joint_xml('lj3', 'revolute', 'l2', 'left'),
        joint_xml('rj1', 'revolute', 'base', 'r1'),
        joint_xml('rj2', 'revolute', 'r1', 'right'),
        joint_xml('weld', 'fixed', 'base', 'camera'),
        joint_xml('rolling', 'floating', 'base', 'ball'),
    ],
)


def test_without_a_tip_the_leaf_with_the_most_joints_is_taken():
    assert load_arm(TWO_ARMS).tip_frame == 'left'
    assert load_arm(TWO_ARMS, 'r1').tip_frame == 'right'
    assert load_arm(TWO_ARMS, 'camera').tip_frame == 'left'


def test_several_equal_tips_are_listed():
    text = urdf(
        ('base', 'one', 'two'),
        [joint_xml('j1', 'revolute', 'base', 'one'), joint_xml('j2', 'revolute', 'base', 'two')],
    )
    with pytest.raises(ModelError, match='several possible tips: one, two'):
        load_arm(text)


@pytest.mark.parametrize(
    ('base', 'tip', 'words'),
    [
        ('bas', None, ["base frame 'bas'", 'did you mean base']),
        (None, 'zzz', ["tip frame 'zzz'", 'known: base']),
        ('r1', 'left', ["'left' does not descend from base frame 'r1'"]),
        ('left', 'base', ['does not descend', 'exchange base and tip']),
        ('base', 'base', ['no movable joint between']),
        ('base', 'camera', ['no movable joint between', "'base'", "'camera'"]),
        ('base', 'ball', ["'rolling' is of type floating"]),
    ],
)
def test_frames_that_make_no_chain_are_refused_by_name(base, tip, words):
    with pytest.raises(ModelError) as caught:
        load_arm(TWO_ARMS, base, tip)
    assert all(word in str(caught.value) for word in words), caught.value


def test_empty_frame_names_mean_the_default():
    assert load_arm(TWO_ARMS, '', '').tip_frame == 'left'


def test_the_base_may_be_fixed_to_a_link_above_the_tip():
    arm = load_arm(
        TWO_ARMS.replace('<child link="camera"/><origin xyz="0.0', '<child link="camera"/><origin xyz="0.7'),
        'camera',
        'left',
    )
    position = arm.forward(np.zeros(3))[:3, 3]
    np.testing.assert_allclose(
        position, load_arm(TWO_ARMS).forward(np.zeros(3))[:3, 3] - [0.7, 0, 0], atol=EXACT
    )
    assert arm.joint_names == ('lj1', 'lj2', 'lj3')


def test_more_than_thirty_two_variables_are_refused():
    text = random_urdf(np.random.default_rng(1), joints=33, branches=0, kinds=('revolute',))
    with pytest.raises(ModelError, match='33 joints move between'):
        load_arm(text)
    assert load_arm(random_urdf(np.random.default_rng(1), joints=32, branches=0, kinds=('revolute',))).n == 32


@pytest.mark.parametrize(
    ('frame', 'positions', 'words'),
    [
        ('nowhere', {}, "frame 'nowhere' does not exist"),
        ('right', {'lj1': 0.0, 'rj1': 0.1}, 'no finite position of joint rj2'),
        ('right', {'rj1': np.nan, 'rj2': np.inf}, 'no finite position of joint rj1, rj2'),
        ('ball', {}, 'rolling (floating)'),
    ],
)
def test_a_frame_that_cannot_be_placed_is_refused_with_the_reason(frame, positions, words):
    with pytest.raises(ArgumentError) as caught:
        load_arm(TWO_ARMS, tip='left').base_from_frame(frame, positions)
    assert words in str(caught.value)


def test_an_arm_can_be_sent_to_another_process():
    arm = load_arm(TWO_ARMS, tip='left')
    positions = {'lj1': 0.1, 'lj2': 0.2, 'lj3': 0.3}
    pose = arm.base_from_frame('left', positions)
    copy = pickle.loads(pickle.dumps(arm))
    np.testing.assert_array_equal(copy.base_from_frame('left', positions), pose)
    np.testing.assert_array_equal(copy.forward([0.1, 0.2, 0.3]), arm.forward([0.1, 0.2, 0.3]))


def test_a_frame_fixed_to_the_base_needs_no_positions():
    np.testing.assert_array_equal(load_arm(TWO_ARMS, tip='left').base_from_frame('camera', {}), np.eye(4))


@pytest.mark.parametrize('q', [[0.0], np.zeros(7), np.zeros((6, 1)), 'six', None, [0, 0, 0, 0, 0, 'x']])
def test_a_configuration_of_the_wrong_shape_is_refused(q):
    arm = load_arm('puma560')
    for function in (arm.forward, arm.jacobian):
        with pytest.raises(ArgumentError, match='expected 6'):
            function(q)


@pytest.mark.parametrize(
    ('source', 'words'),
    [
        ('pum560', ["'pum560' is not known", 'fr3, gen3, iiwa14', 'did you mean puma560?', '.urdf']),
        ('', ["robot '' is not known"]),
        ('/nowhere/arm.urdf', ["cannot read the robot '/nowhere/arm.urdf'", 'No such file']),
        ('/nowhere/arm.yaml', ['No such file']),
        ('robot.xacro', ['No such file']),
        ('robot.sdf', ['is not known', '.urdf']),
        ('a\0b.urdf', ['cannot read']),
        (None, ['cannot read the robot None']),
        (7, ['cannot read the robot 7']),
    ],
)
def test_a_source_that_cannot_be_found_is_refused_with_what_is_known(source, words):
    with pytest.raises(ModelError) as caught:
        load_arm(source)
    assert all(word in str(caught.value) for word in words), caught.value


def test_a_source_may_be_a_name_a_path_or_a_text(tmp_path):
    robots = share_path() / 'config' / 'robots'
    text = chain(('j', 'revolute', {}))
    path = tmp_path / 'arm é.URDF'
    path.write_text(text, encoding='utf-8')
    assert load_arm(str(robots / 'panda.yaml')).joint_names == load_arm('panda').joint_names
    assert (
        load_arm(path).joint_names
        == load_arm(str(path)).joint_names
        == load_arm(f'\ufeff\n {text}').joint_names
    )


def test_an_arm_that_cannot_be_made_names_its_robot():
    with pytest.raises(
        ModelError, match="robot 'panda': tip frame 'hand' does not exist; known: panda_link0"
    ):
        load_arm('panda', tip='hand')


def test_a_malformed_file_is_named(tmp_path):
    path = tmp_path / 'broken.urdf'
    path.write_text('<robot>\n<link', encoding='utf-8')
    with pytest.raises(ModelError, match=r'broken\.urdf: line 2, column \d+: not well-formed'):
        load_arm(path)


def test_a_pipe_is_no_file_to_read(tmp_path):
    os.mkfifo(tmp_path / 'robot.urdf')
    with pytest.raises(ModelError, match='no regular file'):  # and does not wait for a writer
        load_arm(tmp_path / 'robot.urdf')


@pytest.mark.parametrize('place', ['name="LONG"', 'type="LONG"'])
def test_no_error_is_as_long_as_the_file(place):
    text = chain(('j', 'revolute', {})).replace('name="j"' if 'name' in place else 'type="revolute"', place)
    with pytest.raises(ModelError) as caught:
        load_arm(text.replace('LONG', 'x' * 10**6))
    assert len(str(caught.value)) < 5000
