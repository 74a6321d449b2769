"""Picture of a motion along a path: joints over time against their limits, speed of the tip, singular values."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ros_ik_pkg.compare.palette import BAD, TARGET
from ros_ik_pkg.compare.plots import STYLE
from ros_ik_pkg.compare.problem import is_rotary
from ros_ik_pkg.ik import Arm, PathSolution
from ros_ik_pkg.ik.path.breaks import NEARLY_SINGULAR

LINE, REST = '#1f6feb', '#8b949e'
COLUMNS = 3
LEAST_RANGE = 0.5  # deg or m, of the axis of a joint that hardly moves
POINTS = 2000  # of a curve


def save_path_picture(path: Path, arm: Arm, solution: PathSolution) -> None:
    """Write the picture in the format of the file's suffix; raises ValueError if there is no motion to show."""
    if len(solution.q) < 2:
        raise ValueError('there is no motion to draw: the path breaks at its first pose')
    with matplotlib.rc_context(STYLE):
        draw_path(arm, solution).savefig(path, dpi=130, facecolor='white')


def draw_path(arm: Arm, solution: PathSolution) -> Figure:
    """Return the figure: one plot for each joint, then the speed of the tip and the smallest singular value."""
    rows = -(-arm.n // COLUMNS)
    figure = Figure(figsize=(13.0, 2.3 * (rows + 1) + 0.6), layout='constrained')
    grid = figure.add_gridspec(rows + 1, 6)
    at = np.linspace(0.0, solution.times[-1], POINTS)
    q, degrees = solution.at(at), np.where(is_rotary(arm), 180.0 / np.pi, 1.0)
    for j, name in enumerate(arm.joint_names):
        axes = figure.add_subplot(grid[j // COLUMNS, 2 * (j % COLUMNS) : 2 * (j % COLUMNS) + 2])
        axes.plot(at, degrees[j] * q[:, j], color=LINE)
        draw_limits(axes, degrees[j] * arm.lower[j], degrees[j] * arm.upper[j])
        axes.set_title(f'{name} [{"deg" if degrees[j] > 1.0 else "m"}]')
        mark_changes(axes, solution)
    speed, singular = (figure.add_subplot(grid[rows, 3 * k : 3 * k + 3]) for k in range(2))
    positions = solution.base_from_tip[:, :3, 3]
    speeds = np.linalg.norm(np.diff(positions, axis=0), axis=1) / np.diff(solution.times)
    speeds[list(solution.off_path)] = np.nan  # the tip is elsewhere then
    speed.stairs(speeds, solution.times, baseline=None, color=LINE)
    speed.set_title('speed of the tip [m/s]')
    speed.set_ylim(bottom=0.0)
    singular.semilogy(solution.times, np.maximum(solution.sigma_min, 1e-6), color=LINE)
    singular.axhline(NEARLY_SINGULAR, color=BAD, linestyle='--', linewidth=1.0)
    singular.set_title('smallest singular value (dashed: nearly singular)')
    for axes in (speed, singular):
        axes.set_xlabel('time [s]')
        mark_changes(axes, solution)
    whole = 'whole' if solution.complete else f'up to pose {solution.place[-1]:.4g}'
    count = len(solution.reconfigurations)
    title = f'{arm.name}: a path followed {whole}, {count} reconfiguration{"" if count == 1 else "s"}'
    figure.suptitle(title, x=0.012, ha='left', fontsize=14, fontweight='bold')
    return figure


def draw_limits(axes: Axes, lower: float, upper: float) -> None:
    """Draw the limits that are near the curve, and leave the axis no taller than the curve needs."""
    low, high = axes.get_ylim()
    missing = max(0.0, LEAST_RANGE - (high - low))
    low, high = low - 0.5 * missing, high + 0.5 * missing
    room = high - low
    axes.set_ylim(low - 0.1 * room, high + 0.1 * room)
    for limit in (lower, upper):
        if low - room <= limit <= high + room:
            axes.axhline(limit, color=BAD, linestyle='--', linewidth=1.0)
            bottom, top = axes.get_ylim()
            axes.set_ylim(min(bottom, limit - 0.05 * room), max(top, limit + 0.05 * room))


def mark_changes(axes: Axes, solution: PathSolution) -> None:
    """Shade the time in which the tip is off its line, and mark where the joints rest."""
    for row in solution.off_path:
        axes.axvspan(solution.times[row], solution.times[row + 1], color=TARGET, alpha=0.12, linewidth=0.0)
    for row in solution.stops[1:-1]:
        axes.axvline(solution.times[row], color=REST, linewidth=0.6)
