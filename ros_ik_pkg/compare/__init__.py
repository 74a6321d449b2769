"""Compare the methods on one target: figures, sentences, tables and plots; without ROS."""

from ros_ik_pkg.compare.runs import MethodRun, compare_methods
from ros_ik_pkg.compare.words import describe, describe_run

__all__ = ['MethodRun', 'compare_methods', 'describe', 'describe_run']
