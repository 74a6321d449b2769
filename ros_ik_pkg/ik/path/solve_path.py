"""solve_path: from poses of the tip to a motion of the joints."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.exceptions import ArgumentError, OptionError
from ros_ik_pkg.ik.options import SolveOptions, all_demanded
from ros_ik_pkg.ik.path.breaks import find_break
from ros_ik_pkg.ik.path.clear_of_room import ClearOfRoom
from ros_ik_pkg.ik.path.figures import pose_figures
from ros_ik_pkg.ik.path.joint_path import follow
from ros_ik_pkg.ik.path.motion import make_motion
from ros_ik_pkg.ik.path.path_options import PathOptions
from ros_ik_pkg.ik.path.path_solution import PathSolution
from ros_ik_pkg.ik.path.problem import Clear, Problem
from ros_ik_pkg.ik.path.waypoints import SAG, Samples, read_poses, read_stamps, sample_path
from ros_ik_pkg.ik.world import World


def solve_path(
    arm: Arm,
    poses: Any,
    seed: Any = None,
    options: SolveOptions | None = None,
    path: PathOptions | None = None,
    stamps: Any = None,
    vias: Sequence[int] = (),
    clear: Clear | None = None,
    progress: Callable[[int], object] | None = None,
    world: World | None = None,
) -> PathSolution:
    """Return a motion of the joints that leads the tip along a whole path.

    From pose to pose the tip moves in a straight line and turns at a constant rate about one axis (SLERP). Of all
    routes through the solutions of all samples, the motion follows one with the fewest reconfigurations, and among
    those the one with the least weighted joint motion.

    Parameters
    ----------
    arm : Arm
    poses : (N, 4, 4) array or sequence of pinocchio.SE3
        Poses of the tip in the base frame [m], two or more. A pose equal to the one before is skipped.
    seed : (n,) array, optional
        Where the joints are [rad, m]; the distance to the start of the path counts as motion. Default: the path may
        begin anywhere.
    options : SolveOptions, optional
        Tolerances, task and weights; deadline, choice and null_space have no effect.
    path : PathOptions, optional
    stamps : (N,) array, optional
        Rising times of the poses [s], used instead of tool_speed. The tip is late if the joints cannot keep them.
    vias : sequence of int, optional
        Indices of poses in the middle of a circular arc, which leads from the pose before to the pose after.
    clear : callable, optional
        Called with joint positions (k, n), returns (k,) bool: whether each is free of contact. Default: the check for
        contact with the arm itself and the world, if avoid_collisions is on and the robot has shapes.
    progress : callable, optional
        Called with the number of samples done since the last call; with 0 while the route is searched.
    world : World, optional
        What the arm must stay clear of besides itself.

    Returns
    -------
    PathSolution
        As far as the path can be followed; if that is not to its end, with the place and the reason.

    Raises
    ------
    ArgumentError
        If an argument has the wrong shape, is not finite or makes no path. The text names the pose.

    """
    began = time.monotonic()
    options, path = all_demanded(options or SolveOptions()), path or PathOptions()
    if clear is None and options.avoid_collisions and arm.shaped:
        clear = ClearOfRoom(arm.contacts.room(world), options, path)
    problem = _make_problem(arm, poses, seed, options, path, stamps, vias, clear, progress, began)
    joints = follow(problem)
    motion = make_motion(problem, joints)
    complete = joints.reached == len(problem.samples.poses)
    breaks = () if complete else (find_break(problem, joints),)
    rows = len(joints.q)
    figures = pose_figures(arm.packed, problem.continuing, np.ascontiguousarray(joints.poses).reshape(-1, 4), joints.q)
    places = problem.samples.place
    largest = motion.errors.max(axis=0, initial=0.0)
    return PathSolution(
        complete=complete,
        q=joints.q,
        times=np.concatenate([np.zeros(min(rows, 1)), np.cumsum(motion.durations)]),
        velocities=motion.velocities,
        accelerations=motion.accelerations,
        place=np.interp(joints.sample, np.arange(len(places)), places),
        base_from_tip=joints.poses,
        reconfigurations=tuple(joints.reconfigurations),
        stops=tuple(map(int, np.flatnonzero(motion.stops))),
        led=joints.led,
        slowed=motion.slowed,
        breaks=breaks,
        position_error=figures[:, 0],
        orientation_error=figures[:, 1],
        sigma_min=figures[:, 2],
        line_error=float(max(largest[0], figures[:, 0].max(initial=0.0))),
        line_angle=float(max(largest[1], figures[:, 1].max(initial=0.0))),
        solve_time=time.monotonic() - began,
    )


def _make_problem(
    arm: Arm, poses: Any, seed: Any, options: SolveOptions, path: PathOptions, stamps: Any, vias: Sequence[int],
    clear: Clear | None, progress: Callable[[int], object] | None, began: float,
) -> Problem:  # fmt: skip
    """Check the arguments, and sample the path."""
    try:
        options.check_lengths(arm.n)
    except OptionError as error:
        raise ArgumentError(str(error)) from None
    if len(path.acceleration_limits) not in (0, arm.n):
        raise ArgumentError(
            f'acceleration_limits has {len(path.acceleration_limits)} numbers; expected {arm.n}, one for each joint, '
            'or none'
        )
    given = read_poses(poses)
    times = None if stamps is None else read_stamps(stamps, len(given))
    samples = sample_path(given, vias, path.step, path.angle_step, path.tolerance, times is not None)
    if len(vias):
        path = replace(path, tolerance=(1.0 - SAG) * path.tolerance)
    stop_time = began + path.deadline if path.deadline > 0.0 else math.inf
    return Problem(
        arm, samples, _read_seed(arm, seed), options, path, _least_durations(samples, path, times), clear, stop_time,
        progress,
    )  # fmt: skip


def _read_seed(arm: Arm, seed: Any) -> np.ndarray:
    """Return the seed (n,), (0,) if there is none."""
    if seed is None:
        return np.empty(0)
    try:
        values = np.array(seed, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f'seed is not an array of numbers: {error}') from None
    if values.shape != (arm.n,) or not np.all(np.isfinite(values)):
        raise ArgumentError(f'seed = {values.tolist()}; expected {arm.n} finite numbers [rad, m]')
    return values


def _least_durations(samples: Samples, path: PathOptions, times: np.ndarray | None) -> np.ndarray:
    """Return the shortest times of the intervals between samples (N - 1,) [s]: by stamps or tool_speed, else 0."""
    if times is not None:
        return np.diff(np.interp(samples.place, np.arange(len(times)), times))
    if path.tool_speed > 0.0:
        return np.linalg.norm(np.diff(samples.poses[:, :3, 3], axis=0), axis=1) / path.tool_speed
    return np.zeros(len(samples.poses) - 1)
