"""The iteration axis of every plot: logarithmic, but with iteration 0 on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

TICKS = (0, 1, 3, 10, 30, 100, 300, 1000, 3000, 10000, 30000, 100000)
MAX_POINTS = 250  # of a curve; more are not visible


def place(iterations: ArrayLike) -> np.ndarray:
    """Return the positions of iterations k on the axis: log10(1 + k)."""
    return np.log10(1.0 + np.asarray(iterations, dtype=float))


def ticks(last: int) -> tuple[int, ...]:
    """Return the iterations to label on an axis that ends at `last`, and the next one beyond."""
    return TICKS[: 1 + next((i for i, tick in enumerate(TICKS) if tick >= max(last, 3)), len(TICKS) - 1)]


def thinned(values: np.ndarray) -> np.ndarray:
    """Return the indices of the points to draw: the minimum and maximum of each axis section, and both ends.

    This keeps the full amplitude of an error that oscillates from one iteration to the next, without aliasing.
    """
    count = len(values)
    if count <= MAX_POINTS:
        return np.arange(count)
    edges = np.unique(np.geomspace(1, count, MAX_POINTS // 2).round().astype(int))
    chosen = [0, count - 1]
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist()):
        piece = values[begin:end]
        chosen += [begin + int(np.argmin(piece)), begin + int(np.argmax(piece))]
    return np.unique(chosen)
