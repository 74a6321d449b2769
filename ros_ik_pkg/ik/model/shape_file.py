"""The file of shapes that a DH table names: <collision> elements as in a URDF, in the frames of the table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.collision_elements import read_collisions
from ros_ik_pkg.ik.model.tree import Tree
from ros_ik_pkg.ik.model.urdf import MAX_BYTES, parse_xml
from ros_ik_pkg.ik.text import suggest


def with_shapes(tree: Tree) -> Tree:
    """Return a robot with the shapes of the file that its table names; the same robot if it names none.

    The file has the <link> elements of a URDF, without joints. It may have <disable_collisions> elements too, which are
    read as those of an SRDF, when contact is first looked at. A relative path counts from the folder of the table, and
    mesh files are searched beside the file.

    Raises
    ------
    ModelError
        If the file cannot be read, or names a link that the table does not have.

    """
    if tree.shape_file is None:
        return tree
    where, path = f'shapes {str(tree.shape_file)!r}', (tree.folder or Path()) / tree.shape_file
    try:
        path = path.resolve(strict=True)
        if not path.is_file():  # opening a pipe would block until something writes to it
            raise ModelError('it is no regular file')
        with path.open('rb') as file:
            robot = parse_xml(file.read(MAX_BYTES + 1))
    except (OSError, ValueError, RuntimeError) as error:  # not there, not XML, a name that no file can have
        raise ModelError(f'{where}: cannot read {str(path)!r}: {error}') from error
    found, faults = read_collisions(robot)
    if not found:
        raise ModelError(f'{where}: no <collision> in {path}; expected <robot> with <link> elements as in a URDF')
    for link in found:
        if link not in tree.links:
            raise ModelError(f'{where}: link {link!r} does not exist; {suggest(link, tree.links)}')
    shapes = {link: (*tree.shapes.get(link, ()), *found.get(link, ())) for link in {**tree.shapes, **found}}
    return replace(tree, shapes=shapes, shape_faults=(*tree.shape_faults, *faults), folder=path.parent, shape_file=path)
