"""Every motion checked: random paths among obstacles; SciPy's polynomials, Pinocchio and coal are the judges;
`scripts/bench --check-paths N`.

Judged on a grid ten times as fine as the rows, as a joint trajectory controller runs the motion: limits of position,
velocity and acceleration, the tip against its line; and contact at random times of it, on the meshes as they are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from multiprocessing import get_context

import numpy as np
from scipy.interpolate import BPoly
from scipy.spatial.transform import Rotation
from tqdm import tqdm

from bench.collision import WORLDS, add_room
from bench.judge import Judge, rotation_vectors
from bench.paths import random_path
from bench.published_robots import PANDA, UR5, XARM7, Z1, UrdfJudge, moving_pairs
from ros_ik_pkg.ik import Arm, PathOptions, PathSolution, load_arm, solve_path

CHECK_HEAD = ('arm', 'room', 'paths', 'whole', 'in part', 'none', 'reconfigured', 'led', 'arcs', 'rows', 'violations')
ROBOTS = {'panda': PANDA, 'xarm7': XARM7, 'ur5': UR5, 'z1': Z1}
FINER = 10
PROCESSES = 2
ROUNDING = 1e-6  # of a limit
SEED = 15
RAMP = 0.5  # s, the default acceleration; see docs/paths.md


@dataclass(frozen=True)
class Case:
    """What was seen of the random paths of one arm in one room, and what is wrong with their motions."""

    arm: str
    room: str
    seen: Counter[str]
    faults: list[str]


def check_rows(count: int) -> tuple[list[tuple[str, ...]], int]:
    """Return a row for each arm and room, and how many of `count` paths in all violate something."""
    cases = check_cases(count, SEED)
    for case in cases:
        for fault in case.faults:
            print(fault)
    rows = [(case.arm, case.room, *(str(case.seen[head]) for head in CHECK_HEAD[2:-1]), str(len(case.faults)))
            for case in cases]  # fmt: skip
    return rows, sum(len(case.faults) for case in cases)


def check_cases(count: int, seed: int) -> list[Case]:
    """Judge `count` random paths, as many for each arm and room, on two cores."""
    cases = [(k, i) for k in range(len(ROBOTS)) for i in range(len(WORLDS))]
    each = -(-count // len(cases))
    with ProcessPoolExecutor(PROCESSES, get_context('spawn')) as pool:
        found = pool.map(check_case, cases, repeat(each), repeat(seed))
        return list(tqdm(found, desc='paths', total=len(cases), leave=False))


def check_case(case: tuple[int, int], count: int, seed: int) -> Case:
    """Judge `count` random paths of one arm in one room."""
    k, i = case
    (name, (urdf, srdf, tip)), (title, world) = list(ROBOTS.items())[k], list(WORLDS.items())[i]
    arm = load_arm(urdf, tip=tip, srdf=srdf)
    room = arm.contacts.room(world)
    contact = UrdfJudge(urdf, moving_pairs(room), room.positions, base=arm.base_frame)
    add_room(contact, arm, room, world)
    judge, random, faults = Judge(arm), np.random.default_rng([seed, k, i]), []
    seen: Counter[str] = Counter()
    for number in range(count):
        path = random_options(arm, random)
        poses = random_path(arm, random, int(random.integers(2, 12)))
        vias = range(1, len(poses) - 1, 2) if random.random() < 0.3 and not straight(poses) else ()
        start = random.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi))
        motion = solve_path(
            arm, poses, start if path.lead_in or random.random() < 0.5 else None, path=path, vias=vias, world=world
        )
        rows = len(motion.q)
        seen['paths'] += 1
        seen['whole' if motion.complete else 'in part' if rows > 1 else 'none'] += 1
        seen['reconfigured'] += bool(motion.reconfigurations)
        seen['led'] += motion.led
        seen['arcs'] += len(vias) > 0
        seen['rows'] += rows
        if rows > 1 and (fault := violation(arm, judge, contact, motion, path, poses, vias)):
            faults.append(f'{name} {title}, path {number}: {fault}')
    return Case(name, title, seen, faults)


def straight(poses: np.ndarray) -> bool:
    """Return whether poses (K, 4, 4) lie on a line, so that no arc leads through three of them."""
    moved = np.diff(poses[:, :3, 3], axis=0)
    across = np.linalg.norm(np.cross(moved[:-1], moved[1:]), axis=1)
    return not (across > 1e-5 * (moved * moved).sum(axis=1).max(initial=0.0)).all()


def random_options(arm: Arm, random: np.random.Generator) -> PathOptions:
    """Draw options of a path; no deadline, so that a run repeats."""
    return PathOptions(
        step=float(random.choice([0.005, 0.02])), max_reconfigurations=int(random.choice([0, 3])), samples=16,
        tool_speed=float(random.choice([0.0, 0.1])), lead_in=bool(random.random() < 0.3), deadline=0.0,
        acceleration_limits=tuple(random.uniform(0.5, 5.0, arm.n)) if random.random() < 0.5 else (),
    )  # fmt: skip


def violation(
    arm: Arm, judge: Judge, contact: UrdfJudge, solution: PathSolution, path: PathOptions, poses: np.ndarray,
    vias: Sequence[int] = (),
) -> str:  # fmt: skip
    """Return what is wrong with a motion along poses (K, 4, 4), empty if nothing is."""
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
    away, turned = from_line(judge, solution, poses, vias, q[on_path], row[on_path])
    if (away > path.tolerance).any() or (turned > path.angle_tolerance).any():
        return f'the tip is {away.max():.3g} m and {turned.max():.3g} rad off its line'
    for place, row_of_grid in enumerate(q):
        if contact.touches(arm.joint_names, row_of_grid):
            return f'contact after row {place // FINER}, at {row_of_grid.tolist()}'
    return ''


def from_line(
    judge: Judge, solution: PathSolution, poses: np.ndarray, vias: Sequence[int], q: np.ndarray, row: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances (N,) [m, rad] of the tip at q (N, n), after these rows (N,), from the path as it was given:
    poses (K, 4, 4), of which `vias` are the middles of arcs."""
    tips, away, angle = judge.forward(q), np.zeros(len(q)), np.zeros(len(q))
    segment = np.ceil(solution.place[row + 1] - 1e-9).astype(int) - 1
    for k in np.unique(segment):
        here, start, end = segment == k, poses[k], poses[k + 1]
        points = tips[here][:, :3, 3]
        turn = rotation_vectors((end[:3, :3] @ start[:3, :3].T)[None])
        via = next((via for via in vias if via in (k, k + 1)), None)
        if via is None:
            along, gone, way = end[:3, 3] - start[:3, 3], points - start[:3, 3], end[:3, 3] - start[:3, 3]
            if np.linalg.norm(way) < 1e-9:  # the tip only turns
                way, gone = turn[0], rotation_vectors(tips[here][:, :3, :3] @ start[:3, :3].T)
            fraction = np.clip(gone @ way / (way @ way), 0.0, 1.0)
            away[here] = np.linalg.norm(start[:3, 3] + np.outer(fraction, along) - points, axis=1)
        else:
            fraction, away[here] = from_arc(points, poses[via - 1 : via + 2, :3, 3], k - via + 1)
        wanted = Rotation.from_rotvec(fraction[:, None] * turn).as_matrix() @ start[:3, :3]
        angle[here] = np.linalg.norm(rotation_vectors(wanted @ tips[here][:, :3, :3].transpose(0, 2, 1)), axis=1)
    return away, angle


def from_arc(points: np.ndarray, ends: np.ndarray, half: int) -> tuple[np.ndarray, np.ndarray]:
    """Return of points (N, 3) the fraction of the way along one half of the arc through three ends (3, 3), and the
    distance from its circle [m], (N,) each."""
    normal = np.cross(ends[1] - ends[0], ends[2] - ends[0])
    normal /= np.linalg.norm(normal)
    # The centre is as far from all ends, and in their plane.
    planes = np.stack([ends[1] - ends[0], ends[2] - ends[0], normal])
    offsets = [0.5 * (ends[1] @ ends[1] - ends[0] @ ends[0]), 0.5 * (ends[2] @ ends[2] - ends[0] @ ends[0]),
               normal @ ends[0]]  # fmt: skip
    centre = np.linalg.solve(planes, offsets)
    first, last = ends[half] - centre, ends[half + 1] - centre

    def angle_of(vectors: np.ndarray) -> np.ndarray:
        return np.arctan2(np.cross(first, vectors) @ normal, vectors @ first) % (2.0 * np.pi)

    whole, radial, out = angle_of(last), points - centre, (points - centre) @ normal
    angle = angle_of(radial)
    angle = np.where(angle > 0.5 * (whole + 2.0 * np.pi), 0.0, np.minimum(angle, whole))
    in_plane = np.linalg.norm(radial - np.outer(out, normal), axis=1)
    return angle / whole, np.hypot(in_plane - np.linalg.norm(first), out)
