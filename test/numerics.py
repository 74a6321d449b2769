"""For the tests of the numerics: judges that share nothing with them, and entry points to their compiled parts."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
from chains import pinocchio_tip
from hypothesis import settings
from hypothesis import strategies as st

from bench.bare_arm import bare_arm
from ros_ik_pkg.ik import SolveOptions
from ros_ik_pkg.ik.kernel.data_layout import BRANCH_ROWS, Joints, Tuning, Workspace, blocks
from ros_ik_pkg.ik.kernel.pair_layout import PairWorkspace
from ros_ik_pkg.ik.step.methods import take_step

SIX_ROWS = np.ones(6)
ROUNDING = 1e-12  # what the judge's own arithmetic may be off by, in m and rad
SEEDS = st.integers(0, 2**32 - 1)
law = settings(deadline=None, derandomize=True, max_examples=60)  # the same cases in every run
few = settings(law, max_examples=30)  # where a case costs much

get_arm = cache(bare_arm)  # contact has tests of its own


# Judges


def pose_errors(arm, q, target):
    """Distance [m] and angle [rad] between the tip at q and the target, by Pinocchio."""
    pose = pinocchio_tip(arm, q)
    angle = np.linalg.norm(pin.log3(target[:3, :3] @ pose[:3, :3].T))
    return np.linalg.norm(target[:3, 3] - pose[:3, 3]), angle


def twist(arm, q, target):
    """Twist error [p* - p ; log(R* R^T)] by Pinocchio, (6,)."""
    pose = pinocchio_tip(arm, q)
    return np.concatenate([target[:3, 3] - pose[:3, 3], pin.log3(target[:3, :3] @ pose[:3, :3].T)])


def numeric_jacobian(arm, q, step=1e-6):
    """Geometric Jacobian in base axes by central differences of Pinocchio's forward kinematics, (6, n)."""
    columns = []
    for nudge in step * np.eye(arm.n):
        ahead, behind = pinocchio_tip(arm, q + nudge), pinocchio_tip(arm, q - nudge)
        turn = pin.log3(ahead[:3, :3] @ behind[:3, :3].T)
        columns.append(np.concatenate([ahead[:3, 3] - behind[:3, 3], turn]) / (2.0 * step))
    return np.array(columns).T


def assert_answer(arm, solution, target, options=None):
    """Assert that a solution is one: converged, within tolerance by Pinocchio, within the limits."""
    options = options or SolveOptions()
    assert solution.converged, f'{solution.status.label} at {solution.q}, {solution.position_error} m off'
    position_error, orientation_error = pose_errors(arm, solution.q, target)
    assert position_error <= options.position_tolerance + ROUNDING
    assert orientation_error <= options.orientation_tolerance + ROUNDING
    assert np.all((arm.lower <= solution.q) & (solution.q <= arm.upper))


def count_answers(arm, batch, targets, options=None):
    """Share of a batch that is solved, every answer judged by Pinocchio; one that is wrong is an error."""
    options = options or SolveOptions()
    for q, target in zip(batch.q[batch.converged], targets[batch.converged]):
        position_error, orientation_error = pose_errors(arm, q, target)
        assert position_error <= options.position_tolerance + ROUNDING
        assert orientation_error <= options.orientation_tolerance + ROUNDING
        assert np.all((arm.lower <= q) & (q <= arm.upper))
    return np.mean(batch.converged)


# Made-up input


def random_rotation(rng):
    """Draw a rotation (3, 3) evenly."""
    return pin.Quaternion(*(lambda v: v / np.linalg.norm(v))(rng.normal(size=4))).matrix()


def random_configurations(arm, rng, count):
    """Draw configurations (count, n) within the limits, a turn at most about zero."""
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    return rng.uniform(lower, upper, (count, arm.n))


def reachable_poses(arm, rng, count):
    """Draw poses (count, 4, 4) that the arm reaches within its limits."""
    return np.array([pinocchio_tip(arm, q) for q in random_configurations(arm, rng, count)])


def random_jacobian(rng, n, rank, rows=6):
    """Make up a matrix (6, n) of a rank, all rows below `rows` zero."""
    J = np.zeros((6, n))
    J[:rows] = rng.normal(size=(rows, rank)) @ rng.normal(size=(rank, n))
    return J


# Doors to the compiled parts


def tuning(**options):
    """Options as the compiled code takes them."""
    return Tuning(*SolveOptions(**options).numbers[: len(Tuning._fields)].tolist())


def make_workspace(joints, n, starts=1):
    """Make what kernels write to, for a chain of that many joints and variables."""
    angles = np.zeros((3, blocks(joints)))
    return Workspace(
        joints=Joints(np.empty((joints, 6)), *angles), columns=np.empty((n, 6)), e=np.empty(6), weights=np.ones(6),
        y=np.empty(6), A=np.empty((6, 6)), rhs=np.empty(6), U=np.empty((6, 6)), W=np.empty((6, n)),
        sigma=np.empty(6), dq=np.empty(n), q=np.empty(n),
        near=np.empty(n), best=np.empty(n), seed=np.empty(n), null=np.empty(n), went=np.empty(n),
        trial=np.empty((n, 6)), scales=np.empty(0), branches=np.empty((BRANCH_ROWS, 6)),
        scores=np.empty(starts, np.float32), clock=np.empty(2, np.int64),
    )  # fmt: skip


def step(method, J, e, weights=SIX_ROWS, **options):
    """Take one step of a method; J (6, n) and e (6,) are weighted already. Returns dq (n,) and its damping."""
    work = make_workspace(1, J.shape[1])
    work.columns[:], work.e[:], work.weights[:] = J.T, e, weights
    damping = take_step(tuning(method=method, **options), float(np.linalg.norm(e)), work)
    return work.dq.copy(), damping


def pair_step(method, J, e, **options):
    """Take one step of a method over two tips; J (12, n) and e (12,) are weighted already. Returns dq (n,), damping."""
    n, tip = J.shape[1], make_workspace(1, J.shape[1])
    work = PairWorkspace(
        tip, tip, np.ascontiguousarray(J.T), e.copy(), np.ones(12), *np.empty((3, 12)), *np.empty((2, 12, 12)),
        np.empty((12, n)), *np.empty((6, n)), np.empty(0), np.empty(1, np.float32), np.empty(2, np.int64),
    )  # fmt: skip
    damping = take_step(tuning(method=method, **options), float(np.linalg.norm(e)), work)
    return work.dq.copy(), damping
