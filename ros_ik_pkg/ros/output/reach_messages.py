"""A reach map as messages: a cloud for RViz, and a pose of the tip for each of its points; pure functions."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.ik import Arm, ReachMap

FILLED = 0.45  # of a cell's edge: what lies behind is seen between the cubes
AT_ONCE = 50  # points that are made before other threads get their turn


class ReachCloud(NamedTuple):
    """The positions that are reached: their middles (k, 3) [m], the share of the rotations (k,), 0 to 1, and a pose of
    the tip (k, 4, 4) in each, that with the largest sigma_min."""

    centres: np.ndarray
    shares: np.ndarray
    base_from_tip: np.ndarray


def reach_cloud(found: ReachMap, arm: Arm) -> ReachCloud:
    """Return the positions of a map that are reached."""
    share = found.share
    reached = share > 0.0
    order = np.lexsort((-found.sigma_min, found.cells // found.rotations))
    _, first = np.unique((found.cells // found.rotations)[order], return_index=True)
    poses = []
    for number, q in enumerate(found.q[order[first]]):
        poses.append(arm.forward(q))
        if number % AT_ONCE == 0:
            time.sleep(0.0)
    return ReachCloud(found.centres()[reached], share[reached], np.array(poses).reshape(-1, 4, 4))


def reach_markers_message(cloud: ReachCloud, step: float, header: Header) -> MarkerArray:
    """Return a cube for each position: red where few rotations are reached, blue where all are."""
    edge = FILLED * step
    marker = Marker(header=header, ns='reach', type=Marker.CUBE_LIST, scale=Vector3(x=edge, y=edge, z=edge))
    marker.pose.orientation.w = 1.0
    points, colours = [], []
    for number, ((x, y, z), share) in enumerate(zip(cloud.centres.tolist(), cloud.shares.tolist())):
        points.append(Point(x=x, y=y, z=z))
        colours.append(ColorRGBA(r=1.0 - share, g=0.4 + 0.2 * share, b=share, a=1.0))
        if number % AT_ONCE == 0:
            time.sleep(0.0)
    marker.points, marker.colors = points, colours
    return MarkerArray(markers=[marker])


def reach_poses_message(cloud: ReachCloud, header: Header) -> PoseArray:
    """Return the pose of the tip for each position, in the order of the cubes."""
    poses = []
    for number, pose in enumerate(cloud.base_from_tip):
        px, py, pz, x, y, z, w = pin.SE3ToXYZQUAT(pin.SE3(pose)).tolist()
        poses.append(Pose(position=Point(x=px, y=py, z=pz), orientation=Quaternion(x=x, y=y, z=z, w=w)))
        if number % AT_ONCE == 0:
            time.sleep(0.0)
    return PoseArray(header=header, poses=poses)
