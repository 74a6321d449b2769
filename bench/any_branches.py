"""All branches of six-joint arms of no closed form, beside those that Newton iterations from many starts find."""

from __future__ import annotations

import numpy as np
from tqdm import tqdm

from bench.branches import SAME, SEED, draw, gaps, timed, urdf_of, within
from bench.judge import Judge
from bench.table import Table
from ros_ik_pkg.ik import Arm, SolveOptions, load_arm

ANY_HEAD = [
    'arm', 'poses', 'branches by chance', 'most', 'in our list', 'listed twice', 'wrong', 'by proof', 'missing there',
    'median [us]', 'p90 [us]', 'p99 [us]',
]  # fmt: skip
# a [m], alpha [deg], d [m], angle at zero [deg] of each joint, by Denavit and Hartenberg; limits [deg]. By the
# manufacturers: FANUC CRX-10iA/L, UFACTORY xArm6, Kinova Gen3 lite and Jaco 2 with the non-spherical wrist.
CRX_10IA_L = (
    (0.0, -90, 0.0, 0, -190, 190), (0.71, 180, 0.0, -90, -180, 180), (0.0, -90, 0.0, 180, -285, 285),
    (0.0, 90, -0.54, 0, -190, 190), (0.0, -90, 0.15, 0, -180, 180), (0.0, 180, -0.16, 0, -225, 225),
)  # fmt: skip
XARM6 = (
    (0.0, -90, 0.267, 0, -360, 360), (0.28949, 0, 0.0, -79.35, -118, 120), (0.0775, -90, 0.0, 79.35, -225, 11),
    (0.0, 90, 0.3425, 0, -360, 360), (0.076, -90, 0.0, 0, -97, 180), (0.0, 0, 0.097, 0, -360, 360),
)  # fmt: skip
GEN3_LITE = (
    (0.0, 90, 0.2433, 0, -154, 154), (0.28, 180, 0.03, 90, -150, 150), (0.0, 90, 0.02, 90, -150, 150),
    (0.0, 90, 0.245, 90, -149, 149), (0.0, 90, 0.057, 180, -145, 145), (0.0, 0, 0.235, 90, -149, 149),
)  # fmt: skip
JACO2 = (
    (0.0, 90, 0.2755, 0, -360, 360), (0.41, 180, 0.0, 0, 47, 313), (0.0, 90, -0.0098, 0, 19, 341),
    (0.0, 60, -0.2502, 0, -360, 360), (0.0, 60, -0.0858, 0, -360, 360), (0.0, 180, -0.2116, 0, -360, 360),
)  # fmt: skip
TABLES = {'crx_10ia_l': CRX_10IA_L, 'xarm6': XARM6, 'gen3_lite': GEN3_LITE, 'jaco2': JACO2}
STARTS, STEPS = 240, 40  # of the Newton iterations at each pose
BLOCK = 50  # poses at a time
CALLS = 5  # of each pose; the time is that of the quickest
LONGEST = 0.5  # rad of a joint in a step
THERE = 1e-9  # m, rad


def any_table(count: int) -> tuple[tuple[str, str, Table], int]:
    """Return title, text and table for N random poses of each arm, and how much in them is wrong."""
    text = (
        'choice: all on arms of no closed form, beside what damped Newton iterations on the placements of '
        f"Pinocchio's model find from {STARTS} random starts each, and the configuration of the pose. missing there: "
        f'of poses with a proof. The time is the least of {CALLS} calls.'
    )
    rows, faults = [], 0
    for arm in tqdm(arms_of_no_closed_form(), leave=False):
        random = np.random.default_rng(SEED)
        q = draw(arm, random, count)
        row, wrong = any_row(arm, q, draw(arm, random, count), random)
        rows.append(row)
        faults += wrong
    return ('All branches: any geometry', text, [ANY_HEAD, *rows]), faults


def arms_of_no_closed_form() -> list[Arm]:
    """Return the arms of TABLES, and three with axes at random."""
    arms = [load_arm(urdf_of(name, axes_of(table))) for name, table in TABLES.items()]
    for seed in range(3):
        random = np.random.default_rng(seed)
        axes = [
            (f'{x} {y} {z}', ' '.join(map(str, random.normal(size=3))), -170, 170)
            for x, y, z in random.uniform(-0.4, 0.4, (6, 3))
        ]
        arms.append(load_arm(urdf_of(f'random {seed + 1}', tuple(axes))))
    return arms


def axes_of(table: tuple[tuple[float, ...], ...]) -> tuple[tuple[str, str, float, float], ...]:
    """Return origin in the frame before, axis, and limits of each joint of a table by Denavit and Hartenberg."""
    axes, pose, before = [], np.eye(4), np.zeros(3)
    for a, alpha, d, at_zero, low, high in table:
        axes.append((' '.join(map(str, pose[:3, 3] - before)), ' '.join(map(str, pose[:3, 2])), low, high))
        before = pose[:3, 3]
        c, s, ca, sa = (f(np.radians(x)) for x in (at_zero, alpha) for f in (np.cos, np.sin))
        pose = pose @ np.array([
            [c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0.0, sa, ca, d], [0.0, 0.0, 0.0, 1.0],
        ])  # fmt: skip
    return tuple(axes)


def any_row(arm: Arm, q: np.ndarray, seeds: np.ndarray, random: np.random.Generator) -> tuple[list[str], int]:
    """Return the row of an arm, and how many branches are missing, listed twice and wrong. The poses are those of q."""
    judge, options = Judge(arm), SolveOptions(choice='all', deadline=0.0, avoid_collisions=False)
    poses = judge.forward(q)
    total, most, listed, twice, wrong, proven, denied, times = 0, 0, 0, 0, 0, 0, 0, []
    for begin in range(0, len(q), BLOCK):
        rows = slice(begin, begin + BLOCK)
        for pose, seed, known in zip(poses[rows], seeds[rows], by_chance(judge, poses[rows], q[rows], random)):
            known = distinct(within(arm, known, seed))
            answer, _ = timed(arm, pose, seed, options)
            ours = answer.solutions
            times.append(1e6 * min(timed(arm, pose, seed, options)[1] for _ in range(CALLS)))
            total, most = total + len(known), max(most, len(ours))
            missing = int((gaps(known, ours).min(axis=1, initial=np.inf) >= SAME).sum())
            listed += len(known) - missing
            denied += missing if answer.completeness == 'proof' else 0
            twice += int((gaps(ours, ours) < SAME).sum() - len(ours)) // 2
            wrong += int((~judge.solved(np.repeat(pose[None], len(ours), axis=0), ours)).sum())
            proven += answer.completeness == 'proof'
    return [
        arm.name, str(len(q)), str(total), str(most), f'{100 * listed / total:.2f} %', str(twice), str(wrong),
        f'{100 * proven / len(q):.2f} %', str(denied), *(f'{np.percentile(times, k):.1f}' for k in (50, 90, 99)),
    ], total - listed + twice + wrong  # fmt: skip


def by_chance(judge: Judge, poses: np.ndarray, q: np.ndarray, random: np.random.Generator) -> list[np.ndarray]:
    """Return of each pose (k, 4, 4) its configuration q (k, 6) and where damped Newton iterations from random
    configurations lead, all at once in NumPy with the placements of Pinocchio's model."""
    goals = np.repeat(poses, STARTS, axis=0)
    ends = random.uniform(-np.pi, np.pi, (len(goals), q.shape[1]))
    going = np.arange(len(goals))
    for _ in range(STEPS):
        error, J = errors_and_jacobians(judge, goals[going], ends[going])
        left = np.linalg.norm(error, axis=1) > THERE
        going, error, J = going[left], error[left], J[left]
        damping = 1e-4 * np.minimum(1.0, (error**2).sum(axis=1))[:, None, None] + 1e-14
        transposed = J.transpose(0, 2, 1)
        step = np.linalg.solve(transposed @ J + damping * np.eye(q.shape[1]), transposed @ error[..., None])[..., 0]
        ends[going] += np.clip(step, -LONGEST, LONGEST)
    arrived = np.ones(len(goals), bool)
    arrived[going] = False
    return [np.vstack([own, ends[k * STARTS : (k + 1) * STARTS][arrived[k * STARTS : (k + 1) * STARTS]]])
            for k, own in enumerate(q)]  # fmt: skip


def errors_and_jacobians(judge: Judge, goals: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return twist errors (m, 6) to the goals and Jacobians (m, 6, 6), both in base axes at the tip."""
    frame, axes = np.repeat(np.eye(4)[None], len(q), axis=0), []
    for joint, angle in zip(judge.joints, q.T):
        turn = np.repeat(np.eye(4)[None], len(q), axis=0)
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
        turn[:, 1, 0], turn[:, 0, 1] = np.sin(angle), -np.sin(angle)
        frame = frame @ judge.model.jointPlacements[joint.id].homogeneous @ turn
        axes.append((frame[:, :3, 2], frame[:, :3, 3]))
    frame = frame @ judge.model.frames[judge.tip].placement.homogeneous
    tip = frame[:, :3, 3]
    J = np.stack([np.concatenate([np.cross(h, tip - p), h], axis=1) for h, p in axes], axis=2)
    R = goals[:, :3, :3] @ frame[:, :3, :3].transpose(0, 2, 1)
    turn = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    sine = np.linalg.norm(turn, axis=1)
    angle = np.arctan2(sine, np.trace(R, axis1=1, axis2=2) - 1.0)
    turn *= np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 0.5)[:, None]
    return np.concatenate([goals[:, :3, 3] - tip, turn], axis=1), J


def distinct(q: np.ndarray) -> np.ndarray:
    """Return those of configurations (k, n) that differ from all before them."""
    kept: list[np.ndarray] = []
    for row in q:
        if not kept or gaps(row[None], np.array(kept)).min() >= SAME:
            kept.append(row)
    return np.array(kept)
