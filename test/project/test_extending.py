"""docs/extending.md: its changes, applied to a copy of the package; and that its tests notice what is left out."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from textwrap import indent

import pytest
from test_docs import blocks

from torture.mutants import copy_package

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / 'docs' / 'extending.md'
NAME = 'sugihara'
EVERYWHERE = f"""
import sys

import pytest
from matplotlib.colors import to_hex
from ros_ik_pkg.compare import compare_methods
from ros_ik_pkg.compare.palette import COLOURS
from ros_ik_pkg.compare.plots import draw
from ros_ik_pkg.compare.problem import make_problem
from ros_ik_pkg.ik import METHODS, OptionError, SolveOptions, load_arm
from ros_ik_pkg.panel.markup.style import STYLE
from ros_ik_pkg.panel.markup.texts import Texts
from ros_ik_pkg.ros.interface.parameters import PARAMETERS

sys.path.insert(0, 'test')
from launch_stand_in import show_args

assert METHODS[-1] == {NAME!r} and len(METHODS) == 6
assert SolveOptions(method={NAME!r}, sugihara_bias=0.5).sugihara_bias == 0.5
try:
    SolveOptions(sugihara_bias=-1.0)
except OptionError as error:
    assert str(error).startswith('sugihara.bias = -1.0')
else:
    raise AssertionError('a bias below 0 is taken')
assert PARAMETERS['sugihara.bias'].default == 1e-3
assert {NAME!r} in PARAMETERS['method'].allowed and {NAME!r} in PARAMETERS['compare'].allowed
with pytest.MonkeyPatch.context() as patch:
    arguments = show_args(patch, 'ik.launch.py')
assert arguments['method'].choices == ['', *METHODS] and {NAME!r} in arguments['compare'].description
assert '--{NAME}: #d55e00' in STYLE and '--{NAME}: #ff8a3d' in STYLE
assert Texts('en').title(6).startswith('6 methods')
problem = make_problem(load_arm('puma560'), None, None)
runs = compare_methods(problem.arm, problem.target, problem.seed)
assert runs[-1].method == {NAME!r} and runs[-1].status.label == 'converged'
(line,) = (line for line in draw(problem, runs).axes[0].lines if line.get_label() == {NAME!r})
assert to_hex(line.get_color()) == COLOURS[{NAME!r}] == '#d55e00'
"""

pytestmark = pytest.mark.once


@pytest.fixture(scope='module')
def copy(tmp_path_factory) -> Path:
    """A copy of the package with the changes of the page."""
    folder = tmp_path_factory.mktemp('extended')
    copy_package(folder)
    changes = blocks(PAGE.read_text(), 'diff')
    assert len(changes) == 2  # a method is added in two files
    for change in changes:
        subprocess.run(['git', 'apply'], cwd=folder, input=change, text=True, check=True)
    return folder


def run(folder: Path, *arguments: str) -> str:
    """Run Python on the copy and return what it prints."""
    command = [sys.executable, *arguments]
    environment = os.environ | {'PYTHONPATH': os.pathsep.join([str(folder), os.environ.get('PYTHONPATH', '')])}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=1800)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
    return done.stdout


@pytest.mark.workspace  # compiles for a minute
def test_a_method_that_was_added_as_the_page_says_is_everywhere_and_holds_to_the_contract(copy):
    everywhere = copy / 'test' / 'test_everywhere.py'  # in one process with the contract, which compiles once
    everywhere.write_text(f'def test_{NAME}_is_everywhere():\n{indent(EVERYWHERE, "    ")}')
    suites = 'test/ik/step/test_methods.py', 'test/ik/step/test_step_rules.py', 'test/compare/test_iterate.py'
    done = run(copy, '-m', 'pytest', '-rA', '-p', 'no:cacheprovider', '-k', NAME, str(everywhere), *suites).splitlines()
    assert f'PASSED test/test_everywhere.py::test_{NAME}_is_everywhere' in done
    assert int(done[-1].split(' passed')[0].split()[-1]) > 50 and 'failed' not in done[-1]


def test_documents_made_again_as_the_page_says_have_the_options_of_the_added_method(copy):
    for name, file in (('parameters.md', 'docs/parameters.md'), ('ik_node.yaml', 'config/ik_node.yaml')):
        (command,) = (line for line in blocks(PAGE.read_text(), 'bash')[0].splitlines() if f' {name} >' in line)
        python, *arguments, sign, place = command.split()
        assert (python, sign, place) == ('python', '>', file)
        (copy / file).write_text(run(copy, *arguments))
        assert 'sugihara.bias' in (copy / file).read_text()
    run(copy, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', 'test/ros/interface/test_parameters.py')


# What is declared and nothing more, and the tests that the page names for the places that are missing then.
DECLARED = {
    'stop reason': (
        'ros_ik_pkg/ik/solution.py', r'(    COLLISION = (\d+)\n)', '\\1    TRIED = 999\n',
        (
            'ik/test_solution.py::test_the_statuses_are_numbered_as_ever',
            'ik/test_solution.py::test_every_status_has_a_sentence_of_its_own',
            'panel/test_panel_parts.py::test_in_polish_the_node_s_answer_is_told_by_its_status',
            'compare/test_compare.py::test_every_stop_reason_is_described_in_the_other_language_too[tried]',
            'project/test_docs.py::test_the_reasons_for_a_failure_are_those_of_status',
            'project/test_docs.py::test_the_statuses_that_the_tutorial_explains_are_those_of_the_solver',
        ),
    ),
    'output topic': (
        'ros_ik_pkg/ros/interface/topics.py', r'(TOPICS = \(\n)',
        "\\1    Topic('~/tried', String, 'out', 'nothing'),\n",
        (
            'ros/interface/test_topics.py::test_the_documented_topics_are_those_of_the_table',
            'ros/test_security.py::test_the_policy_names_the_topics_of_the_table_and_those_that_every_node_has',
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize('what', DECLARED)
def test_each_place_that_lacks_what_was_declared_is_noticed_by_a_test_of_the_page(what, tmp_path):
    file, place, addition, tests = DECLARED[what]
    section = PAGE.read_text().partition(f'## Add a{"n" * (what[0] in "aeiou")} {what}')[2].partition('\n## ')[0]
    assert all(f'test/{test.partition("::")[0]}' in section for test in tests)
    copy_package(tmp_path)
    path = tmp_path / file
    text, count = re.subn(place, addition, path.read_text())
    assert count == 1
    path.write_text(text)
    for name in ('README.md', 'CHANGELOG.rst', 'CONTRIBUTING.md'):
        shutil.copy(ROOT / name, tmp_path)
    shutil.copytree(ROOT / 'scripts', tmp_path / 'scripts')
    command = [sys.executable, '-m', 'pytest', '-q', '--tb=no', '-p', 'no:cacheprovider', *(f'test/{t}' for t in tests)]
    paths = os.pathsep.join([str(tmp_path), os.environ.get('PYTHONPATH', '')])
    done = subprocess.run(
        command, cwd=tmp_path, env=os.environ | {'PYTHONPATH': paths}, capture_output=True, text=True, timeout=1800
    )
    assert done.stdout.splitlines()[-1].startswith(f'{len(tests)} failed in'), done.stdout
