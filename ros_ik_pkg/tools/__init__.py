"""Programs behind `scripts/` and `ros2 run`: ROS clients of the node, they hold no solver."""
