"""The parts of the panel that need neither browser nor node: presets, words, curves, sliders."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ros_ik_pkg.compare import MethodRun, compare_methods, describe
from ros_ik_pkg.compare.iterate import make_iterate
from ros_ik_pkg.compare.iteration_axis import MAX_POINTS, thinned
from ros_ik_pkg.compare.newton import iterates, value
from ros_ik_pkg.compare.problem import is_rotary
from ros_ik_pkg.ik import METHODS, SolveOptions, Status, load_arm, solve
from ros_ik_pkg.panel.answers import PLOTTED, Curve
from ros_ik_pkg.panel.markup import texts as texts_module
from ros_ik_pkg.panel.markup.chart import plots_html
from ros_ik_pkg.panel.markup.html import comparison_words, node_words, status_html, table_html
from ros_ik_pkg.panel.markup.iterate_html import iterate_html
from ros_ik_pkg.panel.markup.joint_labels import short_names, slider_range
from ros_ik_pkg.panel.markup.newton_html import newton_html
from ros_ik_pkg.panel.markup.texts import Texts, all_texts
from ros_ik_pkg.panel.presets import PRESETS

pytestmark = pytest.mark.once

OPTIONS = SolveOptions(max_iterations=300)
ROBOTS = ('puma560', 'ur5', 'panda', 'iiwa14')


@pytest.mark.parametrize('robot', ROBOTS)
@pytest.mark.parametrize('name', PRESETS)
def test_every_preset_starts_within_the_limits_of_every_robot(name, robot):
    arm = load_arm(robot)
    problem = PRESETS[name](arm)
    assert np.all((arm.lower <= problem.seed) & (problem.seed <= arm.upper))
    np.testing.assert_allclose(problem.target[:3, :3] @ problem.target[:3, :3].T, np.eye(3), atol=1e-9)


@pytest.mark.parametrize('robot', ROBOTS)
def test_nothing_converges_on_the_unreachable_target(robot):
    problem = PRESETS['Unreachable'](load_arm(robot))
    runs = compare_methods(problem.arm, problem.target, problem.seed, METHODS, OPTIONS)
    assert Status.CONVERGED not in {run.status for run in runs}


@pytest.mark.parametrize('robot', ROBOTS)
def test_the_wrist_of_the_singular_preset_is_nearly_singular(robot):
    arm = load_arm(robot)
    singular, notes = PRESETS['Wrist singular'](arm).seed, PRESETS['Lecture notes'](arm).seed
    smallest = [np.linalg.svd(arm.jacobian(q), compute_uv=False)[-1] for q in (singular, notes)]
    assert smallest[0] < 0.3 * smallest[1]


def test_at_the_singular_wrist_of_the_puma_pinv_diverges_and_damping_does_not():
    problem = PRESETS['Wrist singular'](load_arm('puma560'))
    runs = {run.method: run for run in compare_methods(problem.arm, problem.target, problem.seed, METHODS, OPTIONS)}
    assert runs['pinv'].status is Status.DIVERGED
    assert runs['adaptive_dls'].status is runs['dls'].status is Status.CONVERGED
    assert 'smallest singular value' in describe(list(runs.values()))


def test_the_stretched_target_takes_a_straight_elbow_where_damping_creeps():
    problem = PRESETS['Arm stretched out'](load_arm('puma560'))
    seed_tip = problem.arm.forward(problem.seed)[:3, 3]
    assert np.linalg.norm(problem.target[:3, 3]) > 1.3 * np.linalg.norm(seed_tip)
    answer = solve(problem.arm, problem.target, problem.seed, SolveOptions(deadline=0.0)).q
    assert np.linalg.svd(problem.arm.jacobian(answer), compute_uv=False)[-1] < 0.01
    np.testing.assert_allclose(answer[[0, 1, 3, 4, 5]], problem.seed[[0, 1, 3, 4, 5]], atol=0.1)  # it just stretches
    options = SolveOptions(max_iterations=2000, position_tolerance=1e-6, orientation_tolerance=1e-6)
    runs = {run.method: run for run in compare_methods(problem.arm, problem.target, problem.seed, METHODS, options)}
    assert runs['dls'].iterations > 10 * runs['adaptive_dls'].iterations


def test_texts_of_the_node_cannot_become_markup():
    assert '<script>' not in status_html('<script>', False, '<script>')


def test_the_table_marks_the_node_s_own_method():
    run = MethodRun('dls', Status.STALLED, 7, 0.1, 0.2, 1e-5, 0.3)
    assert 'class=active' in table_html({'dls': run}, 'dls')
    assert 'class=active' not in table_html({'dls': run}, 'sdls')


def test_the_node_s_answer_is_told_in_words():
    solved = {'outcome': 'solved', 'method': 'dls', 'iterations': '8', 'attempts': '1', 'solve_time': '1e-4'}
    assert node_words(solved) == ('solved by dls in 8 iterations, 0.1 ms', True)
    assert node_words({**solved, 'attempts': '3'})[0] == 'solved by dls in 8 iterations and 3 attempts, 0.1 ms'
    failed = {'outcome': 'failed', 'status': 'unreachable', 'message': 'out of reach'}
    assert node_words(failed) == ('failed: out of reach', False)


def test_in_polish_the_node_s_answer_is_told_by_its_status():
    polish = Texts('pl')
    for status in (*(status.label for status in Status), *REFUSALS):
        words, good = node_words({'outcome': 'failed', 'status': status, 'message': 'in English'}, polish)
        assert not good and 'in English' not in words
        assert status == Status.CONVERGED.label or words != f'nierozwiązane: {status}'


def test_a_status_that_is_too_long_for_its_column_is_shortened():
    run = MethodRun('transpose', Status.MAX_ITERATIONS, 2000, 0.1, 0.2, 1e-5, 0.3)
    table = table_html({'transpose': run}, '')
    assert 'max_iterations' not in table and 'out of steps' in table


def test_where_no_method_is_chosen_the_page_says_what_to_do():
    assert comparison_words([], compared=False) == 'Choose methods to compare.'
    assert comparison_words([], compared=True) == ''


URDF = """<robot name="stick">
  <link name="base"/>
  <link name="stick"><visual><geometry><mesh filename="{mesh}"/></geometry></visual></link>
  <joint name="hinge" type="continuous"><parent link="base"/><child link="stick"/><axis xyz="0 0 1"/></joint>
</robot>"""


@pytest.fixture
def server():
    viser = pytest.importorskip('viser', reason='viser is not installed: scripts/panel installs it')
    server = viser.ViserServer(host='127.0.0.1', port=0, verbose=False)
    yield server
    server.stop()


def stick(tmp_path, mesh: str) -> str:
    """Write a URDF with one mesh, and the mesh file stick.stl."""
    import trimesh

    trimesh.creation.box((0.4, 0.05, 0.05)).export(tmp_path / 'stick.stl')
    path = tmp_path / 'stick.urdf'
    path.write_text(URDF.format(mesh=mesh))
    return str(path)


def test_an_arm_with_meshes_is_drawn_with_them(server, tmp_path):
    from ros_ik_pkg.panel.drawing.mesh_drawing import mesh_drawing

    path = stick(tmp_path, 'stick.stl')
    drawing = mesh_drawing(server, '/arm', load_arm(path), path)
    drawing.show(np.array([np.pi / 2]))
    (frame,) = drawing._robot._joint_frames
    np.testing.assert_allclose(frame.wxyz, [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], atol=1e-9)


@pytest.mark.parametrize('mesh', ['gone.stl', 'package://stick_description/stick.stl'])
def test_an_arm_whose_meshes_are_not_there_is_drawn_from_its_chain(server, tmp_path, mesh):
    from ros_ik_pkg.panel.drawing.mesh_drawing import mesh_drawing

    path = stick(tmp_path, mesh)
    assert mesh_drawing(server, '/arm', load_arm(path), path) is None


def test_meshes_of_packages_are_found_in_the_workspace_that_is_sourced(server, tmp_path, monkeypatch):
    from ros_ik_pkg.panel.drawing.mesh_drawing import mesh_drawing

    share = tmp_path / 'install' / 'share' / 'stick_description'
    share.mkdir(parents=True)
    stick(share, 'package://stick_description/stick.stl')
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/nonexistent:{tmp_path / "install"}')
    arm = load_arm(str(share / 'stick.urdf'))
    for source in (str(share / 'stick.urdf'), 'package://stick_description/stick.urdf'):
        assert mesh_drawing(server, '/arm', arm, source) is not None
    monkeypatch.setenv('AMENT_PREFIX_PATH', '')
    assert mesh_drawing(server, '/arm', arm, str(share / 'stick.urdf')) is None


@pytest.mark.parametrize('robot', [*ROBOTS, 'stanford', 'planar3r'])
def test_the_drawn_joints_end_where_forward_kinematics_does(robot):
    pytest.importorskip('viser', reason='viser is not installed: scripts/panel installs it')
    from ros_ik_pkg.panel.drawing.arm_drawing import joint_transforms, placements

    arm = load_arm(robot)
    q = arm.home + 0.2
    product = np.linalg.multi_dot([*joint_transforms(arm, q), placements(arm)[-1], np.eye(4)])
    np.testing.assert_allclose(product, arm.forward(q), atol=1e-12)


def test_long_curves_are_thinned_to_their_envelope_and_keep_both_ends():
    waves = 10.0 ** -np.linspace(0, 6, 2001) * np.where(np.arange(2001) % 2, 1.0, 3.0)
    chosen = thinned(waves)
    assert len(chosen) <= MAX_POINTS and chosen[0] == 0 and chosen[-1] == 2000
    np.testing.assert_array_equal(thinned(waves[:5]), np.arange(5))
    for begin in range(300, 1900, 200):
        window = waves[chosen[(chosen >= begin) & (chosen < begin + 200)]] * 10.0 ** (6 * begin / 2000)
        assert window.max() > 1.5 and window.min() < 0.5, 'crests and troughs are both there'


def test_the_way_of_the_tip_keeps_its_ends_and_long_strides_and_one_point_of_many_short_ones():
    pytest.importorskip('viser', reason='viser is not installed: scripts/panel installs it')
    from ros_ik_pkg.panel.drawing.scene import spaced

    way = np.zeros((103, 3))
    way[1:, 0] = 1.0 + np.linspace(0.0, 0.1, 102)
    thin = spaced(way, 0.02)
    assert len(thin) < 10
    np.testing.assert_array_equal(thin[[0, 1, -1]], way[[0, 1, -1]])
    assert spaced(np.empty((0, 3)), 0.02).shape == (0, 3)


def test_every_method_is_a_line_and_a_dot_in_each_plot():
    problem = PRESETS['Lecture notes'](load_arm('puma560'))
    runs = compare_methods(problem.arm, problem.target, problem.seed, METHODS, OPTIONS)
    curves = {
        run.method: Curve(
            run.method, *(run.trace.column(name) for name in PLOTTED), run.trace.joint_positions
        )
        for run in runs
    }
    drawn = plots_html(curves)
    assert 'class="cursor"' not in drawn and plots_html(curves, cursor=3).count('class="cursor"') == 2
    for method in METHODS:
        assert drawn.count(f'stroke:var(--{method})') == 4
    assert len(drawn) < 40_000  # it goes out for every target


@pytest.mark.parametrize(
    ('names', 'short'),
    [
        (('panda_joint1', 'panda_joint2'), ['joint1', 'joint2']),
        (('iiwa_joint_1', 'iiwa_joint_2'), ['joint 1', 'joint 2']),
        (('shoulder_pan_joint', 'elbow_joint', 'wrist_1_joint'), ['shoulder pan', 'elbow', 'wrist 1']),
        (('a', 'a_b'), ['a', 'a b']),
        (('hinge_joint',), ['hinge joint']),
    ],
)
def test_labels_of_joints_leave_out_what_all_have_in_common(names, short):
    assert short_names(names) == short


@pytest.mark.parametrize('robot', [*ROBOTS, 'stanford'])
def test_sliders_cover_the_limits_and_end_within_them(robot):
    arm = load_arm(robot)
    for lower, upper, turns in zip(arm.lower.tolist(), arm.upper.tolist(), is_rotary(arm).tolist()):
        low, high = slider_range(lower, upper, turns)
        if turns:
            assert (low, high) == (round(low, 1), round(high, 1))
            low, high = np.radians([low, high])
        assert lower - 1e-8 <= low < lower + 0.002 and upper - 0.002 < high <= upper + 1e-8


def test_sliders_of_joints_without_limits_go_half_a_turn_to_either_side():
    assert slider_range(-np.inf, np.inf, True) == (-180.0, 180.0)


REFUSALS = ('joint_states', 'no_robot', 'frame', 'quaternion', 'not_finite', 'position', 'stale', 'future', 'argument')


def test_every_text_of_the_page_is_there_in_both_languages():
    english, polish = all_texts('en'), all_texts('pl')
    assert len(english) > 60 and not english & polish
    keys = re.findall(r"texts\['([^']+)'\]|texts\.fill\(\s*'([^']+)'", sources())
    for key in {a or b for a, b in keys}:
        assert Texts('pl')[key] and Texts('en')[key]


def sources() -> str:
    """Return the text of all modules of the panel."""
    return ''.join(path.read_text() for path in Path(texts_module.__file__).parents[1].rglob('*.py'))


def test_newton_s_tangents_double_the_digits():
    guesses = iterates()
    root = guesses[-1]
    assert abs(value(root)) < 1e-12
    errors = np.abs(np.array(guesses[:-2]) - root)
    assert np.all(errors[1:] <= 1.0 * errors[:-1] ** 2)
    assert newton_html(3, Texts()).count('<tr>') == 5  # the head and four guesses


def test_the_card_holds_the_numbers_of_the_iterate_and_the_chart_one_row_a_direction():
    problem = PRESETS['Lecture notes'](load_arm('puma560'))
    run = compare_methods(problem.arm, problem.target, problem.seed, ['adaptive_dls'], OPTIONS)[0]
    positions = run.trace.joint_positions
    for k in (0, len(positions) - 1):
        iterate = make_iterate(problem.arm, problem.target, 'adaptive_dls', OPTIONS, positions, k)
        last = k == len(positions) - 1
        html = iterate_html(iterate, 'adaptive_dls', OPTIONS, problem.arm.joint_names, [True] * 6, last, Texts())
        figures = dict(re.findall(r'data-figure="(\w+)">([^<]+)<', html))
        for name in ('position_error', 'orientation_error', 'step_norm'):
            expected = run.trace.column(name)[k]
            assert float(figures[name]) == pytest.approx(expected, rel=2e-3, abs=1e-7)
        assert html.count('data-direction=') == 6 and html.count('data-joint=') == 6
    assert 'within tolerance: stop' in html
