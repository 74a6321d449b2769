"""A stream of targets on a straight line through a singularity, or close by, over DDS: the joints move smoothly.

The judge is a continuation of its own: Newton steps with Pinocchio's Jacobian from each target to the next, the least
ones where they are not unique.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from chains import pinocchio_tip
from ros_helpers import DEFAULTS, TIMEOUT, Client, allow_lark, connected, joint_state, pose_of

from ros_ik_pkg.ik import load_arm

pytestmark = [allow_lark, pytest.mark.newest]

ARM = load_arm('puma560')
WRIST = ARM.joint_names.index('joint5')
SINGULAR = np.array([0.4, -0.9, 0.2, 0.0, 0.0, 0.3])  # the axes of joints 4 and 6 are one
LENGTH, COUNT = 0.3, 101  # m, targets
# rad: the tolerance of 1e-5 rad, at the angle of joint 5 that is nearest to 0 and not 0, 0.03 rad or more.
CLOSE = 1e-5 / 0.03
TURNS = {'through the singularity': 0.0, 'close by': 0.05, 'further off': 0.2}  # rad, tool out of the arm's plane


def straight_line(turn: float) -> list[np.ndarray]:
    """Return poses (4, 4) on a vertical line; the one in the middle is that of SINGULAR with the tool turned."""
    middle = pinocchio_tip(ARM, SINGULAR)
    middle[:3, :3] = pin.exp3(np.array([0.0, 0.0, turn])) @ middle[:3, :3]
    targets = np.repeat(middle[None], COUNT, axis=0)
    targets[:, 2, 3] += np.linspace(-LENGTH / 2, LENGTH / 2, COUNT)
    return list(targets)


def off_by(q: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the twist (6,) from the tip at q (n,) to a target (4, 4) [m, rad]."""
    pose = pinocchio_tip(ARM, q)
    return np.r_[target[:3, 3] - pose[:3, 3], pin.log3(target[:3, :3] @ pose[:3, :3].T)]


def continued(targets: list[np.ndarray], q: np.ndarray) -> np.ndarray:
    """Return the joints (N, n) that reach the targets one after the other, each nearest those before."""
    data, tip = ARM.model.createData(), ARM.model.getFrameId(ARM.tip_frame)
    path = []
    for target in targets:
        while np.abs(error := off_by(q, target)).max() > 1e-12:
            jacobian = pin.computeFrameJacobian(ARM.model, data, q, tip, pin.LOCAL_WORLD_ALIGNED)
            q = q + np.linalg.lstsq(jacobian, error, rcond=1e-6)[0]
        path.append(q)
    return np.array(path)


def smooth_way(turn: float) -> np.ndarray:
    """Return the joints (N, n) along the line: down from SINGULAR in the arm's plane, turned there, and up."""
    down = continued(straight_line(0.0)[COUNT // 2 :: -1], SINGULAR)
    turned = continued([straight_line(share * turn)[0] for share in np.linspace(0.0, 1.0, 20)], down[-1])
    return continued(straight_line(turn), turned[-1])


@pytest.fixture(scope='module')
def running(tmp_path_factory):
    """One node and one client for all tests of this file."""
    with connected(Client, tmp_path_factory.mktemp('node') / 'log') as client:
        client.set_parameters(DEFAULTS)
        yield client


def streamed(client: Client, targets: list[np.ndarray]) -> np.ndarray:
    """Send targets one after the other; return the joints (N, n) that were published."""
    replies = [client.solve(pose_of(target), TIMEOUT) for target in targets]
    assert all(reply.solved for reply in replies), {reply.message for reply in replies}
    return np.array([[reply.joints[name] for name in ARM.joint_names] for reply in replies])


def steps(path: np.ndarray) -> np.ndarray:
    """Return the largest step of each joint."""
    return np.abs(np.diff(path, axis=0)).max(axis=0)


@pytest.mark.parametrize('case', TURNS)
def test_on_a_straight_line_past_a_singularity_the_joints_take_the_one_smooth_way_there_and_back(running, case):
    targets = straight_line(TURNS[case])
    expected = smooth_way(TURNS[case])
    start = joint_state(ARM.joint_names, expected[0])
    running.set_parameters({'seed_source': 'joint_states'})
    running.settle(pose_of(targets[0]), lambda reply: reply.figures.get('iterations') == '0', start)
    running.set_parameters({'seed_source': 'last_solution'})
    there = streamed(running, targets)
    back = streamed(running, targets[::-1])[::-1]
    table = '\n' + np.array2string(there, precision=4, threshold=there.size, suppress_small=True)
    assert np.abs(there - expected).max() <= CLOSE, table
    assert np.abs(back - there).max() <= 2 * CLOSE, table
    assert (steps(there) <= steps(expected) + 2 * CLOSE).all(), table
    if case == 'through the singularity':
        assert there[0, WRIST] * there[-1, WRIST] < 0.0, table  # it went through, not up to it and back


def test_the_way_past_is_as_hard_as_it_is_said_to_be():
    """Joint 4 must turn within a few targets the closer, the faster; a branch jump would be half a turn at once."""
    largest = {case: steps(smooth_way(turn)).max() for case, turn in TURNS.items()}
    assert largest['through the singularity'] < largest['further off'] < largest['close by'] < 0.5
