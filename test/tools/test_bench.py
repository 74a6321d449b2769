"""The measurements measure what they say: cases, judge, timing, jumps, the million checks, the report."""

from __future__ import annotations

import io
import re
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from chains import chain
from ros_helpers import TIMEOUT, allow_lark

from bench import check, iteration, peers, ros
from bench.__main__ import make_parser, read_arguments
from bench.batches import batch_row
from bench.cases import KINDS, Case, make_case
from bench.judge import Judge, rotation_vectors
from bench.measure import JUMP, Entry, check_models, count_jumps, run_case
from bench.model import is_plain, make_model, urdf_of
from bench.process import WorkerError, WorkerProcess
from bench.report import Report
from bench.solver import Answer, Model, Solver, UnsupportedError, time_calls
from bench.solves import load_all
from bench.table import markdown, solve_table
from bench.wire import receive, send
from ros_ik_pkg.ik import METHODS, SolveOptions, load_arm, robot_names, solve_batch
from ros_ik_pkg.ros.runtime.spin import make_executor
from ros_ik_pkg.tools.processes import ros_node

pytestmark = pytest.mark.once

ROOT = Path(__file__).resolve().parents[2]
COUNT = 60


@pytest.fixture(scope='module')
def panda():
    return load_arm('panda')


@pytest.fixture(scope='module')
def judge(panda):
    return Judge(panda)


@pytest.fixture(scope='module')
def reachable(panda):
    return make_case(panda, 'reachable', COUNT)


@pytest.fixture(scope='module')
def answers(panda, reachable):
    return solve_batch(panda, reachable.targets, reachable.seeds, SolveOptions(deadline=0.0)).q


def test_help_names_every_option():
    text = (ROOT / 'scripts' / 'bench').read_text()
    options = set(re.findall(r'--[a-z]+', make_parser().format_help())) - {'--help'}
    assert options <= set(re.findall(r'--[a-z]+', text))


@pytest.mark.parametrize('words', ['--count 0', '--check -5', '--set speed=3', '--output nowhere/x.md'])
def test_arguments_out_of_range_are_refused(words, capsys):
    with pytest.raises(SystemExit):
        read_arguments(words.split())
    assert re.split('[=/]', words.split()[1])[0] in capsys.readouterr().err


@pytest.mark.parametrize('kind', KINDS)
def test_a_case_is_the_same_on_every_run(panda, kind):
    first, second = (make_case(panda, kind, 20) for _ in range(2))
    assert np.array_equal(first.targets, second.targets)
    assert np.array_equal(first.seeds, second.seeds)


def test_a_path_is_smooth_closed_and_within_the_limits(panda, judge):
    case = make_case(panda, 'tracking', 1000)
    steps = np.abs(case.path - np.roll(case.path, 1, axis=0)).max(axis=1)
    assert len(case) == 1000
    assert steps.max() < JUMP / 2
    assert judge.inside(case.path, 0.0).all()


def test_poses_near_singularities_are_nearer_than_random_ones(panda, judge, monkeypatch):
    chosen = []
    monkeypatch.setattr(judge, 'forward', lambda q: chosen.append(q) or np.zeros((len(q), 4, 4)))
    monkeypatch.setattr('bench.cases.Judge', lambda arm: judge)
    make_case(panda, 'singular', 10)
    make_case(panda, 'reachable', 100)
    near, random = (judge.smallest_singular_values(q) for q in chosen)
    assert np.median(near) < 0.2 * np.median(random)


@pytest.mark.parametrize('kind', ['beyond', 'inside'])
def test_unreachable_poses_are_not_solved(panda, kind):
    case = make_case(panda, kind, 100)
    assert len(case) == 10
    assert not solve_batch(panda, case.targets, options=SolveOptions(deadline=0.002)).converged.any()


@pytest.mark.parametrize('name', robot_names())
def test_the_judge_agrees_with_the_arm(name):
    arm = load_arm(name)
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (20, arm.n))
    np.testing.assert_allclose(Judge(arm).forward(q), [arm.forward(row) for row in q], atol=1e-12)


def test_the_judge_takes_good_answers_and_no_others(panda, judge, reachable, answers):
    assert judge.solved(reachable.targets, answers).all()
    assert not judge.solved(reachable.targets, answers + 1e-4).any()
    tight = Judge(replace(panda, upper=answers.min(axis=0) - 0.1))
    assert not tight.solved(reachable.targets, answers).any()
    assert not judge.solved(reachable.targets, np.full_like(answers, np.nan)).any()


@pytest.mark.parametrize('angle', [0.0, 1e-9, 1e-4, 1.0, 3.0, np.pi - 1e-6, np.pi - 1e-9])
def test_rotation_vectors_are_the_logarithm(angle):
    axis = np.array([2.0, -1.0, 0.5]) / np.sqrt(5.25)
    np.testing.assert_allclose(rotation_vectors(pin.exp3(angle * axis)[None])[0], angle * axis, atol=1e-12, rtol=1e-7)


@pytest.mark.parametrize('name', robot_names())
def test_the_urdf_for_the_others_is_the_same_arm(name):
    arm = load_arm(name)
    copy = load_arm(urdf_of(arm))
    q = np.random.default_rng(2).uniform(-1.0, 1.0, arm.n)
    assert is_plain(arm)
    np.testing.assert_allclose(copy.forward(q), arm.forward(q), atol=1e-12)
    np.testing.assert_array_equal(copy.upper, arm.upper)


def test_messages_between_processes_come_back_as_sent():
    stream, arrays = io.BytesIO(), [np.arange(6.0).reshape(2, 3), np.empty((0, 7))]
    send(stream, {'text': 'as\nsent'}, *arrays)
    stream.seek(0)
    header, read = receive(stream)
    assert header == {'text': 'as\nsent'}
    assert all(np.array_equal(one, other) for one, other in zip(read, arrays))
    assert receive(stream) is None


class Halving(Solver):
    """Answers with half of the seed; refuses every second call, and raises for a target of zeros."""

    calls = 0

    def call(self, target, seed):
        if not target.any():
            raise ValueError('zeros')
        self.calls += 1
        return seed / 2 if self.calls % 2 else None

    def read(self, result, seed):
        return Answer(result, 7.0, 2.0)


def test_a_warm_start_goes_on_from_the_last_answer():
    rows, _ = time_calls(Halving(), np.ones((3, 4, 4)), np.full((1, 2), 8.0), warm=True)
    np.testing.assert_array_equal(rows[:, 0], [4.0, np.nan, 2.0])
    assert (rows[:, 2] > 0.0).all()
    assert (rows[:, 3:] == [7.0, 2.0]).all()


def test_a_cold_start_takes_the_seed_of_each_target():
    rows, _ = time_calls(Halving(), np.ones((3, 4, 4)), np.array([[8.0], [4.0], [2.0]]), warm=False)
    np.testing.assert_array_equal(rows[:, 0], [4.0, np.nan, 1.0])


def test_a_library_that_raises_has_no_answer():
    rows, error = time_calls(Halving(), np.zeros((2, 4, 4)), np.ones((2, 3)), warm=False)
    assert np.isnan(rows[:, :3]).all()
    assert error == 'ValueError: zeros'


@pytest.fixture(scope='module')
def entries(panda, tmp_path_factory):
    process = WorkerProcess('ours')
    model = make_model(panda, 'panda', tmp_path_factory.mktemp('arms'))
    names, _ = process.load(model, {'max_attempts': 100, 'deadline': 0.0})
    yield [Entry(name, process, name) for name in names]
    process.close()


def test_solvers_in_their_process_solve_and_are_judged(judge, entries, reachable):
    done = []
    check_models(judge, entries)
    runs = run_case(judge, reachable, entries[1:], done.append)
    assert [run.entry.fault for run in runs] == [''] * 4
    assert sum(done) == 4 * COUNT
    for run in runs:
        assert np.array_equal(run.answered, run.solved)
        assert run.solved.mean() > 0.9
        assert (run.seconds > 0.0).all()
        assert (run.attempts >= 1).all()


def test_tracking_goes_on_from_one_turn_to_the_next(judge, panda, entries):
    case = make_case(panda, 'tracking', 120)
    (run,) = run_case(judge, case, [entries[3]], lambda done: None)
    assert run.solved.all()
    assert run.jumps == 0


def test_a_library_with_another_arm_is_found_out(entries):
    other = Judge(load_arm('iiwa14'))
    copies = [replace(entry) for entry in entries]
    check_models(other, copies)
    assert all('forward kinematics differs' in entry.fault for entry in copies)


def test_a_worker_that_fails_says_why(entries):
    with pytest.raises(WorkerError, match='no such solver'):
        entries[0].process.forward('no such solver', np.zeros((1, 7)))


def test_a_jump_that_the_path_does_not_force_is_counted(judge, panda):
    case = make_case(panda, 'tracking', 50)
    q = case.path.copy()
    assert count_jumps(judge, case, q) == (0, 0)
    q[20:, 0] += 1.0
    assert count_jumps(judge, case, q) == (1, 0)


def test_the_check_finds_wrong_answers():
    group = check.make_group(np.random.default_rng([2026, 0]), 200)
    arm = group.judge.arm
    group.options = SolveOptions(max_attempts=20)
    batch = solve_batch(arm, group.targets, group.seeds, group.options, group.references)
    assert not check.find_faults(group, batch)
    row = int(np.flatnonzero(batch.converged)[0])
    batch.q[row] += 1e-3
    assert {fault for where, fault in check.find_faults(group, batch) if where == row} >= {
        'converged, but not at the target'
    }
    batch.wished_orientation_error[row] = 0.5
    assert (row, 'not the wished orientation error of its q') in check.find_faults(group, batch)
    batch.q[row] = arm.upper + 1.0
    assert (row, 'outside the limits') in check.find_faults(group, batch)


def test_thousands_of_answers_are_right(capsys):
    assert check.check_answers(3000) == 0
    assert capsys.readouterr().out.startswith('3000 solves, 0 wrong, ')


def test_iterations_of_every_method_are_timed(monkeypatch):
    monkeypatch.setattr(iteration, 'REPEATS', 2)
    rows = iteration.iteration_rows(['panda'])
    assert [row[:3] for row in rows] == [['panda', '7', method] for method in METHODS]
    assert all(np.isfinite(float(cell)) for row in rows for cell in row[3:])


def test_the_table_divides_by_the_reference(judge, entries, reachable):
    runs = run_case(judge, reachable, entries[2:4], lambda done: None)
    table = solve_table(runs, 'adaptive_dls')
    assert table[2][-3:] == ['1.0'] * 3
    assert len({len(line) for line in markdown(table).splitlines()}) == 1


def test_a_solver_that_fell_out_stays_in_the_table(entries, judge, reachable):
    gone = replace(entries[2], fault='not installable: no wheel')
    (run,) = run_case(judge, reachable, [gone], lambda done: None)
    assert 'not installable: no wheel' in solve_table([run])[1]


def test_the_report_is_saved_with_machine_and_command(tmp_path):
    report = Report('scripts/bench --iteration')
    report.add('One iteration', 'text', [['method', 'us'], ['dls', '1']])
    report.save(tmp_path / 'report.md')
    text = (tmp_path / 'report.md').read_text()
    for expected in ('`scripts/bench --iteration`', 'processor', '| dls    | 1  |'):
        assert expected in text


def test_the_plot_is_drawn(judge, entries, reachable, tmp_path):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed: scripts/bench installs it')
    report = Report('scripts/bench')
    report.add_runs(run_case(judge, reachable, entries[2:4], lambda done: None), [], '')
    report.save(tmp_path / 'report.md')
    assert (tmp_path / 'report.png').stat().st_size > 10_000
    assert '(report.png)' in (tmp_path / 'report.md').read_text()


def test_every_peer_of_the_requirements_has_a_library():
    common, requirements = peers.read_requirements()
    assert common == 'numpy<2'
    _, others = peers.read_requirements(peers.COLLISION_PEERS)
    assert {peers.library_of(line) for line in (*requirements, *others)} == set(peers.BRINGS.values())
    assert {peers.library_of(line) for line in others} == {'pink', 'mink'}


def test_the_reason_of_pip_is_kept():
    assert peers.last_error('Collecting x\nERROR: one\nERROR: No matching x\n') == 'No matching x'
    assert peers.last_error('') == 'pip failed without a reason'


def test_an_arm_that_others_cannot_take_is_refused_with_a_reason(panda, tmp_path):
    from bench.peer_closed_forms import make_ssik
    from bench.peer_solvers import finite_limits

    model = make_model(panda, 'panda', tmp_path)
    slider = replace(model, prismatic=[1, *model.prismatic[1:]], upper=[np.inf, *model.upper[1:]])
    with pytest.raises(UnsupportedError, match='revolute'):
        make_ssik(slider, {})
    with pytest.raises(UnsupportedError, match='limits'):
        finite_limits(slider)


def test_an_empty_path_has_no_jumps(judge):
    case = Case('tracking', np.eye(4)[None], np.zeros((1, 7)), np.zeros((1, 7)))
    assert count_jumps(judge, case, np.zeros((1, 7))) == (0, 0)


def test_others_leave_arms_with_mimic_joints_out():
    text = chain(
        ('one', 'revolute', {}),
        ('two', 'revolute', {'mimic': ('one', -1.0, 0.1)}),
    )
    arm = load_arm(text)
    assert not is_plain(arm)
    arguments = read_arguments(['--methods', 'dls'])
    with closing(WorkerProcess('ours')) as ours:
        model = Model('mimic', text, '', [], [], [], [])
        other = SimpleNamespace(library='rtb')
        entries, absent, versions = load_all([ours, other], arm, model, arguments)
    assert [entry.name for entry in entries] == ['dls']
    assert absent == {'rtb': 'takes no mimic joints'}
    assert list(versions) == ['ours']


def test_batches_are_timed_one_by_one_side_by_side_and_on_two_workers(panda):
    name, count, solved, scalar, lanes, gain, one, two, ratio, rate = batch_row(panda, SolveOptions(), 300)
    assert (name, count, solved) == ('panda', '300', '300 of 300')
    assert float(gain) == pytest.approx(float(scalar) / float(lanes), rel=0.05)
    assert float(ratio) == pytest.approx(float(one) / float(two), rel=0.05)
    assert float(rate) == pytest.approx(1e6 / float(two), rel=0.05)


@allow_lark
def test_a_round_trip_over_ros_is_timed(panda, monkeypatch):
    with ros_node('bench') as node:
        executor = make_executor()
        executor.add_node(node)
        side = ros.Side(node, 'echo', ros.poses_of(panda))
        with ros.running(ros.command_of('echo', panda, 'panda'), 'echo'):
            side.wait(executor.spin_once)
            monkeypatch.setattr(ros, 'PATIENCE', TIMEOUT)  # for the last answer, on a busy machine
            began = time.perf_counter()
            trips = side.stretch(executor.spin_once, 50.0, 10)
            seconds = time.perf_counter() - began
    assert np.isfinite(trips[-1])
    assert 0.0 < np.nanmin(trips) <= np.nanmax(trips) < seconds
