"""The axis of iterations in every plot: logarithmic, and yet with the start, iteration 0, on it."""

from __future__ import annotations

import numpy as np

TICKS = (0, 1, 3, 10, 30, 100, 300, 1000, 3000, 10000, 30000, 100000)


def place(iterations: np.ndarray) -> np.ndarray:
    """Return where iterations stand on the axis: log10(1 + k)."""
    return np.log10(1.0 + np.asarray(iterations, dtype=float))


def ticks(last: int) -> tuple[int, ...]:
    """Return the iterations to label on an axis that ends at `last`, and the first one beyond it."""
    return TICKS[: 1 + next((i for i, tick in enumerate(TICKS) if tick >= max(last, 3)), len(TICKS) - 1)]
