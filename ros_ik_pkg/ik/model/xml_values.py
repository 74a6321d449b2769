"""Numbers and placements as URDF writes them."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.transforms import rotation_from_quaternion, rotation_from_rpy, transform
from ros_ik_pkg.ik.text import to_number


def read_origin(element: ElementTree.Element, where: str, quaternions: bool) -> np.ndarray:
    """Read <origin xyz rpy> or, from URDF 1.1 on, <origin xyz quat_xyzw>: the transform from the link to what the
    element places in it; identity if it is missing."""
    origin = element.find('origin')
    if origin is None:
        return np.eye(4)
    xyz = read_vector(origin.get('xyz', '0 0 0'), f'{where}: <origin xyz>')
    if 'quat_xyzw' not in origin.attrib:
        return transform(rotation_from_rpy(read_vector(origin.get('rpy', '0 0 0'), f'{where}: <origin rpy>')), xyz)
    what = f'{where}: <origin quat_xyzw>'
    if not quaternions:
        raise ModelError(f'{what} needs <robot version="1.1">; set the version, or write rpy')
    if 'rpy' in origin.attrib:
        raise ModelError(f'{where}: <origin> has both rpy and quat_xyzw; expected one of them')
    quaternion = read_vector(origin.get('quat_xyzw', ''), what, 4)
    if not 1e-6 < np.linalg.norm(quaternion) < 1e6:
        raise ModelError(f'{what} is {origin.get("quat_xyzw")!r}; expected a unit quaternion')
    return transform(rotation_from_quaternion(quaternion), xyz)


def read_vector(text: str, what: str, count: int = 3) -> np.ndarray:
    """Read as many finite numbers as `count` says."""
    words = text.split()
    if len(words) != count:
        raise ModelError(f'{what} is {text!r}; expected {"three" if count == 3 else "four"} numbers')
    return np.array([read_number(word, what) for word in words])


def read_number(text: str, what: str) -> float:
    """Read one finite number."""
    value = to_number(text)
    if math.isnan(value):
        raise ModelError(f'{what} is {text!r}; expected a finite number')
    return value
