"""How joints are named on the page, and how far their sliders go."""

from __future__ import annotations

import math
from collections.abc import Sequence

TURN = math.pi  # rad; range of a slider to either side if a joint has no limit
STEPS = (0.001, 0.1)  # m, degrees


def slider_range(lower: float, upper: float, turns: bool) -> tuple[float, float]:
    """Return both ends in degrees or metres, rounded inwards to a step of the slider."""
    if turns:
        lower, upper = (limit if math.isfinite(limit) else end for limit, end in ((lower, -TURN), (upper, TURN)))
        lower, upper = math.degrees(lower), math.degrees(upper)
    step, slack = STEPS[turns], 1e-6  # of a step: limits in radians are no round degrees
    low, high = math.ceil(lower / step - slack), math.floor(upper / step + slack)
    return round(low * step, 3), round(max(high, low) * step, 3)


def short_names(names: Sequence[str]) -> list[str]:
    """Return names without their common parts, such as joint4 for panda_joint4 and wrist 1 for wrist_1_joint."""
    words = [name.split('_') for name in names]
    head, tail = common(words), common([word[::-1] for word in words])
    while head and any(not ''.join(word[head:]).strip('0123456789') for word in words):
        head -= 1  # a bare number is not a name
    short = [word[head : max(len(word) - tail, head + 1)] for word in words]
    return [' '.join(word) for word in (short if len(names) > 1 else words)]


def common(lists: Sequence[Sequence[str]]) -> int:
    """Return how many entries from the first on are the same in all lists."""
    columns = [len(set(column)) == 1 for column in zip(*lists)]
    return [*columns, False].index(False)
