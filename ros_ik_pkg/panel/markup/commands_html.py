"""What the page says and draws of the stream of commands: its status, and how near the limits the joints move."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from ros_ik_pkg.panel.markup.iterate_html import joint_colour
from ros_ik_pkg.panel.markup.texts import Texts

WIDE, HIGH = 1000, 400  # of a drawing; whole numbers on it are fine enough
TOP = 1.15  # share of a limit at the upper edge


def stream_html(words: str, good: bool | None) -> str:
    """Return what is said of the stream; good is None while there is none."""
    dot = '' if good is None else f'<span class="dot {"good" if good else "bad"}"></span>'
    return f'<div class="ik said" data-testid="stream">{dot}{escape(words)}</div>'


def commands_html(peaks: np.ndarray, names: Sequence[str], texts: Texts) -> str:
    """Return the charts of velocity and acceleration, shares (k, 2, n) of their limits, and which joint has which
    colour."""
    charts = ''.join(_chart(peaks[:, row], names, texts[key], key, texts)
                     for row, key in enumerate(('velocity', 'acceleration')))  # fmt: skip
    legend = ' '.join(
        f'<span><span class="dot" style="background:{joint_colour(k)}"></span>{escape(name)}</span>'
        for k, name in enumerate(names)
    )
    return f'<div class="ik" data-testid="commands">{charts}<div class="note wrap legend">{legend}</div></div>'


def _chart(shares: np.ndarray, names: Sequence[str], title: str, key: str, texts: Texts) -> str:
    """Return one chart: a line for each joint, from -100 to 100 % of its limit, and the joint that came nearest."""
    curves = ''
    if len(shares):
        x = np.linspace(0, WIDE, len(shares)).round().astype(int).tolist()
        heights = (HIGH * (0.5 - 0.5 * np.clip(shares / TOP, -1.0, 1.0))).round().astype(int)
        for joint in range(shares.shape[1]):
            points = 'L'.join(f'{a} {b}' for a, b in zip(x, heights[:, joint].tolist()))
            curves += f'<path style="stroke:{joint_colour(joint)}" d="M{points}"/>'
    limits = ''.join(f'<path class="limit" d="M0 {HIGH * (0.5 - 0.5 * s / TOP):.0f}H{WIDE}"/>' for s in (1.0, -1.0))
    zero = f'<path class="zero" d="M0 {HIGH // 2}H{WIDE}"/>'
    return (
        f'<h4>{title}<span class="peak" data-testid="{key}">{_highest(shares, names, texts)}</span></h4>'
        f'<span class="strip chart"><svg viewBox="0 0 {WIDE} {HIGH}" preserveAspectRatio="none">{zero}{limits}{curves}'
        '</svg></span>'
    )


def _highest(shares: np.ndarray, names: Sequence[str], texts: Texts) -> str:
    """Say which joint came nearest to its limit."""
    if not len(shares):
        return ''
    largest = np.abs(shares).max(axis=0)
    joint = int(largest.argmax())
    return texts.fill('peak', share=f'{100.0 * largest[joint]:.0f}', name=escape(names[joint]))
