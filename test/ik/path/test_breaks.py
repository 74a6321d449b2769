"""Why a path breaks, and a path of very many poses."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from ros_ik_pkg.ik import BreakReason, PathOptions, load_arm, solve_path

PATH = PathOptions(deadline=0.0)


@pytest.fixture(scope='module')
def ur5():
    return load_arm('ur5')


def test_a_turn_that_a_stretched_wrist_cannot_make_breaks_the_path_for_singularity(ur5):
    stretched, before = np.array([0.3, -1.2, 1.5, -0.3, 0.0, 0.1]), np.array([0.3, -1.2, 1.5, -0.3, -0.3, 0.1])
    home = ur5.forward(stretched)
    lost = np.linalg.svd(ur5.jacobian(stretched))[0][:, -1]
    turned = home.copy()
    turned[:3, 3] += 0.3 * lost[:3]
    turned[:3, :3] = pin.exp3(0.3 * lost[3:]) @ home[:3, :3]

    def on_this_side(q):
        return np.cos(q[:, 0] - stretched[0]) > 0.5  # the shoulder on the other side could make the turn

    solution = solve_path(ur5, [ur5.forward(before), home, turned], before, path=PATH, clear=on_this_side)
    assert not solution.complete and solution.place[-1] == 1.0
    found = solution.breaks[0]
    assert found.reason == BreakReason.SINGULARITY and 'from pose 1 to 2' in found.text
    assert solution.sigma_min[-1] < 1e-6


def test_a_path_of_a_hundred_thousand_poses_is_followed_whole(ur5):
    start, angle = np.array([0.3, -1.2, 1.5, 0.2, 0.9, 0.1]), np.linspace(0.0, 20.0 * np.pi, 100_000)
    poses = np.tile(ur5.forward(start), (len(angle), 1, 1))
    poses[:, 1, 3] += 0.1 * np.sin(angle)
    poses[:, 2, 3] += 0.1 * (np.cos(angle) - 1.0)
    solution = solve_path(ur5, poses, start, path=PATH)
    assert solution.complete and not solution.reconfigurations and len(solution.q) >= len(poses)
    assert solution.place[-1] == len(poses) - 1 and (np.diff(solution.times) > 0.0).all()
    for row in range(0, len(solution.q), 997):
        np.testing.assert_allclose(ur5.forward(solution.q[row]), solution.base_from_tip[row], atol=1e-6)
