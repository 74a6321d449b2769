"""Robots with meshes and SRDFs as the package example-robot-data ships them, and Pinocchio's own view of them."""

from __future__ import annotations

import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik.contacts.coal_library import ask_anew, geometry_object

SHARE = next(path for path in (Path(place) / 'cmeel.prefix' / 'share' for place in sys.path)
             if (path / 'example-robot-data').is_dir())
ROBOTS = SHARE / 'example-robot-data' / 'robots'
PANDA = ROBOTS / 'panda_description/urdf/panda.urdf', ROBOTS / 'panda_description/srdf/panda.srdf', 'panda_hand_tcp'
XARM7 = ROBOTS / 'xarm_description/urdf/xarm7.urdf', ROBOTS / 'xarm_description/srdf/xarm7.srdf', None
UR5 = ROBOTS / 'ur_description/urdf/ur5_robot.urdf', ROBOTS / 'ur_description/srdf/ur5.srdf', 'ee_link'
UR10 = ROBOTS / 'ur_description/urdf/ur10_robot.urdf', None, 'ee_link'
Z1 = ROBOTS / 'z1_description/urdf/z1.urdf', ROBOTS / 'z1_description/srdf/z1.srdf', None
SO100 = ROBOTS / 'so_arm_description/urdf/so100.urdf', None, None
TIAGO = ROBOTS / 'tiago_description/robots/tiago_no_hand.urdf', None, 'arm_tool_link'
BAXTER = ROBOTS / 'baxter_description/urdf/baxter.urdf', ROBOTS / 'baxter_description/srdf/baxter_manipulation.srdf'


class UrdfJudge:
    """Contact as Pinocchio and coal see the URDF, which Pinocchio reads, with its meshes as they are."""

    def __init__(self, urdf, pairs, positions=None, base=None):
        """`pairs` are of link names; obstacles are added with `add`."""
        self.model = pin.buildModelFromUrdf(str(urdf))
        self.geometry = pin.buildGeomFromUrdf(
            self.model, str(urdf), pin.GeometryType.COLLISION, package_dirs=[str(SHARE)])
        self.owners = [self.model.frames[item.parentFrame].name for item in self.geometry.geometryObjects]
        self.base = base
        self.rest = pin.neutral(self.model)
        self.put(positions or {}, self.rest)
        self.allow(pairs)

    def allow(self, pairs):
        """Take pairs of owners into account."""
        wanted = {frozenset(pair) for pair in pairs}
        for i, j in combinations(range(len(self.owners)), 2):
            if frozenset((self.owners[i], self.owners[j])) in wanted:
                self.geometry.addCollisionPair(pin.CollisionPair(i, j))
        self.ready()

    def add(self, name, shape, pose, against, frame=None):
        """Add an obstacle at a pose in a frame, the base by default, against some links."""
        self.geometry.addGeometryObject(
            geometry_object(name, self.model, self.model.getFrameId(frame or self.base), np.asarray(pose), shape))
        self.owners.append(name)
        self.allow([(name, link) for link in against])

    def ready(self):
        """Make the workspaces."""
        self.data, self.placed = self.model.createData(), self.geometry.createData()
        ask_anew(self.placed)

    def put(self, positions, q):
        """Write joint positions by name to a configuration of the model."""
        for name, value in positions.items():
            joint = self.model.joints[self.model.getJointId(name)]
            q[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))

    def keep(self, margin):
        """Take a distance of up to `margin` [m] for contact."""
        for request in self.placed.collisionRequests:
            request.security_margin = margin

    def touches(self, names, q):
        """Return whether a pair touches at joint positions q."""
        full = self.rest.copy()
        self.put(dict(zip(names, q)), full)
        return pin.computeCollisions(self.model, self.data, self.geometry, self.placed, full, True)


def configurations(arm, count, seed=0):
    """Return random configurations within limits, one turn for those without."""
    lower, upper = np.clip(arm.lower, -np.pi, np.pi), np.clip(arm.upper, -np.pi, np.pi)
    return np.random.default_rng(seed).uniform(lower, upper, (count, arm.n))


def moving_pairs(room):
    """Return the pairs of names that a room of an arm looks at, but for the floor."""
    return {pair for pair in room.pairs if 'floor' not in pair}
