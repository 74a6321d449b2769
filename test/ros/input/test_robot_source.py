"""The arm comes from robot_description, robot, or the topic, in this order, and from nothing else."""

from __future__ import annotations

import pytest

from ros_ik_pkg.ik import ModelError
from ros_ik_pkg.ros.input.robot_source import RobotSource, follows_topic
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, Settings

URDF = (
    '<robot name="{0}"><link name="a"/><link name="b"/><joint name="{0}_joint" type="revolute">'
    '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
)


def settings(**values) -> Settings:
    return Settings.from_values({name: option.default for name, option in PARAMETERS.items()} | values)


def source(topic_text: str = '') -> RobotSource:
    robot_source = RobotSource('/robot_description')
    if topic_text:
        robot_source.take(topic_text)
    return robot_source


def test_the_parameters_go_before_the_topic_and_the_description_before_the_name():
    every = source(URDF.format('topic'))
    assert every.load(settings(robot_description=URDF.format('text'))).name == 'text'
    assert every.load(settings()).name == 'puma560'
    assert every.load(settings(robot='')).name == 'topic'
    assert source().load(settings(robot='')) is None


def test_the_topic_is_followed_only_where_no_parameter_names_a_robot():
    assert follows_topic(settings(robot=''))
    assert not follows_topic(settings())
    assert not follows_topic(settings(robot='', robot_description=URDF.format('text')))


def test_frames_are_looked_up_in_the_new_robot():
    assert source().load(settings(tip_frame='link3', base_frame='link1')).n == 2
    with pytest.raises(ModelError, match=r'tip_frame = .nose.: .*nose'):
        source().load(settings(tip_frame='nose'))


@pytest.mark.parametrize('text', ['puma560', '/etc/hostname', '../config/robots/ur5.yaml', ' ', 'x' * 100000])
def test_a_description_opens_no_files(text):
    for use in (RobotSource('/robot_description').take, lambda text: source().load(settings(robot_description=text))):
        with pytest.raises(ModelError, match=r'robot_description.* expected URDF text') as refused:
            use(text)
        assert len(str(refused.value)) < 300


@pytest.mark.parametrize('text', ['', ' ', 'puma560', '<robot name="broken"><link', '<html/>'])
def test_what_is_no_urdf_leaves_the_text_of_the_topic_as_it_was(text):
    robot_source = RobotSource('/robot_description')
    robot_source.take(URDF.format('good'))
    with pytest.raises(ModelError, match=r'^topic /robot_description: '):
        robot_source.take(text)
    assert robot_source.load(settings(robot='', tip_frame='b')).name == 'good'


def test_errors_about_the_robot_of_the_topic_name_the_topic_and_not_the_empty_parameter():
    with pytest.raises(ModelError, match=r"^topic /robot_description, tip_frame = 'nose': robot 'good': .*nose"):
        source(URDF.format('good')).load(settings(robot='', tip_frame='nose'))
    with pytest.raises(ModelError, match=r"^parameter robot_description, tip_frame = 'nose': robot 'text': .*nose"):
        source().load(settings(robot_description=URDF.format('text'), tip_frame='nose'))


def test_the_reason_of_a_rejection_stays_until_a_good_text_comes():
    robot_source = source(URDF.format('good'))
    with pytest.raises(ModelError):
        robot_source.take('<robot name="broken"><link')
    assert 'not well-formed' in robot_source.rejected and 'not well-formed' in robot_source.awaited()
    assert robot_source.take(URDF.format('better')) == 'better'
    assert not robot_source.rejected and 'no URDF came on topic /robot_description' in robot_source.awaited()


def test_limits_and_held_joints_are_parameters_of_the_arm():
    arm = source().load(settings(robot='panda', held_joints=['panda_joint1:=0.5'], joint_limits=(
        'joint_limits: {panda_joint2: {has_position_limits: true, min_position: -0.5, max_position: 0.5}}')))
    assert arm.n == 6
    assert (arm.lower[0], arm.upper[0]) == (-0.5, 0.5)
    with pytest.raises(ModelError, match=r'xacro_args: .nonsense. is not allowed'):
        source().load(settings(xacro_args=['nonsense']))
