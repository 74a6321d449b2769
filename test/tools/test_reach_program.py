"""The program that maps what an arm reaches."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numerics import get_arm

from ros_ik_pkg.ik import load_reach_map

ROOT = Path(__file__).resolve().parents[2]
QUICK = ['--step', '0.2', '--parts', '1', '--samples', '20000']


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, '-m', 'ros_ik_pkg.tools.reach', *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


def test_a_map_is_summed_up_and_written_to_every_kind_of_file(tmp_path):
    pytest.importorskip('matplotlib')
    files = [tmp_path / name for name in ('map.png', 'map.npz', 'map.ply')]
    done = run('--robot', 'ur5', *QUICK, '--plot', str(files[0]), '--npz', str(files[1]), '--ply', str(files[2]))
    assert done.returncode == 0, done.stderr
    found = load_reach_map(files[1])
    positions = int((found.share > 0.0).sum())
    assert f'{len(found.cells)} of {found.share.size * 4} cells reached' in done.stdout
    assert f'positions: {positions} reached' in done.stdout
    assert files[0].read_bytes().startswith(b'\x89PNG')
    lines = files[2].read_text().splitlines()
    rows = np.array([line.split() for line in lines[lines.index('end_header') + 1 :]], dtype=float)
    assert f'element vertex {positions}' in lines and len(rows) == positions
    np.testing.assert_allclose(rows[:, :3], found.centres()[found.share > 0.0], atol=1e-5)


def test_the_colours_show_what_is_asked_for(tmp_path):
    pytest.importorskip('matplotlib')
    seen = {}
    for colour in ('share', 'sigma_min'):
        files = [tmp_path / f'{colour}{suffix}' for suffix in ('.png', '.ply')]
        done = run('--robot', 'ur5', *QUICK, '--colour', colour, '--plot', str(files[0]), '--ply', str(files[1]))
        assert done.returncode == 0, done.stderr
        lines = files[1].read_text().splitlines()
        rows = np.array([line.split() for line in lines[lines.index('end_header') + 1 :]], dtype=float)
        assert lines[lines.index('end_header') - 2 : lines.index('end_header')] == [
            'property float share', 'property float sigma_min']  # fmt: skip
        shown = rows[:, 6 if colour == 'share' else 7]
        end = 1.0 if colour == 'share' else shown.max()
        np.testing.assert_allclose(rows[:, 5], 255.0 * shown / end, atol=1.0)  # blue
        seen[colour] = files[0].read_bytes()
    assert seen['share'] != seen['sigma_min']
    done = run('--robot', 'ur5', *QUICK, '--colour', 'clearance', '--ply', str(tmp_path / 'no.ply'))
    assert done.returncode == 1 and 'the map has no clearance' in done.stderr and not done.stdout  # before it is made


def test_a_floor_takes_cells_away_from_a_robot_with_shapes_only(tmp_path):
    text = (
        '<robot name="post"><link name="a"/><link name="b"><collision><origin xyz="0 0 0.25"/><geometry>'
        '<cylinder radius="0.02" length="0.5"/></geometry></collision></link><link name="tip"/>'
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>'
        '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        '<joint name="t" type="fixed"><parent link="b"/><child link="tip"/><origin xyz="0 0 0.5"/></joint></robot>'
    )
    (tmp_path / 'post.urdf').write_text(text)
    reached = []
    for extra in ([], ['--floor', '-0.1'], ['--floor', '-0.1', '--ignore-collisions']):
        done = run('--robot', str(tmp_path / 'post.urdf'), *QUICK, *extra)
        assert done.returncode == 0, done.stderr
        reached.append(int(done.stdout.split(': ')[1].split()[0]))
    assert reached[1] < reached[0] == reached[2]


def test_places_of_the_base_are_ranked(tmp_path):
    position = get_arm('ur5').forward(get_arm('ur5').home + 0.5)[:3, 3]
    rows = ['x,y,z,roll,pitch,yaw', f'{position[0]},{position[1]},{position[2]},0,90,0', '0.3,0.1,9,0,0,0']
    (tmp_path / 'poses.csv').write_text('\n'.join(rows))
    done = run('--place', str(tmp_path / 'poses.csv'), '--degrees')
    assert done.returncode == 0, done.stderr
    table = done.stdout.splitlines()
    assert 'any of 2 poses' in table[0]
    assert {row.split()[3] for row in table[3:]} == {'1'}  # the second pose is out of reach from everywhere


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['--step', '0'], 'a length above 0'), (['--robot', 'nonsense'], 'nonsense'),
        (['--place', 'nothing.csv'], 'nothing.csv'), (['--plot', 'map.doc'], 'expected a name that ends in'),
    ],
)  # fmt: skip
def test_a_wrong_argument_ends_with_what_is_wrong(arguments, message):
    done = run(*arguments)
    assert done.returncode in (1, 2) and message in done.stderr and 'Traceback' not in done.stderr
