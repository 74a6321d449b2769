"""The ROS adapter: messages in, messages out, parameters; the only part of the package that imports rclpy."""
