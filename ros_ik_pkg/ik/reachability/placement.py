"""Where the base of an arm stands best for a list of poses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.batch_solver import solve_batch
from ros_ik_pkg.ik.exceptions import ArgumentError
from ros_ik_pkg.ik.options import SolveOptions, all_demanded
from ros_ik_pkg.ik.search.reach import make_reach

ATTEMPTS = 30  # of each search: most that fail do so because there is no solution
ACROSS, TURNS = 15, 8  # candidates along x and y, and about z


@dataclass(frozen=True)
class Placement:
    """One place of the base, and what the arm does from there."""

    x: float  # of the base frame in the frame of the poses [m]
    y: float  # [m]
    yaw: float  # [rad]
    solved: int  # of the poses
    sigma_min: float  # the smallest one over the solved poses; NaN if there is none
    q: np.ndarray  # (N, n) solutions [rad, m]; NaN where there is none


def rank_placements(
    arm: Arm,
    poses: ArrayLike,
    height: float = 0.0,
    options: SolveOptions | None = None,
    progress: Callable[[int], object] | None = None,
) -> list[Placement]:
    """Rank places of the base on a floor: most poses solved first, then the largest sigma_min.

    Parameters
    ----------
    arm : Arm
    poses : (N, 4, 4) array
        Poses of the tip in any fixed frame whose z axis points up [m].
    height : float
        Of the base frame in the frame of the poses [m]. The base frame stands upright.
    options : SolveOptions, optional
        As in `solve`, but for at most 30 attempts.
    progress : callable, optional
        Called with the number of places done since the last call, of 15 * 15 * 8.

    Returns
    -------
    list of Placement
        All places from which any pose is solved, the best one first.

    Raises
    ------
    ArgumentError
        If the poses are none, or if the arm slides without end.

    """
    goals = np.array(poses, dtype=np.float64)
    if goals.ndim != 3 or goals.shape[1:] != (4, 4) or not len(goals):
        raise ArgumentError(f'poses have the shape {goals.shape}; expected (N, 4, 4)')
    reach = float(make_reach(arm.geometry).lengths[1])
    if not math.isfinite(reach):
        raise ArgumentError('the arm slides without end: its base may stand anywhere')
    options = replace(all_demanded(options or SolveOptions()), max_attempts=ATTEMPTS)
    middle = goals[:, :2, 3].mean(axis=0)
    offsets = np.linspace(-reach, reach, ACROSS)
    turns = 2.0 * math.pi * np.arange(TURNS) / TURNS
    ranked = []
    for dx in offsets:
        for dy in offsets:
            bases = [_base(middle[0] + dx, middle[1] + dy, height, yaw) for yaw in turns]
            targets = np.concatenate([np.linalg.inv(base) @ goals for base in bases])
            result = solve_batch(arm, targets, options=options)
            q = np.where(result.converged[:, None], result.q, np.nan).reshape(TURNS, len(goals), arm.n)
            for yaw, rows in zip(turns.tolist(), q):
                solved = ~np.isnan(rows[:, 0])
                if solved.any():
                    sigma = min(np.linalg.svd(arm.jacobian(row), compute_uv=False).min() for row in rows[solved])
                    ranked.append(Placement(float(middle[0] + dx), float(middle[1] + dy), yaw, int(solved.sum()),
                                            float(sigma), rows))  # fmt: skip
            if progress is not None:
                progress(TURNS)
    return sorted(ranked, key=lambda place: (-place.solved, -place.sigma_min))


def _base(x: float, y: float, z: float, yaw: float) -> np.ndarray:
    """Return the pose (4, 4) of an upright base."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0, x], [s, c, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]])
