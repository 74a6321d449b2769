"""Plot of a comparison: errors and joints over the iterations, and the path of the tip in space."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from ros_ik_pkg.compare.iteration_axis import place, ticks
from ros_ik_pkg.compare.palette import COLOURS, TARGET
from ros_ik_pkg.compare.problem import Problem, is_rotary
from ros_ik_pkg.compare.runs import MethodRun
from ros_ik_pkg.compare.words import describe
from ros_ik_pkg.methods import BY_NAME

FLOOR = 1e-8  # m, rad; lower end of the error plots
MOST_COLUMNS = 7  # joint plots in a row
CAPTION_WIDTH = 165  # characters in a line
SHORTEST_AXIS = 3  # iterations
THINNEST = 0.2  # shortest side of the box around the tip path, as a fraction of the longest
BOX_ZOOM = 0.84  # leaves room for the labels around the box
INK, FAINT = '#24292f', '#d7dce1'
STYLE: Any = {
    'font.family': 'sans-serif', 'font.size': 10, 'text.color': INK, 'axes.labelcolor': INK,
    'axes.edgecolor': '#8b949e', 'axes.spines.top': False, 'axes.spines.right': False, 'axes.titlesize': 11,
    'axes.titleweight': 'bold', 'axes.titlelocation': 'left', 'axes.grid': True, 'grid.color': FAINT,
    'grid.linewidth': 0.7, 'xtick.color': INK, 'ytick.color': INK, 'lines.solid_capstyle': 'round',
}  # fmt: skip


def save_picture(path: Path, problem: Problem, runs: Sequence[MethodRun]) -> None:
    """Write the plot in the format of the file's suffix; raises ValueError if matplotlib cannot write it."""
    with matplotlib.rc_context(STYLE):
        draw(problem, runs).savefig(path, dpi=130, facecolor='white')


def draw(problem: Problem, runs: Sequence[MethodRun]) -> Figure:
    """Return the figure."""
    rows = -(-problem.arm.n // MOST_COLUMNS)
    columns = -(-problem.arm.n // rows)
    figure = Figure(figsize=(14.0, 7.0 + 2.0 * rows), layout='constrained')
    halves: Any = figure.subfigures(2, 1, height_ratios=[6.2, 2.2 * rows])
    top, bottom = halves
    errors, space = top.subfigures(1, 2, width_ratios=[1.15, 1.0])
    upper, lower = errors.subplots(2, 1, sharex=True)
    draw_errors(upper, runs, 'position_error', 'distance from the target [m]')
    draw_errors(lower, runs, 'orientation_error', 'angle from the target [rad]')
    lower.set_xlabel('iteration')
    upper.legend(ncols=len(runs), loc='lower center', bbox_to_anchor=(0.5, 1.0), frameon=False, columnspacing=1.4)
    draw_paths(space, problem, runs)
    draw_joints(bottom.subplots(rows, columns, squeeze=False), problem, runs)
    title = f'{problem.arm.name}: one seed, one target, {len(runs)} methods'
    figure.suptitle(title, x=0.012, ha='left', fontsize=15, fontweight='bold')
    figure.supxlabel(textwrap.fill(describe(runs), CAPTION_WIDTH), x=0.012, ha='left', fontsize=10)
    return figure


def _line_style(run: MethodRun) -> dict[str, Any]:
    """Return the line style of a run, the same in every plot."""
    look = BY_NAME[run.method].look
    return {'color': look.colour, 'linestyle': look.dash, 'linewidth': look.width, 'label': run.method}


def draw_errors(axes: Axes, runs: Sequence[MethodRun], column: str, label: str) -> None:
    """Plot one error over the iterations, with a dot at the last configuration."""
    for run in runs:
        x, y = place(run.iterates.column('iteration')), np.maximum(run.iterates.column(column), FLOOR)
        axes.plot(x, y, **_line_style(run), clip_on=False)
        axes.plot(x[-1], y[-1], 'o', color=COLOURS[run.method], markersize=7, clip_on=False, zorder=5)
    axes.set_yscale('log')
    axes.minorticks_off()
    axes.set_ylim(FLOOR, max(1.0, *(run.iterates.column(column).max() for run in runs)))
    axes.set_ylabel(label)
    _iteration_ticks(axes, runs)


def _iteration_ticks(axes: Axes, runs: Sequence[MethodRun], every: int = 1) -> None:
    """Set the ticks of the iteration axis: every `every`-th one, counted back from the last."""
    last = max([SHORTEST_AXIS, *(run.iterations for run in runs)])
    marks = [tick for tick in ticks(last) if tick <= last][::-every][::-1]
    axes.set_xticks(place(marks), [str(mark) for mark in marks])
    axes.set_xlim(0.0, float(place(last)) * 1.02)


def draw_paths(figure: Figure | SubFigure, problem: Problem, runs: Sequence[MethodRun]) -> None:
    """Plot the path of the tip for every method, from the seed to the red target."""
    axes: Any = figure.add_subplot(projection='3d', computed_zorder=False)
    for run in runs:
        axes.plot(*run.iterates.tip_positions.T, **_line_style(run), alpha=0.9)
    start, target = problem.arm.forward(problem.seed)[:3, 3], problem.target[:3, 3]
    axes.scatter(*start, color=INK, s=45, depthshade=False, zorder=9)
    axes.scatter(*target, color=TARGET, s=110, depthshade=False, zorder=10)
    axes.text(*start, '  seed', color=INK, zorder=11)
    axes.text(*target, '  target', color=TARGET, fontweight='bold', zorder=11)
    axes.set_title('Path of the tip', loc='left')
    for axis, name in zip((axes.xaxis, axes.yaxis, axes.zaxis), 'xyz'):
        axis.set_label_text(f'{name} [m]')
        axis.labelpad = 3 if name == 'z' else 9
    equal_scales(axes)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.set(facecolor='#f6f8fa', edgecolor=FAINT)


def equal_scales(axes: Any) -> None:
    """Give the three axes one scale, none of them so short that its marks overlap."""
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    spans = limits[:, 1] - limits[:, 0]
    longest = spans.max()
    wanted = np.maximum(spans, THINNEST * longest)
    limits += np.outer((wanted - spans) / 2, [-1, 1])
    axes.set(xlim=limits[0], ylim=limits[1], zlim=limits[2])
    axes.set_box_aspect(wanted, zoom=BOX_ZOOM)
    for axis, (low, high) in zip((axes.xaxis, axes.yaxis, axes.zaxis), limits.tolist()):
        marks = matplotlib.ticker.MaxNLocator(max(round(4 * (high - low) / longest), 1)).tick_values(low, high)
        axis.set_ticks([mark for mark in marks if low <= mark <= high])  # some releases ignore nbins of a locator


def draw_joints(grid: np.ndarray, problem: Problem, runs: Sequence[MethodRun]) -> None:
    """Plot every joint over the iterations, revolute joints in degrees."""
    rotary = is_rotary(problem.arm)
    for i, axes in enumerate(grid.flat):
        if i >= problem.arm.n:
            axes.set_visible(False)
            continue
        for run in runs:
            values = run.iterates.joint_positions[:, i]
            x, y = place(run.iterates.column('iteration')), np.degrees(values) if rotary[i] else values
            axes.plot(x, y, **_line_style(run))
        axes.set_title(f'{problem.arm.joint_names[i]} [{"°" if rotary[i] else "m"}]', fontsize=10, fontweight='normal')
        axes.set_xlabel('iteration', fontsize=9)
        _iteration_ticks(axes, runs, every=2)
        axes.locator_params(axis='y', nbins=4)
