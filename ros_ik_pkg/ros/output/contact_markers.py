"""The two nearest points of a solution as markers for RViz."""

from __future__ import annotations

from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from ros_ik_pkg.ros.handling.result import Result
from ros_ik_pkg.ros.output.messages import base_header

WIDTH = 0.01  # [m]
TOUCHING, CLEAR = ColorRGBA(r=0.85, g=0.1, b=0.1, a=1.0), ColorRGBA(r=0.2, g=0.6, b=0.9, a=1.0)


def contact_markers(result: Result) -> MarkerArray:
    """Return the nearest points of a solution, the line between them and the names of the bodies; red if they touch."""
    contact = result.solution.contact
    if not contact.links:
        return MarkerArray(markers=[Marker(header=base_header(result), action=Marker.DELETEALL)])
    points = [Point(x=x, y=y, z=z) for x, y, z in contact.points.tolist()]
    color = TOUCHING if contact.touches else CLEAR
    markers = []
    for number, kind in enumerate((Marker.SPHERE_LIST, Marker.LINE_LIST, Marker.TEXT_VIEW_FACING)):
        marker = Marker(header=base_header(result), ns='contact', id=number, type=kind, color=color, points=points)
        marker.scale = Vector3(x=WIDTH, y=WIDTH, z=WIDTH)
        marker.pose.orientation.w = 1.0
        markers.append(marker)
    text = markers[2]
    text.points, text.pose.position, text.scale.z = [], points[0], 4.0 * WIDTH
    text.text = f'{" - ".join(contact.links)} {1e3 * contact.clearance:.3g} mm'
    return MarkerArray(markers=markers)
