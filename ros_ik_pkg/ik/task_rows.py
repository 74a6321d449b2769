"""The rows of a task by name, and which of them are wished for only."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ros_ik_pkg.ik.exceptions import OptionError
from ros_ik_pkg.ik.solution import ROW_NAMES

AUTO = 'auto'
SECONDARIES = {'none': 0, 'orientation': 0b111000, 'position': 0b000111}  # numbers whose bit r stands for row r
SIX = 6  # joints, from which on an arm reaches most poses whole


def wishes_of(secondary: str, weights: Sequence[float], usual: bool) -> tuple[float, int]:
    """Return the number of joints below which rows are wished for only, and those rows as a number of bits.

    `secondary` and `weights` are those of SolveOptions; `usual` says whether 'auto' may wish for rows.

    Raises OptionError if no row is left that is demanded.
    """
    rows = sum(1 << r for r, weight in enumerate(weights) if weight > 0.0)
    if secondary == AUTO:
        return SIX if usual else 0, SECONDARIES['orientation']
    mask = SECONDARIES.get(secondary)
    if mask is None:
        mask = sum(1 << ROW_NAMES.index(name) for name in secondary.split())
    if not rows & ~mask:
        raise OptionError(f'secondary = {secondary!r} leaves no row of the task that is demanded')
    return math.inf if rows & mask else 0, rows & mask


def names_of_rows(mask: int) -> tuple[str, ...]:
    """Return the names of the rows that a number of bits stands for."""
    return tuple(name for r, name in enumerate(ROW_NAMES) if mask >> r & 1)
