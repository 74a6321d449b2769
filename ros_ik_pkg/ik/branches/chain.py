"""Six axes of an arm in the order in which they are solved, counted from the base or from the tip."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.branches.axes import turn_round
from ros_ik_pkg.ik.kernel.compiled import inlined, kernel
from ros_ik_pkg.ik.kernel.data_layout import Geometry
from ros_ik_pkg.ik.kernel.vectors import rotated

JOINTS = 6
TURN = 2.0 * math.pi


class Chain(NamedTuple):
    """Six axes in the order in which they are solved, and where the solutions go."""

    lines: np.ndarray  # (6, 6) direction and point of each, where all joints are zero [lengths of the arm]
    G: tuple[float, ...]  # rotation and
    t: tuple[float, ...]  # translation of the motion that the joints have to make together
    near: float  # by how much angles may be outside the limits [rad]
    slack: float  # by which equations may be missed
    free: float  # lever up to which an angle counts as free
    backwards: bool  # whether the first axis is the one at the tip
    geometry: Geometry
    bounded: bool  # whether limits count
    reference: np.ndarray  # (n,) [rad]
    branches: np.ndarray  # (BRANCH_ROWS, 6) out [rad]


@inlined
def from_other_end(chain):
    """Return the chain counted from its other end: its motions are the inverse ones."""
    turn_round(chain.lines)
    G, t = chain.G, chain.t
    G = (G[0], G[3], G[6], G[1], G[4], G[7], G[2], G[5], G[8])
    return Chain(
        chain.lines, G, rotated(G, (-t[0], -t[1], -t[2])), chain.near, chain.slack, chain.free, not chain.backwards,
        chain.geometry, chain.bounded, chain.reference, chain.branches,
    )  # fmt: skip


@inlined
def with_slack(chain, near, slack):
    """Return the chain with other slack."""
    return Chain(
        chain.lines, chain.G, chain.t, near, slack, chain.free, chain.backwards, chain.geometry, chain.bounded,
        chain.reference, chain.branches,
    )  # fmt: skip


@kernel
def put(chain, found, angles):
    """Append a branch, at the whole turns within the limits that are nearest to the reference, unless it is outside of
    them; return the number of branches."""
    geometry, row = chain.geometry, chain.branches[found]
    for k in range(JOINTS):
        i = JOINTS - 1 - k if chain.backwards else k
        q = angles[k] * geometry.multiplier[i] * (-1.0 if chain.backwards else 1.0)
        q += TURN * math.floor((chain.reference[i] - q) / TURN + 0.5)
        lower, upper = geometry.lower[i], geometry.upper[i]
        if q > upper:
            q -= TURN * math.ceil((q - upper) / TURN)
            if q < lower:  # between the limits, the long way round
                q = q + TURN if q + TURN - upper < lower - q else q
        elif q < lower:
            q += TURN * math.ceil((lower - q) / TURN)
            if q > upper:
                q = q - TURN if lower - (q - TURN) < q - upper else q
        if chain.bounded:
            if q < lower - chain.near or q > upper + chain.near:
                return found
            q = min(max(q, lower), upper)
        row[i] = q
    return found + 1


@inlined
def reference_of(chain, k):
    """Return the angle of an axis at the reference."""
    i = JOINTS - 1 - k if chain.backwards else k
    angle = chain.reference[i] * chain.geometry.multiplier[i]
    return -angle if chain.backwards else angle
