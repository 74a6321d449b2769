"""The <collision> elements of a URDF: the shapes of every link, and what is wrong with those that are left out."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.shapes import Shape
from ros_ik_pkg.ik.model.xml_values import read_number, read_origin, read_vector
from ros_ik_pkg.ik.text import list_names

KINDS = ('mesh', 'box', 'cylinder', 'sphere', 'capsule')


def read_collisions(
    robot: ElementTree.Element, quaternions: bool = False
) -> tuple[dict[str, tuple[Shape, ...]], tuple[str, ...]]:
    """Read the shapes by link, and a sentence for each element that cannot be used.

    A link whose elements are all faulty is there with no shapes; one without elements is not there. `quaternions`:
    whether the URDF's version allows quat_xyzw.
    """
    shapes: dict[str, tuple[Shape, ...]] = {}
    faults: list[str] = []
    for link in robot.findall('link'):
        name = link.get('name', '').strip()
        for element in link.findall('collision'):
            before = shapes.setdefault(name, ())
            try:
                shapes[name] = (*before, _read_shape(element, f'link {name!r}: <collision>', quaternions))
            except ModelError as error:
                faults.append(f'{error}; left out')
    return shapes, tuple(faults)


def _read_shape(element: ElementTree.Element, where: str, quaternions: bool) -> Shape:
    """Read one <collision>."""
    geometry = element.find('geometry')
    found = [] if geometry is None else [child for child in geometry if child.tag in KINDS]
    if len(found) != 1:
        raise ModelError(f'{where} has {len(found)} shapes; expected one <geometry> with one of {list_names(KINDS)}')
    shape = found[0]
    where = f'{where}: <{shape.tag}>'
    frame_from_shape = read_origin(element, where, quaternions)
    try:
        if shape.tag == 'mesh':
            file = shape.get('filename', '').strip()
            if not file:
                raise ModelError('no filename')
            return Shape('mesh', read_vector(shape.get('scale', '1 1 1'), 'scale'), frame_from_shape, file)
        if shape.tag == 'box':
            return Shape('box', read_vector(shape.get('size', ''), 'size'), frame_from_shape)
        keys = ('radius',) if shape.tag == 'sphere' else ('radius', 'length')
        size = np.array([read_number(shape.get(key, ''), key) for key in keys])
        return Shape(shape.tag, size, frame_from_shape)
    except ModelError as error:
        raise ModelError(f'{where}: {error}') from error
