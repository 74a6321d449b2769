"""The launch files, run by stand-ins for launch that do what the real one was seen to do."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from launch_stand_in import ROOT, ros2_launch, show_args

from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.interface.parameters import PARAMETERS, SEED_SOURCES
from ros_ik_pkg.ros.runtime.stop_flag import LAUNCHER_VARIABLE

IK, TWO_ARMS, PANEL = 'ik.launch.py', 'two_arms.launch.py', 'panel.launch.py'
FILES = sorted(path.name for path in (ROOT / 'launch').glob('*.launch.py'))
COMMON = {'method', 'seed_source', 'compare', 'params_file', 'use_sim_time', 'log_level', 'respawn'}


@pytest.fixture
def launch(monkeypatch):
    return lambda file, command='', parent='': ros2_launch(monkeypatch, file, command, parent)


@pytest.mark.parametrize('file', FILES)
def test_every_launch_file_has_the_common_arguments_with_a_description(monkeypatch, file):
    shown = show_args(monkeypatch, file)
    assert set(shown) >= COMMON
    assert all(argument.description for argument in shown.values())


@pytest.mark.parametrize('file', FILES)
def test_lists_that_the_launch_files_repeat_are_those_of_the_node(monkeypatch, file):
    shown = show_args(monkeypatch, file)
    assert shown['method'].choices == ['', *PARAMETERS['method'].allowed]
    assert shown['seed_source'].choices == ['', *SEED_SOURCES]
    assert all(name in shown['compare'].description for name in PARAMETERS['compare'].allowed)


@pytest.mark.parametrize('name', ['robot', 'method', 'seed_source'])
def test_show_args_names_the_value_that_the_node_uses_if_nothing_is_given(monkeypatch, name):
    argument = show_args(monkeypatch, IK)[name]
    assert argument.default_value == ''
    assert f'else {PARAMETERS[name].default}' in argument.description


@pytest.mark.parametrize(
    ('command', 'parameters'),
    [
        ('', {}),
        ('robot:=ur5', {'robot': 'ur5'}),
        ('base_frame:=a tip_frame:=1', {'base_frame': 'a', 'tip_frame': '1'}),
        ('robot_from_topic:=true', {'robot': '', 'robot_description': ''}),
        ('robot_from_topic:=1 robot:=ur5', {'robot': '', 'robot_description': ''}),
        ('robot_from_topic:=True tip_frame:=b', {'robot': '', 'robot_description': '', 'tip_frame': 'b'}),
        ('robot_from_topic:=0 robot:=ur5', {'robot': 'ur5'}),
        ('use_sim_time:=1', {'use_sim_time': True}),
        ('use_sim_time:=false', {'use_sim_time': False}),
        ('seed_source:=home method:=sdls', {'seed_source': 'home', 'method': 'sdls'}),
        ('compare:=all', {'compare': ['all']}),
        ('compare:=dls,sdls', {'compare': ['dls', 'sdls']}),
        ("compare:='[dls, sdls]'", {'compare': ['dls', 'sdls']}),
    ],
)
def test_an_argument_sets_its_parameter_and_an_absent_one_leaves_the_node_alone(launch, command, parameters):
    (node,) = launch(IK, command)
    assert (node.package, node.executable, node.name) == ('ros_ik_pkg', 'ik_node', topics.NODE_NAME)
    assert node.parameters == parameters
    for name, value in parameters.items():
        if name != 'use_sim_time':  # declared by rclpy on every node
            PARAMETERS[name].check(value)


@pytest.mark.parametrize('file', FILES)
@pytest.mark.parametrize(
    ('command', 'words'),
    [
        ('methud:=sdls', ['methud', 'method']),
        ('nonsense:=1', ['nonsense', 'params_file']),
        ('method:=nonsense', ['method', 'nonsense', 'adaptive_dls']),
        ('seed_source:=nonsense', ['seed_source', 'nonsense', 'last_solution']),
        ('use_sim_time:=maybe', ['use_sim_time', 'maybe', 'true']),
        ('respawn:=', ['respawn', 'true']),
        ('log_level:=loud', ['log_level', 'loud', 'debug']),
        ('compare:=dls,nonsense', ['compare', 'nonsense', 'sdls']),
        ('params_file:=/no/such/file.yaml', ['params_file', '/no/such/file.yaml', 'does not exist']),
    ],
)
def test_a_wrong_argument_ends_the_launch_with_a_reason(launch, file, command, words):
    with pytest.raises(RuntimeError) as refusal:
        launch(file, command)
    assert all(word in str(refusal.value) for word in words), refusal.value


def test_garbage_for_robot_from_topic_is_refused(launch):
    with pytest.raises(RuntimeError, match=r'robot_from_topic.*perhaps'):
        launch(IK, 'robot_from_topic:=perhaps')


@pytest.mark.parametrize('file', FILES)
def test_arguments_that_launch_itself_reads_are_accepted(launch, file):
    assert launch(file, 'sigterm_timeout:=2 launch-prefix:=gdb')


def test_a_launch_file_that_includes_ours_may_have_arguments_of_its_own(launch):
    (node,) = launch(IK, 'start_rviz:=true robot:=ur5', parent='bringup.launch.py')
    assert node.parameters == {'robot': 'ur5'}


def test_a_launch_file_given_by_its_path_refuses_unknown_arguments_too(launch, monkeypatch):
    launch(IK)
    import ros_ik_pkg.tools.launch_arguments as shared

    path = str(ROOT / 'launch' / IK)
    assert shared._is_on_command_line(path, ['ros2', 'launch', path, 'x:=1'])
    assert not shared._is_on_command_line(path, ['ros2', 'launch', 'robot_bringup', IK, 'x:=1'])


def test_the_parameters_file_comes_before_the_arguments_which_win(launch, tmp_path):
    file = tmp_path / 'my.yaml'
    file.write_text('/**:\n  ros__parameters: {method: dls}\n')
    (node,) = launch(IK, f'params_file:={file} method:=sdls')
    assert (node.files, node.parameters) == ([str(file)], {'method': 'sdls'})


def test_topics_namespace_log_level_and_respawn_reach_the_node(launch):
    (node,) = launch(IK, 'namespace:=arm1 robot_description:=/robot_description log_level:=debug respawn:=true')
    assert (node.namespace, node.respawn, node.ros_arguments) == ('arm1', True, ['--log-level', 'debug'])
    inputs = {topic.name for topic in (topics.TARGET_POSE, topics.JOINT_STATES, topics.ROBOT_DESCRIPTION)}
    assert set(node.remappings) == inputs
    assert node.remappings['robot_description'] == '/robot_description'
    (node,) = launch(IK)
    assert (node.respawn, node.ros_arguments) == (False, ['--log-level', 'info'])
    assert all(source == target for source, target in node.remappings.items())


def test_two_arms_are_nodes_in_two_namespaces_that_share_topics(launch):
    left, right = launch(TWO_ARMS, 'left_tip:=l right_tip:=r right_base:=torso compare:=dls')
    assert [left.namespace, right.namespace] == ['left', 'right']
    assert left.parameters == {'robot': '', 'tip_frame': 'l', 'compare': ['dls']}
    assert right.parameters == {'robot': '', 'tip_frame': 'r', 'base_frame': 'torso', 'compare': ['dls']}
    for node in (left, right):
        assert node.remappings == {name: f'/{name}' for name in ('joint_states', 'robot_description')}


def test_the_panel_comes_with_a_node_unless_there_is_one(launch):
    panel, node = launch(PANEL, 'robot:=panda port:=9000')
    assert (panel.executable, panel.arguments) == ('panel', ['--host', '127.0.0.1', '--port', '9000'])
    assert node.parameters['robot'] == 'panda'
    for name, value in node.parameters.items():
        PARAMETERS[name].check(value)
    (panel,) = launch(PANEL, 'start_node:=0')
    assert panel.executable == 'panel'


@pytest.mark.parametrize('file', FILES)
def test_every_node_is_told_which_process_launches_it(launch, file):
    assert all(node.environment == {LAUNCHER_VARIABLE: str(os.getpid())} for node in launch(file))


def test_the_launch_helpers_need_neither_numba_nor_rclpy(launch):
    names = {'numba', 'rclpy', 'numpy', 'pinocchio', 'ros_ik_pkg.ik'}
    code = f"""
import sys
sys.path[:0] = [{str(ROOT / 'test')!r}, {str(ROOT)!r}]
import launch_stand_in, pytest
with pytest.MonkeyPatch.context() as patch:
    launch_stand_in.ros2_launch(patch, {IK!r})
    print(*({names!r} & set(sys.modules)))
"""
    assert subprocess.check_output([sys.executable, '-c', code], text=True, cwd=ROOT).split() == []
