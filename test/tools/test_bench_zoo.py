"""scripts/bench --zoo finds the URDFs of installed packages and solves every chain of each."""

from __future__ import annotations

import sys

import pytest
from chains import chain

from bench import zoo
from bench.__main__ import main
from ros_ik_pkg.ik.model.sources import read_tree

pytestmark = pytest.mark.once

POSES = 3
TWO_TIPS = """<robot name="two_tips"><link name="base"/><link name="left"/><link name="right"/>
<joint name="a" type="revolute"><parent link="base"/><child link="left"/><origin xyz="0 0.2 0"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="b" type="prismatic"><parent link="base"/><child link="right"/><origin xyz="0 -0.2 0"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """Return an empty folder of installed packages."""
    monkeypatch.setattr(zoo.sysconfig, 'get_path', {'purelib': str(tmp_path)}.get)
    return tmp_path


def run(monkeypatch, capsys) -> tuple[int, list[str], str]:
    """Run scripts/bench --zoo; return the exit code, the figures under ZOO_HEAD and the whole output."""
    monkeypatch.setattr(sys, 'argv', ['bench', '--zoo', str(POSES)])
    code, output = main(), capsys.readouterr().out
    return code, [cell.strip() for cell in output.strip().splitlines()[-1].strip('|').split('|')], output


def write(path, text: str) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)


def test_every_chain_of_every_installed_urdf_is_solved(packages, monkeypatch, capsys):
    write(packages / 'one' / 'arm.urdf', chain(('one', 'revolute', {}), ('two', 'revolute', {})))
    write(packages / 'other' / 'two_tips.urdf', TWO_TIPS)
    code, figures, _ = run(monkeypatch, capsys)
    assert code == 0
    assert dict(zip(zoo.ZOO_HEAD, figures)) == {
        'robots': '2', 'chains': '3', 'chains refused': '0', 'poses': '9', 'solved': '9', 'wrong': '0'
    }  # fmt: skip


def test_a_chain_that_is_refused_and_a_file_that_is_no_robot_are_named(packages, monkeypatch, capsys):
    text = chain(('one', 'revolute', {'lower': 1.0, 'upper': -1.0}), ('two', 'revolute', {}))
    write(packages / 'one' / 'reversed.urdf', text)
    write(packages / 'one' / 'empty.urdf', '')
    code, figures, output = run(monkeypatch, capsys)
    assert (code, figures[:3]) == (0, ['1', '0', '1'])
    assert "reversed.urdf to tip: robot 'made_up': joint 'one'" in output and 'empty.urdf: ' in output


def test_a_wrong_solution_is_counted_and_ends_with_exit_code_1(packages, monkeypatch, capsys):
    write(packages / 'one' / 'arm.urdf', chain(('one', 'revolute', {}), ('two', 'revolute', {})))
    monkeypatch.setattr(zoo.Judge, 'solved', lambda judge, targets, q: q[:, 0] > 10.0)
    code, figures, output = run(monkeypatch, capsys)
    assert (code, figures[-2:]) == (1, ['0', str(POSES)])
    assert f'arm.urdf to tip: 0 of {POSES} solved, {POSES} wrong' in output


def test_the_ends_of_a_robot_are_its_leaves_beyond_a_movable_joint(tmp_path):
    write(tmp_path / 'two_tips.urdf', TWO_TIPS)
    assert zoo.ends_of(read_tree(tmp_path / 'two_tips.urdf')) == ['left', 'right']
