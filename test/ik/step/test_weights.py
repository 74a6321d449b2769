"""Joint weights in the step: the formula in NumPy, and what an arm on a heavy lift does with them."""

from __future__ import annotations

import numpy as np
import pytest
from numerics import assert_answer, get_arm, numeric_jacobian, pinocchio_tip, random_configurations, twist

from ros_ik_pkg.ik import METHODS, SolveOptions, load_arm, solve
from ros_ik_pkg.ik.step.weights import MOST_RATIO, scale_joints

DAMPING = {'pinv': lambda e: 0.0, 'dls': lambda e: 0.01, 'adaptive_dls': lambda e: max(1e-3, 0.2 * np.linalg.norm(e))}
CALM = {'deadline': 0.0, 'max_attempts': 1}
LIFT = """<robot name="lift"><link name="floor"/><link name="column"/><link name="shoulder"/><link name="upper"/>
<link name="lower"/><link name="tip"/>
<joint name="lift" type="prismatic"><parent link="floor"/><child link="column"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="a" type="revolute"><parent link="column"/><child link="shoulder"/><axis xyz="0 1 0"/>
<limit lower="-2.9" upper="2.9" velocity="1" effort="1"/></joint>
<joint name="b" type="revolute"><parent link="shoulder"/><child link="upper"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2.9" upper="2.9" velocity="1" effort="1"/></joint>
<joint name="c" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2.9" upper="2.9" velocity="1" effort="1"/></joint>
<joint name="tip" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0.2 0 0"/></joint></robot>"""
PLANE = {'task_weights': (1.0, 0.0, 1.0, 0.0, 1.0, 0.0)}  # what three joints about y can do, and a lift as well
BENT = np.array([0.0, 0.4, 0.9, -0.5])
HEAVY = (20.0, 1.0, 1.0, 1.0)


def first_step(arm, target, seed, **options):
    """Return the first step of a descent (n,)."""
    trace = solve(arm, target, seed, SolveOptions(**CALM, max_joint_step=10.0, **options), trace=True).trace
    return trace.joint_positions[1] - trace.joint_positions[0]


@pytest.mark.parametrize('method', DAMPING)
def test_a_step_is_the_shortest_one_in_the_weighted_distance(method):
    arm, rng = get_arm('iiwa14'), np.random.default_rng(1)
    for q in random_configurations(arm, rng, 10):
        q *= 0.8
        target, w = pinocchio_tip(arm, q + rng.uniform(-0.1, 0.1, arm.n)), rng.uniform(1.0, 8.0, arm.n)
        J, e = numeric_jacobian(arm, q), twist(arm, q, target)
        S = np.diag(w.min() / w)
        expected = S @ S @ J.T @ np.linalg.solve(J @ S @ S @ J.T + DAMPING[method](e) ** 2 * np.eye(6), e)
        found = first_step(arm, target, q, method=method, joint_weights=tuple(w))
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_the_transposed_step_goes_along_the_weighted_gradient():
    arm, rng = get_arm('iiwa14'), np.random.default_rng(2)
    q = 0.5 * random_configurations(arm, rng, 1)[0]
    target, w = pinocchio_tip(arm, q + 0.05), rng.uniform(1.0, 8.0, arm.n)
    J, e = numeric_jacobian(arm, q), twist(arm, q, target)
    gradient = np.diag(w.min() / w) ** 2 @ J.T @ e
    JJTe = J @ gradient
    expected = gradient * (e @ JJTe) / (JJTe @ JJTe)
    found = first_step(arm, target, q, method='transpose', joint_weights=tuple(w))
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize('method', METHODS)
def test_equal_weights_change_no_bit(method):
    arm, rng = get_arm('panda'), np.random.default_rng(3)
    for q, seed in zip(random_configurations(arm, rng, 20), random_configurations(arm, rng, 20)):
        target, options = pinocchio_tip(arm, q), {'method': method, 'deadline': 0.0, 'max_attempts': 10}
        alone = solve(arm, target, seed, SolveOptions(**options))
        for weight in (1.0, 7.0, 0.0):
            weighed = solve(arm, target, seed, SolveOptions(joint_weights=(weight,) * arm.n, **options))
            assert weighed.q.tobytes() == alone.q.tobytes()


@pytest.mark.parametrize('method', METHODS)
def test_a_heavy_lift_stays_if_the_arm_can_do_without(method):
    arm = load_arm(LIFT)
    target = pinocchio_tip(arm, BENT + np.array([0.0, 0.2, -0.3, 0.2]))
    options = {'method': method, 'max_iterations': 2000, **CALM, **PLANE}
    light, heavy = (solve(arm, target, BENT, SolveOptions(joint_weights=weights, **options)) for weights in ((), HEAVY))
    for solution in (light, heavy):
        assert_answer(arm, solution, target)
    assert abs(heavy.q[0]) < 0.1 * abs(light.q[0])


@pytest.mark.parametrize('choice', ['first', 'nearest'])
def test_a_heavy_lift_moves_if_it_must(choice):
    arm = load_arm(LIFT)
    for rise in (-0.9, 0.3, 0.9):
        far = pinocchio_tip(arm, [rise, 0.0, 0.05, 0.0])  # stretched out: the arm alone reaches no further
        options = SolveOptions(joint_weights=(1000.0, 1.0, 1.0, 1.0), choice=choice, deadline=0.0, **PLANE)
        solution = solve(arm, far, BENT, options)
        assert_answer(arm, solution, far)
        assert solution.q[0] == pytest.approx(rise, abs=0.06)  # bent by what is left of the stretched arm


@pytest.mark.parametrize('kind', ['reachable', 'beyond'])
def test_the_closest_approach_is_as_close_with_weights(kind):
    arm = load_arm(LIFT)
    target = pinocchio_tip(arm, [0.5, 0.3, 0.4, 0.2])
    target[0, 3] += 2.0 if kind == 'beyond' else 0.0
    options = {'deadline': 0.0, **PLANE}
    light, heavy = (solve(arm, target, BENT, SolveOptions(joint_weights=weights, **options)) for weights in ((), HEAVY))
    assert heavy.position_error == pytest.approx(light.position_error, abs=1e-5)


@pytest.mark.parametrize(
    ('weights', 'scales'),
    [
        ((2.0, 4.0, 8.0), (1.0, 0.5, 0.25)),
        ((1.0, 1e6, 1.0), (1.0, 1.0 / MOST_RATIO, 1.0)),
        ((0.0, 1.0, 1.0), (1.0, 1.0 / MOST_RATIO, 1.0 / MOST_RATIO)),
        ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    ],
)
def test_only_the_ratios_of_weights_count_and_none_is_too_large(weights, scales):
    found = np.full(3, np.nan)
    scale_joints(np.array(weights), found)
    np.testing.assert_allclose(found, scales, rtol=1e-15)
