"""Picture of a reach map: three slices through its middle, and the cloud of all positions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from ros_ik_pkg.compare.plots import STYLE, equal_scales
from ros_ik_pkg.ik import ReachMap
from ros_ik_pkg.ik.reachability.figures import MEANINGS, end_of_scale, position_figure

COLOURS = 'viridis'  # even in lightness, and readable for the colour-blind
AXES = 'xyz'
POINT = 40.0  # points^2
ZOOM = 1.15  # fills the quarter of the picture


def save_picture(path: Path, name: str, found: ReachMap, colour: str) -> None:
    """Write the picture of a figure of MEANINGS in the format of the file's suffix."""
    with matplotlib.rc_context(STYLE):
        draw(name, found, colour).savefig(path, dpi=130, facecolor='white')


def draw(name: str, found: ReachMap, colour: str) -> Figure:
    """Return the figure."""
    figure = Figure(figsize=(14.0, 10.0), layout='constrained')
    values = position_figure(found, colour)
    scale = Normalize(0.0, end_of_scale(colour, values))
    shown: Any = None
    for place, axis in zip((1, 2, 3), (1, 0, 2)):  # from the side, from the front, from above
        axes = figure.add_subplot(2, 2, place)
        shown = draw_slice(axes, found, values, scale, axis)
    draw_cloud(figure, found, values, scale)
    figure.colorbar(shown, ax=figure.axes, shrink=0.6, label=MEANINGS[colour])
    figure.suptitle(f'{name}: what it reaches, {found.rotations} rotations at each position',
                    x=0.012, ha='left', fontsize=15, fontweight='bold')  # fmt: skip
    return figure


def draw_slice(axes: Any, found: ReachMap, values: np.ndarray, scale: Normalize, axis: int) -> Any:
    """Draw the layer of cells through the base frame's origin, or the nearest one, across an axis."""
    layer = int(np.clip(-found.corner[axis] / found.step, 0, found.shape[axis] - 1))
    across, up = (i for i in range(3) if i != axis)
    ends = found.corner + found.step * np.array(found.shape)
    image = axes.imshow(
        np.take(values, layer, axis).T, origin='lower', cmap=COLOURS, norm=scale, interpolation='nearest',
        extent=(found.corner[across], ends[across], found.corner[up], ends[up]),
    )  # fmt: skip
    axes.set(xlabel=f'{AXES[across]} [m]', ylabel=f'{AXES[up]} [m]')
    axes.set_title(f'{AXES[axis]} = {found.corner[axis] + found.step * (layer + 0.5):.2f} m')
    axes.grid(visible=False)
    axes.plot(0.0, 0.0, '+', color='#d1242f', markersize=12, markeredgewidth=2.0)
    return image


def draw_cloud(figure: Figure, found: ReachMap, values: np.ndarray, scale: Normalize) -> None:
    """Draw the positions of the half behind the plane y = 0, so that the inside is seen."""
    axes: Any = figure.add_subplot(2, 2, 4, projection='3d')
    centres = found.centres()
    seen = ~np.isnan(values) & (centres[..., 1] >= 0.0)
    points = centres[seen]
    axes.scatter(*points.T, c=values[seen], cmap=COLOURS, norm=scale, s=POINT, marker='s', linewidths=0.0)
    axes.set(xlabel='x [m]', ylabel='y [m]', zlabel='z [m]')
    axes.set_title('the half with y above 0', loc='left')
    axes.view_init(elev=18.0, azim=-65.0)
    equal_scales(axes)
    axes.set_box_aspect(np.ptp(points, axis=0), zoom=ZOOM)
