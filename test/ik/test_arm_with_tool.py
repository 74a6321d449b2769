"""An arm with a tool: what it answers is what a robot with the tool in its URDF answers, judged by Pinocchio."""

from __future__ import annotations

import threading

import numpy as np
import pinocchio as pin
import pytest
from chains import joint_positions, pinocchio_pose, random_urdf

from bench.published_robots import UR5
from ros_ik_pkg.ik import ArgumentError, SolveOptions, World, load_arm, solve, solve_batch
from ros_ik_pkg.ik.model.tool import read_tool
from ros_ik_pkg.ik.search.starts import reach_poses

TOOL = pin.SE3(pin.rpy.rpyToMatrix(0.4, -1.1, 2.0), np.array([0.03, -0.05, 0.21]))
OTHER = pin.SE3(pin.rpy.rpyToMatrix(-2.0, 0.3, 0.1), np.array([-0.2, 0.0, 0.04]))
XYZ = np.array([0.1, 0.2, 0.3])
NEAR = 1e-5 + 1e-9  # m, rad; the default tolerances
EXACT = 1e-12


def with_link(text, tool):
    """Return a URDF with the tool as a link behind the link tip."""
    xyz, rpy = tool.translation, pin.rpy.matrixToRpy(tool.rotation)
    numbers = [' '.join(repr(float(value)) for value in values) for values in (xyz, rpy)]
    return text.replace(
        '</robot>', '<link name="held"/><joint name="hold" type="fixed"><parent link="tip"/><child link="held"/>'
        f'<origin xyz="{numbers[0]}" rpy="{numbers[1]}"/></joint></robot>')  # fmt: skip


def some_q(arm, rng):
    return rng.uniform(np.maximum(arm.lower, -3.0), np.minimum(arm.upper, 3.0))


@pytest.mark.parametrize('seed', range(10))
def test_an_arm_with_a_tool_is_the_arm_of_a_urdf_that_has_it(seed):
    rng = np.random.default_rng(seed)
    text = random_urdf(rng, joints=int(rng.integers(1, 9)), mimics=seed % 2)
    arm = load_arm(text, 'base', 'tip').with_tool(OTHER).with_tool(TOOL)
    by_urdf = load_arm(with_link(text, TOOL), 'base', 'held')
    q = some_q(arm, rng)
    expected = pinocchio_pose(with_link(text, TOOL), 'base', 'held', joint_positions(arm, q))
    np.testing.assert_allclose(arm.forward(q), expected, atol=EXACT)
    np.testing.assert_allclose(arm.jacobian(q), by_urdf.jacobian(q), atol=EXACT)
    np.testing.assert_allclose(arm.reach_bound.lengths, by_urdf.reach_bound.lengths, atol=EXACT)
    np.testing.assert_allclose(arm.reach_bound.in_tip, by_urdf.reach_bound.in_tip, atol=EXACT)
    np.testing.assert_allclose(arm.base_from_frame('tool', joint_positions(arm, q)), expected, atol=EXACT)


def test_the_starts_of_searches_are_poses_of_the_tool():
    arm = load_arm('panda').with_tool(TOOL)
    expected = reach_poses(arm.packed, np.ascontiguousarray(arm.starts[: arm.n].T, dtype=float))
    poses = arm.starts[arm.n :].T
    np.testing.assert_allclose(poses[:, :3], expected[:, :3], atol=1e-6)
    assert np.all(np.abs(np.sum(poses[:, 3:] * expected[:, 3:], axis=1)) > 1.0 - 1e-6)


@pytest.mark.parametrize('robot', ['xarm7', 'ur5', 'puma560'])
def test_answers_bring_the_tool_to_the_target(robot):
    arm, rng = load_arm(robot), np.random.default_rng(3)
    tooled = arm.with_tool(TOOL)
    flange = [pin.SE3(arm.forward(some_q(arm, rng))) for _ in range(100)]
    targets = np.array([(pose * TOOL).homogeneous for pose in flange])
    batch = solve_batch(tooled, targets, options=SolveOptions(deadline=10.0))
    assert np.all(batch.converged)
    for target, q in zip(targets, batch.q):
        error = pin.log6(pin.SE3(target).actInv(pin.SE3(arm.forward(q)) * TOOL)).vector
        assert np.linalg.norm(error[:3]) < 2.0 * NEAR
        assert np.linalg.norm(error[3:]) < NEAR


def test_a_target_out_of_reach_of_the_tip_is_in_reach_of_a_long_tool():
    arm = load_arm('ur5')
    target = arm.forward(np.zeros(arm.n)) @ pin.SE3(np.eye(3), np.array([0.0, 0.0, 1.5])).homogeneous
    assert solve(arm, target).status.label == 'unreachable'
    assert solve(arm.with_tool([0.0, 0.0, 1.5, 0.0, 0.0, 0.0]), target).converged


def test_tools_count_from_the_tip_frame_and_not_from_each_other():
    arm, q = load_arm('panda'), np.full(7, 0.3)
    expected = arm.with_tool(TOOL).forward(q)
    tooled = arm
    for k in range(1000):
        tooled = tooled.with_tool(OTHER if k % 2 else TOOL)
    np.testing.assert_array_equal(tooled.with_tool(TOOL).forward(q), expected)
    np.testing.assert_array_equal(tooled.with_tool(None).forward(q), arm.forward(q))


def test_arms_with_different_tools_share_shapes_and_model():
    arm = load_arm('panda')
    one, other = arm.with_tool(TOOL), arm.with_tool(OTHER)
    assert one.model is other.model is arm.model
    assert one.contacts is other.contacts is arm.contacts


@pytest.mark.parametrize(
    ('given', 'expected'),
    [
        ([*XYZ, 0.0, 0.0, np.pi / 2], pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, np.pi / 2), XYZ)),
        ((*XYZ, 0.1, -0.2, 0.3), pin.SE3(pin.rpy.rpyToMatrix(0.1, -0.2, 0.3), XYZ)),
        (pin.SE3ToXYZQUAT(TOOL), TOOL),
        (TOOL.homogeneous, TOOL),
        (TOOL, TOOL),
        (None, pin.SE3.Identity()),
        ([], pin.SE3.Identity()),
    ],
)
def test_a_tool_is_read_from_numbers_a_matrix_or_an_se3(given, expected):
    np.testing.assert_allclose(read_tool(given), pin.SE3(expected).homogeneous, atol=EXACT)


@pytest.mark.parametrize(
    'given',
    [[1.0], [0.0] * 7, [0.0] * 5, [np.nan] * 6, [np.inf, *[0.0] * 5], 'tool', np.diag([1.0, 1.0, -1.0, 1.0]),
     [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.02], [101.0, 0.0, 0.0, 0.0, 0.0, 0.0], np.full((4, 4), np.nan), [[0.0] * 6]],
)  # fmt: skip
def test_what_is_no_tool_is_refused(given):
    with pytest.raises(ArgumentError, match='tool'):
        load_arm('ur5').with_tool(given)


def test_a_tool_has_a_frame_of_its_own():
    arm = load_arm('panda')
    with pytest.raises(ArgumentError, match=f'{arm.tip_frame}.*is a link'):
        arm.with_tool(TOOL, arm.tip_frame)
    named = arm.with_tool(TOOL, 'gripper')
    positions = dict(zip(arm.joint_names, arm.home))
    np.testing.assert_allclose(named.base_from_frame('gripper', positions), named.forward(arm.home), atol=EXACT)
    assert named.joints_to('gripper') == arm.joint_names
    assert arm.with_tool(None).tool_frame == ''
    clash = load_arm(random_urdf(np.random.default_rng(0)).replace('"tip"', '"tool"'), 'base', 'tool')
    assert clash.with_tool(TOOL).tool_frame == 'tool_tool'


def test_links_that_move_with_the_tip_know_where_the_tool_is():
    arm = load_arm('panda').with_tool(TOOL)
    np.testing.assert_allclose(arm.frame_from_tool(arm.tip_frame), TOOL.homogeneous, atol=EXACT)
    np.testing.assert_allclose(arm.frame_from_tool('tool'), np.eye(4), atol=EXACT)
    assert arm.frame_from_tool(arm.base_frame) is None
    with pytest.raises(ArgumentError, match='does not exist'):
        arm.frame_from_tool('nowhere')


def test_threads_with_different_tools_never_get_each_others_answers():
    urdf, srdf, tip = UR5
    arm = load_arm(urdf, tip=tip, srdf=srdf)  # with shapes: its tools share the scene that the search is given
    world, faults = World(floor=-3.0), []
    target = arm.forward(np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2]))
    tools = [TOOL, OTHER]

    def run(tool):
        tooled, wanted = arm.with_tool(tool), target @ tool.homogeneous
        for _ in range(300):
            found = solve(tooled, wanted, options=SolveOptions(deadline=10.0), world=world)
            reached = arm.forward(found.q) @ tool.homogeneous
            if not found.converged or np.linalg.norm((reached - wanted)[:3, 3]) > 2.0 * NEAR:
                faults.append(found)

    threads = [threading.Thread(target=run, args=(tool,)) for tool in tools]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not faults
