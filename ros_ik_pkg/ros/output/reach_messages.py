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
from ros_ik_pkg.ik.reachability.figures import end_of_scale, position_figures, red_to_blue

FILLED = 0.45  # of a cell's edge: what lies behind is seen between the cubes
AT_ONCE = 50  # points that are made before other threads get their turn


class ReachCloud(NamedTuple):
    """The positions that are reached: their middles (k, 3) [m], figures (k,) by name (`position_figures`), and a
    pose of the tip (k, 4, 4) in each, that with the largest sigma_min."""

    centres: np.ndarray
    figures: dict[str, np.ndarray]
    base_from_tip: np.ndarray


def reach_cloud(found: ReachMap, arm: Arm) -> ReachCloud:
    """Return the positions of a map that are reached."""
    reached = found.share > 0.0
    order = np.lexsort((-found.sigma_min, found.cells // found.rotations))
    _, first = np.unique((found.cells // found.rotations)[order], return_index=True)
    poses = []
    for number, q in enumerate(found.q[order[first]]):
        poses.append(arm.forward(q))
        if number % AT_ONCE == 0:
            time.sleep(0.0)
    figures = {name: figure[reached] for name, figure in position_figures(found).items()}
    return ReachCloud(found.centres()[reached], figures, np.array(poses).reshape(-1, 4, 4))


def reach_markers_message(cloud: ReachCloud, step: float, header: Header) -> MarkerArray:
    """Return a cube for each position, once for each figure, with the figure's name as namespace.

    Red stands for 0, blue for the number in the marker's text. Cubes of the second figure and the third are a little
    smaller, so that the share is seen if all are shown.
    """
    markers = []
    for smaller, (name, values) in enumerate(cloud.figures.items()):
        edge, end = (FILLED - 0.01 * smaller) * step, end_of_scale(name, values)
        marker = Marker(header=header, ns=name, type=Marker.CUBE_LIST, scale=Vector3(x=edge, y=edge, z=edge))
        marker.pose.orientation.w, marker.text = 1.0, f'{end:.3g}'
        points, colours = [], []
        rows = zip(cloud.centres.tolist(), red_to_blue(values, end).tolist())
        for number, ((x, y, z), (red, green, blue)) in enumerate(rows):
            points.append(Point(x=x, y=y, z=z))
            colours.append(ColorRGBA(r=red, g=green, b=blue, a=1.0))
            if number % AT_ONCE == 0:
                time.sleep(0.0)
        marker.points, marker.colors = points, colours
        markers.append(marker)
    return MarkerArray(markers=markers)


def reach_poses_message(cloud: ReachCloud, header: Header) -> PoseArray:
    """Return the pose of the tip for each position, in the order of the cubes."""
    poses = []
    for number, pose in enumerate(cloud.base_from_tip):
        px, py, pz, x, y, z, w = pin.SE3ToXYZQUAT(pin.SE3(pose)).tolist()
        poses.append(Pose(position=Point(x=px, y=py, z=pz), orientation=Quaternion(x=x, y=y, z=z, w=w)))
        if number % AT_ONCE == 0:
            time.sleep(0.0)
    return PoseArray(header=header, poses=poses)
