"""The comparison without ROS: one descent for each method, told in figures, words, tables, files and a picture."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ros_ik_pkg.compare import MethodRun, command, compare_methods, describe, describe_run
from ros_ik_pkg.compare.files import write_csv, write_json
from ros_ik_pkg.compare.palette import COLOURS
from ros_ik_pkg.compare.problem import Problem, joints_from_degrees, make_problem, numbers_of, pose
from ros_ik_pkg.compare.singular import bounds, singular_configuration, smallest_singular_value
from ros_ik_pkg.compare.sweep import run_sweep, sweep_table
from ros_ik_pkg.compare.table import align, runs_table
from ros_ik_pkg.ik import METHODS, ArgumentError, SolveOptions, Status, load_arm, solve

pytestmark = pytest.mark.once

ROOT = Path(__file__).resolve().parents[2]
OPTIONS = SolveOptions(max_iterations=2000, position_tolerance=1e-6, orientation_tolerance=1e-6)


@pytest.fixture(scope='module')
def notes() -> Problem:
    """The robot, seed and target that the comparison starts with."""
    return make_problem(load_arm('puma560'), None, None)


@pytest.fixture(scope='module')
def runs(notes) -> list[MethodRun]:
    return compare_methods(notes.arm, notes.target, notes.seed, METHODS, OPTIONS)


def a_run(method: str = 'pinv', status: Status = Status.DIVERGED, **figures) -> MethodRun:
    values = {'iterations': 7, 'position_error': 0.3, 'orientation_error': 0.1, 'time': 1e-5, 'sigma_min': 2e-4}
    return MethodRun(method, status, **values | figures)


def test_the_seed_of_the_notes_has_the_pose_of_the_notes(notes):
    expected = [0.5, 0.15, 0.3]
    np.testing.assert_allclose(notes.arm.forward(notes.seed)[:3, 3], expected, atol=5e-4)  # the notes round to 0.1 deg
    turned = pose([0, 0, 0, 0, 90, 0])[:3, :3].T @ notes.arm.forward(notes.seed)[:3, :3]
    assert np.degrees(np.arccos((np.trace(turned) - 1) / 2)) < 0.1


def test_on_the_default_target_all_methods_converge_and_the_transpose_takes_longest(runs):
    assert [run.status for run in runs] == [Status.CONVERGED] * len(METHODS)
    steps = {run.method: run.iterations for run in runs}
    assert max(steps, key=steps.get) == 'transpose'
    assert steps['transpose'] > 20 * steps['adaptive_dls']


def test_a_run_is_one_descent_from_the_seed(notes, runs):
    for run in runs:
        assert set(run.trace.column('attempt')) == {0.0}
        assert len(run.trace) == run.iterations + 1
        np.testing.assert_array_equal(run.trace.joint_positions[0], notes.seed)


def test_the_figures_of_a_run_are_those_of_its_last_configuration(notes, runs):
    for run in runs:
        tip = notes.arm.forward(run.trace.joint_positions[-1])[:3, 3]
        assert run.position_error == pytest.approx(np.linalg.norm(tip - notes.target[:3, 3]), abs=1e-12)
        assert run.sigma_min == run.trace.column('sigma_min').min()


def test_restarts_deadline_and_joint_jump_of_the_options_do_not_count(notes, runs):
    restless = SolveOptions(
        max_iterations=2000, position_tolerance=1e-6, orientation_tolerance=1e-6, max_attempts=50, deadline=1e-9,
        max_joint_jump=1e-3, choice='all',
    )  # fmt: skip
    again = compare_methods(notes.arm, notes.target, notes.seed, METHODS, restless)
    assert [run.iterations for run in again] == [run.iterations for run in runs]


def test_methods_are_run_as_asked(notes):
    chosen = compare_methods(notes.arm, notes.target, notes.seed, ('sdls', 'dls'), OPTIONS)
    assert [run.method for run in chosen] == ['sdls', 'dls']


def test_at_the_singular_wrist_pinv_fails_and_the_sentence_says_why(notes):
    seed = joints_from_degrees(notes.arm, (2.8, -77.7, 6.8, 8.5, 0.1, 172.0))
    target = notes.arm.forward(seed)
    target[:3, 3] += 0.1
    sentence = describe(compare_methods(notes.arm, target, seed, METHODS, OPTIONS))
    assert sentence.startswith('pinv diverged at its first step: smallest singular value')
    assert 'adaptive_dls in ' in sentence


def test_words_name_the_iteration_the_distance_and_the_cause():
    assert describe_run(a_run()) == 'pinv diverged at iteration 7: smallest singular value 0.0002'
    assert describe_run(a_run('dls', Status.STALLED, position_error=0.058)) == (
        'dls stalled at iteration 7, 58 mm from the target'
    )
    swinging = describe_run(a_run(status=Status.OSCILLATING, position_error=1.25))
    assert swinging == 'pinv oscillates 1.25 m from the target'
    assert '11.5° from' in describe_run(a_run(status=Status.STALLED, position_error=0.0, orientation_error=0.2))


def test_joints_at_limits_are_named_and_a_regular_jacobian_is_not_blamed():
    def words(*joints: str, status: Status = Status.DIVERGED, sigma_min: float = 0.2) -> str:
        return describe_run(a_run(status=status, sigma_min=sigma_min, joints_at_limits=joints))

    assert words('j2') == 'pinv diverged at iteration 7: j2 at its limit'
    assert words('j2', 'j4', status=Status.NOT_FINITE) == (
        'pinv found no finite step at iteration 7: j2 and j4 at their limits'
    )
    assert words('j1', 'j2', 'j4').endswith(': 3 joints at their limits')
    assert words('j2', sigma_min=2e-4).endswith(': smallest singular value 0.0002, j2 at its limit')
    assert words('j2', status=Status.STALLED) == 'pinv stalled at iteration 7, 300 mm from the target, j2 at its limit'
    assert words() == 'pinv diverged at iteration 7, 300 mm from the target'


@pytest.mark.parametrize('robot', ['puma560', 'panda'])
def test_the_joints_that_are_named_sit_at_limits_in_the_last_configuration(robot):
    problem = make_problem(load_arm(robot), None, None)
    arm, far = problem.arm, np.diag([-1.0, -1.0, 1.0, 1.0]) @ problem.target
    far[:3, 3] *= 3.0
    runs = compare_methods(arm, far, problem.seed, METHODS, OPTIONS)
    for run in runs:
        last = run.trace.joint_positions[-1]
        ends = zip(arm.joint_names, last, arm.lower, arm.upper)
        assert list(run.joints_at_limits) == [name for name, q, low, high in ends if q in (low, high)], run.method
    assert any(run.joints_at_limits for run in runs)


def test_failures_come_first_and_the_quickest_of_the_others_next():
    several = [a_run('sdls', Status.CONVERGED, iterations=31), a_run(), a_run('dls', Status.CONVERGED, iterations=8)]
    assert describe(several) == (
        'pinv diverged at iteration 7: smallest singular value 0.0002; dls in 8 and sdls in 31 converged'
    )


@pytest.mark.parametrize('status', [status for status in Status if status < Status.DEADLINE])
def test_every_stop_reason_of_a_descent_has_a_sentence(status):
    assert describe_run(a_run(status=status)).startswith('pinv ')


@pytest.mark.parametrize('status', Status)
def test_every_stop_reason_is_described_in_the_other_language_too(status):
    assert status.text not in describe_run(a_run(status=status), 'pl')


def test_the_table_is_aligned_and_has_a_row_for_each_method(runs):
    heading, *rows = runs_table(runs).splitlines()
    assert [row.split()[0] for row in rows] == list(METHODS)
    column = heading.index('status')
    assert {row[column - 1] for row in rows} == {' '} and all(row[column:] == 'converged' for row in rows)


def test_colours_change_nothing_but_the_colours(runs):
    assert re.sub(r'\033\[[\d;]*m', '', runs_table(runs, coloured=True)) == runs_table(runs)


def test_columns_are_as_wide_as_their_widest_entry():
    assert align([('a', 'bb'), ('ccc', 'd')]) == ['a    bb', 'ccc   d']


def test_every_method_has_a_colour_of_its_own():
    assert set(COLOURS) == set(METHODS) and len(set(COLOURS.values())) == len(METHODS)


def test_csv_holds_every_iterate(tmp_path, notes, runs):
    write_csv(tmp_path / 'runs.csv', notes, runs)
    with (tmp_path / 'runs.csv').open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(len(run.trace) for run in runs)
    last = [row for row in rows if row['method'] == 'dls'][-1]
    dls = runs[METHODS.index('dls')]
    assert float(last['position_error']) == dls.position_error
    assert (last['iteration'], last['attempt'], last['status']) == (str(dls.iterations), '0', 'converged')
    np.testing.assert_allclose(notes.arm.forward(joints_of(last, notes))[0, 3], float(last['tip_x']), atol=1e-12)


def joints_of(row: dict[str, str], problem: Problem) -> np.ndarray:
    return np.array([float(row[name]) for name in problem.arm.joint_names])


def test_json_holds_the_same_and_nothing_that_json_cannot(tmp_path, notes):
    exactly = compare_methods(notes.arm, notes.arm.forward(np.zeros(6)), np.zeros(6), METHODS, OPTIONS)
    write_json(tmp_path / 'runs.json', notes, exactly, OPTIONS, 'puma560')
    document = json.loads((tmp_path / 'runs.json').read_text(), parse_constant=lambda text: pytest.fail(text))
    assert list(document['methods']) == list(METHODS)
    assert document['methods']['sdls']['iterations'] == 0


def test_what_json_holds_is_enough_to_repeat_the_comparison(tmp_path, notes, runs):
    write_json(tmp_path / 'runs.json', notes, runs, OPTIONS, 'puma560')
    document = json.loads((tmp_path / 'runs.json').read_text())
    given = document['arguments']
    problem = make_problem(load_arm(given['robot']), given['seed'], given['target'])
    options = SolveOptions(**{k: tuple(v) if isinstance(v, list) else v for k, v in document['options'].items()})
    again = compare_methods(problem.arm, problem.target, problem.seed, given['methods'], options)
    assert [run.iterations for run in again] == [run.iterations for run in runs]


def test_other_robots_get_a_seed_and_a_target_within_reach():
    for robot in ('ur5', 'panda', 'stanford'):
        problem = make_problem(load_arm(robot), None, None)
        assert solve(problem.arm, problem.target, problem.seed, SolveOptions(deadline=0.0)).converged
        assert not np.allclose(problem.arm.forward(problem.seed), problem.target, atol=0.05)


def test_poses_and_numbers_are_each_others_inverse():
    numbers = [0.4, -0.3, 0.6, 10.0, 80.0, -30.0]
    np.testing.assert_allclose(numbers_of(pose(numbers)), numbers, atol=1e-9)


@pytest.mark.parametrize('pitch', [90.0, -90.0])
def test_at_a_pitch_of_90_degrees_all_turning_is_in_the_yaw(pitch):
    pose_there = pose([0.0, 0.0, 0.0, 25.0, pitch, 40.0])
    numbers = numbers_of(pose_there)
    assert numbers[3] == 0.0
    np.testing.assert_allclose(pose(numbers), pose_there, atol=1e-9)


def test_prismatic_joints_are_given_in_metres():
    arm = load_arm('stanford')
    q = joints_from_degrees(arm, [90.0, 0.0, 0.5, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(q, [np.pi / 2, 0.0, 0.5, 0.0, 0.0, 0.0])


def test_a_seed_of_the_wrong_length_is_refused_with_the_names_of_the_joints(notes):
    with pytest.raises(ArgumentError, match=r'seed has 3 numbers; expected 6: joint1, joint2'):
        make_problem(notes.arm, [0.0, 1.0, 2.0], None)


@pytest.mark.parametrize('robot', ['puma560', 'panda'])
def test_singular_configurations_are_singular_and_within_the_limits(robot):
    arm, random = load_arm(robot), np.random.default_rng(7)
    for _ in range(3):
        q = singular_configuration(arm, random)
        assert smallest_singular_value(arm, q) < 1e-2
        assert np.all((bounds(arm)[0] <= q) & (q <= bounds(arm)[1]))


def test_the_sweep_solves_the_same_targets_with_every_method(notes):
    counted = []
    done = run_sweep(notes.arm, 4, ('dls', 'sdls'), OPTIONS, counted.append)
    assert sum(counted) == 8
    assert {len(solutions) for part in (done.regular, done.singular) for solutions in part.values()} == {4}
    again = run_sweep(notes.arm, 4, ('dls',), OPTIONS, counted.append)
    assert [s.iterations for s in again.singular['dls']] == [s.iterations for s in done.singular['dls']]


def test_the_sweep_table_shows_that_damping_survives_singular_targets(notes):
    done = run_sweep(notes.arm, 10, ('transpose', 'adaptive_dls'), OPTIONS, lambda _: None)
    rows = {line[:24].strip(): line[24:].split() for line in sweep_table(done).splitlines()}
    share = [int(text) for text in rows['singular targets: solved'] if text != '%']
    assert share[1] > share[0]


def run_command(*arguments: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, '-m', 'ros_ik_pkg.compare.command', *arguments]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True)


def test_the_command_prints_one_row_for_each_method_and_the_sentence():
    done = run_command('--max-iterations', '50')
    assert done.returncode == 0, done.stderr
    assert all(f'\n{method} ' in done.stdout for method in METHODS)
    assert 'transpose ran out of its 50 iterations' in done.stdout
    assert '\033' not in done.stdout  # a pipe is no terminal


@pytest.mark.parametrize(
    ('arguments', 'complaint'),
    [
        (['--robot', 'nosuch'], 'nosuch'),
        (['--step-size', '9'], '--step-size 9 is not allowed: expected a number from'),
        (['--damping', '-1'], '--damping -1 is not allowed'),
        (['--tolerance', '7'], '--tolerance 7 is not allowed'),
        (['--seed', '1', '2'], '--seed 1 2: it has 2 numbers; expected 6 finite numbers: joint1'),
        (['--target', '9', '9', '9', '0', '0', 'nan'], '--target 9 9 9 0 0 nan: expected six finite numbers'),
        (['--csv', '/nonexistent/runs.csv'], '/nonexistent/runs.csv'),
    ],
)
def test_the_command_says_what_is_wrong_without_a_traceback(arguments, complaint):
    done = run_command(*arguments)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith('compare: ') and complaint in last


@pytest.mark.parametrize('arguments', [['--seed', '1'], ['--target', '1', '2', '3', '4', '5', '6'], ['--csv', 'x']])
def test_a_sweep_refuses_arguments_that_it_would_ignore(arguments):
    done = run_command('--sweep', '2', *arguments)
    assert done.returncode == 2 and '--sweep' in done.stderr and 'excludes' in done.stderr


def test_a_picture_is_written_under_the_name_that_is_said(tmp_path):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed: scripts/compare --plot installs it')
    done = run_command('--max-iterations', '0', '--plot', str(tmp_path / 'picture'))
    assert done.returncode == 0 and (tmp_path / 'picture.png').is_file()
    assert f'wrote {tmp_path / "picture.png"}' in done.stderr and 'Warning' not in done.stderr
    refused = run_command('--plot', str(tmp_path / 'picture.doc'))
    assert refused.returncode == 2 and 'expected a name that ends in .png, .svg, .pdf' in refused.stderr


def test_a_seed_outside_the_limits_begins_at_them_and_that_is_said():
    done = run_command('--seed', '0', '0', '0', '0', '0', '999', '--methods', 'dls', 'dls')
    assert 'compare: --seed: joint6 is outside its limits -266 to 266; starting at 266' in done.stderr
    assert done.stdout.count('\ndls   ') == 1


def test_an_output_without_all_letters_gets_others():
    line = [sys.executable, '-m', 'ros_ik_pkg.compare.command', '--max-iterations', '1']
    environment = {**os.environ, 'PYTHONIOENCODING': 'ascii'}
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, env=environment)
    assert done.returncode == 0 and 'yaw 0.0 deg' in done.stdout


def test_where_nobody_reads_on_the_command_ends_without_a_word(tmp_path):
    command = f'{sys.executable} -m ros_ik_pkg.compare.command | head -n 1'
    done = subprocess.run(['bash', '-c', command], cwd=ROOT, capture_output=True, text=True)
    assert done.stderr == '' and done.stdout.startswith('puma560: target')


def test_help_of_the_script_names_every_option():
    options = set(re.findall(r'--[a-z-]+', command.arguments().format_help())) - {'--help'}
    assert options <= set(re.findall(r'--[a-z-]+', (ROOT / 'scripts' / 'compare').read_text()))


def test_the_picture_is_a_picture(tmp_path, notes, runs):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed: scripts/compare --plot installs it')
    from ros_ik_pkg.compare.plots import save_picture

    save_picture(tmp_path / 'runs.png', notes, runs)
    assert (tmp_path / 'runs.png').read_bytes().startswith(b'\x89PNG')


def test_the_picture_shows_every_method_in_every_plot(notes, runs):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed: scripts/compare --plot installs it')
    from ros_ik_pkg.compare.plots import draw

    axes = draw(notes, runs).axes
    assert len(axes) == 3 + notes.arm.n
    assert all(plot.get_xlabel() == 'iteration' for plot in axes[-notes.arm.n :])
    for plot in axes[3:]:
        labels = {mark.get_text(): place for place, mark in zip(plot.get_xticks(), plot.get_xticklabels())}
        assert all(place == pytest.approx(np.log10(1 + int(text))) for text, place in labels.items())
    assert all(2 <= len(axis.get_majorticklocs()) <= 6 for axis in (axes[2].xaxis, axes[2].yaxis, axes[2].zaxis))
    assert {line.get_color() for line in axes[0].get_lines()} == set(COLOURS.values())
    assert axes[0].get_ylim()[0] == 1e-8


@pytest.mark.parametrize('robot', ['panda', 'planar3r'])
@pytest.mark.parametrize('iterations', [0, 30])
def test_the_picture_of_any_robot_is_whole(tmp_path, robot, iterations):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed: scripts/compare --plot installs it')
    from ros_ik_pkg.compare.plots import draw

    problem = make_problem(load_arm(robot), None, None)
    options = SolveOptions(max_iterations=iterations)
    figure = draw(problem, compare_methods(problem.arm, problem.target, problem.seed, METHODS, options))
    figure.draw_without_rendering()
    frame = figure.bbox
    texts = [text for axes in figure.axes for text in (axes.title, axes.xaxis.label, axes.yaxis.label)]
    for text in filter(lambda text: text.get_text(), [*texts, *figure.texts, figure.axes[2].zaxis.label]):
        box = text.get_window_extent()
        assert frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1, text.get_text()
