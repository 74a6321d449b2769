"""The panel in the browser: a separate ROS node that sends targets to the IK node and shows the results."""
