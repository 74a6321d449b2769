"""A made-up robot with two arms on a torso, and Pinocchio's own reading of it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import load_tree

AXES = ('0 0 1', '0 1 0', '1 0 0', '0 1 0', '1 0 0', '0 1 0', '1 0 0')
TIPS = 'left_tip', 'right_tip'


def arm_text(side: str, y: float, shape: str) -> str:
    """Write an arm of seven joints with its shoulder at y [m]."""
    parts, parent = [], 'torso'
    for k, axis in enumerate(AXES):
        child, place = f'{side}_{k}', f'0 {y} 0' if k == 0 else '0.02 0 0.17'
        parts.append(
            f'<link name="{child}">{shape if k in (3, 6) else ""}</link><joint name="{side}_j{k}" type="revolute">'
            f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{place}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.6" upper="2.6" velocity="1" effort="1"/></joint>'
        )
        parent = child
    return ''.join(parts) + (
        f'<link name="{side}_tip"/><joint name="{side}_end" type="fixed"><parent link="{parent}"/>'
        f'<child link="{side}_tip"/><origin xyz="0.1 0 0.05" rpy="0.2 0.3 0.4"/></joint>'
    )


def robot_text(torso: bool, shape: str = '') -> str:
    """Write two arms on a torso that lifts and turns, or on one that stands still."""
    kinds = ('prismatic', 'revolute') if torso else ('fixed', 'fixed')
    limits = '<axis xyz="0 0 1"/><limit lower="-0.4" upper="0.5" velocity="1" effort="1"/>'
    return (
        '<robot name="two_arms"><link name="floor"/><link name="column"/><link name="torso"/>'
        f'<joint name="lift" type="{kinds[0]}"><parent link="floor"/><child link="column"/>{limits}</joint>'
        f'<joint name="turn" type="{kinds[1]}"><parent link="column"/><child link="torso"/>'
        f'<origin xyz="0.1 0 0.6"/>{limits}</joint>{arm_text("left", 0.3, shape)}{arm_text("right", -0.3, shape)}'
        '</robot>'
    )


@cache
def get_arms(torso=True, shape=''):
    return load_tree(robot_text(torso, shape), TIPS)


@cache
def model_of(torso=True):
    model = pin.buildModelFromXML(robot_text(torso))
    return model, model.createData()


def poses(arms, q, torso=True):
    """Poses of both tips in the root frame by Pinocchio."""
    model, data = model_of(torso)
    values = pin.neutral(model)
    for name, value in zip(arms.joint_names, q):
        values[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, values)
    return tuple(data.oMf[model.getFrameId(tip)].homogeneous for tip in TIPS)


def off(target, pose):
    return np.linalg.norm(target[:3, 3] - pose[:3, 3]), np.linalg.norm(pin.log3(target[:3, :3] @ pose[:3, :3].T))
