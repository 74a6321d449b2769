"""The Pinocchio model of a whole robot, and the data read from it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik.model.chain import Chain
from ros_ik_pkg.ik.model.transforms import rotation_from_z, transform
from ros_ik_pkg.ik.model.tree import Joint, Tree


def build_model(tree: Tree) -> pin.Model:
    """Build the Pinocchio model of the whole tree, joint frames turned so that every axis is local z."""
    model = pin.Model()
    model.name = tree.name
    held = {tree.root: (0, np.eye(4))}  # link -> the Pinocchio joint that carries it, and where on it
    _add_link(model, tree.root, 0, np.eye(4))
    for joint in tree.joints:
        carrier, placement = held[joint.parent]
        placement = placement @ joint.origin
        if joint.movable:
            turn = transform(rotation_from_z(joint.axis), np.zeros(3))
            motion = pin.JointModelPZ() if joint.kind == 'prismatic' else pin.JointModelRZ()
            carrier = model.addJoint(carrier, motion, pin.SE3(placement @ turn), joint.name)
            placement = turn.T
        held[joint.child] = carrier, placement @ joint.tail
        _add_link(model, joint.child, *held[joint.child])
    movable = [joint for joint in tree.joints if joint.movable]
    model.lowerPositionLimit = np.array([joint.lower for joint in movable])
    model.upperPositionLimit = np.array([joint.upper for joint in movable])
    model.velocityLimit = np.array([joint.velocity for joint in movable])
    return model


def _add_link(model: pin.Model, link: str, carrier: int, placement: np.ndarray) -> None:
    """Add the frame of a link to the model."""
    model.addFrame(pin.Frame(link, carrier, 0, pin.SE3(placement), pin.FrameType.BODY))


def frame_id(tree: Tree, link: str) -> int:
    """Index of a link's frame in the model; frame 0 is Pinocchio's universe."""
    return 1 + tree.links.index(link)


def joint_id(tree: Tree, joint: Joint) -> int:
    """Index of a joint in the model, one more than its index into q; joint 0 is Pinocchio's universe."""
    return 1 + [other for other in tree.joints if other.movable].index(joint)


def placements_of(tree: Tree, model: pin.Model, chain: Chain, base: str, tip: str) -> np.ndarray:
    """Read the constant transforms between the chain's joints, (nj + 1, 12), from the model."""
    base_placement, tip_placement = (model.frames[frame_id(tree, link)].placement for link in (base, tip))
    steps = [model.jointPlacements[joint_id(tree, joint)] for joint in chain.joints] + [tip_placement]
    steps[0] = base_placement.actInv(steps[0])
    return np.array([[*step.rotation.ravel(), *step.translation] for step in steps])


def carrier_of(frame: pin.Frame) -> int:
    """Return the index of the joint that carries a frame, by either name that releases of Pinocchio have for it."""
    return int(frame.parentJoint if hasattr(frame, 'parentJoint') else frame.parent)
