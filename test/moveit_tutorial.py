"""A program as tutorials write it against move_group, which knows nothing of this package: a pose in, joints out."""

import rclpy
from moveit_msgs.msg import MoveItErrorCodes
from moveit_msgs.srv import GetPositionFK, GetPositionIK
from rclpy.node import Node


class IKClient(Node):
    def __init__(self):
        super().__init__('ik_client')
        self.ik = self.create_client(GetPositionIK, '/compute_ik')
        self.fk = self.create_client(GetPositionFK, '/compute_fk')
        for client in (self.ik, self.fk):
            while not client.wait_for_service(timeout_sec=1.0):
                self.get_logger().info('service not available, waiting again...')

    def send_request(self, x, y, z):
        request = GetPositionIK.Request()
        request.ik_request.group_name = 'panda_arm'
        request.ik_request.avoid_collisions = True
        request.ik_request.timeout.sec = 2
        request.ik_request.pose_stamped.header.frame_id = 'panda_link0'
        request.ik_request.pose_stamped.header.stamp = self.get_clock().now().to_msg()
        request.ik_request.pose_stamped.pose.position.x = x
        request.ik_request.pose_stamped.pose.position.y = y
        request.ik_request.pose_stamped.pose.position.z = z
        request.ik_request.pose_stamped.pose.orientation.x = 1.0
        request.ik_request.pose_stamped.pose.orientation.w = 0.0
        future = self.ik.call_async(request)
        rclpy.spin_until_future_complete(self, future)
        return future.result()

    def check(self, state):
        request = GetPositionFK.Request()
        request.header.frame_id = 'panda_link0'
        request.fk_link_names = ['panda_link8']
        request.robot_state = state
        future = self.fk.call_async(request)
        rclpy.spin_until_future_complete(self, future)
        return future.result().pose_stamped[0].pose


def main():
    rclpy.init()
    client = IKClient()
    response = client.send_request(0.4, 0.1, 0.5)
    if response.error_code.val == MoveItErrorCodes.SUCCESS:
        joint_state = response.solution.joint_state
        for name, position in zip(joint_state.name[:7], joint_state.position[:7]):
            print(name, position)
        position = client.check(response.solution).position
        print('reached', position.x, position.y, position.z)
    else:
        print('IK failed with error code', response.error_code.val)
    client.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
