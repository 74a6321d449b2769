"""A short slice of scripts/torture: the same code with less of everything; and that it finds what it looks for."""

from __future__ import annotations

import ast
import math
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace
from random import Random
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from ros_helpers import CALM, CALM_ARGUMENTS, TIMEOUT, allow_lark

from bench import check
from bench.collision import CROWDED
from bench.judge import Judge
from bench.published_robots import UR5, configurations
from ros_ik_pkg.ik import load_arm
from torture import __main__ as command
from torture import contact, files, habitats, load, messages, network, parameters, reliability, soak, solves, tools
from torture import mutants as mutants_module
from torture import peer as peer_module
from torture.cable import CLEAR, CUT, Cable, Weather
from torture.hostile import HOSTILE
from torture.loader import Loader
from torture.mutants import SURVIVED, mutants_of
from torture.peer import connected
from torture.place import names_a_place
from torture.plan import Check, Plan, skipped
from torture.reliability import Reliability
from torture.running import COUNTED_NODE, TARGETS, Usage, running_node
from torture.sending import Sender, Sent
from torture.stream import Stream
from torture.waypoints import Stamps, client_of, sent_at, which_of

pytestmark = [allow_lark, pytest.mark.once]
ARM = load_arm('puma560')


def assert_right(checks) -> None:
    """Let the lines of a section speak where one is wrong."""
    checks = list(checks)
    assert checks
    assert [check for check in checks if check.fault] == []


@pytest.fixture(scope='module')
def node():
    """A node that solves every good target, also where a busy machine holds it up."""
    with pytest.MonkeyPatch.context() as patch, running_node(*CALM_ARGUMENTS, program=COUNTED_NODE) as node:
        patch.setattr(peer_module, 'DEFAULTS', peer_module.DEFAULTS | CALM)
        yield node


@pytest.fixture(scope='module')
def peer(node):
    with connected(ARM) as peer:
        yield peer


@pytest.fixture(scope='module')
def sender(peer):
    with Sender('puma560', 7, [peer.name]) as sender:
        yield sender


@pytest.fixture
def stream(peer):
    return Stream(peer, 7)


def stamp_of_last(sender, peer, stream, rate, condition) -> int:
    """Let a process stream until the condition holds, however slow the machine is; return the last stamp."""
    sender.begin(rate)
    assert peer.wait(condition, TIMEOUT)
    sent = sender.end()
    assert sent.targets > 1 and sent.joint_states > 1
    return sent.last[0]


def test_random_solves_are_right_whatever_the_seed(monkeypatch):
    monkeypatch.setattr(check, 'GROUP', 25)
    checks = list(solves.run(Plan(seed=7, count=1000)))
    assert_right(checks)
    assert checks[0].figure.startswith('1000, 40 sets of options on ')
    assert int(checks[0].figure.split()[-2]) > 20


def test_a_group_with_a_wrong_answer_is_named_and_can_be_run_alone(monkeypatch):
    monkeypatch.setattr(check, 'GROUP', 20)
    monkeypatch.setattr(check, 'find_late', lambda group, answers: [(3, 'late')])
    wrong = list(solves.run(Plan(seed=7, count=60)))[1]
    assert wrong.figure == '3' and 'seed 7, group 2, row 3' in wrong.fault and wrong.again == '--group 0'
    assert list(solves.run(Plan(seed=7, count=60, group=2)))[1].fault in wrong.fault
    assert next(solves.run(Plan(seed=7, count=60, group=3))).wrong


def test_any_message_is_answered_with_a_reason():
    assert messages.fuzz_layer(7, 150, ARM) == ''


def test_the_fuzz_sees_an_answer_without_a_reason(monkeypatch):
    monkeypatch.setattr(messages, 'fault_in', lambda answer, answering: 'no reason' * (answer.outcome == 'refused'))
    assert 'no reason' in messages.fuzz_layer(7, 50, ARM)


def test_any_message_over_dds_leaves_the_node_as_it_was(node, peer, monkeypatch):
    monkeypatch.setattr(messages, 'LONGEST_PAUSE', 2.0)
    assert_right(check for check in messages.fuzz_node(7, 300, node, peer) if 'memory' not in check.what)


def test_publishers_of_another_type_do_not_disturb(node, peer):
    assert_right([messages.wrong_type(node, peer)])


def test_a_flood_of_refused_targets_does_not_fill_the_log(node, peer):
    assert_right([messages.flood(1.0, node, peer)])


def test_any_parameter_value_is_taken_or_refused_with_a_reason(node, peer, sender):
    checks = list(parameters.fuzz(7, 60, node, peer, sender))
    by_speed = 'memory', 'targets that streamed'  # how many are passed over, too
    assert_right(check for check in checks if not check.what.startswith(by_speed))
    assert 'sent' in checks[-1].figure and 'results' not in checks[-1].fault and 'last' not in checks[-1].fault


def test_a_target_that_the_node_took_and_never_answered_is_noticed(node, peer, sender, stream):
    lost = node.taken()[TARGETS] - peer.heard - 1  # nothing is under way: the stream waited for that
    sender.begin(100.0)
    assert 'taken' in parameters.answered(lost, sender, stream, node, peer).fault


def test_a_refused_change_that_changed_something_is_noticed(peer, monkeypatch):
    values = iter(f'values {k}' for k in range(1000))
    monkeypatch.setattr(peer, 'all_values', lambda: next(values))
    calls = parameters.Calls(7, peer)
    assert any('refused, but something changed' in calls.one() for _ in range(100))
    assert peer.set_defaults() == ''


def test_a_message_that_the_node_did_not_take_is_counted(node, peer, monkeypatch):
    monkeypatch.setattr(peer.targets, 'publish', lambda message: None, raising=False)
    monkeypatch.setattr(messages, 'LONGEST_PAUSE', 0.01)
    taken, random = messages.Taken(node, peer), Random(7)
    for _ in range(10):
        taken.send(random)
    assert next(taken.checks()).fault == 'too few'


def test_targets_and_joint_states_at_speed_are_answered_in_order(peer, sender, stream):
    last = stamp_of_last(sender, peer, stream, 500.0, lambda: len(stream.solutions) > 10)
    assert stream.fault_at_end(last) == '' and 0.0 < stream.latency(50) < TIMEOUT


def test_a_rate_that_was_not_reached_is_noticed():
    assert Sent(91, 1000, 1.0, {}).too_slow(100.0) == ''
    assert Sent(89, 800, 1.0, {}).too_slow(100.0) == (
        'not tried: targets at 89 Hz instead of 100, joint states at 800 Hz instead of 1000'
    )


def test_of_a_burst_the_last_target_is_solved(node, peer, sender):
    assert_right(check for check in load.burst(2000, 7, node, peer, sender) if 'memory' not in check.what)


def test_answers_out_of_order_or_to_targets_of_another_are_noticed(peer, sender, stream):
    last = stamp_of_last(sender, peer, stream, 100.0, lambda: len(stream.results) > 1)
    assert stream.fault_at_end(last) == ''
    stream.results[-1], stream.results[-2] = stream.results[-2:]
    assert 'after one to a newer target' in stream.fault_at_end(last)
    of_another = Stream(peer, 7, client=3)
    of_another.solutions, of_another.results, of_another.outcomes = stream.solutions, stream.results, stream.outcomes
    assert "answers to another's target, such as of client 0" in of_another.fault_at_end(last)


def test_a_solution_of_a_stream_that_misses_its_target_is_noticed(peer, sender, stream):
    last = stamp_of_last(sender, peer, stream, 100.0, lambda: len(stream.solutions) > 1)
    assert stream.fault_at_end(last) == ''
    names, positions = stream.solutions[last]
    stream.solutions[last] = names, [*positions[:-1], positions[-1] + 1e-3]
    assert stream.fault_at_end(last).startswith('1 wrong, such as ')


def test_solutions_are_for_the_tool_that_they_name_while_tools_change():
    """In a process of its own: here a peer of other tests holds the only context that rclpy has."""
    words = [sys.executable, '-m', 'torture', 'tools', '--count', '60']
    done = subprocess.run(words, cwd=command.ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_solution_for_another_tool_than_the_named_one_is_noticed():
    q, sent = ARM.home[None], [np.array([0.0, 0.0, z, 0.0, 0.0, 0.0, 1.0]) for z in (0.1, 0.2)]
    judge = Judge(ARM)
    target = judge.forward(q)[0] @ pin.XYZQUATToSE3(sent[1]).homogeneous
    for named, missed, foreign in ((sent[1], 0, 0), (sent[0], 1, 0), (sent[0] + 1e-3, 1, 1)):
        seen = SimpleNamespace(_judge=judge, sent=sent, named=[], judged=0, missed=0, ambiguous=0, foreign=0)
        tools.Tools._hold(seen, q[0], target, named)
        assert (seen.missed, seen.ambiguous, seen.foreign) == (missed, 0, foreign)


def test_solutions_among_obstacles_are_clear_of_contact():
    """In a process of its own, as those for tools."""
    words = [sys.executable, '-m', 'torture', 'contact', '--count', '40']
    done = subprocess.run(words, cwd=command.ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_solution_that_touches_is_noticed():
    urdf, srdf, tip = UR5
    arm = load_arm(urdf, tip=tip, srdf=srdf)
    seen = SimpleNamespace(_judge=contact.judge_of(arm, urdf), judged=0, touching=0)
    q = configurations(arm, 200, seed=1)
    touching = [row for row in q if not arm.contacts.is_clear(row, 0.0, CROWDED, True)]
    clear = contact.clear_configurations(arm, arm.contacts.room(CROWDED).packed, 5, 0)
    for row in (*touching, *clear):
        contact.Targets._hold(seen, arm.joint_names, row)
    assert seen.judged == len(touching) + 5 and 5 < seen.touching == len(touching)


def test_random_paths_among_obstacles_are_right():
    words = [sys.executable, '-m', 'torture', 'paths', '--count', '12']
    done = subprocess.run(words, cwd=command.ROOT, capture_output=True, text=True)
    assert done.returncode == 0 and 'panda: motions along 3 paths' in done.stdout, done.stdout + done.stderr


def test_a_stamp_says_who_sent_which_target_and_when():
    stamps, began = Stamps(), time.monotonic()
    some = [stamps.next(client, which) for client, which in ((0, 0), (19, 499), (3, 7))]
    assert some == sorted(some) and [client_of(stamp) for stamp in some] == [0, 19, 3]
    assert [which_of(stamp) for stamp in some] == [0, 499, 7]
    assert all(-1e-4 < sent_at(stamp) - began < TIMEOUT for stamp in some)


def test_a_wrong_solution_is_noticed(peer):
    assert peer.fault(ARM.home) == ''
    stamp = max(peer.solutions)
    peer.solutions[stamp].position[1] += 1e-3
    assert 'wrong solution' in peer.wrongness(stamp, ARM.home)


def test_parameters_change_while_targets_stream_and_all_topics_are_heard(node, peer, sender, monkeypatch):
    monkeypatch.setattr(soak, 'CHANGES', ({'compare': ['all']}, {'robot': 'puma560'}))
    monkeypatch.setattr(soak, 'STEP', 0.2)
    run = soak.Soak(7, node, peer, sender)
    assert run.stream(2.0) == '' and run.sent().targets > 0
    assert all(usage.memory > 50.0 and usage.files > 5 and usage.threads > 2 for usage in run.usages)
    deadline = time.monotonic() + TIMEOUT
    while run.everything.missing():
        assert time.monotonic() < deadline, run.everything.missing()
        assert peer.fault(ARM.home) == ''
    assert peer.set_defaults() == ''


def test_growth_is_noticed():
    flat = [Usage(100.0 + 0.1 * (k % 3), 20, 9) for k in range(50)]
    assert not any(check.fault for check in soak.judged(flat))
    leaking = [replace(usage, memory=usage.memory + 0.1 * k, files=20 + k // 25) for k, usage in enumerate(flat)]
    assert [bool(check.fault) for check in soak.judged(leaking)] == [True, True, False]


def test_a_soak_is_judged_after_the_first_tenth_a_short_one_after_two_minutes_or_half():
    assert [len(soak.after_warm_up(range(n))) for n in (20, 600, 3000)] == [10, 480, 2700]


def test_values_of_a_type_that_ros_does_not_have_end_nothing(node, peer):
    assert_right([parameters.no_such_type(node, peer)])  # the last one: it leaves tracebacks in the log


@pytest.fixture(scope='module')
def loader():
    with Loader() as loader:
        yield loader


def test_files_with_pieces_changed_load_or_are_refused(loader, tmp_path):
    assert_right(check for check in files.fuzz(Random(7), 100, tmp_path, loader) if 'slowest' not in check.what)


@pytest.mark.parametrize('name', ['a cycle of links', 'an entity bomb', 'an external entity', 'aliases of aliases',
                                  'a YAML tag that makes objects', 'a binary file'])  # fmt: skip
def test_a_hostile_file_is_refused(name, loader, tmp_path):
    suffix, make = HOSTILE[name]
    path, content = tmp_path / f'robot{suffix}', make()
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    done = loader.load(path)
    assert (done.outcome, done.fault) == ('refused', '') and done.seconds < files.MOST_SECONDS


def test_a_pipe_is_refused(loader, tmp_path):
    assert_right([files.special(tmp_path, loader)])


def test_a_file_that_takes_for_ever_or_ends_the_process_is_noticed(loader, tmp_path, monkeypatch):
    path = tmp_path / 'robot.urdf'
    path.write_text('<robot/>')
    monkeypatch.setattr('torture.loader.HANG', 0.2)
    os.kill(loader._process.pid, signal.SIGSTOP)
    assert 'not done after 0.2 s' in loader.load(path).fault
    monkeypatch.undo()
    os.kill(loader._process.pid, signal.SIGKILL)
    loader._process.wait()
    assert 'the process ended with -9' in loader.load(path).fault
    assert loader.load(path).outcome == 'refused'


@pytest.mark.parametrize(('error', 'placed'), [
    ("line 3, column 1: not well-formed XML (unclosed token)", True),
    ("robot 'x': joint 'j0' has type 'ball'; expected one of revolute", True),
    ("robot 'x': joint name used more than once: j0", True),
    ("joint 'j1': <axis xyz> is zero; expected a direction", True),
    ("robot 'x': the robot has no links", True),
    ("robot 'x': something is wrong somewhere", False),
    ("robot 'x': joint 'elsewhere' is wrong", False),
])  # fmt: skip
def test_an_error_that_names_no_place_is_noticed(error, placed):
    assert names_a_place(error, '<robot name="x"><joint name="j0"><axis xyz="0 0 0"/></joint></robot>') == placed


@pytest.fixture
def cable():
    """A cable between two sockets: what one sends, the other gets."""
    (left, right), (one, other) = ((socket.socketpair(type=socket.SOCK_DGRAM)) for _ in range(2))
    cable = Cable((right.fileno(), other.fileno()), 7)
    cable.start()
    yield cable, left, one
    cable.close()
    for end in (left, right, one, other):
        end.close()


@pytest.mark.parametrize(
    ('weather', 'least', 'most'),
    [(CLEAR, 20, 20), (CUT, 0, 0), (Weather(doubled=1.0), 40, 40), (Weather(loss=0.5), 3, 17)],
)
def test_a_cable_does_what_the_weather_says(cable, weather, least, most):
    cable, left, one = cable
    cable.weather = weather
    for _ in range(20):
        left.send(b'frame')
    deadline = time.monotonic() + TIMEOUT
    while cable.taken < 20 * (1 + (weather.doubled == 1.0)):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    cable.weather = CLEAR
    left.send(b'end')  # what comes out comes before it: nothing delays a frame here
    one.settimeout(TIMEOUT)
    came = len(list(iter(lambda: one.recv(100), b'end')))
    assert least <= came <= most and cable.taken - cable.lost == came + 1


@pytest.mark.parametrize(('share', 'median', 'count', 'said'), [
    (0.2, 0.3, 50, ''),
    (0.01, 0.3, 50, '0.010 of the frames lost instead of 0.2'),
    (0.9, 0.3, 50, '0.900 of the frames'),
    (0.2, 0.01, 50, 'quicker than the delay'),
    (0.2, math.inf, 50, 'none solved'),
    (0.2, 0.3, 0, '0 sent'),
])  # fmt: skip
def test_a_weather_that_was_none_is_noticed(share, median, count, said):
    fault = network.not_tried(Weather(loss=0.2, delay=0.05, jitter=0.01), share, median, count)
    assert said in fault and bool(said) == bool(fault)


def test_a_cable_delays(cable):
    cable, left, one = cable
    cable.weather, began = Weather(delay=0.15), time.monotonic()
    one.send(b'frame')
    left.settimeout(TIMEOUT)
    assert left.recv(100) == b'frame' and time.monotonic() - began >= 0.15


@pytest.mark.parametrize(('name', 'said', 'right'), [
    ('de_DE.UTF-8', 'locale: de_DE.UTF-8 writes 0,5', True),
    ('de_DE.UTF-8', 'locale: de_DE.UTF-8 writes 0.5', False),
    ('de_DE.UTF-8', 'locale: C writes 0.5', False),
    ('', 'locale: LC_CTYPE=C.UTF-8;LC_NUMERIC=C writes 0.5', True),
    ('C', '', False),
])  # fmt: skip
def test_a_node_in_another_locale_than_it_should_be_in_is_noticed(name, said, right):
    assert (habitats._not_in_it(name, f'ready: \n{said}\n') == '') == right


def test_a_locale_that_cannot_be_made_is_skipped(tmp_path, monkeypatch):
    assert habitats.find_locale('C', str(tmp_path)) == ({}, '')
    assert habitats.find_locale('xx_XX.UTF-8', str(tmp_path))[1] == 'not installed'
    monkeypatch.setattr('shutil.which', lambda name: None)
    assert habitats.find_locale('xx_XX.UTF-8', str(tmp_path))[1] == 'not installed'


def test_the_report_keeps_the_last_run_of_each_section(tmp_path):
    path = tmp_path / 'reliability.md'
    for section, table in (('files', '| old |'), ('load', '| kept |'), ('files', '| new |')):
        Reliability(section, f'scripts/torture {section}').write(path, f'About {section}.', table)
    text = path.read_text()
    counts = [text.count(words) for words in ('| old |', '| kept |', '| new |', '## files\n', 'processor')]
    assert counts == [0, 1, 1, 1, 2]


def fails_midway(plan):
    """A section that a crash ends."""
    yield Check('before', '1')
    raise RuntimeError('no node | any more')


@pytest.fixture
def torture(tmp_path, monkeypatch, capsys):
    """Run the command with sections as they are given; return exit code, lines, and the report that it writes."""
    monkeypatch.setattr(command, 'own_domain', lambda: threading.Lock())
    monkeypatch.setattr(command, 'REPORT', tmp_path / 'report.md')

    def run(*words, **sections):
        for name, section in sections.items():
            monkeypatch.setattr(f'torture.{name}.run', section)
        monkeypatch.setattr('sys.argv', ['torture', *words])
        code = command.main()
        report = tmp_path / 'report.md'
        return code, capsys.readouterr().out.splitlines(), report.read_text() if report.exists() else ''

    return run


@pytest.mark.parametrize(('found', 'code'), [(Check('x', '1'), 0), (Check('x', '1', 'no'), 1), (skipped('x', 'no'), 0)])
def test_the_exit_code_is_0_only_if_nothing_is_wrong(torture, found, code):
    got, lines, report = torture('files', '--seed', '5', files=lambda plan: [found])
    assert got == code and found.verdict in report
    assert ('reproduce with scripts/torture files --seed 5' in lines) == bool(code)
    assert lines[-1] == f'1 checks, {code} wrong' + ', skipped files: x' * found.skipped


def test_a_crash_of_a_section_is_a_finding_and_the_next_one_is_run(torture):
    words, after = ('files', 'load', '--seed', '5'), [Check('x', '1')]
    code, lines, report = torture(*words, files=fails_midway, load=lambda plan: after)
    assert code == 1 and lines[-1] == '3 checks, 1 wrong'
    assert '| before ' in report and r"WRONG: 'RuntimeError: no node \| any more'" in report and '## load' in report
    assert 'reproduce with scripts/torture files --seed 5' in lines


def test_a_small_run_leaves_the_report_alone_and_says_how_it_is_reproduced(torture, tmp_path):
    wrong = Check('x', '1', 'no', '--group 3')
    words = 'solves', '--count', '10', '--minutes', '0.5'
    code, lines, report = torture(*words, solves=lambda plan: [wrong])
    assert (code, report) == (1, '')
    assert 'reproduce with scripts/torture solves --seed 2026 --count 10 --minutes 0.5 --group 3' in lines
    assert '## solves' in torture(*words, '--output', str(tmp_path / 'report.md'), solves=lambda plan: [wrong])[2]


@pytest.mark.parametrize(('words', 'said'), [
    (['soap'], "'soap' is no section; expected solves, messages"),
    (['files', '--count', '0'], 'nothing would be tried'),
    (['files', '--count', '-1'], 'expected a whole number'),
    (['files', '--minutes', '0'], 'expected minutes, more than 0'),
    (['files', '--minutes', 'nan'], 'expected minutes, more than 0'),
])  # fmt: skip
def test_what_makes_no_sense_on_the_command_line_is_refused(words, said, capsys):
    with pytest.raises(SystemExit):
        command.make_parser().parse_args(words)
    assert said in capsys.readouterr().err


def test_the_report_names_files_that_are_not_committed(monkeypatch):
    changed = ''.join(f' M file{k}\n' for k in range(7))
    monkeypatch.setattr(reliability, '_git', lambda word, *rest: 'abc\n' if word == 'rev-parse' else changed)
    assert reliability.commit() == 'abc, not committed: file0, file1, file2, file3, file4 and 2 more'
    changed = ''
    assert reliability.commit() == 'abc'


def test_the_help_names_every_section_and_option():
    help_text = (command.ROOT / 'scripts' / 'torture').read_text()
    assert all(f'#   {section} ' in help_text for section in command.SECTIONS)
    assert all(option in help_text for option in ('--seed', '--count', '--minutes', '--group', '--output'))
    assert {f'{name}.py' for name in command.SECTIONS} <= set(os.listdir(command.ROOT / 'torture'))


CODE = """LIMIT = 3

def f(q, limit):
    total = 0.5
    for i in range(len(q)):
        if q[i] < limit and not q[i] == -limit:
            total += q[i] * 2.0
            clip(q)
    return min(total, limit)
"""


def test_a_mutant_is_one_change_of_a_line_in_a_function():
    mutants = list(mutants_of('a.py', CODE))
    changed = {mutant.words[1] for mutant in mutants}
    assert {
        'total = 1.0', 'if q[i] <= limit and not q[i] == -limit:', 'if q[i] < limit or not q[i] == -limit:',
        'if q[i] < limit and q[i] == -limit:', 'if q[i] < limit and not q[i] != -limit:',
        'if q[i] < limit and not q[i] == limit:', 'total -= q[i] * 2.0', 'total += q[i] / 2.0', 'total += q[i] * 4.0',
        'pass', 'return max(total, limit)',
    } == changed  # fmt: skip
    assert len(mutants) == len(changed)
    for mutant in mutants:
        ast.parse(mutant.change())
        lines = zip(CODE.splitlines(), mutant.change().splitlines(), strict=True)
        assert [k + 1 for k, (before, after) in enumerate(lines) if before != after] == [mutant.line]


def test_a_mutant_that_no_test_notices_is_a_finding_unless_it_is_known_to_compute_the_same(monkeypatch):
    mutants = list(mutants_of('a.py', CODE))[:3]
    outcomes = {mutants[0]: 'test_x', mutants[1]: SURVIVED, mutants[2]: SURVIVED, None: SURVIVED}
    monkeypatch.setattr(mutants_module, 'find_mutants', lambda root: list(mutants))
    monkeypatch.setattr(mutants_module, 'judge', lambda scratch, limit, mutant: outcomes[mutant])
    monkeypatch.setattr(mutants_module, 'EQUAL', {mutants[2].words: 'nobody sees it'})
    checks = list(mutants_module.run(Plan(seed=7)))
    assert checks[1].figure == '1 of 3, drawn from 3 changes'
    assert sorted(check.fault for check in checks) == ['', '', '', 'no test notices']


def test_the_same_seed_makes_the_same_problems():
    first, again, other = (check.make_group(np.random.default_rng([seed, 0]), 10) for seed in (7, 7, 8))
    assert first.options == again.options != other.options
    np.testing.assert_array_equal(first.targets, again.targets)
    np.testing.assert_array_equal(first.seeds, again.seeds)
