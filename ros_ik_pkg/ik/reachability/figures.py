"""What a reach map says of each position, and the colours of it, for pictures, point clouds and markers."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.exceptions import ArgumentError
from ros_ik_pkg.ik.reachability.reach_map import ReachMap

MEANINGS = {
    'share': 'share of the rotations that are reached',
    'sigma_min': 'largest of the smallest singular values',
    'clearance': 'largest clearance [m]',
}


def position_figures(found: ReachMap) -> dict[str, np.ndarray]:
    """Return the figures (nx, ny, nz) of MEANINGS by name, NaN where nothing is reached; `clearance` only if contact
    counts."""
    share = found.share
    figures = {'share': np.where(share > 0.0, share, np.nan), 'sigma_min': found.best_sigma_min}
    if not np.isnan(found.clearance).all():
        figures['clearance'] = found.best_clearance
    return figures


def position_figure(found: ReachMap, name: str) -> np.ndarray:
    """Return the figure of this name; raises ArgumentError if the map has none."""
    figures = position_figures(found)
    if name not in figures:
        raise ArgumentError(f'the map has no {name}: contact does not count; expected {" or ".join(figures)}')
    return figures[name]


def end_of_scale(name: str, values: np.ndarray) -> float:
    """Return the value that the last colour stands for: 1 for shares, else the largest that is finite."""
    return 1.0 if name == 'share' else float(np.max(values[np.isfinite(values)], initial=1e-9))


def red_to_blue(values: np.ndarray, end: float) -> np.ndarray:
    """Return colours (k, 3), 0 to 1, of values (k,): red for 0, blue for `end` and above."""
    parts = np.clip(values / end, 0.0, 1.0)
    return np.stack([1.0 - parts, 0.4 + 0.2 * parts, parts], -1)
