"""What a node can answer while the solver is being compiled, and where compiled code is kept."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numerics import get_arm, reachable_poses

from ros_ik_pkg.ik import METHODS, NotCompiledError, SolveOptions, Status, compilation, load_arm, solve
from ros_ik_pkg.ik.kernel import cache_folder
from ros_ik_pkg.ik.solver import use_usual
from ros_ik_pkg.methods import DEFAULT

ROOT = Path(__file__).resolve().parents[2]
BEAM = '<collision><origin xyz="0.5 0 0"/><geometry><box size="0.8 0.2 0.2"/></geometry></collision>'
FOLDING = '<robot name="folding">' + ''.join(f'<link name="l{i}">{BEAM}</link>' for i in range(4)) + ''.join(
    f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/><origin xyz="1 0 0"/>'
    '<axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1" effort="1" velocity="1"/></joint>'
    for i in range(3)
) + '</robot>'
A_PATH = """
import numpy as np
from ros_ik_pkg.ik import PathOptions, load_arm, solve_path
arm = load_arm('ur5')
poses = np.stack([arm.forward(arm.home)] * 3)
poses[:, 2, 3] += 0.0, 0.05, 0.1
print(solve_path(arm, poses, arm.home, path=PathOptions(max_reconfigurations=1)).complete)
"""


@pytest.fixture
def usual() -> Iterator[None]:
    """Only the usual solve is compiled so far."""
    use_usual(True)
    yield
    use_usual(False)


@pytest.mark.parametrize('name', ['panda', 'ur5'])
def test_the_usual_solve_gives_the_bits_of_the_complete_one(usual, name):
    arm, options = get_arm(name), SolveOptions(max_attempts=10, deadline=0.0)
    targets, answered = reachable_poses(arm, np.random.default_rng(3), 200), 0
    for target in targets:
        use_usual(True)
        try:
            first = solve(arm, target, options=options)
        except NotCompiledError:
            continue
        answered += 1
        use_usual(False)
        complete = solve(arm, target, options=options)
        np.testing.assert_array_equal(first.q, complete.q)
        assert (first.status, first.iterations, first.attempts) == (
            complete.status, complete.iterations, complete.attempts
        )  # fmt: skip
    assert answered >= len(targets) - 4


def test_what_is_not_compiled_yet_is_refused_and_not_waited_for(usual):
    arm = get_arm('panda')
    target, beyond = arm.forward(arm.home), arm.forward(arm.home)
    beyond[0, 3] = 10.0
    assert solve(arm, target, arm.home + 0.1).converged
    for change in (
        {'options': SolveOptions(null_space='posture')}, {'options': SolveOptions(choice='all')},
        {'reference': arm.home}, {'trace': True}, {'options': SolveOptions(secondary='orientation')},
        *({'options': SolveOptions(method=method)} for method in METHODS if method != DEFAULT),
        {'options': SolveOptions(choice='nearest')}, {'options': SolveOptions(max_joint_jump=1.0)},
        {'options': SolveOptions(adaptive_dls_damping=0.0)},
        {'options': SolveOptions(task_weights=(1.0, 1.0, 1.0, 1.0, 1.0, 0.5))},
        {'options': SolveOptions(task_tolerances=(0.0, 0.0, 0.0, 0.0, 0.0, 0.1))},
        {'target': beyond},
    ):  # fmt: skip
        with pytest.raises(NotCompiledError, match='still being compiled'):
            solve(arm, **({'target': target} | change))


def test_all_methods_answer_before_what_needs_more_than_one_solution_is_compiled(usual):
    arm = get_arm('panda')
    target, beyond = arm.forward(arm.home + 0.1), arm.forward(arm.home)
    beyond[0, 3] = 10.0
    use_usual(False, alone=True)
    for method in METHODS:
        assert solve(arm, target, options=SolveOptions(method=method, max_iterations=10000)).converged
    assert solve(arm, beyond).status == Status.UNREACHABLE
    for change in ({'options': SolveOptions(choice='all')}, {'reference': arm.home}, {'trace': True}):
        with pytest.raises(NotCompiledError, match='still being compiled'):
            solve(arm, target, **change)


def test_the_usual_solve_of_an_arm_with_shapes_is_clear_of_contact_or_refused(usual):
    arm, options = load_arm(FOLDING), SolveOptions(secondary='none')  # three joints: wishes are not compiled yet
    other = load_arm(FOLDING)  # the judge has a model of its own
    outcomes = []
    for q in np.random.default_rng(5).uniform(-3.1, 3.1, (60, 3)):
        try:
            solution = solve(arm, arm.forward(q), np.zeros(3), options)
        except NotCompiledError:
            outcomes.append(False)
            continue
        if solution.converged:
            outcomes.append(True)
            assert other.contacts.is_clear(solution.q)
    assert 5 < sum(outcomes) < len(outcomes) - 5


def run(program: str, **environment: str) -> str:
    """Run a program that imports this package in a process of its own; return what it prints."""
    paths = os.pathsep.join([str(ROOT), os.environ.get('PYTHONPATH', '')])
    result = subprocess.run(
        [sys.executable, '-c', program],
        env=os.environ | {'PYTHONPATH': paths} | environment, capture_output=True, text=True, timeout=900,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


KINEMATICS = """
import numpy as np
from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN
from ros_ik_pkg.ik.kernel.linalg import svd
arm = load_arm('panda')
U, W, sigma = np.empty((6, 6)), np.empty((6, arm.n)), np.empty(6)
J = arm.jacobian(arm.home)
svd(np.ascontiguousarray(J.T), U, W, sigma)
print(WHY_PLAIN)
print((arm.forward(arm.home).tobytes() + J.tobytes() + sigma.tobytes()).hex())
"""
SOLVES = """
import numpy as np
from ros_ik_pkg.ik import SolveOptions, load_arm, solve, solve_batch
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN
arm, random, numbers = load_arm('panda'), np.random.default_rng(1), b''
beyond = arm.forward(arm.home)
beyond[0, 3] = 3.0
targets = [beyond, *(arm.forward(arm.home + random.uniform(-0.6, 0.6, arm.n)) for _ in range(10))]
for target in targets:
    for options in (SolveOptions(), SolveOptions(method='sdls', null_space='posture')):
        numbers += solve(arm, target, options=options).q.tobytes()
        numbers += solve(arm, target, options=options, trace=True).trace.joint_positions.tobytes()
numbers += solve_batch(arm, targets).q.tobytes()
print(WHY_PLAIN)
print(numbers.hex())
"""


def assert_plain_numba_gives_the_same_bits(program: str) -> None:
    usual = run(program, ROS_IK_PLAIN_NUMBA='0')
    why, numbers = run(program, ROS_IK_PLAIN_NUMBA='1').splitlines()
    assert why == 'ROS_IK_PLAIN_NUMBA is set'
    assert usual == numbers  # and no reason for plain Numba


@pytest.mark.workspace  # compiles anew
def test_plain_numba_gives_the_same_bits():
    assert_plain_numba_gives_the_same_bits(KINEMATICS)


@pytest.mark.workspace  # compiles for a minute
def test_plain_numba_gives_the_same_solutions():
    assert_plain_numba_gives_the_same_bits(SOLVES)


BROKEN = """
import numba
numba.version_info = (0, 99, 0)
numba.__version__ = '0.99.0'
{change}
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN
from ros_ik_pkg.ik.kernel.sincos import sincos
print(round(sincos(0.5)[0], 6), WHY_PLAIN)
"""
CHANGES = {
    'nothing changed': '',
    'no pass': 'import numba.core.typed_passes; del numba.core.typed_passes.NoPythonBackend',
    'no class': 'import numba.core.codegen; del numba.core.codegen.JITCodeLibrary',
    'no cache': 'import numba.core.caching; del numba.core.caching._CacheLocator',
    'other arguments': 'import numba.np.arrayobj as a; a.populate_array = lambda array: None',
}


@pytest.mark.parametrize('change', CHANGES)
def test_an_unknown_numba_is_tried_out_and_what_lacks_a_part_is_used_plainly(change, tmp_path):
    words = run(BROKEN.format(change=CHANGES[change]), NUMBA_CACHE_DIR=str(tmp_path)).split(maxsplit=1)
    assert words[0] == '0.479426'
    if change == 'nothing changed':
        assert words[1:] == []
    else:
        assert words[1].startswith('Numba 0.99.0 lacks what the solver uses of its insides (')


def test_an_odd_numba_is_reported(monkeypatch):
    said = []
    monkeypatch.setattr(compilation, 'WHY_PLAIN', 'Numba 0.99 lacks something')
    monkeypatch.setattr(compilation, 'all_cached', lambda: True)  # else it may also say that it compiles
    compilation.warm_up(said.append)
    assert said == ['Numba 0.99 lacks something: plain Numba is used, which is slower']


SINE = 'from ros_ik_pkg.ik.kernel.sincos import sincos; print(sincos(0.5))'


def kept(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in folder.rglob('*.nbc')}


def test_the_cache_of_another_machine_type_is_not_used(tmp_path):
    first = run(SINE, NUMBA_CACHE_DIR=str(tmp_path))
    files = kept(tmp_path)
    assert run(SINE, NUMBA_CACHE_DIR=str(tmp_path), NUMBA_CPU_NAME='generic', NUMBA_CPU_FEATURES='') == first
    both = kept(tmp_path)
    assert files.items() < both.items()  # compiled again, beside what was there
    assert run(SINE, NUMBA_CACHE_DIR=str(tmp_path)) == first
    assert kept(tmp_path) == both


def test_a_folder_that_cannot_be_written_to_is_read_where_it_holds_code(tmp_path, monkeypatch):
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))
    folder = cache_folder.cache_folder()
    assert folder is not None
    monkeypatch.setattr(cache_folder, 'is_writable', lambda folder: False)
    assert cache_folder.cache_folder() is None
    (folder / 'sincos.nbi').touch()
    assert cache_folder.cache_folder() == folder


@pytest.mark.workspace  # compiles for half a minute
def test_the_program_fills_the_cache_and_a_node_starts_complete_from_it(tmp_path):
    program = 'from ros_ik_pkg.ik.compilation import main; print(main([]))'
    text, code = run(program, NUMBA_CACHE_DIR=str(tmp_path)).splitlines()[-2:]
    assert 'kept in' in text and code == '0'
    files = kept(tmp_path)
    start = 'from ros_ik_pkg.ik import Compilation as C; c = C(print); c.close(); print(c.complete, c.stream_ready)'
    assert run(start, NUMBA_CACHE_DIR=str(tmp_path)) == 'True True'
    lanes = 'from ros_ik_pkg.ik.batch.entry import solve_lanes; print(solve_lanes.is_cached())'
    assert run(lanes, NUMBA_CACHE_DIR=str(tmp_path)) == 'True'
    assert run(A_PATH, NUMBA_CACHE_DIR=str(tmp_path)) == 'True'
    assert kept(tmp_path) == files


def test_lanes_are_compiled_for_a_large_batch_and_for_nothing_else():
    program = """
from ros_ik_pkg.ik import load_arm, solve, solve_batch, warm_up
from ros_ik_pkg.ik.batch.entry import solve_lanes
warm_up(lambda text: None)
arm = load_arm('xarm7')
target = arm.forward(arm.home + 0.1)
for count in (1, 20, 999):
    solve(arm, target) if count == 1 else solve_batch(arm, [target] * count)
    print(len(solve_lanes.compiled.signatures))
"""
    assert run(program).split() == ['0', '0', '1']


@pytest.mark.workspace  # compiles for half a minute
def test_the_first_start_answers_early_and_completes_itself(tmp_path):
    program = """
import time
from ros_ik_pkg.ik import Compilation, NotCompiledError, load_arm, solve
compilation = Compilation(lambda text: None)
arm = load_arm('ur5')
print(compilation.complete, solve(arm, arm.forward(arm.home + 0.1)).converged)
while not compilation.complete:
    time.sleep(0.1)
print(len(solve(arm, arm.forward(arm.home + 0.1), trace=True).trace.joint_positions) > 1)
while not compilation.stream_ready:
    time.sleep(0.1)
compilation.close()
"""
    assert run(program, NUMBA_CACHE_DIR=str(tmp_path)) == 'False True\nTrue'


def test_a_node_answers_all_targets_before_what_streams_need_is_compiled(monkeypatch):
    monkeypatch.setattr(compilation, 'CACHE_FOLDER', None)  # no helper
    monkeypatch.setattr(compilation, 'stream_cached', lambda: False)
    monkeypatch.setattr(compilation, 'all_cached', lambda: True)
    begin = threading.Event()
    monkeypatch.setattr(compilation, 'compile_stream', lambda: begin.wait(60.0))
    started = compilation.Compilation(lambda text: None)
    try:
        assert started.complete and not started.stream_ready
        begin.set()
        started._thread.join(60.0)
        assert started.stream_ready
    finally:
        started.close()


@pytest.mark.parametrize('cached', [True, False])
def test_a_slow_start_speaks_of_compiling_only_if_something_is_compiled(monkeypatch, cached):
    said = []
    monkeypatch.setattr(compilation, 'all_cached', lambda: cached)
    monkeypatch.setattr(compilation, 'NOTICE_AFTER', 0.0)
    monkeypatch.setattr(compilation, 'compile_kinematics', lambda: time.sleep(0.2))
    compilation.warm_up(said.append)
    assert len(said) == (not cached)
    assert cached or 'compiling the solver for this machine' in said[0]
