"""Jacobian inverse kinematics without ROS: load an arm, solve poses, see every iteration."""

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.arm_tree import ArmTree, load_tree
from ros_ik_pkg.ik.batch_solver import BatchSolution, solve_batch
from ros_ik_pkg.ik.compilation import Compilation, warm_up
from ros_ik_pkg.ik.contacts.judge import Contact
from ros_ik_pkg.ik.exceptions import ArgumentError, IkError, ModelError, NotCompiledError, OptionError
from ros_ik_pkg.ik.loading import load_arm
from ros_ik_pkg.ik.model.sources import robot_names
from ros_ik_pkg.ik.options import CHOICES, METHODS, OPTIONS, SolveOptions
from ros_ik_pkg.ik.path.path_options import PATH_OPTIONS, PathOptions
from ros_ik_pkg.ik.path.path_solution import BreakReason, PathBreak, PathSolution
from ros_ik_pkg.ik.path.solve_path import solve_path
from ros_ik_pkg.ik.path.waypoints import sample_arcs
from ros_ik_pkg.ik.reachability.placement import Placement, rank_placements
from ros_ik_pkg.ik.reachability.reach_map import ReachMap, load_reach_map, reach_map
from ros_ik_pkg.ik.solution import TRACE_COLUMNS, Solution, Status, Trace
from ros_ik_pkg.ik.solver import solve
from ros_ik_pkg.ik.tip_solver import prepare_tips, solve_tips
from ros_ik_pkg.ik.world import Obstacle, World

__all__ = [
    'CHOICES',
    'METHODS',
    'OPTIONS',
    'PATH_OPTIONS',
    'TRACE_COLUMNS',
    'ArgumentError',
    'Arm',
    'ArmTree',
    'BatchSolution',
    'BreakReason',
    'Compilation',
    'Contact',
    'IkError',
    'ModelError',
    'NotCompiledError',
    'Obstacle',
    'OptionError',
    'PathBreak',
    'PathOptions',
    'PathSolution',
    'Placement',
    'ReachMap',
    'Solution',
    'SolveOptions',
    'Status',
    'Trace',
    'World',
    'load_arm',
    'load_reach_map',
    'load_tree',
    'prepare_tips',
    'rank_placements',
    'reach_map',
    'robot_names',
    'sample_arcs',
    'solve',
    'solve_batch',
    'solve_path',
    'solve_tips',
    'warm_up',
]  # fmt: skip
