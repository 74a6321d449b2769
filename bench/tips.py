"""Two arms of one robot solved together; `--tips`. The judge is Pinocchio's own reading of the URDF."""

from __future__ import annotations

import sysconfig
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin

from bench.judge import ROUNDING
from bench.model import urdf_of
from ros_ik_pkg.ik import ArmTree, SolveOptions, load_arm, load_tree, prepare_tips, solve_tips

TIPS_HEAD = [
    'robot', 'joints', 'shared', 'task', 'poses', 'solved %', 'wrong', 'median us', 'mean us', 'p99 us', 'attempts',
]  # fmt: skip
EXAMPLES = Path(sysconfig.get_path('purelib'), 'cmeel.prefix/share/example-robot-data/robots')
PUBLISHED = {
    'baxter_description/urdf/baxter.urdf': ('left_gripper', 'right_gripper'),
    'talos_data/robots/talos_reduced.urdf': ('gripper_left_base_link', 'gripper_right_base_link'),
    'tiago_description/robots/tiago_dual.urdf': ('arm_left_7_link', 'arm_right_7_link'),
    'pr2_description/urdf/pr2.urdf': ('l_gripper_palm_link', 'r_gripper_palm_link'),
    'g1_description/urdf/g1_29dof_rev_1_0.urdf': ('left_rubber_hand', 'right_rubber_hand'),
}
PATH_STEP = 0.004  # rad, m: about what a joint moves from one target of a path to the next
OPTIONS = SolveOptions(deadline=0.0, avoid_collisions=False)


class PairJudge:
    """Pinocchio's kinematics of both tips, from a URDF that Pinocchio parsed."""

    def __init__(self, arms: ArmTree, model: pin.Model) -> None:
        self.arms, self.model, self.data = arms, model, model.createData()
        self.base, *self.tips = (model.getFrameId(name) for name in (arms.base_frame, *arms.tip_frames))
        self.joints = [model.joints[model.getJointId(name)] for name in arms.joint_names]

    def forward(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the poses (4, 4) of both tips in the base frame at q (n,)."""
        values = pin.neutral(self.model)
        for joint, value in zip(self.joints, q):
            values[joint.idx_q : joint.idx_q + joint.nq] = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
        pin.framesForwardKinematics(self.model, self.data, values)
        base = self.data.oMf[self.base]
        first, second = (base.actInv(self.data.oMf[tip]).homogeneous for tip in self.tips)
        return first, second

    def targets(self, q: np.ndarray, relative: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return the targets that q (n,) reaches, the first in the frame of the second tip if `relative`."""
        first, second = self.forward(q)
        return (np.linalg.inv(second) @ first if relative else first), second

    def holds(self, targets: tuple[np.ndarray, np.ndarray], q: np.ndarray, relative: bool) -> bool:
        """Return whether q (n,) is within the limits and brings both tips to their targets, within the tolerances."""
        errors = [
            (np.linalg.norm(target[:3, 3] - pose[:3, 3]), np.linalg.norm(pin.log3(target[:3, :3] @ pose[:3, :3].T)))
            for target, pose in zip(targets, self.targets(q, relative))
        ]
        inside = bool(np.all((self.arms.lower <= q) & (q <= self.arms.upper)))
        return inside and all(p <= OPTIONS.position_tolerance + ROUNDING
                              and o <= OPTIONS.orientation_tolerance + ROUNDING for p, o in errors)  # fmt: skip


def robots() -> Iterator[tuple[ArmTree, pin.Model]]:
    """Return the robots with Pinocchio's own models of them."""
    for path, tips in PUBLISHED.items():
        yield load_tree(EXAMPLES / path, tips), pin.buildModelFromUrdf(str(EXAMPLES / path))
    for robot, carrier in (('panda', 'lift'), ('ur5', 'nothing')):
        text = two_arms(robot, carrier)
        yield load_tree(text, ('left_tip', 'right_tip')), pin.buildModelFromXML(text)


def two_arms(robot: str, carrier: str) -> str:
    """Return a URDF of two arms of config/robots, side by side on a lift that turns or on nothing that moves."""
    text = urdf_of(load_arm(robot))
    body = text[text.index('>') + 1 : text.index('</robot>')]
    parts = [body.replace('link="', f'link="{side}').replace('name="', f'name="{side}') for side in ('left_', 'right_')]
    moves = carrier == 'lift'
    limit = '<limit lower="{0}" upper="{1}" velocity="1" effort="1"/>'
    lift = f'<joint name="lift" type="prismatic"><axis xyz="0 0 1"/>{limit.format(0.0, 0.8)}'
    turn = f'<joint name="turn" type="revolute"><axis xyz="0 0 1"/>{limit.format(-2.0, 2.0)}'
    still = ('<joint name="lift" type="fixed">', '<joint name="turn" type="fixed">')
    first, second = (lift, turn) if moves else still
    sides = ''.join(
        f'<joint name="{side}mount" type="fixed"><parent link="torso"/><child link="{side}base"/>'
        f'<origin xyz="0 {y} 0" rpy="{-2.0 * y} 0 0"/></joint>'
        for side, y in (('left_', 0.3), ('right_', -0.3))
    )
    return (
        f'<robot name="two {robot} on {carrier}"><link name="floor"/><link name="column"/><link name="torso"/>'
        f'{first}<parent link="floor"/><child link="column"/></joint>'
        f'{second}<parent link="column"/><child link="torso"/></joint>{parts[0]}{parts[1]}{sides}</robot>'
    )


def tip_rows(count: int) -> list[list[str]]:
    """Return the table under TIPS_HEAD."""
    prepare_tips()
    rows = []
    for arms, model in robots():
        judge = PairJudge(arms, model)
        for task in ('two poses', 'relative'):
            for kind in ('cold', 'tracking'):
                figures, solved, wrong = _measure(judge, kind, task == 'relative', count)
                shared = str(int((arms.side == 0).sum()))
                rows.append([arms.name, str(arms.n), shared, task, f'{count} {kind}', f'{100 * solved / count:.2f}',
                             str(wrong), *figures])  # fmt: skip
    return rows


def _measure(judge: PairJudge, kind: str, relative: bool, count: int) -> tuple[list[str], int, int]:
    """Solve pairs from random seeds, or a path from the answer before; return times, and what was solved and wrong."""
    arms, random = judge.arms, np.random.default_rng(0)
    lower, upper = np.maximum(arms.lower, -np.pi), np.minimum(arms.upper, np.pi)
    q = random.uniform(lower, upper, (count, arms.n))
    if kind == 'tracking':
        time_of = PATH_STEP * np.arange(count)[:, None]
        phases, speeds = random.uniform(0.0, 2.0 * np.pi, arms.n), random.uniform(0.5, 1.5, arms.n)
        q = (lower + upper) / 2.0 + 0.35 * (upper - lower) * np.sin(speeds * time_of + phases)
    seed = q[0] if kind == 'tracking' else None
    seconds, attempts, solved, wrong = np.empty(count), np.empty(count), 0, 0
    for k in range(count):
        targets = judge.targets(q[k], relative)
        start = random.uniform(lower, upper) if seed is None else seed
        began = time.perf_counter()
        solution = solve_tips(arms, targets, start, OPTIONS, relative=relative)
        seconds[k], attempts[k] = time.perf_counter() - began, solution.attempts
        good = judge.holds(targets, solution.q, relative)
        solved += solution.converged and good
        wrong += solution.converged and not good
        seed = seed if seed is None else solution.q.copy()
    figures = [np.median(seconds), seconds.mean(), np.percentile(seconds, 99)]
    return [*(f'{1e6 * figure:.1f}' for figure in figures), f'{attempts.mean():.1f}'], solved, wrong
