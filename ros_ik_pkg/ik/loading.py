"""Loads arms: from a URDF or a DH table to a chain between two frames and a Pinocchio model."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.exceptions import ModelError
from ros_ik_pkg.ik.model.chain import make_chain
from ros_ik_pkg.ik.model.default_tip import default_tip
from ros_ik_pkg.ik.model.joint_limits import limit_joints
from ros_ik_pkg.ik.model.pinocchio_model import build_model, placements_of
from ros_ik_pkg.ik.model.sources import read_tree
from ros_ik_pkg.ik.model.tree import Tree


def load_arm(
    source: str | os.PathLike[str], base: str | None = None, tip: str | None = None, *, limits: str = 'soft',
    joint_limits: str | os.PathLike[str] = '', held: Mapping[str, float | None] | None = None,
    xacro_args: Mapping[str, str] | None = None, srdf: str | os.PathLike[str] | None = None,
    meshes: Iterable[str | os.PathLike[str]] = (),
) -> Arm:
    """Load an arm.

    Parameters
    ----------
    source : str or path
        Name of a robot of config/robots, path or URI (package://, file://) of a DH table (.yaml, .yml), of a .urdf or
        of a .xacro, or URDF text.
    base, tip : str, optional
        Links that the chain leads from and to. Default base: the root link. Default tip: the tip frame of
        the DH table; of a URDF the only leaf, or the one leaf with the most movable joints above it, before the
        joints of a gripper.
    limits : 'soft' or 'hard'
        Whether the soft limits of a URDF (<safety_controller>) narrow the hard ones.
    joint_limits : str or path
        Path or URI of a .yaml file, or its text, in the format of MoveIt's joint_limits.yaml. It narrows the
        limits of the robot: of two limits the narrower counts.
    held : mapping of str to float or None
        Joints that stay at a position [rad, m], None for their home: they are fixed joints of the arm.
    xacro_args : mapping of str to str
        Arguments of the .xacro file.
    srdf : str or path, optional
        Path, URI or text of an SRDF that says which links may touch; default: derived from the shapes.
    meshes : iterable of str or path
        Folders in which meshes are searched first: packages, or folders that hold packages.

    Returns
    -------
    Arm
        Its `warnings` say what is odd about the description.

    Raises
    ------
    ModelError
        If the source cannot be found, read or used; the text says what is wrong and where.

    """
    tree = read_tree(source, xacro_args)
    with faults_of(tree):
        arm = replace(make_arm(limit_joints(tree, limits, joint_limits, held), base, tip), srdf=srdf,
                      meshes=tuple(meshes))
        if srdf is not None:
            _ = arm.contacts  # so that an SRDF of another robot is refused here
        return arm


@contextmanager
def faults_of(tree: Tree) -> Iterator[None]:
    """Add the name of the robot to every ModelError."""
    try:
        yield
    except ModelError as error:
        raise ModelError(f'robot {tree.name!r}: {error}') from error


def make_arm(tree: Tree, base: str | None, tip: str | None) -> Arm:
    """Make the arm between two frames of a robot."""
    base = tree.check_link(base, 'base frame') if base else tree.root
    warnings: tuple[str, ...] = ()
    if tip:
        tip = tree.check_link(tip, 'tip frame')
    elif tree.tip:
        tip = tree.tip
    else:
        tip, warnings = default_tip(tree, base)
    chain = make_chain(tree, base, tip)
    model = build_model(tree)
    return Arm(
        name=tree.name, base_frame=base, tip_frame=tip, frame_names=tree.links, joint_names=chain.names,
        lower=chain.lower, upper=chain.upper, velocity_limits=chain.velocity_limits,
        acceleration_limits=chain.acceleration_limits, jerk_limits=chain.jerk_limits, wraps=chain.wraps,
        home=chain.home, placements=placements_of(tree, model, chain, base, tip), prismatic=chain.prismatic,
        variable=chain.variable, multiplier=chain.multiplier, offset=chain.offset, model=model, tree=tree,
        warnings=(*warnings, *chain.notes))
