"""What contributors and continuous integration run is the same, and the files that say so can be read."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from conftest import LONG

pytestmark = pytest.mark.once

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = ROOT / '.github' / 'workflows'


def commands(workflow: str) -> str:
    (job,) = yaml.safe_load((WORKFLOWS / workflow).read_text())['jobs'].values()
    return '\n'.join(step.get('run', '') for step in job['steps'])


def test_the_commit_hook_runs_the_linters_of_the_test_script():
    (source,) = yaml.safe_load((ROOT / '.pre-commit-config.yaml').read_text())['repos']
    assert [hook['entry'] for hook in source['hooks']] == ['scripts/test --lint']
    before, _, _ = (ROOT / 'scripts' / 'test').read_text().partition('[[ $lint_only ]] && exit')
    assert '-m ruff check' in before and '-m mypy' in before and '-m pytest' not in before


def test_continuous_integration_runs_what_a_contributor_can_run():
    assert commands('ci.yml').splitlines()[-1] == '.ci/run'
    for script in ('.ci/run', 'scripts/docs', 'scripts/test'):
        assert os.access(ROOT / script, os.X_OK)


def test_the_files_whose_tests_begin_first_are_there():
    assert len(LONG) > 5 and [name for name in LONG if not (ROOT / 'test' / f'{name}.py').is_file()] == []


def test_everything_includes_the_api_reference_with_warnings_as_errors():
    assert 'scripts/docs' in (ROOT / 'scripts' / 'test').read_text().partition('if [[ $all ]]')[2]
    assert 'sphinx -W' in (ROOT / 'scripts' / 'docs').read_text()


def test_everything_includes_the_node_on_kilted():
    assert 'ROS_IK_DISTRO=kilted other' in (ROOT / 'scripts' / 'test').read_text().partition('if [[ $all ]]')[2]


def test_the_workflow_with_a_full_jazzy_says_that_it_has_not_been_run():
    text = (WORKFLOWS / 'jazzy.yml').read_text()
    assert 'not been run' in text
    assert list(yaml.load(text, yaml.BaseLoader)['on'].split()) == ['workflow_dispatch']


def test_the_workflow_with_a_full_jazzy_builds_as_the_documents_say():
    documented = (ROOT / 'docs' / 'install.md').read_text()
    built = commands('jazzy.yml')
    for start in ('rosdep install', 'python3 -m venv', 'pip install', 'python3 -m colcon build'):
        (line,) = [line for line in built.splitlines() if line.startswith(start)]
        assert line in documented


@pytest.mark.parametrize('path', sorted((ROOT / '.github' / 'ISSUE_TEMPLATE').glob('*.md')), ids=lambda path: path.name)
def test_an_issue_template_has_a_name_and_a_purpose(path):
    _, header, body = path.read_text().split('---\n', 2)
    assert {'name', 'about'} <= set(yaml.safe_load(header)) and body.strip()


def test_every_file_is_under_the_licence_of_the_package():
    (every_file,) = tomllib.loads((ROOT / 'REUSE.toml').read_text())['annotations']
    name = ElementTree.parse(ROOT / 'package.xml').findtext('license')
    assert (every_file['path'], every_file['SPDX-License-Identifier']) == ('**', name)
    assert (ROOT / 'LICENSES' / f'{name}.txt').read_text() == (ROOT / 'LICENSE').read_text()
