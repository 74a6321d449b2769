"""The comparison as a moving picture: every method's arm and error, iteration by iteration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.figure import Figure

from ros_ik_pkg.compare.iteration_axis import place
from ros_ik_pkg.compare.palette import COLOURS, TARGET
from ros_ik_pkg.compare.plots import FAINT, INK, STYLE, draw_errors, equal_scales
from ros_ik_pkg.compare.problem import Problem
from ros_ik_pkg.compare.runs import MethodRun
from ros_ik_pkg.compare.skeleton import joint_origins
from ros_ik_pkg.ik import ArgumentError

FORMATS = ('.gif', '.mp4')
MOST_FRAMES = 60
FRAMES_A_SECOND = 8
REST = 10  # frames that the last one stands for


def save_animation(
    path: Path, problem: Problem, runs: Sequence[MethodRun], progress: Callable[[int], object] | None = None
) -> None:
    """Write the animation in the format of the file's suffix.

    progress : callable, optional
        Called with 1 for each frame that is drawn.

    Raises
    ------
    ArgumentError
        If the suffix is none of FORMATS, or ffmpeg, which .mp4 needs, is not installed.

    """
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise ArgumentError(f'{str(path)!r}: expected a name that ends in {", ".join(FORMATS)}')
    if suffix == '.mp4' and not FFMpegWriter.isAvailable():
        raise ArgumentError('.mp4 needs the program ffmpeg (apt install ffmpeg); .gif needs nothing')
    writer = (FFMpegWriter if suffix == '.mp4' else PillowWriter)(fps=FRAMES_A_SECOND)
    with matplotlib.rc_context(STYLE):
        animation = animate(problem, runs)
        called = (lambda *_: progress(1)) if progress else None
        animation.save(path, writer=writer, dpi=80, progress_callback=called)


def frames_of(runs: Sequence[MethodRun]) -> list[int]:
    """Return the iterations to draw: all of a short comparison, else ever fewer, as the axis of the plots has them."""
    last = max(run.iterations for run in runs)
    chosen = np.unique(np.geomspace(1, last + 1, MOST_FRAMES).round().astype(int) - 1) if last else np.zeros(1, int)
    return [*chosen.tolist(), *([last] * REST)]


def animate(problem: Problem, runs: Sequence[MethodRun]) -> FuncAnimation:
    """Return the animation; a method that has stopped stands still."""
    figure = Figure(figsize=(11.0, 5.4), layout='constrained')
    halves: Any = figure.subfigures(1, 2, width_ratios=[1.0, 1.0])
    errors, space = halves
    upper, lower = errors.subplots(2, 1, sharex=True)
    draw_errors(upper, runs, 'position_error', 'distance from the target [m]')
    draw_errors(lower, runs, 'orientation_error', 'angle from the target [rad]')
    lower.set_xlabel('iteration')
    upper.legend(ncols=len(runs), loc='lower center', bbox_to_anchor=(0.5, 1.0), frameon=False, columnspacing=1.2)
    cursors = [axes.axvline(0.0, color=INK, linewidth=1.0, linestyle=':') for axes in (upper, lower)]
    axes = space.add_subplot(projection='3d', computed_zorder=False)
    arms = {run.method: axes.plot([], [], [], '-o', color=COLOURS[run.method], markersize=3)[0] for run in runs}
    ways = {run.method: axes.plot([], [], [], color=COLOURS[run.method], linewidth=1.0)[0] for run in runs}
    axes.scatter(*problem.target[:3, 3], color=TARGET, s=90, depthshade=False, zorder=10)
    ends = [joint_origins(problem.arm, run.iterates.joint_positions[k]) for run in runs for k in (0, -1)]
    corners = np.vstack([*ends, problem.target[:3, 3]])
    for set_bounds, values in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), corners.T):
        set_bounds(values.min(), values.max())
    equal_scales(axes)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.set(facecolor='#f6f8fa', edgecolor=FAINT)

    def draw(iteration: int) -> list:
        for cursor in cursors:
            cursor.set_xdata([place(iteration)] * 2)
        for run in runs:
            k = min(iteration, len(run.iterates) - 1)
            arms[run.method].set_data_3d(*joint_origins(problem.arm, run.iterates.joint_positions[k]).T)
            ways[run.method].set_data_3d(*run.iterates.tip_positions[: k + 1].T)
        axes.set_title(f'iteration {iteration}', loc='left')
        return [*cursors, *arms.values(), *ways.values()]

    return FuncAnimation(figure, draw, frames=frames_of(runs))
