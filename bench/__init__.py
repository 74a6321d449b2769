"""Measurements of ros_ik_pkg; `scripts/bench` runs them."""
