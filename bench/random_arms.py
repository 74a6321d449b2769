"""Made-up arms as URDF: any joint kinds, placements, axes and limits."""

from __future__ import annotations

import numpy as np

KINDS = ('revolute', 'continuous', 'prismatic')
KIND_SHARES = (0.65, 0.15, 0.2)
MOST_JOINTS = 9
MADE_UP = 'made_up'  # the name of each


def random_urdf(random: np.random.Generator) -> str:
    """Make up an arm of 1 to MOST_JOINTS joints from link 'base' to link 'tip'."""
    count = int(random.integers(1, MOST_JOINTS + 1))
    links = ['base', *(f'link{k}' for k in range(1, count)), 'tip']
    joints = [_joint(random, k, links[k], links[k + 1]) for k in range(count)]
    parts = [*(f'<link name="{link}"/>' for link in links), *joints]
    return f'<robot name="{MADE_UP}">{"".join(parts)}</robot>'


def _joint(random: np.random.Generator, k: int, parent: str, child: str) -> str:
    """Write one joint; half of the axes and angles are along or around x, y or z, as in real arms."""
    kind = random.choice(KINDS, p=KIND_SHARES)
    straight = random.random() < 0.5
    axis = np.eye(3)[random.integers(3)] if straight else random.normal(size=3)
    rpy = random.integers(-1, 2, 3) * np.pi / 2 if straight else random.uniform(-np.pi, np.pi, 3)
    xyz = random.uniform(-0.5, 0.5, 3) * (random.random(3) < 0.6)
    reach = 2 * np.pi if kind == 'revolute' else 1.0
    limit = f'lower="{random.uniform(-reach, -0.1)}" upper="{random.uniform(0.1, reach)}" '
    return (
        f'<joint name="q{k}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_text(xyz)}" rpy="{_text(rpy)}"/><axis xyz="{_text(axis)}"/>'
        f'<limit {limit if kind != "continuous" else ""}velocity="1" effort="1"/></joint>'
    )


def _text(vector: np.ndarray) -> str:
    return ' '.join(repr(float(value)) for value in vector)
