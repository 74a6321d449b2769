"""Comparisons as files for slides and lessons: the moving picture and the notebook."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from numerics import get_arm, pinocchio_tip
from PIL import Image

from ros_ik_pkg.compare import compare_methods
from ros_ik_pkg.compare.animation import MOST_FRAMES, REST, animate, frames_of, save_animation
from ros_ik_pkg.compare.notebook import save_notebook
from ros_ik_pkg.compare.problem import make_problem
from ros_ik_pkg.compare.skeleton import joint_origins
from ros_ik_pkg.ik import ArgumentError, SolveOptions

ROOT = Path(__file__).resolve().parents[2]
OPTIONS = SolveOptions(max_iterations=2000, position_tolerance=1e-6, orientation_tolerance=1e-6)


@pytest.fixture(scope='module')
def comparison():
    problem = make_problem(get_arm('puma560'), None, None)
    methods = ('pinv', 'dls', 'adaptive_dls')
    return problem, compare_methods(problem.arm, problem.target, problem.seed, methods, OPTIONS)


@pytest.mark.parametrize('name', ['puma560', 'panda', 'stanford', 'planar3r'])
def test_the_polyline_of_an_arm_ends_at_its_tip(name):
    arm, rng = get_arm(name), np.random.default_rng(0)
    for _ in range(5):
        q = rng.uniform(np.maximum(arm.lower, -2.0), np.minimum(arm.upper, 2.0))
        points = joint_origins(arm, q)
        assert points.shape == (len(arm.prismatic) + 2, 3) and not points[0].any()
        np.testing.assert_allclose(points[-1], pinocchio_tip(arm, q)[:3, 3], atol=1e-12)


def test_the_moving_picture_has_a_frame_for_each_iteration_and_rests_at_the_end(tmp_path, comparison):
    problem, runs = comparison
    path, drawn = tmp_path / 'moving.gif', []
    save_animation(path, problem, runs, drawn.append)
    last = max(run.iterations for run in runs)
    assert frames_of(runs)[: last + 1] == list(range(last + 1))
    assert len(drawn) == len(frames_of(runs)) == last + 1 + REST
    with Image.open(path) as picture:
        assert picture.n_frames >= last + 1  # frames that are alike may be joined
        first = np.asarray(picture.convert('RGB'))
        picture.seek(picture.n_frames - 1)
        assert np.any(np.asarray(picture.convert('RGB')) != first)


def test_at_each_frame_the_arms_stand_at_the_iterates_of_the_trace(comparison):
    problem, runs = comparison
    animation = animate(problem, runs)
    artists = animation._func(3)
    for run, line in zip(runs, artists[2 : 2 + len(runs)]):
        expected = joint_origins(problem.arm, run.trace.joint_positions[3])
        np.testing.assert_allclose(np.array(line.get_data_3d()).T, expected)
    animation._draw_was_started = True  # it was asked for single frames alone


def test_a_long_descent_is_thinned():
    problem = make_problem(get_arm('puma560'), None, None)
    runs = compare_methods(problem.arm, problem.target, problem.seed, ('transpose',), OPTIONS)
    frames = frames_of(runs)
    assert runs[0].iterations > 500 and len(frames) <= MOST_FRAMES + REST
    assert frames[:4] == [0, 1, 2, 3] and frames[-1] == runs[0].iterations


def test_a_format_that_cannot_be_written_is_refused_with_what_to_do(tmp_path, comparison, monkeypatch):
    with pytest.raises(ArgumentError, match=r'expected a name that ends in \.gif, \.mp4'):
        save_animation(tmp_path / 'moving.avi', *comparison)
    monkeypatch.setattr(FFMpegWriter, 'isAvailable', classmethod(lambda _: False))
    with pytest.raises(ArgumentError, match='apt install ffmpeg'):
        save_animation(tmp_path / 'moving.mp4', *comparison)


def test_the_notebook_runs_without_ros_and_finds_what_the_comparison_found(tmp_path, comparison):
    problem, runs = comparison
    path = tmp_path / 'lesson.ipynb'
    save_notebook(path, problem, 'puma560', [run.method for run in runs], OPTIONS)
    book = json.loads(path.read_text())
    assert (book['nbformat'], book['nbformat_minor']) == (4, 5)
    assert len({cell['id'] for cell in book['cells']}) == len(book['cells'])
    program = '\n'.join(''.join(cell['source']) for cell in book['cells'] if cell['cell_type'] == 'code')
    block = "import sys\nsys.modules['rclpy'] = None\n"  # an import of rclpy fails
    environment = os.environ | {'MPLBACKEND': 'Agg', 'PYTHONPATH': str(ROOT)}
    done = subprocess.run(
        [sys.executable, '-c', block + program], env=environment, capture_output=True, text=True, timeout=900
    )
    assert done.returncode == 0, done.stderr
    for run in runs:
        assert f'{run.method:13} {run.iterations:5} steps' in done.stdout
