"""The two error plots of the page, as SVG.

The SVG is stretched to the available space with constant line widths; labels are HTML, so that they are not stretched.
The page needs no plot library, and an update takes a few kilobytes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ros_ik_pkg.compare.iteration_axis import place, thinned, ticks
from ros_ik_pkg.panel.answers import Curve
from ros_ik_pkg.panel.markup.texts import Texts

PLOTS = {'position_error': 'plot position', 'orientation_error': 'plot orientation'}
FLOOR, CEILING = -8.0, 0.5  # powers of ten
DECADES = range(-8, 1, 2)
SHORTEST_AXIS = 30  # iterations; so that the axis does not jump while the quick methods vary
SIDE = 1000  # of the drawing; whole numbers on it are fine enough


def plots_html(
    curves: Mapping[str, Curve], old: bool = False, texts: Texts | None = None, cursor: int | None = None
) -> str:
    """Return both plots, faint if they are old, with a line at the iteration `cursor`."""
    texts = texts or Texts()
    last = max([SHORTEST_AXIS, *(int(curve.iteration[-1]) for curve in curves.values())])
    plots = ''.join(_plot(curves, column, last, texts[title], texts, cursor) for column, title in PLOTS.items())
    return f'<div class="ik{" old" if old else ""}" data-testid="plots">{plots}</div>'


def _plot(
    curves: Mapping[str, Curve], column: str, last: int, title: str, texts: Texts, cursor: int | None
) -> str:
    width = float(place(last)) * 1.02
    marks = [(mark, float(place(mark)) / width) for mark in ticks(last) if mark <= last]
    decades = [(decade, _height(10.0**decade)) for decade in DECADES]
    grid = ''.join(f'M{x * SIDE:.0f} 0V{SIDE}' for _, x in marks)
    grid += ''.join(f'M0 {y * SIDE:.0f}H{SIDE}' for _, y in decades)
    lines = ''.join(_line(method, curve, column, width, texts) for method, curve in curves.items())
    if cursor is not None:
        lines += f'<path class="cursor" d="M{float(place(cursor)) / width * SIDE:.0f} 0V{SIDE}"/>'
    x_labels = ''.join(f'<i class="x" style="left:{100 * x:.1f}%">{mark}</i>' for mark, x in marks)
    y_labels = ''.join(
        f'<i class="y" style="top:{100 * y:.1f}%">{f"10<sup>{decade}</sup>" if decade else 1}</i>'
        for decade, y in decades
    )
    return (
        f'<div class="plot"><b>{title}</b><div class="area"><svg viewBox="0 0 {SIDE} {SIDE}" '
        f'preserveAspectRatio="none"><path class="grid" d="{grid}"/>{lines}</svg>{x_labels}{y_labels}</div></div>'
    )


def _height(error: float | np.ndarray) -> float | np.ndarray:
    """Return the vertical positions of errors, from 0 at the top to 1 at the bottom, clipped to this range."""
    return np.clip((CEILING - np.log10(np.maximum(error, 1e-300))) / (CEILING - FLOOR), 0.0, 1.0)


def _line(method: str, curve: Curve, column: str, width: float, texts: Texts) -> str:
    """Return a curve, and a dot where it ends."""
    errors = getattr(curve, column)
    chosen = thinned(errors)
    x = (SIDE * place(curve.iteration[chosen]) / width).round().astype(int).tolist()
    y = (SIDE * _height(errors[chosen])).round().astype(int).tolist()
    points = 'L'.join(f'{a} {b}' for a, b in zip(x, y))
    stroke = f'style="stroke:var(--{method})"'
    end = texts.fill('end of curve', method=method, error=f'{errors[-1]:.2g}', count=int(curve.iteration[-1]))
    told = f'<title>{end}</title>'
    return f'<path {stroke} d="M{points}"/><path class="dots" {stroke} d="M{x[-1]} {y[-1]}h0">{told}</path>'
