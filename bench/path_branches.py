"""All branches of many poses by EAIK's closed form, in the environment of the peers: reads and writes .npz files."""

from __future__ import annotations

import sys
import time

import numpy as np
from eaik.IK_Homogeneous import HomogeneousRobot

MOST = 16
EXACT = 1e-6  # largest component of the difference of two poses


def main() -> None:
    """Read transforms (n + 1, 4, 4) and poses (N, 4, 4); write branches (N, MOST, n), counts (N,) and seconds."""
    source, target = sys.argv[1:]
    given = np.load(source)
    frames = [np.eye(4)]
    for transform in given['transforms']:
        frames.append(frames[-1] @ transform)
    robot = HomogeneousRobot(np.array(frames[1:]))
    if not robot.hasKnownDecomposition():
        sys.exit(f'EAIK knows no closed form of this arm ({robot.getKinematicFamily()})')
    poses = given['poses']
    branches, counts = np.zeros((len(poses), MOST, len(frames) - 2)), np.zeros(len(poses), np.int64)
    began = time.perf_counter()
    for k, pose in enumerate(poses):
        result = robot.IK(pose)
        for q in result.Q:
            if np.abs(robot.fwdKin(np.asarray(q)) - pose).max() < EXACT:
                branches[k, counts[k]] = q
                counts[k] += 1
    np.savez(target, branches=branches, counts=counts, seconds=time.perf_counter() - began)


if __name__ == '__main__':
    main()
