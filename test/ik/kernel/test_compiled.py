"""Compiled once for every arm, option and form of a call, and kept where the next start finds it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pinocchio as pin
import pytest
from chains import random_urdf
from numerics import get_arm

import ros_ik_pkg
from ros_ik_pkg.ik import CHOICES, METHODS, SolveOptions, load_arm, solve, solve_batch
from ros_ik_pkg.ik.kernel import cache_folder, compiled
from ros_ik_pkg.ik.kernel.compiled import kernel, variant_of
from ros_ik_pkg.ik.kernel.numba_insides import WHY_PLAIN
from ros_ik_pkg.ik.kinematics.forward import forward_kinematics, geometric_jacobian
from ros_ik_pkg.ik.search.entry import solve_one, solve_range

HOME = Path(ros_ik_pkg.__file__).parents[1]


def test_one_compiled_solve_serves_every_arm_option_and_form_of_a_call():
    made_up = load_arm(random_urdf(np.random.default_rng(1)), 'base', 'tip')
    for arm in (*map(get_arm, ('planar3r', 'puma560', 'panda')), made_up):
        target = arm.forward(arm.home)
        fixed = arm.home.copy()
        fixed.flags.writeable = False
        for method in METHODS:
            solve(arm, target, options=SolveOptions(method=method))
        for choice in CHOICES:
            solve(
                arm, pin.SE3(target), fixed, SolveOptions(choice=choice, max_attempts=2), arm.home.tolist(), trace=True
            )
        solve(arm, np.asfortranarray(target), tuple(arm.home), SolveOptions(joint_weights=(1,) * arm.n))
        solve_batch(arm, np.broadcast_to(target, (3, 4, 4)), fixed, workers=2)
        solve_batch(arm, [target] * 2, np.tile(arm.home, (2, 1)), references=arm.home, workers=1)
    assert len(solve_range.compiled.signatures) == 1
    assert len(solve_one.compiled.signatures) == 1


def test_one_compiled_kinematics_serves_every_form_of_a_configuration():
    arm = get_arm('panda')
    fixed = arm.home.copy()
    fixed.flags.writeable = False
    for q in (arm.home, fixed, arm.home.tolist(), arm.home.astype(np.float32), np.repeat(arm.home, 2)[::2]):
        arm.forward(q)
        arm.jacobian(q)
    assert len(forward_kinematics.signatures) == 1
    assert len(geometric_jacobian.signatures) == 1


def test_an_entry_point_can_be_the_argument_of_a_compiled_function():
    number = numba.float64(numba.float64)
    entry = compiled.entry_point(number.return_type, number.args)
    double, square = entry(lambda x: 2.0 * x), entry(lambda x: x * x)

    @numba.njit
    def twice(function, x):
        return function(function(x))

    assert twice(double.as_argument(), 3.0) == 12.0 and twice(square.as_argument(), 3.0) == 81.0
    assert len(twice.signatures) == 1  # compiled for the types, not for the functions


def in_a_new_process(program, **environment):
    """Run a program that imports this package; return what it prints."""
    home = environment.pop('PYTHONPATH', str(HOME))
    paths = os.pathsep.join([home, os.environ.get('PYTHONPATH', '')])
    result = subprocess.run(
        [sys.executable, '-c', program],
        env=os.environ | {'PYTHONPATH': paths} | environment, cwd=home, capture_output=True, text=True, timeout=900,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


FOLDER = 'from ros_ik_pkg.ik.kernel.cache_folder import CACHE_FOLDER; print(CACHE_FOLDER)'
SINE = f'from ros_ik_pkg.ik.kernel.sincos import sincos; print(sincos(0.5)); {FOLDER}'
AFTER_WARM_UP = """
import numpy as np
from numba.core.event import install_recorder
from ros_ik_pkg.ik import SolveOptions, load_arm, solve, solve_batch, warm_up
from ros_ik_pkg.ik.kinematics.pose_error import pose_matrix
from ros_ik_pkg.ik.search.final_check import passes
warm_up()
with install_recorder('numba:compile') as compilations:
    for name in ('puma560', 'panda'):
        arm = load_arm(name)
        target = arm.forward(arm.home)
        for options in (SolveOptions(), SolveOptions(method='sdls', choice='all', null_space='posture')):
            solve(arm, target, options=options, trace=True)
            solve(arm, np.asfortranarray(target), arm.home.tolist(), options, reference=arm.home)
        solve_batch(arm, [target])
        arm.jacobian(arm.home)
        passes(arm.packed, SolveOptions().numbers, pose_matrix(0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0), arm.home)
print([str(event.data['dispatcher']) for _, event in compilations.buffer])
"""


def test_nothing_is_compiled_after_the_warm_up():
    assert in_a_new_process(AFTER_WARM_UP).splitlines()[-1] == '[]'


def types_of(*values):
    """The types by which Numba knows arrays."""
    return [numba.typeof(value) for value in values]


def test_an_entry_point_is_compiled_once_and_refuses_other_types():
    @compiled.entry_point(numba.types.float64, types_of(np.zeros(1), np.zeros((1, 1))))
    def corner(vector, matrix):
        return vector[0] + matrix[0, 0]

    assert corner.compiled.signatures == []
    for wrong in (np.zeros(1), np.zeros((1, 1), np.float32), np.zeros((2, 2)).T, [[0.0]]):
        with pytest.raises(TypeError):  # at the first call too
            corner(np.zeros(1), wrong)
    assert corner(np.array([1.0]), np.array([[2.0]])) == 3.0
    assert len(corner.compiled.signatures) == 1


@pytest.mark.parametrize('variable', ['NUMBA_CACHE_DIR', 'XDG_CACHE_HOME', 'HOME'])
def test_compiled_code_is_kept_where_the_environment_says(tmp_path, variable, monkeypatch):
    for name in ('NUMBA_CACHE_DIR', 'XDG_CACHE_HOME'):
        monkeypatch.delenv(name, raising=False)
    folder = Path(in_a_new_process(FOLDER, **{variable: str(tmp_path)}))
    below = tmp_path / '.cache' if variable == 'HOME' else tmp_path
    assert folder.parent == below / 'ros_ik_pkg'
    assert folder.is_dir()


def test_a_second_start_finds_what_the_first_compiled(tmp_path):
    first = in_a_new_process(SINE, NUMBA_CACHE_DIR=str(tmp_path))
    files = {path: path.stat().st_mtime_ns for path in tmp_path.rglob('*.nb*')}
    assert any('sincos' in path.name for path in files)
    assert in_a_new_process(SINE, NUMBA_CACHE_DIR=str(tmp_path)) == first
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob('*.nb*')} == files


def test_where_nothing_can_be_written_it_is_compiled_in_memory():
    assert in_a_new_process(SINE, NUMBA_CACHE_DIR='/dev/null/nowhere').endswith(')\nNone')


def test_comments_docstrings_places_and_looks_keep_the_cache_and_a_constant_does_not(tmp_path):
    path = tmp_path / 'a.py'

    def digest(text: str) -> str:
        path.write_text(text)
        return cache_folder.digest_of_sources([path])

    plain = digest('A = 1\n\ndef f():\n    return A\n')
    assert digest('"""Module."""\n# why\nA = 1\n\n\ndef f():\n    """Return A."""\n    return A\n') == plain
    drawn = "A = 1\nB = Method('m', Look('{}', dash={}), step={})\n"
    assert digest(drawn.format('#e69f00', '(0, (1, 1))', 1)) == digest(drawn.format('#000000', "'-'", 1))
    assert digest(drawn.format('#e69f00', '(0, (1, 1))', 1)) != digest(drawn.format('#e69f00', '(0, (1, 1))', 2))
    assert digest('A = 2\n\ndef f():\n    return A\n') != plain
    assert digest('A = 1\n\ndef f():\n    return -A\n') != plain


def test_the_cache_depends_on_files_with_compiled_code_and_what_they_import_alone():
    names = {path.name for path in cache_folder.sources_of_compiled_code()}
    assert {'search.py', 'methods.py', 'sincos.py', 'solution.py', 'compiled.py'} <= names
    assert not {'arm.py', 'urdf.py', 'solver.py', 'text.py'} & names


def test_the_name_of_the_folder_is_looked_up_until_a_source_changes(tmp_path, monkeypatch):
    path, known = tmp_path / 'a.py', tmp_path / 'names'
    path.write_text('A = 1\n')
    name = cache_folder.name_of_sources([path], known)
    assert name == cache_folder.digest_of_sources([path])
    path.write_text('A = 1  # why\n')
    assert cache_folder.name_of_sources([path], known) == name
    path.write_text('A = 2\n')
    other = cache_folder.name_of_sources([path], known)
    assert other == cache_folder.digest_of_sources([path]) != name
    notes = list(known.iterdir())
    assert len(notes) == 3
    monkeypatch.setattr(cache_folder, 'digest_of_sources', lambda paths: 'worked out')
    assert cache_folder.name_of_sources([path], known) == other
    for note in notes:
        note.write_text('broken')
    assert cache_folder.name_of_sources([path], known) == 'worked out'


def test_a_copy_of_the_package_elsewhere_finds_what_another_compiled(tmp_path):
    for place in ('here', 'there'):
        shutil.copytree(HOME / 'ros_ik_pkg', tmp_path / place / 'ros_ik_pkg')
    environment = {'NUMBA_CACHE_DIR': str(tmp_path / 'cache')}
    in_a_new_process(SINE, PYTHONPATH=str(tmp_path / 'here'), **environment)
    files = {path: path.stat().st_mtime_ns for path in tmp_path.rglob('*.nb*')}
    in_a_new_process(SINE, PYTHONPATH=str(tmp_path / 'there'), **environment)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob('*.nb*')} == files != {}


def test_the_cache_of_others_stays_where_it_was():
    program = 'import numba; numba.config.CACHE_DIR = "mine"; import ros_ik_pkg.ik; print(numba.config.CACHE_DIR)'
    assert in_a_new_process(program) == 'mine'


def test_compiled_functions_never_raise_on_a_division_by_zero():
    @compiled.kernel
    def inverse(x):
        return 1.0 / x

    assert inverse(0.0) == np.inf
    assert np.isnan(inverse(0.0) - inverse(0.0))


def test_kernels_cannot_allocate():
    @compiled.kernel
    def allocate(n):
        return np.empty(n)[0]

    with pytest.raises(numba.core.errors.NumbaError):
        allocate(3)


def test_where_the_disk_fills_while_compiling_the_code_lives_in_memory(tmp_path):
    program = (
        'import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))\n'  # room for the probe alone
        'from ros_ik_pkg.ik.kernel.sincos import sincos\n'
        'from ros_ik_pkg.ik.kernel.cache_folder import CACHE_FOLDER\n'
        'from ros_ik_pkg.ik.kernel.compiled import NOT_SAVED\n'
        'print(sincos(0.5)[0], bool(CACHE_FOLDER), len(NOT_SAVED))'
    )
    sine, kept, failures = in_a_new_process(program, NUMBA_CACHE_DIR=str(tmp_path)).split()
    assert float(sine) == pytest.approx(np.sin(0.5)) and kept == 'True' and int(failures) > 0


@pytest.mark.skipif(bool(WHY_PLAIN), reason='plain Numba compiles once for each constant')
def test_integer_constants_share_one_version_of_a_part():
    part = kernel(lambda values, k: values[k])
    first, second = np.arange(3.0), np.int64(2)
    whole = numba.njit(lambda values, k: part(values, 0) + part(values, 1) + part(values, k))
    assert whole(first, second) == 3.0
    assert len(part.overloads) == 1


class Usual(NamedTuple):
    value: float


class Other(NamedTuple):
    value: float


@kernel
def doubled(record):
    return 2.0 * record.value


@variant_of(doubled, Other)
def doubled_and_two_more(record):
    return doubled(Usual(record.value)) + 2.0


@variant_of(doubled, None)
def doubled_nothing(record):
    return -1.0


def test_a_variant_is_compiled_for_its_record_or_none_alone_and_callers_share_one_source():
    @kernel
    def caller(record):
        return doubled(record)

    @numba.njit
    def each(value):
        return caller(Usual(value)), caller(Other(value)), caller(None)

    assert each(3.0) == (6.0, 8.0, -1.0)
