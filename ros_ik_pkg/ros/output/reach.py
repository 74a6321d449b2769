"""The reach map on demand: made by another process, published by a thread, so that targets are answered meanwhile."""

from __future__ import annotations

import threading
import traceback

from rclpy.node import Node
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from ros_ik_pkg.ik import Arm, IkError
from ros_ik_pkg.ik.reachability.apart import ReachProcess
from ros_ik_pkg.ik.reachability.reach_map import reach_problem
from ros_ik_pkg.ros.handling.target_handler import TargetHandler
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.output.publisher import Publisher
from ros_ik_pkg.ros.output.reach_messages import reach_cloud, reach_markers_message, reach_poses_message


class Reach:
    """Answers the service ~/map_reach at once, and publishes the map, latched, when it is there.

    The map holds for the arm, the tool and the room of the moment of the call. A map that is under way is not begun
    again; one whose arm is gone when it is done is not published.
    """

    def __init__(self, node: Node, handler: TargetHandler) -> None:
        self._node, self._handler = node, handler
        self._markers, self._poses = Publisher(node, topics.REACH), Publisher(node, topics.REACH_POSES)
        self._process: ReachProcess | None = None
        self._thread: threading.Thread | None = None
        self._closed = False
        node.create_service(Trigger, topics.MAP_REACH, self._on_call)

    def _on_call(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            response.success, response.message = True, self._begin()
        except IkError as error:
            response.success, response.message = False, str(error)
        return response

    def _begin(self) -> str:
        """Begin a map unless one is under way; return what happens. Raises IkError if there can be none."""
        arm, settings = self._handler.arm, self._handler.settings
        if arm is None:
            raise IkError('there is no robot yet')
        if self._thread is not None and self._thread.is_alive():
            return 'a map is under way'
        world, _ = self._handler.surroundings.world(arm, settings)
        problem = reach_problem(arm, options=settings.options, world=world)
        self._process = ReachProcess(problem)
        self._thread = threading.Thread(target=self._publish, args=(self._process, arm), name='reach')
        self._thread.start()
        return f'mapping what {arm.name} reaches; the map comes on {self._node.resolve_topic_name(topics.REACH.name)}'

    def _publish(self, process: ReachProcess, arm: Arm) -> None:
        """Wait for the map, and publish it."""
        try:
            found = process.result()
            if arm is not self._handler.arm:
                self._node.get_logger().warning(f'the reach of {arm.name} is mapped, but that arm is gone')
                return
            cloud = reach_cloud(found, arm)
            header = Header(stamp=self._node.get_clock().now().to_msg(), frame_id=arm.base_frame)
            self._poses.publish(reach_poses_message(cloud, header))
            self._markers.publish(reach_markers_message(cloud, found.step, header))
            self._node.get_logger().info(f'the reach of {arm.name} is mapped: {len(cloud.centres)} positions')
        except Exception:
            if not self._closed:
                self._node.get_logger().error(traceback.format_exc())

    def close(self) -> None:
        """End the map that is under way, and the thread."""
        self._closed = True
        if self._process is not None:
            self._process.end()
        if self._thread is not None:
            self._thread.join()
