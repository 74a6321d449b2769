"""The package is one package for ROS, for colcon and for pip."""

from __future__ import annotations

import ast
import configparser
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

import ros_ik_pkg
from ros_ik_pkg import programs

pytestmark = pytest.mark.once

NAME = 'ros_ik_pkg'
ROOT = Path(__file__).resolve().parents[2]
NOT_SHIPPED = ('.git', '.venv*', '.*_cache', '.hypothesis', 'build', 'install', 'log', '__pycache__')

# What is imported -> the rosdep key that brings it.
ROSDEP_KEYS = {
    'numpy': 'python3-numpy',
    'numba': 'python3-numba',
    'llvmlite': 'python3-numba',  # which is made of it
    'yaml': 'python3-yaml',
}
USED_IF_THERE = {'ament_index_python', 'tf2_ros', 'xacro'}


@pytest.fixture(scope='module')
def manifest() -> ElementTree.Element:
    return ElementTree.parse(ROOT / 'package.xml').getroot()


@pytest.fixture(scope='module')
def setup_call() -> dict[str, ast.expr]:
    """Keyword arguments of setup() in setup.py."""
    return keywords_of('setup', ROOT / 'setup.py')


def keywords_of(function: str, path: Path) -> dict[str, ast.expr]:
    """Return the keyword arguments of the only call of a function in a file."""
    calls = (node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call))
    (call,) = (call for call in calls if getattr(call.func, 'id', None) == function)
    return {keyword.arg: keyword.value for keyword in call.keywords}


def text_of(manifest: ElementTree.Element, tag: str) -> list[str]:
    return [element.text for element in manifest.iter(tag)]


def imported_libraries() -> set[str]:
    """Return the top-level names that any module of the package imports, its own and Python's left out."""
    names = set()
    for path in (ROOT / NAME).rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names |= {alias.name.split('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                names.add(node.module.split('.')[0])
    return names - set(sys.stdlib_module_names) - {NAME}


def entry_points() -> dict[str, str]:
    """Return what setup.py declares as console scripts: name -> module:function."""
    found = re.findall(r"f'(\w+) = \{NAME\}\.([\w.]+:\w+)'", (ROOT / 'setup.py').read_text())
    return dict(found)


def test_manifest_is_of_an_ament_python_package(manifest):
    assert manifest.get('format') == '3'
    assert text_of(manifest, 'name') == [NAME]
    assert text_of(manifest, 'build_type') == ['ament_python']
    assert text_of(manifest, 'license') == ['Apache-2.0']


def test_manifest_has_a_maintainer_address_that_colcon_accepts_and_nobody_owns(manifest):
    address = manifest.find('maintainer').get('email')
    assert address.endswith('.invalid')
    assert re.fullmatch(r'[\w.+-]+@[\w-]+(\.[\w-]+)*\.[a-zA-Z]{2,}', address)


def test_version_is_stated_once_and_read_from_there(manifest, setup_call):
    (version,) = text_of(manifest, 'version')
    assert ast.unparse(setup_call['version']) == "MANIFEST.findtext('version')"
    assert ros_ik_pkg.__version__ == version
    assert re.search(r'^(\d+\.\d+\.\d+) ', (ROOT / 'CHANGELOG.rst').read_text(), re.M)[1] == version
    citation = yaml.safe_load((ROOT / 'CITATION.cff').read_text())
    assert (citation['version'], citation['license']) == (version, *text_of(manifest, 'license'))


def test_types_are_shipped(setup_call):
    assert (ROOT / NAME / 'py.typed').is_file()
    assert ast.unparse(setup_call['package_data']) == "{NAME: ['py.typed']}"


def test_setup_has_no_address_of_its_own(setup_call):
    assert not {'author_email', 'maintainer_email'} & set(setup_call)


def test_manifest_depends_on_every_library_that_is_imported(manifest):
    extras = requirements('plot') | requirements('panel') | requirements('servo')
    libraries = imported_libraries() - USED_IF_THERE - extras
    assert {ROSDEP_KEYS.get(name, name) for name in libraries} <= set(text_of(manifest, 'exec_depend'))


def test_pip_requirements_name_every_library_outside_ros():
    assert requirements() == {'numba', 'numpy', 'pin', 'PyYAML'}


def requirements(extra: str = '') -> set[str]:
    """Return the names in a list of setup.cfg: of the package itself, or of one of its extras."""
    config = configparser.ConfigParser()
    config.read(ROOT / 'setup.cfg')
    listed = config['options.extras_require'][extra] if extra else config['options']['install_requires']
    return set(re.findall(r'^(\w+)', listed, re.MULTILINE))


@pytest.mark.parametrize('name', entry_points())
def test_console_script_leads_to_a_function(name):
    module, function = entry_points()[name].split(':')
    tree = ast.parse((ROOT / NAME / (module.replace('.', '/') + '.py')).read_text())
    assert function in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_a_program_that_needs_ros_names_it_where_it_is_missing(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'ros_ik_pkg.ros', None)
    assert programs.ik_node() == 1
    assert 'ros_ik_pkg.ros' in capsys.readouterr().err


@pytest.mark.parametrize('name', [name for name, place in entry_points().items() if place.startswith('programs:')])
def test_a_program_that_needs_ros_leads_to_the_main_of_a_module(name, monkeypatch):
    modules = []
    monkeypatch.setattr(programs, '_run', lambda module: modules.append(module) or 0)
    assert getattr(programs, name)() == 0
    tree = ast.parse((ROOT / NAME / (modules[0].replace('.', '/') + '.py')).read_text())
    assert 'main' in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert modules[0].split('.')[1] in {name, f'{name}_node'}


def test_every_folder_with_code_is_a_package():
    assert all((path.parent / '__init__.py').is_file() for path in (ROOT / NAME).rglob('*.py'))


@pytest.fixture(scope='module')
def workspace(tmp_path_factory) -> Path:
    """A colcon workspace with a copy of this package, built."""
    path = tmp_path_factory.mktemp('workspace')
    shutil.copytree(ROOT, path / 'src' / NAME, ignore=shutil.ignore_patterns(*NOT_SHIPPED))
    assert '(ros.ament_python)' in colcon(path, 'list')
    output = colcon(path, 'build')
    assert 'warning' not in output.lower(), output
    return path


def colcon(workspace: Path, *arguments: str) -> str:
    command = [str(Path(sys.executable).with_name('colcon')), '--log-base', 'log', *arguments]
    environment = {**os.environ, 'PATH': f'{Path(sys.executable).parent}:{os.environ["PATH"]}'}
    environment.pop('PYTHONDONTWRITEBYTECODE', None)
    done = subprocess.run(command, cwd=workspace, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def in_workspace(workspace: Path, command: str) -> str:
    """Run a command in a shell that has sourced the workspace, away from this repository."""
    environment = {key: value for key, value in os.environ.items() if key != 'PYTHONPATH'}
    sourced = ['bash', '-c', f'. install/setup.bash && {command}']
    return subprocess.check_output(sourced, cwd=workspace, env=environment, text=True)


@pytest.mark.workspace
def test_colcon_installs_what_ros2_run_looks_for(workspace):
    executables = workspace / 'install' / NAME / 'lib' / NAME
    assert {path.name for path in executables.iterdir()} == set(entry_points())
    assert 'VALUE' in in_workspace(workspace, f'install/{NAME}/lib/{NAME}/set_param --help')


@pytest.mark.workspace
def test_the_built_package_loads_a_robot_from_its_own_share(workspace):
    code = f'from {NAME}.share import share_path; from {NAME}.ik import load_arm; '
    code += 'print(share_path(), load_arm("panda").n)'
    share, joints = in_workspace(workspace, f"{sys.executable} -c '{code}'").split()
    assert Path(share) == workspace / 'install' / NAME / 'share' / NAME
    assert joints == '7'


@pytest.mark.workspace
def test_colcon_test_runs_pytest(workspace):
    colcon(workspace, 'test', '--pytest-args', '-k', 'import_rule or manifest')
    assert '0 errors, 0 failures' in colcon(workspace, 'test-result', '--all')


@pytest.mark.workspace
def test_pip_installs_the_robots_beside_the_code(tmp_path):
    source = tmp_path / 'source'
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns(*NOT_SHIPPED))
    pip = [sys.executable, '-m', 'pip', 'install', '--quiet', '--no-deps', '--no-build-isolation']
    subprocess.run([*pip, '--target', str(tmp_path / 'site'), str(source)], check=True)
    code = f'import {NAME}; from {NAME}.ik import load_arm; print({NAME}.__file__, load_arm("ur5").n)'
    environment = {**os.environ, 'PYTHONPATH': str(tmp_path / 'site')}
    shown = subprocess.check_output([sys.executable, '-c', code], cwd=tmp_path, env=environment, text=True)
    assert shown.split() == [str(tmp_path / 'site' / NAME / '__init__.py'), '6']
