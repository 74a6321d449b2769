"""A comparison says which descents pass through contact, as Pinocchio's own reading of the robot has it."""

from __future__ import annotations

import numpy as np

from bench.published_robots import UR5, UrdfJudge, configurations, moving_pairs
from ros_ik_pkg.compare.contact import contact_lines
from ros_ik_pkg.compare.runs import compare_methods
from ros_ik_pkg.ik import SolveOptions, load_arm


def test_each_descent_that_touches_is_named_with_its_first_contact():
    arm = load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])
    room = arm.contacts.room()
    judge = UrdfJudge(UR5[0], moving_pairs(room), room.positions)
    said = silent = 0
    for goal in configurations(arm, 12, seed=3):
        runs = compare_methods(arm, arm.forward(goal), arm.home + 0.1, ('dls', 'pinv'), SolveOptions(deadline=0.0))
        lines = {line.partition(':')[0]: line for line in contact_lines(arm, runs)}
        for run in runs:
            touches = [k for k, q in enumerate(run.iterates.joint_positions) if judge.touches(arm.joint_names, q)]
            if touches:
                first = int(lines[run.method].split(' at iteration ')[1].split(';')[0])
                assert first <= touches[0]  # hulls hold the meshes
                said += 1
            elif run.method not in lines:
                silent += 1
    assert said and silent


def test_a_robot_without_shapes_touches_nothing():
    arm = load_arm('planar3r')
    runs = compare_methods(arm, arm.forward(arm.home + 0.1), np.zeros(arm.n), ('dls',))
    assert contact_lines(arm, runs) == []
