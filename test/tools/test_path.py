"""scripts/path: figures, rows and a picture of a motion along the path of a file."""

from __future__ import annotations

import csv
import time

import numpy as np
import pytest
from chains import pinocchio_tip
from scipy.interpolate import BPoly

from ros_ik_pkg.ik import PathOptions, load_arm, solve_path
from ros_ik_pkg.tools import path

ARM = load_arm('ur5')
START = np.array([0.3, -1.2, 1.5, 0.2, 0.9, 0.1])


def write_line(tmp_path, *lengths):
    """A file with the tip at START, moved along y."""
    x, y, z = ARM.forward(START)[:3, 3]
    rows = [f'- {{x: {x}, y: {y + length}, z: {z}, qx: 0, qy: 1, qz: 0, qw: 0}}' for length in (0.0, *lengths)]
    file = tmp_path / 'path.yaml'
    file.write_text('\n'.join(rows))
    return str(file)


def run(monkeypatch, *words):
    monkeypatch.setattr('sys.argv', ['path', '--robot', 'ur5', *words])
    return path.main()


def test_a_path_is_followed_drawn_and_written(monkeypatch, tmp_path, capsys):
    picture, rows = tmp_path / 'path.png', tmp_path / 'rows.csv'
    words = '--plot', str(picture), '--csv', str(rows), '--set', 'tool_speed=0.05', 'deadline=0'
    assert run(monkeypatch, write_line(tmp_path, 0.1), *words) == 0
    shown = capsys.readouterr().out
    assert 'reached pose: 1' in shown and 'reconfigurations: none' in shown
    assert picture.read_bytes().startswith(b'\x89PNG') and picture.stat().st_size > 20000
    with rows.open() as stream:
        head, *body = csv.reader(stream)
    table = np.array(body, dtype=float)
    assert head[:2] == ['time', ARM.joint_names[0]] and table.shape[1] == 1 + 3 * ARM.n
    assert 2.0 < table[-1, 0] < 3.0
    tips = np.array([ARM.forward(row[1:7])[1, 3] for row in table])
    np.testing.assert_allclose(tips[-1] - tips[0], 0.1, atol=1e-6)


def test_a_row_marked_via_is_the_middle_of_an_arc(monkeypatch, tmp_path, capsys):
    x, y, z = ARM.forward(START)[:3, 3]
    file, rows = tmp_path / 'arc.csv', tmp_path / 'rows.csv'
    file.write_text(
        f'x,y,z,qx,qy,qz,qw,via\n{x},{y},{z},0,1,0,0,0\n{x},{y + 0.05},{z + 0.05},0,1,0,0,1\n'
        f'{x},{y + 0.1},{z},0,1,0,0,0\n'
    )
    assert run(monkeypatch, str(file), '--csv', str(rows)) == 0
    assert 'reached pose: 2' in capsys.readouterr().out
    tips = np.array([pinocchio_tip(ARM, row[1:7])[:3, 3] for row in np.loadtxt(rows, delimiter=',', skiprows=1)])
    away = np.linalg.norm(tips - (x, y + 0.05, z), axis=1)
    np.testing.assert_allclose(away, 0.05, atol=1e-4)
    assert tips[:, 2].max() > z + 0.049


def test_a_path_that_breaks_says_where(monkeypatch, tmp_path, capsys):
    assert run(monkeypatch, write_line(tmp_path, 0.1, 9.0), '--set', 'step=0.1') == 2
    assert 'breaks: the way from pose 1 to 2' in capsys.readouterr().out


@pytest.mark.parametrize(('words', 'text'), [
    (('nothing.csv',), 'nothing.csv'),
    (('--set', 'speed=1'), 'speed'),
    (('--seed', '1', '2'), 'seed'),
])  # fmt: skip
def test_bad_input_is_named(monkeypatch, tmp_path, capsys, words, text):
    first = [] if words[0].endswith('.csv') else [write_line(tmp_path, 0.1)]
    assert run(monkeypatch, *first, *words) == 1
    assert text in capsys.readouterr().err


def test_a_path_that_takes_long_says_that_it_may_be_compiling(monkeypatch, tmp_path, capsys):
    said = []

    def slow(*arguments, **options):
        for _ in range(1000):
            said.append(capsys.readouterr().err)
            if said[-1]:
                break
            time.sleep(0.01)
        return solve_path(*arguments, **options)

    monkeypatch.setattr(path, 'NOTICE_AFTER', 0.0)
    monkeypatch.setattr(path, 'solve_path', slow)
    assert run(monkeypatch, write_line(tmp_path, 0.1)) == 0
    assert 'compiles' in said[-1]


def test_the_motion_between_rows_is_the_polynomial_of_controllers():
    poses = [ARM.forward(START), ARM.forward(START)]
    poses[1][1, 3] += 0.1
    motion = solve_path(ARM, poses, START, path=PathOptions(deadline=0.0))
    rows = np.stack([motion.q, motion.velocities, motion.accelerations], axis=1)
    at = np.linspace(0.0, motion.times[-1], 501)
    np.testing.assert_allclose(motion.at(at), BPoly.from_derivatives(motion.times, rows)(at), atol=1e-9)
    np.testing.assert_allclose(motion.at(np.array([-1.0, 1e3])), motion.q[[0, -1]], atol=1e-12)
