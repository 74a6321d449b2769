"""A room that is there before the robot, over DDS."""

from __future__ import annotations

import numpy as np
from ros_helpers import Client, allow_lark, node_process, pose_of, wait_until_ready
from visualization_msgs.msg import Marker, MarkerArray

from bench.published_robots import UR5
from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.tools.processes import ros_node

pytestmark = allow_lark


def test_obstacles_that_come_before_the_robot_description_count(tmp_path):
    arm = load_arm(UR5[0], tip=UR5[2], srdf=UR5[1])
    log, q = tmp_path / 'log', np.array([0.3, -1.2, 1.4, -0.6, 1.0, 0.2])
    base_from_tip = arm.forward(q)
    ball = Marker(ns='ball', type=Marker.SPHERE, action=Marker.ADD)
    ball.scale.x = ball.scale.y = ball.scale.z = 0.1
    p, ball.pose.orientation.w = ball.pose.position, 1.0
    p.x, p.y, p.z = map(float, base_from_tip[:3, 3])
    words = ["robot:=''", f'tip_frame:={UR5[2]}', 'seed_source:=home', f'srdf:={UR5[1]}']
    arguments = [part for word in words for part in ('-p', word)]
    with node_process(log, *arguments) as process, ros_node('early') as node, Client(node) as client:
        wait_until_ready(process, log, 'no robot yet')
        obstacles = node.create_publisher(MarkerArray, topics.OBSTACLES.name, topics.OBSTACLES.qos)
        client.wait_for(obstacles.get_subscription_count, 'the node')
        obstacles.publish(MarkerArray(markers=[ball]))
        heard = len(client.health)
        client.wait_for(lambda: len(client.health) > heard + 1, 'reports: the obstacle is taken by now')
        client.send_description(UR5[0].read_text())
        wait_until_ready(process, log)
        client.connect()
        reply = client.solve(pose_of(base_from_tip), 60.0)
        assert reply.figures['status'] == 'collision' and 'ball/0' in reply.message
