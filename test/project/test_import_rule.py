"""The design's rule: imports point down only, and each heavy library has its place."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = 'ros_ik_pkg'
ROOT = Path(__file__).resolve().parents[2]
MODULES = sorted((ROOT / PACKAGE).rglob('*.py'))

# Part of the package -> the parts that it may import. `share` is where the package's files are,
# `methods` the table of methods.
BELOW = {
    'share': set(),
    'methods': set(),
    'ik': {'share', 'methods'},
    'adapters': {'ik'},
    'compare': {'ik', 'share', 'methods'},
    'ros': {'ik', 'compare', 'share', 'methods'},
    'panel': {'ros', 'compare', 'ik', 'share', 'methods'},
    'tools': {'ros', 'compare', 'ik', 'share', 'methods'},
    'programs': {'ros', 'panel', 'tools'},
}
WITHOUT_ROS = {'share', 'methods', 'ik', 'adapters', 'compare'}
ROS_LIBRARIES = {'rclpy', 'rcl_interfaces', 'tf2_ros'}
READERS = {'pinocchio', 'coal', 'hppfcl', 'yaml', 'xml'}
MODEL_FILES = {
    'ik/arm.py',
    *(f'ik/contacts/{name}.py' for name in ('contacts', 'judge', 'srdf', 'coal_library', 'obstacles_file')),
    *(f'ik/model/{name}.py' for name in (
        'pinocchio_model', 'dh', 'urdf', 'urdf_spelling', 'joint_limits', 'collision_elements', 'xml_values')),
}  # fmt: skip
COMPILER_INSIDES = ('llvmlite', 'numba.core', 'numba.extending', 'numba.np')

# The rooms of `ik/` and `ros/`, and single files beside them, from the bottom up: each imports from rooms above it in
# this list alone.
ROOMS = {
    'ik': (
        'exceptions', 'text', 'solution', 'task_rows', 'kernel', 'motion', 'kinematics', 'branches', 'collision',
        'step', 'descent', 'search', 'batch', 'model', 'world', 'contacts', 'options', 'arm', 'loading', 'arm_tree',
        'ordered_solver', 'touching', 'solver', 'batch_solver', 'tip_solver', 'path', 'reachability', 'compilation',
        '__init__',
    ),
    'ros': (
        'interface', 'runtime', 'input', 'handling', 'servo', 'output', 'reply', 'client', 'node', 'ik_node',
        '__init__',
    ),
}  # fmt: skip

# What a method imports from above when it is called, so that users find it on the object: `arm.reach()`
LATE = {'ik/arm.py': {'reachability'}}


def part_of(path: Path) -> str:
    """Return 'ik' for ros_ik_pkg/ik/steps.py and 'share' for ros_ik_pkg/share.py."""
    return path.relative_to(ROOT / PACKAGE).parts[0].removesuffix('.py')


def imports(path: Path) -> set[str]:
    """Return the full names of what a file imports anywhere in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}: relative import in line {node.lineno}'
            names |= {f'{node.module}.{alias.name}' for alias in node.names}
    return names


def room_of(names: tuple[str, ...]) -> str:
    """Return 'step' for ('step', 'methods.py') and 'arm' for ('arm.py',)."""
    return names[0].removesuffix('.py')


def libraries(path: Path) -> set[str]:
    """Return the top-level names of what a file imports."""
    return {name.split('.')[0] for name in imports(path)}


def parts_used(path: Path) -> set[str]:
    """Return the parts of the package that a file imports, its own left out."""
    own = (name.split('.') for name in imports(path) if name.startswith(f'{PACKAGE}.'))
    return {names[1] for names in own} - {part_of(path)}


@pytest.fixture(params=MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def module(request) -> Path:
    return request.param


def test_imports_within_the_package_point_down_only(module):
    part = part_of(module)
    if part != '__init__':
        assert parts_used(module) <= BELOW[part]


def test_ros_stays_out_of_the_numerics_and_the_comparison(module):
    if part_of(module) in WITHOUT_ROS:
        assert not libraries(module) & ROS_LIBRARIES


def test_model_readers_are_used_in_the_model_files_alone(module):
    if part_of(module) == 'ik' and str(module.relative_to(ROOT / PACKAGE)) not in MODEL_FILES:
        assert not libraries(module) & READERS


@pytest.mark.parametrize('part', ROOMS)
def test_rooms_import_from_rooms_below_them_alone(part):
    rooms = ROOMS[part]
    for path in sorted((ROOT / PACKAGE / part).rglob('*.py')):
        own = room_of(path.relative_to(ROOT / PACKAGE / part).parts)
        used = {name.split('.')[2] for name in imports(path) if name.startswith(f'{PACKAGE}.{part}.')} & set(rooms)
        above = {room for room in used if rooms.index(room) > rooms.index(own)}
        late = LATE.get(str(path.relative_to(ROOT / PACKAGE)), set())
        assert above == late, f'{path} is in {own} and imports from {above}'


@pytest.mark.parametrize(('file', 'rooms'), LATE.items())
def test_what_is_imported_late_is_not_loaded_with_the_file(file, rooms):
    module = f'{PACKAGE}.{file.removesuffix(".py").replace("/", ".")}'
    spy = (
        'import sys, types; package = types.ModuleType("ros_ik_pkg.ik"); '
        f'package.__path__ = [{str(ROOT / PACKAGE / "ik")!r}]; sys.modules["ros_ik_pkg.ik"] = package; '
        f'import {module}; print(*sys.modules)'
    )
    loaded = subprocess.run([sys.executable, '-c', spy], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert module in loaded.split()
    assert not [name for name in loaded.split() for room in rooms if name.startswith(f'{PACKAGE}.ik.{room}')]


@pytest.mark.parametrize('part', ROOMS)
def test_every_room_has_its_place_in_the_order(part):
    found = {room_of(path.relative_to(ROOT / PACKAGE / part).parts) for path in (ROOT / PACKAGE / part).rglob('*.py')}
    assert found == set(ROOMS[part])


def test_the_insides_of_the_compiler_are_known_in_the_kernel_alone(module):
    if part_of(module) == 'ik' and module.parent.name != 'kernel':
        assert not [name for name in imports(module) if name.startswith(COMPILER_INSIDES)]


def test_nothing_imports_scipy(module):
    assert 'scipy' not in libraries(module)


def test_the_rule_sees_imports_inside_functions(tmp_path):
    path = tmp_path / 'late.py'
    path.write_text('def f():\n    import scipy.linalg\n')
    assert libraries(path) == {'scipy'}
