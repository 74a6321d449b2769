"""Obstacles from YAML: boxes, spheres, cylinders and capsules by name."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml

from ros_ik_pkg.ik.exceptions import ArgumentError, ModelError
from ros_ik_pkg.ik.model.shapes import SIZES
from ros_ik_pkg.ik.model.sources import read_text
from ros_ik_pkg.ik.model.transforms import rotation_from_rpy, transform
from ros_ik_pkg.ik.text import list_names, suggest
from ros_ik_pkg.ik.world import Obstacle

KINDS = tuple(kind for kind in SIZES if kind != 'mesh')
KEYS = ('name', *KINDS, 'xyz', 'rpy', 'link', 'touches')


def read_obstacles(source: str | os.PathLike[str]) -> tuple[Obstacle, ...]:
    """Return the obstacles of a YAML file.

    Parameters
    ----------
    source : str or path
        Path or URI of the file, or its text: a key `obstacles` with a list of mappings. Each has a `name`, one of
        KINDS with its size in a list [m], and optionally `xyz` [m] and `rpy` [rad] of its middle in the base frame,
        `link` that it is attached to, whose frame they are then in, and `touches`, links that it may touch.

    Raises
    ------
    ModelError
        Which names the obstacle, what was got and what was expected.

    """
    try:
        content = yaml.safe_load(read_text(source))
    except yaml.YAMLError as error:
        raise ModelError(f'obstacles_file: not well-formed YAML ({" ".join(str(error).split())})') from error
    entries = content.get('obstacles') if isinstance(content, Mapping) else None
    if not isinstance(entries, list):
        raise ModelError('obstacles_file: expected the key obstacles with a list')
    try:
        return tuple(_read_obstacle(entry, number) for number, entry in enumerate(entries))
    except ArgumentError as error:
        raise ModelError(f'obstacles_file: {error}') from error


def _read_obstacle(entry: Any, number: int) -> Obstacle:
    """Read one obstacle."""
    if not isinstance(entry, Mapping) or not str(entry.get('name', '')).strip():
        raise ArgumentError(f'obstacle {number} has no name; expected name and one of {list_names(KINDS)}')
    name = str(entry['name']).strip()
    unknown = [str(key) for key in entry if key not in KEYS]
    if unknown:
        raise ArgumentError(f'obstacle {name!r}: unknown key {unknown[0]!r}; {suggest(unknown[0], KEYS)}')
    kinds = [kind for kind in KINDS if kind in entry]
    if len(kinds) != 1:
        raise ArgumentError(f'obstacle {name!r} has {len(kinds)} shapes; expected one of {list_names(KINDS)}')
    try:
        xyz, rpy = (np.array(entry.get(key, (0.0, 0.0, 0.0)), dtype=np.float64).reshape(3) for key in ('xyz', 'rpy'))
    except (TypeError, ValueError) as error:
        raise ArgumentError(f'obstacle {name!r}: xyz and rpy are three numbers each') from error
    touches = entry.get('touches') or ()
    if isinstance(touches, str) or not all(isinstance(link, str) for link in touches):
        raise ArgumentError(f'obstacle {name!r}: touches is {touches!r}; expected a list of links')
    return Obstacle(name, kinds[0], entry[kinds[0]], transform(rotation_from_rpy(rpy), xyz),
                    str(entry.get('link') or ''), tuple(touches))
