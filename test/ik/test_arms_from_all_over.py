"""Robots like those from all over: each agrees with Pinocchio's own reading, and its reachable poses are solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import pytest
from chains import joint_positions, pinocchio_jacobian, pinocchio_pose
from made_up_robots import TURN, cobot, gantry, hand, hobby_arm, humanoid, mobile_manipulator, turning_arm
from numerics import count_answers, random_configurations, reachable_poses

from ros_ik_pkg.ik import ModelError, SolveOptions, load_arm, solve_batch

EXACT = 1e-12
CALM = {'deadline': 0.0}  # what a busy machine must not change


@dataclass(frozen=True)
class Chain:
    """A chain of one of these robots, and how many variables it should have."""

    text: str
    base: str
    tip: str
    n: int

    def load(self):
        return load_arm(self.text, self.base, self.tip)


CHAINS = {
    'left arm': Chain(humanoid(), 'waist_pitch_link', 'left_hand_link', 7),
    'right arm and waist': Chain(humanoid(), 'floating_base_link', 'right_hand_link', 9),
    'leg': Chain(humanoid(), 'floating_base_link', 'left_ankle_roll_link', 6),
    'head': Chain(humanoid(), 'floating_base_link', 'nod_link', 4),
    'arm on a lift': Chain(mobile_manipulator(), 'chassis_link', 'tool_link', 7),
    'arm without its lift': Chain(mobile_manipulator('floating'), 'lift_link', 'tool_link', 6),
    'hobby arm': Chain(hobby_arm(), 'base', 'grip_link', 5),
    'hobby arm to the finger that mimics': Chain(hobby_arm(), 'base', 'other_finger_link', 6),
    'cobot': Chain(cobot(), 'base', 'tool_link', 7),
    'turning arm': Chain(turning_arm(), 'base', 'tool_link', 6),
    'index finger': Chain(hand(), 'palm', 'index_tip_link', 2),
    'gantry': Chain(gantry(), 'frame', 'tool_link', 6),
}


@pytest.fixture(params=CHAINS, ids=lambda name: name.replace(' ', '_'))
def chain(request):
    return CHAINS[request.param]


def configurations(arm, count, seed=0):
    """Draw configurations (count, n) from the whole ranges, three turns where there is no limit."""
    lower, upper = np.maximum(arm.lower, -3 * TURN), np.minimum(arm.upper, 3 * TURN)
    return np.random.default_rng(seed).uniform(lower, upper, (count, arm.n))


def test_the_chain_has_its_joints_and_nothing_else(chain):
    arm = chain.load()
    assert arm.n == chain.n
    assert np.all(arm.lower < arm.upper) and np.all((arm.lower <= arm.home) & (arm.home <= arm.upper))


def test_poses_and_jacobians_are_those_of_pinocchio(chain):
    arm = chain.load()
    for q in configurations(arm, 20):
        expected = pinocchio_pose(chain.text, chain.base, chain.tip, joint_positions(arm, q))
        np.testing.assert_allclose(arm.forward(q), expected, rtol=0.0, atol=EXACT)
        jacobian = pinocchio_jacobian(pin.buildModelFromXML(chain.text), arm, q)
        np.testing.assert_allclose(arm.jacobian(q), jacobian, rtol=0.0, atol=EXACT)


def test_every_reachable_pose_is_solved_within_the_limits(chain):
    arm, rng = chain.load(), np.random.default_rng(5)
    targets, seeds = reachable_poses(arm, rng, 300), random_configurations(arm, rng, 300)
    assert count_answers(arm, solve_batch(arm, targets, seeds, SolveOptions(**CALM)), targets) >= 0.999


def test_a_whole_body_without_a_tip_lists_what_it_could_be():
    with pytest.raises(ModelError, match=r'several possible tips: left_hand_link, right_hand_link'):
        load_arm(humanoid(), 'waist_pitch_link')


@pytest.mark.parametrize('drive', ['planar', 'floating'])
def test_a_chain_over_a_base_that_drives_is_refused_by_the_name_and_type_of_its_joint(drive):
    with pytest.raises(ModelError, match=f"joint 'drive' is of type {drive}; a chain takes revolute"):
        load_arm(mobile_manipulator(drive), 'odom', 'tool_link')


def test_one_arm_does_not_hang_on_the_other():
    with pytest.raises(ModelError, match="'right_hand_link' does not descend from base frame 'left_shoulder_roll"):
        load_arm(humanoid(), 'left_shoulder_roll_link', 'right_hand_link')


def test_frames_beside_the_chain_are_placed_by_the_joints_that_lead_there():
    arm = CHAINS['left arm'].load()
    names = ('left_shoulder_pitch', 'left_shoulder_roll', 'neck', 'nod')
    positions = dict(zip(names, (0.3, 0.4, -0.5, 0.2)))
    for frame in ('nod_link', 'left_shoulder_roll_link'):
        expected = pinocchio_pose(humanoid(), 'waist_pitch_link', frame, positions)
        np.testing.assert_allclose(arm.base_from_frame(frame, positions), expected, rtol=0.0, atol=EXACT)


def test_joints_that_turn_further_than_a_turn_and_continuous_ones_wrap():
    assert CHAINS['turning arm'].load().wraps.tolist() == [1, 1, 0, 1, 1, 1]
    assert CHAINS['cobot'].load().wraps.tolist() == [1, 0, 1, 0, 1, 0, 1]
    assert CHAINS['gantry'].load().wraps.tolist() == [0, 0, 0, 1, 0, 0]


def test_limits_of_a_mimic_joint_bound_its_motor():
    arm = CHAINS['index finger'].load()
    assert arm.joint_names == ('index_spread', 'index_bend')
    # middle = 1.1 bend + 0.05 <= 1.9 holds; end = -0.7 middle + 0.02 >= -1.6 holds; bend itself stops first.
    np.testing.assert_allclose([arm.lower[1], arm.upper[1]], [0.0, 1.5])
    tight = load_arm(hand().replace('lower="-1.6" upper="0.2"', 'lower="-0.7" upper="0.2"'), 'palm', 'index_tip_link')
    np.testing.assert_allclose(tight.upper[1], ((0.7 + 0.02) / 0.7 - 0.05) / 1.1, rtol=0.0, atol=EXACT)
