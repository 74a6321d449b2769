"""Contacts: which links of a robot can touch each other or the room, for the compiled search and the exact check."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property
from operator import is_
from pathlib import Path
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik.collision.scene import (
    NO_FLOOR,
    PAIR,
    PIECE,
    Scene,
    clearances_of,
    contacts_of,
    count_contacts,
    pack_scene,
)
from ros_ik_pkg.ik.contacts.bodies import Piece, load_pieces
from ros_ik_pkg.ik.contacts.frames import HELD, Bodies, frame_of, make_bodies, row_of
from ros_ik_pkg.ik.contacts.judge import FLOOR, Contact, Judge
from ros_ik_pkg.ik.contacts.kept_apart import bounds_of, find_kept_apart
from ros_ik_pkg.ik.contacts.levers import make_levers
from ros_ik_pkg.ik.contacts.pairs import find_left_out
from ros_ik_pkg.ik.contacts.srdf import read_allowed
from ros_ik_pkg.ik.exceptions import ArgumentError
from ros_ik_pkg.ik.model.tree import Tree
from ros_ik_pkg.ik.text import list_names, suggest
from ros_ik_pkg.ik.world import Obstacle, World

LOG = logging.getLogger(__name__)
EMPTY = World()
PROBES = 64  # configurations; no part of the room may touch a link in all of them


class Contacts:
    """The shapes of one robot, for one of its arms.

    Attributes
    ----------
    left_out : tuple of LeftOut
        Pairs of links that may touch, with the reason.
    warnings : tuple of str
        Shapes that are left out because they cannot be used, such as meshes that are not found.
    """

    def __init__(
        self, tree: Tree, model: pin.Model, base: str, variables: Sequence[str], home: np.ndarray,
        lower: np.ndarray, upper: np.ndarray,
        srdf: str | os.PathLike[str] | None = None, meshes: Iterable[str | os.PathLike[str]] = (),
    ) -> None:
        """Load the shapes; raises ModelError if the SRDF cannot be used."""
        self._tree, self._model, self._base = tree, model, base
        self._home, self._variables = dict(zip(variables, home)), tuple(variables)
        self._limits = lower, upper
        self._pieces, self.warnings = load_pieces(tree, [Path(folder).expanduser() for folder in meshes])
        self._bodies = make_bodies(tree, variables)
        self._bounds = bounds_of(self._bodies, lower, upper)
        self.left_out = find_left_out(tree, self._bodies, self._pieces, self._home, read_allowed(srdf, tree))
        for warning in self.warnings:
            LOG.warning('%s', warning)
        LOG.info('links that may touch: %s', self.described())
        self._kept: Room | None = None
        self._obstacle_pieces: WeakKeyDictionary[Obstacle, Piece] = WeakKeyDictionary()
        self._kept_apart = self._find_kept_apart()

    @property
    def known(self) -> bool:
        """Whether the robot has any shapes."""
        return len(self._pieces) > 0

    def described(self) -> str:
        """Return the pairs that are left out as a text."""
        return '; '.join(f'{pair.link} - {pair.other} ({pair.reason})' for pair in self.left_out)

    @property
    def outside(self) -> tuple[str, ...]:
        """Names of the joints outside the chain that place a link with a shape."""
        bodies = {self._bodies.links[link][0] for link in self.links}
        above = {body for one in bodies for body in self._bodies.above(one)}
        names = (self._bodies.drives[body - 1][0] for body in sorted(above) if body)
        return tuple(dict.fromkeys(name for name in names if name not in self._variables))

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the links that have shapes."""
        return tuple(dict.fromkeys(piece.owner for piece in self._pieces))

    def _find_kept_apart(self) -> dict[tuple[int, int], float]:
        """Return the distance [m] that pairs of the robot's pieces keep, see `find_kept_apart`."""
        room = Room(self, EMPTY, {})
        owners = [room._body_of(piece)[0] for piece in self._pieces]
        return find_kept_apart(room.packed, self._bodies, owners, room._pairs, room.levers, self._bounds)

    def pieces_of(self, link: str) -> tuple[Piece, ...]:
        """Return the shapes of a link, a mesh in convex parts."""
        return tuple(piece for piece in self._pieces if piece.owner == link)

    def piece_of(self, obstacle: Obstacle) -> Piece:
        """Return the shape of an obstacle, the same object as long as the obstacle exists."""
        return self._obstacle_pieces.setdefault(obstacle, Piece(obstacle.name, obstacle.shape))

    def room(self, world: World | None = None) -> Room:
        """Return the arm in a world, ready to be checked; the last one is kept.

        Raises ArgumentError if the world names unknown links, or if something in it touches a link in every
        configuration.
        """
        world = EMPTY if world is None else world
        kept = self._kept
        if kept is None or kept.world is not world:
            kept = self._kept = Room(self, world) if kept is None else kept.changed(world)
        return kept

    def look(self, q: np.ndarray, world: World | None = None, meshes: bool = False) -> Contact:
        """Return the two things that are nearest to each other at q (n,), by coal.

        `meshes`: whether to take meshes as they are, not the convex hulls of their parts.
        """
        return self.room(world).look(q, meshes)

    def is_clear(self, q: np.ndarray, margin: float = 0.0, world: World | None = None, meshes: bool = False) -> bool:
        """Return whether nothing touches at q (n,) or comes nearer than `margin` [m], by coal."""
        return self.room(world).is_clear(q, margin, meshes)


class Room:
    """An arm in a world: the packed scene for compiled code, and the exact check."""

    def __init__(
        self, contacts: Contacts, world: World, kept_apart: Mapping[tuple[int, int], float] | None = None
    ) -> None:
        """`kept_apart`: the distance [m] that pairs of the robot's pieces keep; that of the contacts by default."""
        self.world = world
        self._contacts = contacts
        self._kept_apart = contacts._kept_apart if kept_apart is None else kept_apart
        self._bodies: Bodies = contacts._bodies
        self._pieces = (*contacts._pieces, *map(contacts.piece_of, world.obstacles))
        self._held: dict[str, Obstacle] = {obstacle.name: obstacle for obstacle in world.obstacles}
        self._check_names()
        self._values = self._bodies.values({**contacts._home, **world.positions})
        self._pairs = self._find_pairs()
        self._grounded = self._find_grounded() if world.floor is not None else []
        self._judges: dict[bool, Judge] = {}
        self._model: tuple[np.ndarray, np.ndarray] | None = None  # a packed arm, and the same with the scene behind it
        self._refuse_walls()

    def changed(self, world: World) -> Room:
        """Return the arm in another world; if only joints have moved, in a fraction of the time."""
        same = world.floor == self.world.floor and len(world.obstacles) == len(self.world.obstacles)
        if not same or not all(map(is_, world.obstacles, self.world.obstacles)):
            return Room(self._contacts, world)
        room = copy(self)
        for made in ('packed', 'levers'):
            room.__dict__.pop(made, None)
        room.world, room._model = world, None
        room._check_names()
        room._values = self._bodies.values({**self._contacts._home, **world.positions})
        room._refuse_walls()
        return room

    @property
    def positions(self) -> dict[str, float]:
        """Where the joints outside the chain stand [rad, m], mimic joints included."""
        names = [joint.name for joint in self._contacts._tree.joints if joint.movable]
        return {name: value for name, value, drive in zip(names, self._values, self._bodies.drives)
                if drive[0] not in self._contacts._variables}

    def _check_names(self) -> None:
        """Raise ArgumentError if an obstacle has the name of a link, or names an unknown link."""
        links = self._contacts._tree.links
        for obstacle in self.world.obstacles:
            if obstacle.name in links or obstacle.name == FLOOR:
                raise ArgumentError(f'obstacle {obstacle.name!r} has the name of a link or of the floor')
            for link in (*([obstacle.link] if obstacle.link else []), *obstacle.touches):
                if link not in links:
                    raise ArgumentError(f'obstacle {obstacle.name!r}: link {link!r} does not exist; '
                                        f'{suggest(link, links)}')
        unknown = [name for name in self.world.positions if name not in self._contacts._tree.joint_named]
        if unknown:
            raise ArgumentError(f'position of joint {list_names(unknown)}, which the robot does not have')

    def _body_of(self, piece: Piece) -> tuple[int, np.ndarray]:
        """Return the body of a piece, and the pose of its owner's frame in the body's."""
        obstacle = self._held.get(piece.owner)
        return self._bodies.links[piece.owner if obstacle is None else obstacle.link or self._contacts._base]

    def _between(self, one: int, other: int) -> bool:
        """Return whether a variable of the chain moves two bodies relative to each other."""
        apart = set(self._bodies.above(one)) ^ set(self._bodies.above(other))
        return any(self._bodies.drives[body - 1][0] in self._contacts._variables for body in apart if body)

    def _find_pairs(self) -> list[tuple[int, int]]:
        """Return the pairs of pieces that may touch and move relative to each other, as a Scene has them in order."""
        left_out = {frozenset((pair.link, pair.other)) for pair in self._contacts.left_out}
        bodies = [self._body_of(piece)[0] for piece in self._pieces]
        moves: dict[tuple[int, int], bool] = {}
        pairs = []
        for j in range(len(self._pieces)):
            for i in range(j):
                key = bodies[i], bodies[j]
                if key not in moves:
                    moves[key] = bodies[i] != bodies[j] and self._between(*key)
                if moves[key] and not self._may_touch(self._pieces[i].owner, self._pieces[j].owner, left_out):
                    pairs.append((i, j))
        return sorted(pairs, key=self._distance_kept)

    def _find_grounded(self) -> list[int]:
        """Return the pieces that move relative to the floor and may not touch it."""
        base, left_out = self._bodies.links[self._contacts._base][0], {pair[:2] for pair in self._contacts.left_out}
        return [k for k, piece in enumerate(self._pieces)
                if self._between(self._body_of(piece)[0], base) and (piece.owner, FLOOR) not in left_out]

    def _distance_kept(self, pair: tuple[int, int]) -> float:
        """Return the distance that two pieces keep [m], -inf if none is known."""
        return self._kept_apart.get(pair, -np.inf)

    def _may_touch(self, one: str, other: str, left_out: set[frozenset[str]]) -> bool:
        """Return whether two owners of pieces may touch."""
        for name, partner in ((one, other), (other, one)):
            held = self._held.get(name)
            if held and (partner in (held.link, *held.touches) if held.link else {partner, FLOOR} in left_out):
                return True
        return {one, other} in left_out

    @cached_property
    def packed(self) -> np.ndarray:
        """The packed scene for compiled code."""
        joints, poses = self._bodies.joints.copy(), self._bodies.poses(self._values)
        for row, value in zip(joints, self._values):
            if row[2] < 0.0:
                row[4] = value if row[2] != HELD else 0.0
        rows, points = [], []
        count = 0
        for piece in self._pieces:
            body, frame = self._body_of(piece)
            if body and joints[body - 1, 2] == HELD:  # it stands in the root frame
                body, frame = 0, frame_of(poses[body]) @ frame
            cover = piece.cover
            vertices, axes = (points @ frame[:3, :3].T + frame[:3, 3] for points in (cover.points, piece.axes))
            rows.append([
                body, count, cover.few, cover.radius, len(vertices), cover.fine_radius,
                *axes[0], piece.radii[0], *axes[1], *axes[2], piece.radii[1],
            ])  # fmt: skip
            points.append(vertices)
            count += len(vertices)
        base, frame = self._bodies.links[self._contacts._base]
        floor = NO_FLOOR if self.world.floor is None else self.world.floor
        pairs = [(*pair, self._distance_kept(pair)) for pair in self._pairs]
        return pack_scene(Scene(
            len(self._contacts._variables), base, floor, joints, poses, np.array(rows).reshape(-1, PIECE),
            np.array(pairs).reshape(-1, PAIR), np.array(self._grounded), row_of(frame), self._contacts._bounds,
            np.vstack([*points, np.empty((0, 3))]).T,
        ))  # fmt: skip

    @cached_property
    def levers(self) -> np.ndarray:
        """The most that the gap of each contact shrinks per rad or m of each joint of the arm, (C, n)."""
        balls = []
        for piece in self._pieces:
            body, frame = self._body_of(piece)
            centre = frame[:3, :3] @ piece.axes[0] + frame[:3, 3]
            balls.append((body, float(np.linalg.norm(centre)) + piece.radii[0]))
        floor = self._bodies.links[self._contacts._base][0], 0.0
        pairs = [(balls[one], balls[other]) for one, other in self._pairs]
        pairs += [(balls[piece], floor) for piece in self._grounded]
        return make_levers(self._bodies, self._values, pairs, len(self._contacts._variables))

    def behind(self, packed_arm: np.ndarray) -> np.ndarray:
        """Return a packed arm followed by the packed scene, for the compiled search; the last one is kept."""
        kept = self._model  # read once: threads may ask for arms with different tools
        if kept is None or kept[0] is not packed_arm:
            kept = self._model = packed_arm, np.concatenate([packed_arm, self.packed])
        return kept[1]

    @property
    def pairs(self) -> set[frozenset[str]]:
        """Names of all pairs that are checked: links, obstacles and 'floor'."""
        return {frozenset(self.names(k)) for k in range(len(self._pairs) + len(self._grounded))}

    def names(self, contact: int) -> tuple[str, str]:
        """Return the names of the two things of a contact, as compiled code numbers it."""
        if contact < len(self._pairs):
            one, other = self._pairs[contact]
            return self._pieces[one].owner, self._pieces[other].owner
        return self._pieces[self._grounded[contact - len(self._pairs)]].owner, FLOOR

    def _refuse_walls(self) -> None:
        """Raise ArgumentError if a part of the room touches a link in every one of PROBES configurations."""
        if self.world.floor is None and not self.world.obstacles:
            return
        lower, upper = (np.clip(limit, -np.pi, np.pi) for limit in self._contacts._limits)
        probes = np.random.default_rng(0).uniform(lower, upper, (PROBES, len(lower)))
        for contact in np.flatnonzero(count_contacts(self.packed, probes) == PROBES):
            link, thing = self.names(int(contact))
            if thing == FLOOR or thing in self._held:
                raise ArgumentError(f'{thing!r} touches link {link!r} in every configuration of the arm')

    def clear(self, q: np.ndarray, margin: float = 0.0, meshes: bool = False) -> np.ndarray:
        """Return for each row of q (k, n) whether nothing touches or comes nearer than `margin` [m], (k,) bool.

        The bound decides most rows, coal the others.
        """
        rows = np.ascontiguousarray(q, dtype=np.float64)
        out = contacts_of(self.packed, rows, margin) < 0
        for k in np.flatnonzero(~out):
            out[k] = self.is_clear(rows[k], margin, meshes)
        return out

    def look(self, q: np.ndarray, meshes: bool = False) -> Contact:
        """Return the two things that are nearest to each other at q (n,), by coal."""
        return self._judge(meshes).nearest(self._values_at(q))

    def least_clearance(self, q: np.ndarray) -> float:
        """Return a lower bound of the clearance at q (n,) [m], in microseconds; meaningless if things touch."""
        return float(self.least_clearances(np.asarray(q, dtype=np.float64)[None])[0])

    def least_clearances(self, q: np.ndarray) -> np.ndarray:
        """Return `least_clearance` of each row of q (k, n), (k,) [m]."""
        return clearances_of(self.packed, np.ascontiguousarray(q, dtype=np.float64))[:, 0]

    def is_clear(self, q: np.ndarray, margin: float = 0.0, meshes: bool = False) -> bool:
        """Return whether nothing touches at q (n,) or comes nearer than `margin` [m], by coal."""
        return self._judge(meshes).clear(self._values_at(q), margin)

    def _values_at(self, q: np.ndarray) -> np.ndarray:
        """Return the values of all joints of the robot at q."""
        return np.array(self._bodies.values({**self.world.positions, **dict(zip(self._contacts._variables, q))}))

    def _judge(self, meshes: bool) -> Judge:
        """Return coal's view, made at its first use."""
        if meshes not in self._judges:
            contacts, pieces = self._contacts, self._pieces
            pairs, grounded = self._pairs, self._grounded
            if meshes:  # the parts of a mesh are one again
                first = {id(piece.shape): k for k, piece in reversed(list(enumerate(pieces)))}
                whole = [first[id(piece.shape)] for piece in pieces]
                pairs = list(dict.fromkeys((whole[i], whole[j]) for i, j in pairs))
                grounded = list(dict.fromkeys(whole[k] for k in grounded))
            self._judges[meshes] = Judge(
                contacts._tree, contacts._model, contacts._base, pieces, pairs, grounded, self.world, meshes)
        return self._judges[meshes]
