"""The inside of an iteration, judged by the solver's own step and by Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from numerics import get_arm, pinocchio_tip

from ros_ik_pkg.compare.iterate import directions_of, ellipsoid_of, make_iterate, twist_error
from ros_ik_pkg.ik import METHODS, SolveOptions, solve

ARMS = ('puma560', 'panda', 'ur5', 'planar3r')


def some_descent(name: str, method: str, seed: int, **options):
    """Return arm, target, options and the trace of one descent between two configurations."""
    arm, rng = get_arm(name), np.random.default_rng(seed)
    lower, upper = np.maximum(arm.lower, -2.5), np.minimum(arm.upper, 2.5)
    start = rng.uniform(lower, upper)
    target = pinocchio_tip(arm, np.clip(start + rng.uniform(-0.5, 0.5, arm.n), lower, upper))
    options = SolveOptions(method=method, max_attempts=1, deadline=0.0, **options)
    return arm, target, options, solve(arm, target, start, options, trace=True).trace


@pytest.mark.parametrize('method', METHODS)
@pytest.mark.parametrize('name', ['puma560', 'panda', 'ur5'])
def test_the_gains_of_the_singular_directions_make_the_step_of_the_solver(name, method):
    for seed in range(5):
        arm, target, options, trace = some_descent(name, method, seed, max_joint_step=10.0, respect_limits=False)
        for k in range(min(len(trace) - 1, 4)):
            iterate = make_iterate(arm, target, method, options, trace.joint_positions, k)
            directions = iterate.directions
            step = directions.v @ (directions.gains(method, options) * directions.component)
            np.testing.assert_allclose(iterate.step, np.clip(step, -10.0, 10.0), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize('name', ARMS)
def test_error_jacobian_and_damping_of_an_iterate_are_those_of_the_trace_and_of_pinocchio(name):
    arm, target, options, trace = some_descent(name, 'adaptive_dls', 1)
    for k in range(len(trace)):
        iterate = make_iterate(arm, target, 'adaptive_dls', options, trace.joint_positions, k)
        assert iterate.position_error == pytest.approx(trace.column('position_error')[k], abs=1e-12)
        assert iterate.orientation_error == pytest.approx(trace.column('orientation_error')[k], abs=1e-8)
        assert np.linalg.norm(iterate.step) == pytest.approx(trace.column('step_norm')[k], abs=1e-12)
        if k < len(trace) - 1:
            assert iterate.damping == pytest.approx(trace.column('damping')[k], rel=1e-6)
        np.testing.assert_allclose(iterate.jacobian, finite_differences(arm, iterate.q), atol=1e-6)


def finite_differences(arm, q: np.ndarray, h: float = 1e-7) -> np.ndarray:
    """Return the Jacobian (6, n) by differences of Pinocchio's forward kinematics."""
    columns = []
    for step in h * np.eye(arm.n):
        ahead, behind = pinocchio_tip(arm, q + step), pinocchio_tip(arm, q - step)
        turn = pin.log3(ahead[:3, :3] @ behind[:3, :3].T)
        columns.append(np.concatenate([ahead[:3, 3] - behind[:3, 3], turn]) / (2.0 * h))
    return np.array(columns).T


def test_steps_at_the_cap_and_joints_that_a_limit_holds_are_marked():
    arm = get_arm('panda')
    seed = arm.home.copy()
    target = arm.forward(seed)
    target[:3, 3] += [0.4, 0.3, 0.2]
    options = SolveOptions(max_attempts=1, deadline=0.0)
    trace = solve(arm, target, seed, options, trace=True).trace
    iterates = [make_iterate(arm, target, 'adaptive_dls', options, trace.joint_positions, k) for k in range(len(trace))]
    assert any(iterate.capped.any() for iterate in iterates)
    assert all(np.abs(iterate.step).max() <= 0.3 + 1e-12 for iterate in iterates)
    assert not iterates[-1].frozen.any() and not iterates[-1].step.any()


def test_a_joint_at_a_limit_that_stands_still_is_marked_as_held():
    arm = get_arm('ur5')
    positions = np.array([arm.upper, arm.upper - np.r_[0.0, 0.1, 0.1, 0.1, 0.1, 0.1]])
    iterate = make_iterate(arm, arm.forward(arm.home), 'dls', SolveOptions(), positions, 0)
    assert iterate.frozen.tolist() == [True, False, False, False, False, False]


def test_an_unknown_method_is_refused_by_name():
    with pytest.raises(ValueError, match=r"method 'newton' is unknown; expected one of transpose"):
        directions_of(np.eye(6), np.ones(6)).gains('newton', SolveOptions())


def test_at_a_singularity_pinv_has_no_bound_and_damping_stops_the_lost_direction():
    jacobian = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    directions = directions_of(jacobian, np.full(6, 0.1))
    assert directions.gains('pinv', SolveOptions())[-1] == np.inf
    for method in ('transpose', 'dls', 'adaptive_dls', 'sdls'):
        assert directions.gains(method, SolveOptions())[-1] == 0.0


def test_the_ellipsoid_holds_the_velocities_of_the_tip():
    arm, rng = get_arm('panda'), np.random.default_rng(0)
    jacobian = arm.jacobian(rng.uniform(arm.lower, arm.upper))
    axes, lengths = ellipsoid_of(jacobian)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    rates = rng.normal(size=(500, arm.n))
    rates /= np.linalg.norm(rates, axis=1)[:, None]
    inside = np.linalg.norm((rates @ jacobian[:3].T) @ axes / lengths, axis=1)
    assert inside.max() <= 1.0 + 1e-9 and inside.max() > 0.8


def test_the_error_is_the_twist_from_the_tip_to_the_target():
    target, pose = np.eye(4), np.eye(4)
    target[:3, :3] = pin.exp3(np.array([0.0, 0.0, 0.5]))
    target[:3, 3] = [1.0, 2.0, 3.0]
    np.testing.assert_allclose(twist_error(target, pose), [1.0, 2.0, 3.0, 0.0, 0.0, 0.5], atol=1e-12)
