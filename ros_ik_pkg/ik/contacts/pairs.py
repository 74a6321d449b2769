"""Which pairs of links are left out because they can't collide or always touch, each with its reason."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from ros_ik_pkg.ik.contacts.bodies import Piece
from ros_ik_pkg.ik.contacts.coal_library import coal
from ros_ik_pkg.ik.contacts.frames import Bodies, frame_of
from ros_ik_pkg.ik.contacts.judge import FLOOR
from ros_ik_pkg.ik.model.tree import Tree

SAMPLES = 300
ADJACENT = 'neighbours in the tree'
HOME = 'touch at home'
ALWAYS = f'touch in each of {SAMPLES} sampled configurations'


class LeftOut(NamedTuple):
    """Two links, or a link and the floor, that may touch, and why."""

    link: str
    other: str
    reason: str


def find_left_out(
    tree: Tree, bodies: Bodies, pieces: Sequence[Piece], home: Mapping[str, float],
    allowed: Mapping[frozenset[str], str],
) -> tuple[LeftOut, ...]:
    """Return the pairs of links that are left out.

    These are the pairs of an SRDF, `allowed`, if it names any; else neighbours, and pairs that touch at home. Pairs
    that touch in every one of many configurations within all joint limits are left out too. Two links that are fixed
    to each other are not a pair.
    """
    reasons = dict(allowed)
    owners = list(dict.fromkeys(piece.owner for piece in pieces))
    if not allowed:
        for link in owners:
            if (above := _shaped_parent(tree, link)) is not None:
                reasons[frozenset((link, above))] = ADJACENT
    open_pairs = [pair for pair in combinations(owners, 2)
                  if bodies.links[pair[0]][0] != bodies.links[pair[1]][0] and frozenset(pair) not in reasons]
    shapes = {link: [(piece.convex, _transform(piece.shape.frame_from_shape)) for piece in pieces
                     if piece.owner == link] for link in owners}
    touching = open_pairs
    for number, values in enumerate(_configurations(bodies, home)):
        if not touching:
            break
        touching = _touching(bodies, values, shapes, touching)
        if number == 0:
            if not allowed:
                reasons |= {frozenset(pair): HOME for pair in touching}
                touching = [pair for pair in open_pairs if frozenset(pair) not in reasons]
            else:
                touching = open_pairs
    reasons |= {frozenset(pair): ALWAYS for pair in touching}
    found = []
    for pair, reason in reasons.items():
        if len(pair) == 2 and pair <= {*owners, FLOOR}:
            link, other = sorted(pair, key=[*tree.links, FLOOR].index)
            found.append(LeftOut(link, other, reason))
    return tuple(found)


def _shaped_parent(tree: Tree, link: str) -> str | None:
    """Return the nearest link above a link that the file gives a shape."""
    while link != tree.root:
        link = tree.joint_above[link].parent
        if link in tree.shapes:
            return link
    return None


def _configurations(bodies: Bodies, home: Mapping[str, float]) -> Iterator[list[float]]:
    """Yield the values of all joints at home, and then at SAMPLES configurations within the limits."""
    yield bodies.values(home)
    random = np.random.default_rng(0)
    for _ in range(SAMPLES):
        positions = {}
        for name, (lower, upper) in bodies.ranges.items():
            lower, upper = max(lower, -math.pi), min(upper, math.pi)
            positions[name] = random.uniform(lower, upper) if lower < upper else bodies.ranges[name][0]
        yield bodies.values(positions)


def _transform(frame: np.ndarray) -> Any:
    """Return a transform (4, 4) as a transform of coal."""
    return coal.Transform3s(frame[:3, :3], frame[:3, 3])


def _touching(bodies: Bodies, values: list[float], shapes: Mapping[str, list], pairs: list[tuple[str, str]]
              ) -> list[tuple[str, str]]:
    """Return those of the pairs that touch at these values of the joints."""
    poses = bodies.poses(values)
    placed: dict[str, list] = {}
    for link in {link for pair in pairs for link in pair}:
        body, frame = bodies.links[link]
        root_from_link = _transform(frame_of(poses[body]) @ frame)
        placed[link] = [(shape, root_from_link * at) for shape, at in shapes[link]]
    return [(one, other) for one, other in pairs if any(
        coal.collide(a, at, b, bt, coal.CollisionRequest(), coal.CollisionResult())
        for a, at in placed[one] for b, bt in placed[other])]
