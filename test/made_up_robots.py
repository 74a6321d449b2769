"""URDFs like those from all over, made up: humanoid, mobile manipulator, hobby arm, cobots, hand, gantry."""

from __future__ import annotations

import numpy as np
from chains import joint_xml, urdf

TURN = 2.0 * np.pi
X, Y, Z = np.eye(3)


def limb(start, joints, prefix=''):
    """Return the links and joints of a limb: (name, kind, axis, offset, options) from the link `start` on."""
    names = [start, *(f'{prefix}{name}_link' for name, *_ in joints)]
    elements = [
        joint_xml(f'{prefix}{name}', kind, parent, child, offset, axis=axis, **options)
        for (name, kind, axis, offset, options), parent, child in zip(joints, names, names[1:])
    ]
    return names[1:], elements


def hinge(name, axis, offset, lower=-2.5, upper=2.5, **options):
    """Write one revolute joint as `limb` takes it."""
    return name, 'revolute', axis, offset, {'lower': lower, 'upper': upper, **options}


def slide(name, axis, offset, lower, upper, **options):
    """Write one prismatic joint as `limb` takes it."""
    return name, 'prismatic', axis, offset, {'lower': lower, 'upper': upper, **options}


def weld(name, offset, **options):
    """Write one fixed joint as `limb` takes it."""
    return name, 'fixed', Z, offset, options


def robot(root, *limbs, name):
    """Write a URDF of limbs that grow from the root link and from each other."""
    links, elements = [root], []
    for more_links, more_elements in limbs:
        links += more_links
        elements += more_elements
    return urdf(links, elements, name)


def humanoid():
    """Write a pelvis on a floating joint, a torso of two joints, a head, two arms of seven and two legs of six."""
    limbs = [limb('world', [('floating_base', 'floating', Z, (0, 0, 1), {})])]
    pelvis = 'floating_base_link'
    limbs.append(limb(pelvis, [hinge('waist_yaw', Z, (0, 0, 0.1)), hinge('waist_pitch', Y, (0, 0, 0.05), -0.5, 1.2)]))
    limbs.append(limb('waist_pitch_link', [hinge('neck', Z, (0, 0, 0.4)), hinge('nod', Y, (0, 0, 0.1), -0.6, 0.6)]))
    for side, way in (('left_', 1.0), ('right_', -1.0)):
        arm = [
            hinge('shoulder_pitch', Y, (0, 0.18 * way, 0.35), -3.0, 1.5),
            hinge('shoulder_roll', X, (0, 0.05 * way, 0), *sorted((-0.4 * way, 2.4 * way))),
            hinge('shoulder_yaw', Z, (0, 0, -0.12), -1.8, 1.8),
            hinge('elbow', Y, (0, 0, -0.14), -2.3, 0.0),
            hinge('wrist_yaw', Z, (0, 0, -0.12), -1.9, 1.9),
            hinge('wrist_pitch', Y, (0, 0, -0.11), -1.2, 1.2),
            hinge('wrist_roll', X, (0, 0, -0.04), -1.1, 1.1),
            weld('hand', (0, 0, -0.08), rpy=(0.0, 0.2, 0.1)),
        ]
        leg = [
            hinge('hip_yaw', Z, (0, 0.1 * way, 0), -0.9, 0.9),
            hinge('hip_roll', X, (0, 0, -0.05), -0.6, 0.6),
            hinge('hip_pitch', Y, (0, 0, -0.05), -1.8, 0.9),
            hinge('knee', Y, (0, 0, -0.38), 0.05, 2.4),
            hinge('ankle_pitch', Y, (0, 0, -0.38), -0.9, 0.7),
            hinge('ankle_roll', X, (0, 0, -0.04), -0.5, 0.5),
        ]
        limbs += [limb('waist_pitch_link', arm, side), limb(pelvis, leg, side)]
    return robot('world', *limbs, name='humanoid')


def mobile_manipulator(drive='planar'):
    """Write a base that drives, with wheels, a lift, an arm of six joints and a gripper of two coupled fingers."""
    base = [('drive', drive, Z, (0, 0, 0), {}), weld('chassis', (0, 0, 0.2))]
    wheels = [limb('chassis_link', [(f'wheel{k}', 'continuous', Y, (0, 0.2 * k, -0.1), {})]) for k in (-1, 1)]
    arm = [
        slide('lift', Z, (0.1, 0, 0.3), 0.0, 0.45),
        hinge('pan', Z, (0.1, 0, 0.1), -3.1, 3.1),
        hinge('shoulder', Y, (0, 0, 0.12), -1.9, 1.9),
        hinge('elbow', Y, (0, 0, 0.35), -2.6, 2.6),
        hinge('forearm', Z, (0, 0, 0.12), -3.1, 3.1),
        hinge('wrist', Y, (0, 0, 0.2), -1.9, 1.9),
        hinge('flange', Z, (0, 0, 0.08), -3.1, 3.1),
        weld('tool', (0, 0, 0.1)),
    ]
    fingers = [
        limb('tool_link', [slide('finger_left', Y, (0, 0.01, 0), 0.0, 0.04)]),
        limb('tool_link', [slide('finger_right', -Y, (0, -0.01, 0), 0.0, 0.04, mimic=('finger_left', 1.0, 0.0))]),
    ]
    return robot('odom', limb('odom', base), *wheels, limb('chassis_link', arm), *fingers, name='mobile')


def hobby_arm():
    """Write an arm of five joints whose gripper has one finger that copies the other."""
    arm = [
        hinge('waist', Z, (0, 0, 0.08), -3.1, 3.1),
        hinge('shoulder', Y, (0, 0, 0.05), -1.8, 1.9),
        hinge('elbow', Y, (0.05, 0, 0.2), -1.9, 1.6),
        hinge('wrist_angle', Y, (0.2, 0, 0), -1.7, 2.1),
        hinge('wrist_rotate', X, (0.07, 0, 0), -3.1, 3.1),
        weld('grip', (0.09, 0, 0)),
    ]
    fingers = [
        limb('grip_link', [hinge('finger', Z, (0.02, 0.02, 0), 0.0, 0.7)]),
        limb('grip_link', [hinge('other_finger', Z, (0.02, -0.02, 0), -0.7, 0.0, mimic=('finger', -1.0, 0.0))]),
    ]
    return robot('base', limb('base', arm), *fingers, name='hobby')


def cobot():
    """Write a seven-joint arm with every other joint continuous, and axes that no one would call round numbers."""
    axes, bends = ([0, 0, -1], [0, -1, 0]), (2.24, 2.57, 2.09)
    joints = []
    for k in range(7):
        offset = (0.0, -0.003 * k, 0.13 if k % 2 == 0 else 0.2)
        bend = {} if k % 2 == 0 else {'lower': -bends[k // 2], 'upper': bends[k // 2]}
        joints.append((f'joint{k + 1}', 'continuous' if k % 2 == 0 else 'revolute', axes[k % 2], offset, bend))
    joints[3][4]['rpy'] = (0.01, 0.0, -0.02)
    return robot('base', limb('base', [*joints, weld('tool', (0, 0, 0.17), rpy=(np.pi, 0.0, 0.0))]), name='cobot')


def turning_arm():
    """Write a six-joint arm whose joints turn up to two turns either way, as those of many cobots."""
    joints = [
        hinge('pan', Z, (0, 0, 0.15), -TURN, TURN),
        hinge('lift', Y, (0, 0.13, 0), -TURN, TURN),
        hinge('elbow', Y, (0, -0.12, 0.42), -np.pi, np.pi),
        hinge('wrist_1', Y, (0, 0, 0.39), -TURN, TURN),
        hinge('wrist_2', Z, (0, 0.09, 0), -2 * TURN, 2 * TURN),
        hinge('wrist_3', Y, (0, 0, 0.09), -1e16, 1e16),
        weld('tool', (0, 0.08, 0)),
    ]
    return robot('base', limb('base', joints), name='turning')


def hand():
    """Write a palm with two fingers; in each one motor bends two more joints, by a factor and an offset."""
    fingers = []
    for k, finger in enumerate(('index_', 'thumb_')):
        bend = f'{finger}bend'
        fingers.append(limb('palm', [
            hinge('spread', X, (0.02 * k, 0.03, 0.09), -0.3, 0.3),
            hinge('bend', Y, (0, 0, 0.01), 0.0, 1.5),
            hinge('middle', Y, (0, 0, 0.045), -0.2, 1.9, mimic=(bend, 1.1, 0.05)),
            hinge('end', -Y, (0, 0, 0.025), -1.6, 0.2, mimic=(f'{finger}middle', -0.7, 0.02)),
            weld('tip', (0, 0, 0.02)),
        ], finger))  # fmt: skip
    return robot('palm', *fingers, name='hand')


def gantry():
    """Write three slides, one of them skew, and a wrist."""
    joints = [
        slide('x', X, (0, 0, 2.0), -1.5, 1.5),
        slide('y', Y, (0, 0, -0.1), 0.0, 2.0),
        slide('z', (0.1, 0.0, -1.0), (0, 0, -0.1), 0.2, 1.1, rpy=(0.0, 0.1, 0.0)),
        hinge('yaw', Z, (0, 0, -0.2), -TURN, TURN),
        hinge('pitch', Y, (0, 0, -0.1), -2.0, 2.0),
        hinge('roll', X, (0, 0, -0.05), -2.0, 2.0),
        weld('tool', (0, 0, -0.1)),
    ]
    return robot('frame', limb('frame', joints), name='gantry')
