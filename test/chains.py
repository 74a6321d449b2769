"""Random robots for the tests, and Pinocchio's own reading of them as the judge."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

KINDS = ('revolute', 'prismatic', 'continuous', 'fixed')


def joint_xml(
    name,
    kind,
    parent,
    child,
    xyz=(0, 0, 0),
    rpy=(0, 0, 0),
    axis=(0, 0, 1),
    lower=-2.0,
    upper=2.0,
    velocity=1.5,
    mimic=None,
):
    """Write one <joint>; mimic is (master, multiplier, offset)."""

    def numbers(values):
        return ' '.join(repr(float(value)) for value in values)

    limit = f'<limit lower="{lower!r}" upper="{upper!r}" velocity="{velocity!r}" effort="1"/>'
    coupling = '' if mimic is None else '<mimic joint="{}" multiplier="{!r}" offset="{!r}"/>'.format(*mimic)
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{numbers(xyz)}" rpy="{numbers(rpy)}"/><axis xyz="{numbers(axis)}"/>'
        f'{"" if kind == "continuous" else limit}{coupling}</joint>'
    )


def urdf(links, joints, name='made_up'):
    """Write a URDF from link names and joint elements."""
    return (
        f'<robot name="{name}">'
        + ''.join(f'<link name="{link}"/>' for link in links)
        + ''.join(joints)
        + '</robot>'
    )


def chain(*joints):
    """Write a robot of one branch from (name, kind, options), its links base, a, b, c, tip."""
    links = [*('base', 'a', 'b', 'c')[: len(joints)], 'tip']
    elements = [
        joint_xml(name, kind, links[k], links[k + 1], (0.1, 0, 0.2), **options)
        for k, (name, kind, options) in enumerate(joints)
    ]
    return urdf(links, elements)


def random_urdf(rng, joints=6, kinds=KINDS, branches=2, mimics=0):
    """Make up a robot: `joints` movable joints from 'base' to 'tip', side branches, mimic joints.

    Fixed joints come between where 'fixed' is among the kinds; half of the axes are along x, y or z.
    """
    movable = [kind for kind in kinds if kind != 'fixed']
    sequence = [str(kind) for kind in rng.choice(movable, joints)]
    if 'fixed' in kinds:
        for place in rng.integers(0, len(sequence) + 1, rng.integers(0, 3)):
            sequence.insert(place, 'fixed')
    links = ['base', *(f'link{k}' for k in range(1, len(sequence))), 'tip']
    elements = [
        _random_joint(rng, f'joint{k}', kind, links[k], links[k + 1]) for k, kind in enumerate(sequence)
    ]
    elements = _couple(rng, elements, sequence, mimics)
    for k in range(branches):
        side = f'side{k}'
        elements.append(
            _random_joint(rng, f'{side}_joint', rng.choice(kinds), str(rng.choice(links[:-1])), side)
        )
        links.append(side)
    rng.shuffle(elements)
    return urdf(links, elements)


def _random_joint(rng, name, kind, parent, child):
    axis = (
        rng.normal(size=3)
        if rng.random() < 0.5
        else rng.choice([-1.0, 1.0, 2.5]) * np.eye(3)[rng.integers(3)]
    )
    lower, upper = np.sort(rng.uniform(-3.0, 3.0, 2)).tolist()
    return joint_xml(
        name,
        kind,
        parent,
        child,
        rng.uniform(-0.5, 0.5, 3),
        rng.uniform(-np.pi, np.pi, 3),
        axis,
        min(lower, -0.1),
        max(upper, 0.1),
    )


def _couple(rng, elements, sequence, mimics):
    """Let some joints mimic an earlier movable one."""
    movable = [k for k, kind in enumerate(sequence) if kind != 'fixed']
    for k in rng.permutation(movable[1:])[:mimics]:
        master = rng.choice([m for m in movable if m < k])
        coupling = (
            f'<mimic joint="joint{master}" multiplier="{float(rng.uniform(-1, 1))!r}" '
            f'offset="{float(rng.uniform(-0.05, 0.05))!r}"/>'
        )
        elements[k] = elements[k].replace('</joint>', f'{coupling}</joint>')
    return elements


def model_pose(model, base, tip, positions):
    """Pose (4, 4) of frame tip in frame base of a Pinocchio model; joint positions by name, others at zero."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, model_configuration(model, positions))
    base_from_world, tip_from_world = (data.oMf[model.getFrameId(link, pin.FrameType.BODY)] for link in (base, tip))
    return base_from_world.actInv(tip_from_world).homogeneous


def pinocchio_pose(text, base, tip, positions):
    """Pose (4, 4) of tip in base by Pinocchio's own URDF parser."""
    return model_pose(pin.buildModelFromXML(text), base, tip, positions)


def pinocchio_tip(arm, q):
    """Pose (4, 4) of an arm's tip in its base frame by Pinocchio, mimic joints included."""
    return model_pose(arm.model, arm.base_frame, arm.tip_frame, joint_positions(arm, q))


def pinocchio_jacobian(model, arm, q):
    """Jacobian (6, n) of an arm in axes of its base by a Pinocchio model, mimic joints by the chain rule."""
    positions, data = joint_positions(arm, q), model.createData()
    values = model_configuration(model, positions)
    base, tip = (model.getFrameId(link, pin.FrameType.BODY) for link in (arm.base_frame, arm.tip_frame))
    by_joint = pin.computeFrameJacobian(model, data, values, tip, pin.LOCAL_WORLD_ALIGNED)
    pin.framesForwardKinematics(model, data, values)
    base_from_world = data.oMf[base].rotation.T
    jacobian = np.zeros((6, arm.n))
    for k, name in enumerate(positions):
        column = by_joint[:, model.joints[model.getJointId(name)].idx_v].reshape(2, 3) @ base_from_world.T
        jacobian[:, arm.variable[k]] += arm.multiplier[k] * column.ravel()
    return jacobian


def model_configuration(model, positions):
    """Lay out joint positions as a model wants them: continuous joints as cosine and sine, others at zero."""
    q = pin.neutral(model)
    for name, value in positions.items():
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
    return q


def flat_pose(arm, q):
    """Pose of the tip from the arm's flat arrays, in plain NumPy: P0 M0 P1 M1 ... Pn."""
    pose = _placement(arm.placements[0])
    for k, kind in enumerate(arm.prismatic):
        value = arm.multiplier[k] * q[arm.variable[k]] + arm.offset[k]
        motion = (
            pin.SE3(np.eye(3), np.array([0, 0, value]))
            if kind
            else pin.SE3(pin.utils.rotate('z', value), np.zeros(3))
        )
        pose = pose @ motion.homogeneous @ _placement(arm.placements[k + 1])
    return pose


def _placement(row):
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = row[:9].reshape(3, 3), row[9:]
    return result


def joint_positions(arm, q):
    """Positions by name of every joint of the chain, mimic joints included."""
    joints = [joint for joint in arm.tree.path(arm.base_frame, arm.tip_frame) if joint.kind != 'fixed']
    return {
        joint.name: arm.multiplier[k] * q[arm.variable[k]] + arm.offset[k] for k, joint in enumerate(joints)
    }
