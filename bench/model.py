"""An arm as plain data and as a URDF file, so that every library gets exactly the same one."""

from __future__ import annotations

import math
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import pinocchio as pin

from bench.solver import Model
from ros_ik_pkg.ik import Arm

FAST = 3.0  # rad/s or m/s, for libraries that insist on a velocity limit


def make_model(arm: Arm, source: str, folder: Path) -> Model:
    """Return the arm as plain data, with its URDF in a folder if every joint has its own variable."""
    path = folder / f'arm{len(list(folder.iterdir()))}.urdf'
    if is_plain(arm):
        path.write_text(urdf_of(arm))
    arrays = arm.placements, arm.prismatic, arm.lower, arm.upper
    return Model(arm.name, source, str(path), *(array.tolist() for array in arrays))


def is_plain(arm: Arm) -> bool:
    """Return whether every joint has its own variable, as all libraries expect."""
    return bool(
        np.array_equal(arm.variable, np.arange(arm.n)) and (arm.multiplier == 1.0).all() and (arm.offset == 0.0).all()
    )


def urdf_of(arm: Arm) -> str:
    """Write the chain from base to tip as a URDF: joints q0, q1, ... with their axes along z."""
    links = ['base', *(f'link{k}' for k in range(1, arm.n + 1)), 'tip']
    joints = [_joint(arm, k, links[k], links[k + 1]) for k in range(arm.n)]
    joints.append(f'<joint name="to_tip" type="fixed">{_placed(arm.placements[-1], links[-2], links[-1])}</joint>')
    body = ''.join(f'<link name="{link}"/>\n' for link in links) + '\n'.join(joints)
    return f'<robot name={quoteattr(arm.name)}>\n{body}\n</robot>\n'


def _joint(arm: Arm, k: int, parent: str, child: str) -> str:
    lower, upper = float(arm.lower[k]), float(arm.upper[k])
    bounded = math.isfinite(lower) and math.isfinite(upper)
    kind = 'prismatic' if arm.prismatic[k] else 'revolute' if bounded else 'continuous'
    limits = f' lower="{lower!r}" upper="{upper!r}"' if bounded else ''
    return (
        f'<joint name="q{k}" type="{kind}">{_placed(arm.placements[k], parent, child)}'
        f'<axis xyz="0 0 1"/><limit{limits} velocity="{FAST}" effort="1"/></joint>'
    )


def _placed(placement: np.ndarray, parent: str, child: str) -> str:
    angles = pin.rpy.matrixToRpy(placement[:9].reshape(3, 3))
    xyz, rpy = (' '.join(repr(float(value)) for value in vector) for vector in (placement[9:], angles))
    return f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/>'
