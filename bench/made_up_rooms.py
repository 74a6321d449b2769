"""Made-up arms with meshes in made-up rooms: what no robot of a maker would show."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from bench.published_robots import configurations
from ros_ik_pkg.ik import ArgumentError, Arm, Obstacle, World, load_arm
from ros_ik_pkg.ik.collision.scene import contacts_of
from ros_ik_pkg.ik.model.transforms import rotation_from_rpy, transform

MARGINS = (0.0, 0.0, 0.002, 0.01)  # [m]
KINDS = {'box': 3, 'sphere': 1, 'cylinder': 2, 'capsule': 2}  # and how many sizes they have
CLEAR = 0.05  # share of random configurations that must be clear, or the room is no place for the arm
SAMPLES = 400
FAR = 0.3  # [m] between obstacles and the base at least


def made_up_rooms(folder: Path, count: int, seed: int = 7) -> Iterator[tuple[Path, Arm, World, float]]:
    """Yield `count` URDFs with their arms, rooms and margins [m]; the files are written to a folder."""
    random = np.random.default_rng(seed)
    made = 0
    while made < count:
        urdf = folder / f'arm{made}.urdf'
        urdf.write_text(write_arm(random, folder, made))
        arm = load_arm(urdf, base='base', tip='tip')
        world, margin = _world(random, arm.n), float(random.choice(MARGINS))
        try:
            room = arm.contacts.room(world)
        except ArgumentError:  # an obstacle touches the arm wherever it is
            continue
        if np.mean(contacts_of(room.packed, configurations(arm, SAMPLES), margin) < 0) > CLEAR:
            made += 1
            yield urdf, arm, world, margin


def write_arm(random: np.random.Generator, folder: Path, number: int) -> str:
    """Write a chain of 4 to 8 joints from link 'base' to link 'tip' as URDF; each link has a mesh or a primitive."""
    count = int(random.integers(4, 9))
    links = ['base', *(f'link{k}' for k in range(1, count)), 'tip']
    ends = [np.append(random.uniform(-0.1, 0.1, 2), random.uniform(0.1, 0.35)) for _ in links]
    parts = []
    for k, (link, end) in enumerate(zip(links, ends)):
        parts.append(f'<link name="{link}">{_shape(random, folder, f"{number}_{k}", end)}</link>')
    for k in range(count):
        kind = random.choice(['revolute', 'continuous', 'prismatic'], p=[0.75, 0.1, 0.15])
        reach = 0.3 if kind == 'prismatic' else 2.8
        limit = '' if kind == 'continuous' else f'lower="{-reach * random.random():.3f}" upper="{reach}" '
        axis = np.eye(3)[random.integers(3)]
        parts.append(
            f'<joint name="q{k}" type="{kind}"><parent link="{links[k]}"/><child link="{links[k + 1]}"/>'
            f'<origin xyz="{_text(ends[k])}" rpy="{_text(random.uniform(-1.2, 1.2, 3))}"/>'
            f'<axis xyz="{_text(axis)}"/><limit {limit}velocity="2" effort="1"/></joint>'
        )
    return f'<robot name="made_up_{number}">{"".join(parts)}</robot>'


def _shape(random: np.random.Generator, folder: Path, name: str, end: np.ndarray) -> str:
    """Write the collision shape of a link that reaches from its frame to `end` (3,): two out of three are meshes."""
    if random.random() < 1 / 3:
        middle, length = 0.5 * end, float(np.linalg.norm(end))
        kind = random.choice(['<box size="0.06 0.05 {0}"/>', '<cylinder radius="0.03" length="{0}"/>'])
        return f'<collision><origin xyz="{_text(middle)}"/><geometry>{kind.format(0.9 * length)}</geometry></collision>'
    triangles = [_lump(random, place * end) for place in (0.1, 0.5, 0.9)]  # in pieces: hollow between them
    path = folder / f'{name}.stl'
    write_stl(path, 1000.0 * np.concatenate(triangles))
    return f'<collision><geometry><mesh filename="file://{path}" scale="0.001 0.001 0.001"/></geometry></collision>'


def _lump(random: np.random.Generator, middle: np.ndarray) -> np.ndarray:
    """Return the triangles (k, 3, 3) of the hull of points around a middle [m]."""
    points = middle + random.normal(size=(24, 3)) * random.uniform(0.01, 0.03, 3)
    return points[ConvexHull(points).simplices]


def write_stl(path: Path, triangles: np.ndarray) -> None:
    """Write triangles (k, 3, 3) as binary STL."""
    rows = np.zeros(len(triangles), dtype=[('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('rest', '<u2')])
    rows['corners'] = triangles
    path.write_bytes(bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes())


def _world(random: np.random.Generator, n: int) -> World:
    """Return a room: half of them have a floor, most some obstacles, and half an object in the hand."""
    obstacles = []
    for k in range(int(random.integers(0, 8))):
        away = random.normal(size=3)
        away *= random.uniform(FAR, 1.2) / np.linalg.norm(away)
        obstacles.append(_obstacle(random, f'thing {k}', away, ''))
    if random.random() < 0.5:
        obstacles.append(_obstacle(random, 'held', np.array([0.0, 0.0, 0.15]), 'tip', (f'link{n - 1}',)))
    return World(-0.2 if random.random() < 0.5 else None, tuple(obstacles))


def _obstacle(
    random: np.random.Generator, name: str, middle: np.ndarray, link: str, touches: tuple[str, ...] = ()
) -> Obstacle:
    kind = str(random.choice(list(KINDS)))
    size = random.uniform(0.02, 0.1, KINDS[kind])
    return Obstacle(name, kind, size, transform(rotation_from_rpy(random.uniform(-3, 3, 3)), middle), link, touches)


def _text(vector: np.ndarray) -> str:
    return ' '.join(f'{value:.6f}' for value in vector)
