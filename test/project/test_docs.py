"""What README.md and docs/ say is so: commands, tables, links and examples."""

from __future__ import annotations

import configparser
import re
import shlex
import subprocess
from functools import cache
from pathlib import Path

import pytest
import yaml
from geometry_msgs.msg import PoseStamped
from launch_stand_in import ros2_launch

from bench.published_robots import ROBOTS
from ros_ik_pkg.ik import METHODS, OPTIONS, SolveOptions, Status, load_arm, solve
from ros_ik_pkg.ros.input.pose import target_pose
from ros_ik_pkg.ros.input.target import Target
from ros_ik_pkg.ros.interface.parameters import PARAMETERS
from ros_ik_pkg.ros.interface.topics import NODE_NAME, TOPICS
from ros_ik_pkg.tools import send_target

pytestmark = pytest.mark.once

ROOT = Path(__file__).resolve().parents[2]
CALM = SolveOptions(deadline=0.0)  # a busy machine may leave no time for a solve
DOCUMENTS = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *sorted((ROOT / 'docs').rglob('*.md'))]
TUTORIALS = sorted((ROOT / 'docs' / 'tutorials').glob('*.md'))
TEXT = {path.name: path.read_text() for path in DOCUMENTS}
EVERYTHING = '\n'.join(TEXT.values())
FENCE = re.compile(r'^```(\w+)\n(.*?)^```', re.M | re.S)
MOST_LINES_OF_README = 100


def blocks(text: str, language: str) -> list[str]:
    """Return the fenced blocks of a text in one language."""
    return [block for name, block in FENCE.findall(text) if re.fullmatch(language, name)]


def commands(document: str) -> list[list[str]]:
    """Return every line of an indented or fenced block, and every inline code, that calls a script of ours."""
    lines = re.findall(r'^(?: {4})?(scripts/\w.*)$', document, re.M) + re.findall(r'`(scripts/\w[^`]*)`', document)
    return [shlex.split(line, comments=True) for line in lines]


def shell_lines() -> list[list[str]]:
    """Return the lines of all shell blocks, in words."""
    lines = '\n'.join(blocks(EVERYTHING, 'bash')).splitlines()
    return [shlex.split(line, comments=True) for line in lines]


def ros2(*verb: str) -> list[list[str]]:
    """Return the arguments of the ros2 commands with a verb; there must be some."""
    starts = ('ros2', *verb)
    found = [words[len(starts) :] for words in shell_lines() if tuple(words[: len(starts)]) == starts]
    assert found, f'no document has a command {" ".join(starts)}'
    return found


def table(document: str, heading: str) -> list[list[str]]:
    """Return the cells of the table below a heading of a document."""
    section = TEXT[document].split(f'## {heading}\n')[1].split('\n## ')[0]
    rows = [line for line in section.splitlines() if line.startswith('|')][2:]
    return [[cell.strip() for cell in row.strip('|').split('|')] for row in rows]


def anchor(heading: str) -> str:
    """Return the anchor that GitHub gives a heading."""
    return re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-')


def links() -> list[tuple[Path, str]]:
    """Return the links and pictures of all documents that lead to files of the repository."""
    found = ((path, link) for path in DOCUMENTS for link in re.findall(r'\]\(([^)\s]+)\)', path.read_text()))
    return [(path, link) for path, link in found if '://' not in link]


@pytest.mark.parametrize(('document', 'link'), links(), ids=lambda value: str(getattr(value, 'name', value)))
def test_a_link_leads_somewhere(document, link):
    name, _, place = link.partition('#')
    target = (document.parent / name).resolve() if name else document
    assert target.exists()
    if place:
        assert place in map(anchor, re.findall(r'^#+ (.*)$', target.read_text(), re.M))


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda path: path.name)
def test_a_script_that_is_named_exists_and_takes_the_options_that_are_shown(document):
    for script, *words in commands(document.read_text()):
        given = {word.partition('=')[0] for word in words if re.match(r'--[a-z]', word)}
        assert given <= options_of(script), f'{script} {words}'


@cache
def options_of(script: str) -> set[str]:
    """Return the options that the help of a script shows, and --help itself."""
    shown = subprocess.check_output([ROOT / script, '--help'], text=True)
    return set(re.findall(r'--[a-z-]+', shown)) | {'--help'}


def test_every_script_is_documented():
    scripts = {path.name for path in (ROOT / 'scripts').iterdir() if not path.name.startswith('_')}
    assert {f'scripts/{name}' for name in scripts} <= {words[0] for words in commands(EVERYTHING)}


def test_the_readme_is_short_and_leads_to_every_document():
    readme = TEXT['README.md']
    assert len(readme.splitlines()) <= MOST_LINES_OF_README
    linked = {(ROOT / link.partition('#')[0]).resolve() for link in re.findall(r'\]\(([^)\s]+)\)', readme)}
    assert set(DOCUMENTS) - linked == {ROOT / 'README.md'}


def test_parameters_that_are_set_by_script_exist_and_are_allowed_but_for_the_nonsense():
    settings = [words[1:] for words in commands(EVERYTHING) if words[0] == 'scripts/set_param' and len(words) > 1]
    assert ['method', 'nonsense'] in settings
    for name, value in settings:
        if value != 'nonsense':
            PARAMETERS[name].check(yaml.safe_load(value))


def test_the_table_of_topics_is_that_of_the_interface():
    kinds = {topic: topic.type.__module__.split('.')[0] for topic in TOPICS}
    expected = [
        [f'`{topic.name}`', f'{kinds[topic]}/{topic.type.__name__}', topic.direction, topic.text] for topic in TOPICS
    ]
    assert table('usage.md', 'Topics') == expected


def test_the_parameters_in_the_table_have_the_default_and_the_text_of_their_declaration():
    reference = (ROOT / 'docs' / 'parameters.md').read_text()
    for name, default, text in table('usage.md', 'Parameters'):
        row = rf'^\| {re.escape(name)} \| {re.escape(default)} \| .* \| {re.escape(text)} \|$'
        assert re.search(row, reference, re.M)


def test_the_robots_that_are_named_are_the_shipped_ones():
    sentence = TEXT['usage.md'].split('Shipped robots: ')[1].split('.')[0]
    assert set(re.findall(r'`(\w+)`', sentence)) == {path.stem for path in (ROOT / 'config/robots').iterdir()}


def test_the_table_of_methods_has_each_of_them_in_order():
    assert [row[0].strip('`') for row in table('README.md', 'The methods')] == list(METHODS)


def test_the_reasons_for_a_failure_are_those_of_status():
    sentence = TEXT['python.md'].split('The reasons are ')[1].split('.')[0]
    assert re.findall(r'`(\w+)`', sentence) == [status.label for status in Status if status is not Status.CONVERGED]
    explained = re.findall(r'`(\w+)`', '\n'.join(re.findall(r'^\| (`.*?) \|', section('Why a descent stops'), re.M)))
    assert set(explained) == {status.label for status in Status}


def section(heading: str) -> str:
    """Return a section of the derivation."""
    return (ROOT / 'docs' / 'derivation.md').read_text().split(f'## {heading}\n')[1].split('\n## ')[0]


def published_targets() -> list[tuple[str, dict]]:
    """Return the targets that the shell blocks publish, each with the robot that its block or document launches."""
    found = []
    for name, text in TEXT.items():
        of_document = 'ur5' if name.startswith('ur5') else PARAMETERS['robot'].default
        for block in blocks(text, 'bash'):
            robot = (re.findall(r'\brobot:=(\w+)', block) or [of_document])[-1]
            for line in block.splitlines():
                if line.startswith('ros2 topic pub'):
                    *_, topic, kind, message = shlex.split(line, comments=True)
                    assert (topic, kind) == ('/target_pose', 'geometry_msgs/msg/PoseStamped')
                    found.append((robot, yaml.safe_load(message)))
    assert {'so101', 'ur5', PARAMETERS['robot'].default} <= {robot for robot, _ in found}
    assert len(found) >= 4
    return found


@pytest.mark.parametrize(('robot', 'given'), published_targets())
def test_a_target_that_ros2_publishes_is_solved_from_home(robot, given):
    message = PoseStamped()
    for part in ('position', 'orientation'):
        for axis, value in given['pose'][part].items():
            setattr(getattr(message.pose, part), axis, value)
    pose, notes = target_pose(Target.of(message))
    arm = load_arm(robot)
    assert given['header']['frame_id'] in (arm.base_frame, 'base_link')  # base_link of ur_description is base, turned
    assert solve(arm, pose, options=CALM).converged
    assert notes == ()


def test_the_target_that_is_sent_by_script_is_solved_and_the_far_one_is_not():
    arm = load_arm(PARAMETERS['robot'].default)
    sent = [words[1:] for words in commands(TEXT['usage.md']) if words[0] == 'scripts/send_target']
    poses = [send_target.given_pose(send_target.arguments().parse_args(words)) for words in sent]
    statuses = [solve(arm, pose, options=CALM).status for pose in poses]
    assert statuses == [Status.CONVERGED, Status.UNREACHABLE]


def test_parameters_that_ros2_sets_exist_and_are_allowed():
    for node, name, value in ros2('param', 'set'):
        assert node == f'/{NODE_NAME}'
        PARAMETERS[name].check(yaml.safe_load(value))
    for node, name in ros2('param', 'describe'):
        assert node == f'/{NODE_NAME}'
        assert name in PARAMETERS


def test_topics_that_ros2_echoes_are_published():
    published = {topic.name.replace('~', f'/{NODE_NAME}') for topic in TOPICS if topic.direction == 'out'}
    echoed = {words[-1] for words in ros2('topic', 'echo')}
    assert {name for name in echoed if name.startswith(f'/{NODE_NAME}')} <= published
    assert echoed - published <= {'/joint_states'}


def test_launch_commands_are_accepted_by_the_launch_files(monkeypatch, tmp_path):
    for package, file, *words in ros2('launch'):
        if package == 'ros_ik_pkg':
            for word in words:
                if word.startswith('params_file:='):
                    monkeypatch.chdir(tmp_path)
                    Path(word.partition(':=')[2]).touch()
            assert '--show-args' in words or ros2_launch(monkeypatch, file, shlex.join(words))


def test_what_pip_installs_is_what_the_package_requires():
    config = configparser.ConfigParser()
    config.read(ROOT / 'setup.cfg')
    required = {*config['options']['install_requires'].split(), 'numpy<2'}
    panel = {re.match(r'[\w-]+', line)[0] for line in config['options.extras_require']['panel'].split()}
    package, extra = [set(words[2:]) for words in shell_lines() if words[:2] == ['pip', 'install']]
    assert package <= required
    assert {'numba', 'pin'} <= {re.match(r'\w+', word)[0] for word in package}
    assert extra == panel


def test_files_in_shell_commands_are_there():
    files = re.findall(r'src/ros_ik_pkg/(\S+)', '\n'.join(blocks(EVERYTHING, 'bash')))
    assert files
    assert [name for name in files if not (ROOT / name).exists()] == []


def run_examples(document: Path, monkeypatch) -> dict:
    """Run the Python blocks of a document one after the other, without deadlines; return the names that they leave."""
    names: dict = {}
    monkeypatch.setattr('ros_ik_pkg.ik.solver.DEFAULT_OPTIONS', CALM)
    for block in blocks(document.read_text(), 'python'):
        block = re.sub(r'deadline=0\.0(, )?', '', block).replace('SolveOptions(', 'SolveOptions(deadline=0.0, ')
        exec(compile(block, document.name, 'exec'), names)
    return names


def test_the_example_of_the_readme_runs_and_is_five_lines(monkeypatch, capsys):
    assert run_examples(ROOT / 'README.md', monkeypatch)['solution'].converged
    (block,) = blocks(TEXT['README.md'], 'python')
    assert len([line for line in block.splitlines() if line]) == 5
    assert capsys.readouterr().out.startswith('True')


def test_examples_in_python_run_and_do_what_their_text_says(monkeypatch):
    names = run_examples(ROOT / 'docs' / 'python.md', monkeypatch)
    assert names['solution'].converged
    assert names['nearest'].converged
    assert names['careful'].joint_distance <= 1.0
    assert names['branches'].shape[1] == 6
    assert names['failed'].status is Status.UNREACHABLE
    assert names['failed'].status.text.startswith('out of reach')
    assert names['trace'].joint_positions.shape == (len(names['trace']), 7)
    assert names['batch'].converged.all()


@pytest.fixture
def tutorial(monkeypatch, tmp_path, capsys):
    """A function that saves the files of a tutorial under the names that it says, runs it, and returns its output."""

    def run(name: str) -> str:
        document = ROOT / 'docs' / 'tutorials' / name
        text = document.read_text()
        monkeypatch.chdir(tmp_path)
        for file, content in zip(re.findall(r'`(\w+\.(?:yaml|urdf))`', text), blocks(text, '(?:yaml|xml)')):
            Path(file).write_text(content)
        run_examples(document, monkeypatch)
        return capsys.readouterr().out

    return run


def test_the_tutorial_on_an_urdf_says_what_happens(tutorial):
    lines = tutorial('own_urdf.md').splitlines()
    assert 'tool0' in lines[0] and 'camera' in lines[0]
    assert lines[1] == "base_link tool0 ('pan', 'lift', 'bend')"
    assert lines[3] == '[0.7 0.  0.3]'
    assert lines[4].startswith('True')


def test_the_tutorial_on_five_joints_says_what_happens(tutorial):
    position, wished, near, full, pointing = tutorial('five_joints.md').splitlines()
    assert position.startswith('True') and wished.startswith("('rx', 'ry', 'rz')")
    assert float(wished.split()[-1]) <= 0.201 and float(near) <= 0.201
    assert full.startswith('False') and pointing == 'True'


def test_the_tutorial_on_a_failing_pose_shows_a_failure_with_one_cause(tutorial):
    lines = tutorial('failing_pose.md').splitlines()
    assert lines[0].split()[0] in {status.label for status in Status} - {'converged'}
    ends = {line.rpartition(' ')[0]: line.split()[-1] for line in lines}
    assert ends['without joint limits'] == ends['position only'] == 'converged'
    assert ends['any rotation about the tool axis'] != 'converged'


def test_the_tutorial_on_lerobot_prints_what_it_says(tutorial, tmp_path):
    (tmp_path / 'docs').mkdir()
    (tmp_path / 'docs' / 'tutorials').symlink_to(ROOT / 'docs' / 'tutorials')
    (tmp_path / 'so101.urdf').symlink_to(ROBOTS / 'so_arm_description' / 'urdf' / 'so101.urdf')
    *_, shown = re.findall(r'(?:^    .*\n)+', TEXT['lerobot.md'], re.M)
    assert tutorial('lerobot.md').split('\n') == [line.removeprefix('    ') for line in shown.split('\n')]


def test_the_statuses_that_the_tutorial_explains_are_those_of_the_solver():
    explained = set(re.findall(r'`(\w+)`', '\n'.join(line.split('|')[1] for line in TEXT['failing_pose.md'].splitlines()
                                                     if line.startswith('| failed'))))  # fmt: skip
    assert explained == {status.label for status in Status} - {'converged'}


def test_parameters_in_yaml_of_the_tutorials_exist_and_are_allowed():
    (text,) = blocks(TEXT['ur5_ros2_control.md'], 'yaml')
    for name, value in yaml.safe_load(text)['/**/ik_node']['ros__parameters'].items():
        PARAMETERS[name].check(value)


def test_options_of_python_are_those_of_the_parameters_with_an_underscore_for_the_dot():
    assert all(option.name == option.ros_name.replace('.', '_') for option in OPTIONS)
