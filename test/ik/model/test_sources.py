"""Robots by package:// URI and from xacro files: what is found, what is expanded, and what never is."""

from __future__ import annotations

import sys

import pytest
from chains import chain

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.loading import load_arm
from ros_ik_pkg.ik.model.sources import parse_xacro_args

URDF = chain(('j1', 'revolute', {}), ('j2', 'prismatic', {}))
XACRO = """<?xml version="1.0"?>
<robot name="expanded" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="joints" default="3"/>
  <xacro:property name="reach" value="${2 * 0.25}"/>
  <xacro:macro name="segment" params="number">
    <link name="link${number}"/>
    <joint name="joint${number}" type="revolute">
      <parent link="link${number - 1}"/> <child link="link${number}"/>
      <origin xyz="0 0 ${reach}"/> <axis xyz="1 0 0"/>
      <limit lower="${-pi / 2}" upper="${radians(90)}" velocity="1" effort="1"/>
    </joint>
    <xacro:if value="${number &lt; $(arg joints)}"><xacro:segment number="${number + 1}"/></xacro:if>
  </xacro:macro>
  <link name="link0"/>
  <xacro:segment number="1"/>
</robot>
"""
BROKEN = XACRO.replace('2 * 0.25', 'nonsense')


@pytest.fixture
def package(tmp_path, monkeypatch):
    """The share folder of an ament package my_arm, in a workspace that is sourced."""
    share = tmp_path / 'share' / 'my_arm'
    marker = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages' / 'my_arm'
    for folder in (share / 'urdf', marker.parent):
        folder.mkdir(parents=True)
    marker.touch()
    (share / 'urdf' / 'arm.urdf').write_text(URDF)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    return share


def refusal_of(source) -> str:
    with pytest.raises(ModelError) as caught:
        load_arm(source)
    return str(caught.value)


def test_a_package_uri_leads_to_the_share_folder_of_the_package(package):
    pytest.importorskip('ament_index_python')
    assert load_arm('package://my_arm/urdf/arm.urdf').joint_names == ('j1', 'j2')


@pytest.mark.parametrize(
    ('uri', 'words'),
    [
        ('package://your_arm/urdf/arm.urdf', ["'your_arm'", 'source the workspace']),
        ('package://my_arm/urdf/leg.urdf', ['cannot read the robot', 'my_arm/urdf/leg.urdf', 'No such file']),
        ('package://my_arm/urdf/arm.dae', ['is not known', '.urdf']),
        ('package://my_arm', ['expected package://PACKAGE/PATH']),
        ('package:///arm.urdf', ['expected package://PACKAGE/PATH']),
        ('package://no name/arm.urdf', ["'no name'"]),
    ],
)
def test_a_package_uri_that_leads_nowhere_is_refused_with_the_reason(package, uri, words):
    pytest.importorskip('ament_index_python')
    message = refusal_of(uri)
    assert all(word in message for word in words), message


def test_without_any_workspace_a_package_uri_says_what_to_source(monkeypatch):
    pytest.importorskip('ament_index_python')
    monkeypatch.delenv('AMENT_PREFIX_PATH', raising=False)
    assert 'source the workspace' in refusal_of('package://my_arm/urdf/arm.urdf')


def test_without_ament_a_package_uri_says_that_it_needs_ros(package, monkeypatch):
    monkeypatch.setitem(sys.modules, 'ament_index_python', None)
    assert 'package:// needs a sourced ROS, else give a path' in refusal_of('package://my_arm/urdf/arm.urdf')


@pytest.mark.parametrize('name', ['arm.xacro', 'arm.urdf.xacro'])
def test_a_xacro_file_is_expanded(package, name):
    pytest.importorskip('xacro')
    pytest.importorskip('ament_index_python')
    path = package / 'urdf' / name
    path.write_text(XACRO)
    for source in (path, str(path), f'package://my_arm/urdf/{name}'):
        arm = load_arm(source)
        assert (arm.name, arm.joint_names) == ('expanded', ('joint1', 'joint2', 'joint3'))
        assert arm.forward([0.0, 0.0, 0.0])[2, 3] == pytest.approx(1.5)
        assert arm.upper.tolist() == pytest.approx([1.5707963267948966] * 3)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        (BROKEN, ['nonsense', 'xacro cannot expand it']),
        (XACRO.replace('</robot>', ''), ['xacro cannot expand it']),
        (XACRO.replace('<xacro:arg name="joints" default="3"/>', ''), ['xacro cannot expand it', 'joints']),
        (XACRO.replace('xyz="1 0 0"', 'xyz="0 0 0"'), ['<axis xyz> is zero']),
        (XACRO.replace('2 * 0.25', '__import__(&quot;os&quot;)'), ['xacro cannot expand it']),
    ],
)
def test_a_xacro_file_that_does_not_expand_to_an_arm_is_named_with_the_reason(tmp_path, text, words):
    pytest.importorskip('xacro')
    path = tmp_path / 'arm.xacro'
    path.write_text(text)
    message = refusal_of(path)
    assert all(word in message for word in (str(path), *words)), message


def test_without_xacro_the_refusal_names_the_package(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'xacro', None)
    path = tmp_path / 'arm.urdf.xacro'
    path.write_text(XACRO)
    assert 'install the package xacro' in refusal_of(path)


def test_a_path_may_begin_at_home_and_a_file_uri_is_a_path(tmp_path, monkeypatch):
    monkeypatch.setenv('HOME', str(tmp_path))
    path = tmp_path / 'my arm.urdf'
    path.write_text(URDF)
    for source in ('~/my arm.urdf', path.as_uri(), f'file://localhost{path}'):
        assert load_arm(source).joint_names == ('j1', 'j2')


@pytest.mark.parametrize(
    ('source', 'words'),
    [
        ('~nobody_of_this_name/arm.urdf', ['cannot read the robot', 'nobody_of_this_name']),
        ('file://elsewhere/arm.urdf', ['expected file:///PATH', 'elsewhere']),
        ('file://', ['expected file:///PATH']),
        ('file:///no/such/arm.urdf', ['/no/such/arm.urdf', 'No such file']),
        ('file:///a%00b.urdf', ['cannot read the robot']),
    ],
)
def test_a_path_or_uri_that_leads_nowhere_is_refused_with_the_reason(source, words):
    message = refusal_of(source)
    assert all(word in message for word in words), message


def test_a_slip_in_the_name_of_a_robot_is_told_with_what_was_meant():
    assert refusal_of('puma650').endswith('or URDF text; did you mean puma560?')
    assert refusal_of('r2d2').endswith('or URDF text')


def test_text_is_never_expanded():
    assert 'the text holds xacro macros' in refusal_of(XACRO)


def test_arguments_are_given_to_a_xacro_and_asked_for_where_they_are_missing(tmp_path):
    pytest.importorskip('xacro')
    path = tmp_path / 'arm.xacro'
    path.write_text(XACRO.replace('<xacro:arg name="joints" default="3"/>', ''))
    assert load_arm(path, xacro_args={'joints': '2'}).joint_names == ('joint1', 'joint2')
    assert 'give arguments with xacro_args, such as NAME:=VALUE' in refusal_of(path)
    assert parse_xacro_args(['joints:=2', 'a:=b:=c', 'empty:=']) == {'joints': '2', 'a': 'b:=c', 'empty': ''}
    with pytest.raises(ModelError, match='expected NAME:=VALUE'):
        parse_xacro_args(['joints=2'])
