"""Newton's method in one dimension, as the lecture notes begin: x^3 - 4 x - 1 = 0 by tangents."""

from __future__ import annotations

START = 2.9
STEPS = 5


def value(x: float) -> float:
    """Return f(x) = x^3 - 4 x - 1."""
    return x**3 - 4.0 * x - 1.0


def slope(x: float) -> float:
    """Return f'(x)."""
    return 3.0 * x**2 - 4.0


def iterates(start: float = START, steps: int = STEPS) -> list[float]:
    """Return x_0 ... x_steps, each where the tangent at the one before crosses zero: x - f(x) / f'(x)."""
    out = [start]
    for _ in range(steps):
        out.append(out[-1] - value(out[-1]) / slope(out[-1]))
    return out
