"""The panel in the browser: a ROS node of its own that sends targets to the IK node and draws what comes back."""
