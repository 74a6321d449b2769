"""The two plots of the page: errors against the iteration, as Plotly figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from ros_ik_pkg.compare.iteration_axis import place, ticks
from ros_ik_pkg.compare.palette import COLOURS
from ros_ik_pkg.panel.answers import Curve

FLOOR, CEILING = -8, 0  # powers of ten
MAX_POINTS = 250  # of a curve; more cannot be told apart and cost updates
SHORTEST_AXIS = 30  # iterations; so that the axis does not jump while the quick methods vary


@dataclass(frozen=True)
class Theme:
    """Colours of the page that plots and tables follow."""

    ink: str
    faint: str


LIGHT, DARK = Theme('#343a40', '#e3e6ea'), Theme('#c9cdd2', '#3a3d42')


def errors_figure(curves: Mapping[str, Curve], column: str, title: str, theme: Theme) -> go.Figure:
    """Return one plot; `column` is a field of Curve."""
    figure = go.Figure([_line(method, curve, column) for method, curve in curves.items()], _layout(title, theme))
    last = max([SHORTEST_AXIS, *(int(curve.iteration[-1]) for curve in curves.values())])
    marks = ticks(last)
    figure.update_xaxes(
        range=[0.0, float(place(last)) * 1.02], tickvals=place(marks).tolist(), ticktext=list(map(str, marks))
    )
    return figure


def _line(method: str, curve: Curve, column: str) -> go.Scatter:
    chosen = thinned(len(curve.iteration))
    values = np.maximum(getattr(curve, column)[chosen], 10.0**FLOOR)
    sizes = np.zeros(len(chosen))
    sizes[-1] = 9
    return go.Scatter(
        x=np.round(place(curve.iteration[chosen]), 4).tolist(),
        y=[float(f'{value:.3g}') for value in values],
        customdata=curve.iteration[chosen].astype(int).tolist(),
        name=method,
        mode='lines+markers',
        line={'color': COLOURS[method], 'width': 2.5},
        marker={'size': sizes.tolist(), 'line': {'width': 0}},
        hovertemplate=f'{method}: %{{y:.2g}} at %{{customdata}}<extra></extra>',
    )


def thinned(count: int) -> np.ndarray:
    """Return which of `count` points to draw: spread over the logarithmic axis, both ends among them.

    They come in pairs of neighbours, so that an error that goes up and down every iteration is seen to do so.
    """
    if count <= MAX_POINTS:
        return np.arange(count)
    spread = np.geomspace(1, count - 1, MAX_POINTS // 2).round().astype(int)
    return np.union1d(spread - 1, spread)


def _layout(title: str, theme: Theme) -> go.Layout:
    axis = {
        'color': theme.ink, 'gridcolor': theme.faint, 'linecolor': theme.faint, 'zeroline': False, 'fixedrange': True,
    }  # fmt: skip
    return go.Layout(
        title={'text': title, 'x': 0.0, 'xref': 'container', 'xanchor': 'left', 'y': 0.97, 'pad': {'l': 14},
               'font': {'size': 13}},
        font={'color': theme.ink, 'size': 12, 'family': 'Inter, system-ui, sans-serif'},
        margin={'l': 52, 'r': 14, 't': 34, 'b': 30},
        paper_bgcolor='rgba(0,0,0,0)',
        plot_bgcolor='rgba(0,0,0,0)',
        showlegend=False,
        xaxis=axis,
        yaxis={**axis, 'type': 'log', 'range': [FLOOR, CEILING + 0.5], 'dtick': 2, 'exponentformat': 'power',
               'tickfont': {'size': 10}},
    )  # fmt: skip
