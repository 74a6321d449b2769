"""Newton's method in one dimension as a drawing: the curve, its tangents, and the guesses as numbers."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ros_ik_pkg.compare.newton import iterates, slope, value
from ros_ik_pkg.panel.markup.texts import Texts

WIDTH, HEIGHT = 400.0, 190.0
X, Y = (1.4, 3.1), (-5.0, 14.0)  # the part of the plane that is drawn


def newton_html(count: int, texts: Texts) -> str:
    """Return the drawing with the first `count` tangents."""
    guesses = iterates(steps=count)
    points = np.linspace(*X, 80)
    curve = 'L'.join(f'{_x(x):.1f} {_y(value(x)):.1f}' for x in points)
    tangents = ''.join(
        f'M{_x(x):.1f} {_y(0.0):.1f}V{_y(value(x)):.1f}L{_x(after):.1f} {_y(0.0):.1f}'
        for x, after in pairwise(guesses)
    )
    dots = ''.join(f'M{_x(x):.1f} {_y(0.0):.1f}h0' for x in guesses)
    rows = ''.join(
        f'<tr><td>x<sub>{k}</sub></td><td>{x:.12f}</td><td>{value(x):+.1e}</td><td>{slope(x):.3f}</td></tr>'
        for k, x in enumerate(guesses)
    )
    return (
        f'<div class="ik newton" data-testid="newton"><svg viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}">'
        f'<path stroke="currentColor" opacity=".5" d="M0 {_y(0.0):.1f}H{WIDTH:.0f}"/>'
        f'<path stroke="var(--dls)" stroke-width="2.2" d="M{curve}"/>'
        f'<path stroke="var(--transpose)" stroke-width="1.6" d="{tangents}"/>'
        f'<path stroke="var(--bad)" stroke-width="7" stroke-linecap="round" d="{dots}"/></svg>'
        f'<div class="note" style="white-space:normal">{texts["newton text"]}</div>'
        f'<table><tr><th></th><th>x</th><th>f(x)</th><th>f′(x)</th></tr>{rows}</table></div>'
    )


def _x(x: float) -> float:
    return WIDTH * (x - X[0]) / (X[1] - X[0])


def _y(y: float) -> float:
    return HEIGHT * (Y[1] - y) / (Y[1] - Y[0])
