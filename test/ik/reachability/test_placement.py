"""Places of the base, judged by Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from numerics import get_arm

from ros_ik_pkg.ik import ArgumentError, rank_placements


def test_the_best_place_solves_all_poses_that_some_place_reaches_and_its_solutions_are_right():
    arm = get_arm('ur5')
    rng = np.random.default_rng(4)
    base = pin.SE3(pin.utils.rotate('z', 0.7), np.array([2.0, -1.0, 0.4]))
    poses = np.array([(base * pin.SE3(arm.forward(q))).homogeneous for q in rng.uniform(-1.5, 1.5, (5, arm.n))])
    ranked = rank_placements(arm, poses, height=0.4)
    best = ranked[0]
    assert best.solved >= 4
    assert [place.solved for place in ranked] == sorted((place.solved for place in ranked), reverse=True)
    stands = pin.SE3(pin.utils.rotate('z', best.yaw), np.array([best.x, best.y, 0.4]))
    data, tip = arm.model.createData(), arm.model.getFrameId(arm.tip_frame)
    for q, pose in zip(best.q, poses):
        if not np.isnan(q[0]):
            pin.framesForwardKinematics(arm.model, data, q)
            np.testing.assert_allclose((stands * data.oMf[tip]).homogeneous, pose, atol=1e-5)


def test_poses_far_above_the_arm_have_no_place():
    pose = np.eye(4)
    pose[2, 3] = 9.0
    assert rank_placements(get_arm('ur5'), pose[None]) == []


def test_what_is_no_list_of_poses_is_refused():
    with pytest.raises(ArgumentError, match=r'expected \(N, 4, 4\)'):
        rank_placements(get_arm('ur5'), np.eye(4))
