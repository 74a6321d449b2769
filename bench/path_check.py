"""Every motion checked: random paths among obstacles; SciPy's polynomials, Pinocchio and coal are the judges;
`scripts/bench --check-paths N`.

Judged on a grid ten times as fine as the rows, as a joint trajectory controller runs the motion: limits of position,
velocity and acceleration, the tip against its line; and contact at random times of it, on the meshes as they are.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from scipy.interpolate import BPoly
from scipy.spatial.transform import Rotation
from tqdm import tqdm

from bench.collision import WORLDS, add_room
from bench.judge import Judge, rotation_vectors
from bench.paths import random_path
from bench.published_robots import PANDA, UR5, XARM7, Z1, UrdfJudge, moving_pairs
from ros_ik_pkg.ik import Arm, PathOptions, PathSolution, load_arm, solve_path

CHECK_HEAD = ('arm', 'room', 'paths', 'whole', 'in part', 'none', 'reconfigured', 'led', 'rows', 'violations')
ROBOTS = {'panda': PANDA, 'xarm7': XARM7, 'ur5': UR5, 'z1': Z1}
FINER = 10
LOOKS = 20  # for contact, at each motion
ROUNDING = 1e-6  # of a limit
SEED = 15
RAMP = 0.5  # s, the default acceleration; see docs/paths.md


def check_rows(count: int) -> tuple[list[tuple[str, ...]], int]:
    """Return a row for each arm and room, and how many of `count` paths in all violate something."""
    rows, wrong = [], 0
    each = -(-count // (len(ROBOTS) * len(WORLDS)))
    for k, (name, (urdf, srdf, tip)) in enumerate(ROBOTS.items()):
        arm = load_arm(urdf, tip=tip, srdf=srdf)
        for i, (title, world) in enumerate(WORLDS.items()):
            room = arm.contacts.room(world)
            contact = UrdfJudge(urdf, moving_pairs(room), room.positions, base=arm.base_frame)
            add_room(contact, arm, room, world)
            judge, random, seen = Judge(arm), np.random.default_rng([SEED, k, i]), Counter()
            for _ in tqdm(range(each), desc=f'{name} {title}', leave=False):
                path = random_options(arm, random)
                poses = random_path(arm, random, int(random.integers(2, 12)))
                seed = random.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi))
                motion = solve_path(arm, poses, seed if path.lead_in or random.random() < 0.5 else None, path=path,
                                    world=world)  # fmt: skip
                rows_of_it = len(motion.q)
                seen['whole' if motion.complete else 'in part' if rows_of_it > 1 else 'none'] += 1
                seen['reconfigured'] += bool(motion.reconfigurations)
                seen['led'] += motion.led
                seen['rows'] += rows_of_it
                if rows_of_it > 1 and (fault := violation(arm, judge, contact, motion, path, random)):
                    seen['violations'] += 1
                    tqdm.write(f'{name} {title}: {fault}')
            figures = (str(seen[head]) for head in CHECK_HEAD[3:])
            rows.append((name, title, str(each), *figures))
            wrong += seen['violations']
    return rows, wrong


def random_options(arm: Arm, random: np.random.Generator) -> PathOptions:
    """Draw options of a path; no deadline, so that a run repeats."""
    return PathOptions(
        step=float(random.choice([0.005, 0.02])), max_reconfigurations=int(random.choice([0, 3])), samples=16,
        tool_speed=float(random.choice([0.0, 0.1])), lead_in=bool(random.random() < 0.3), deadline=0.0,
        acceleration_limits=tuple(random.uniform(0.5, 5.0, arm.n)) if random.random() < 0.5 else (),
    )  # fmt: skip


def violation(
    arm: Arm, judge: Judge, contact: UrdfJudge, solution: PathSolution, path: PathOptions, random: np.random.Generator
) -> str:
    """Return what is wrong with a motion, empty if nothing is."""
    if not (np.diff(solution.times) > 0.0).all():
        return 'times do not rise'
    motion = BPoly.from_derivatives(
        solution.times, np.stack([solution.q, solution.velocities, solution.accelerations], axis=1)
    )
    count = len(solution.q)
    grid = np.interp(np.arange(FINER * (count - 1) + 1) / FINER, np.arange(count), solution.times)
    q, v, a = (motion(grid, order) for order in range(3))
    velocity = np.where(np.isfinite(arm.velocity_limits), arm.velocity_limits, 1.0)
    acceleration = np.array(path.acceleration_limits or velocity / RAMP)
    if not judge.inside(q, 1e-9).all():
        return f'a joint is {np.maximum(arm.lower - q, q - arm.upper).max():.3g} beyond its limits'
    if (np.abs(v) > velocity * (1.0 + ROUNDING)).any():
        return 'a joint is too fast'
    if (np.abs(a) > acceleration * (1.0 + ROUNDING)).any():
        return 'a joint accelerates too much'
    row = np.minimum(np.arange(len(grid)) // FINER, count - 2)
    on_path = ~np.isin(row, [0, *solution.reconfigurations] if solution.led else solution.reconfigurations)
    away, turned = from_line(judge, solution, q[on_path], row[on_path])
    if (away > path.tolerance).any() or (turned > path.angle_tolerance).any():
        return f'the tip is {away.max():.3g} m and {turned.max():.3g} rad off its line'
    for row_of_look in random.choice(q, min(LOOKS, len(q)), replace=False):
        if contact.touches(arm.joint_names, row_of_look):
            return f'contact at {row_of_look.tolist()}'
    return ''


def from_line(
    judge: Judge, solution: PathSolution, q: np.ndarray, row: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances (N,) [m, rad] of the tip at q (N, n) from the lines that begin at these rows."""
    if not len(q):
        return np.zeros(1), np.zeros(1)
    tips, start, end = judge.forward(q), solution.base_from_tip[row], solution.base_from_tip[row + 1]
    along, gone = (end - start)[:, :3, 3], (tips - start)[:, :3, 3]
    turn = rotation_vectors(end[:, :3, :3] @ start[:, :3, :3].transpose(0, 2, 1))
    turned = rotation_vectors(tips[:, :3, :3] @ start[:, :3, :3].transpose(0, 2, 1))
    straight = np.linalg.norm(along, axis=1, keepdims=True) > 1e-9
    way, done = np.where(straight, along, turn), np.where(straight, gone, turned)
    fraction = np.clip((way * done).sum(axis=1) / (way * way).sum(axis=1), 0.0, 1.0)[:, None]
    wanted = Rotation.from_rotvec(fraction * turn).as_matrix() @ start[:, :3, :3]
    angle = rotation_vectors(wanted @ tips[:, :3, :3].transpose(0, 2, 1))
    return np.linalg.norm(fraction * along - gone, axis=1), np.linalg.norm(angle, axis=1)
