"""One iteration as text and charts: the five stages of the notes, the gains of the methods, the step of each joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from ros_ik_pkg.compare.iterate import Iterate
from ros_ik_pkg.compare.problem import numbers_of
from ros_ik_pkg.ik import METHODS, SolveOptions
from ros_ik_pkg.methods import BY_NAME, TABLE
from ros_ik_pkg.panel.markup.texts import Texts

SIDE = 1000  # of the drawing
SIGMAS = -4.0, 0.6  # powers of ten of the singular values that the chart shows
GAINS = -2.5, 4.5
JOINT_COLOURS = (
    '#e69f00', '#0072b2', '#009e73', '#cc79a7', '#56b4e9', '#d55e00', '#8c6bb1', '#8d8d00', '#6b6b6b', '#b15928',
    '#1b9e9e', '#a6761d',
)  # fmt: skip


def joint_colour(joint: int) -> str:
    """Return the colour of a joint, on the page and in the scene."""
    return JOINT_COLOURS[joint % len(JOINT_COLOURS)]


def iterate_html(
    iterate: Iterate, method: str, options: SolveOptions, names: Sequence[str], rotary: Sequence[bool], last: bool,
    texts: Texts,
) -> str:  # fmt: skip
    """Return the card of one iteration, the chart of the gains and the bars of the joints."""
    return (
        f'<div class="ik" data-testid="iterate" data-iteration="{iterate.iteration}">'
        f'{_card(iterate, method, options, last, texts)}{_gains(iterate, options, texts)}'
        f'{_joints(iterate, method, names, rotary, texts)}</div>'
    )


def _card(iterate: Iterate, method: str, options: SolveOptions, last: bool, texts: Texts) -> str:
    """Return the five stages with their numbers."""
    x, y, z, roll, pitch, yaw = numbers_of(iterate.base_from_tip)
    sigma = iterate.directions.sigma
    condition = sigma[0] / sigma[-1] if sigma[-1] > 0.0 else np.inf
    good = (
        iterate.position_error <= options.position_tolerance
        and iterate.orientation_error <= options.orientation_tolerance
    )
    stop = texts['within'] if good else texts['last one'] if last else texts['go on']
    damping = f', λ = <span data-figure="damping">{iterate.damping:.3g}</span>' if iterate.damping else ''
    stages = (
        ('fk', f'<code>T = f(q)</code>: {texts["tip at"]} {x:.4f} {y:.4f} {z:.4f} m, '
         f'{roll:.1f} {pitch:.1f} {yaw:.1f}°'),
        ('error', '<code>e = [p* − p ; log(R*Rᵀ)]</code>: '
         f'‖Δp‖ <span data-figure="position_error">{iterate.position_error:.3e}</span> m, '
         f'ΔR <span data-figure="orientation_error">{iterate.orientation_error:.3e}</span> rad'),
        ('jacobian', f'<code>J(q)</code> 6 × {len(iterate.q)}: s = {" ".join(f"{s:.3g}" for s in sigma)}, '
         f's₁/s<sub>{len(sigma)}</sub> = {condition:.3g}'),
        ('step', f'<code>{BY_NAME[method].look.formula}</code>{damping}'),
        ('update', f'<code>q ← q + α dq</code>: {texts["largest step"]} {np.abs(iterate.step).max():.3g}, '
         f'‖dq‖ <span data-figure="step_norm">{np.linalg.norm(iterate.step):.3e}</span>; {stop}'),
    )  # fmt: skip
    rows = ''.join(
        f'<tr><td>{k}. {texts[f"stage {key}"]}</td><td>{text}</td></tr>' for k, (key, text) in enumerate(stages, 1)
    )
    return f'<table class="card">{rows}</table>'


def _gains(iterate: Iterate, options: SolveOptions, texts: Texts) -> str:
    """Return the chart of gain against singular value, and what each method makes of each direction."""
    directions = iterate.directions
    gains = {method: directions.gains(method, options) for method in METHODS}
    curves = ''.join(_curve(method, values) for method, values in _laws(iterate, options).items())
    dots = ''.join(_dots(method, directions.sigma, values) for method, values in gains.items())
    grid = ''.join(f'M{_x(10.0**k):.0f} 0V{SIDE}' for k in range(-4, 1))
    grid += ''.join(f'M0 {_y(10.0**k):.0f}H{SIDE}' for k in range(-2, 5, 2))
    labels = ''.join(f'<i class="x" style="left:{_x(10.0**k) / 10:.1f}%">{_power(k)}</i>' for k in range(-4, 1))
    labels += ''.join(f'<i class="y" style="top:{_y(10.0**k) / 10:.1f}%">{_power(k)}</i>' for k in range(-2, 5, 2))
    marks = ''.join(f'M{_x(s):.0f} {SIDE}v-40' for s in directions.sigma)
    chart = (
        f'<div class="gains"><div class="area"><svg viewBox="0 0 {SIDE} {SIDE}" preserveAspectRatio="none">'
        f'<path class="grid" d="{grid}"/><path class="cursor" d="{marks}"/>{curves}{dots}</svg>{labels}</div></div>'
    )
    heads = ''.join(
        f'<th><span class="dot" style="background:var(--{method})"></span>{method.replace("adaptive_", "a. ")}</th>'
        for method in METHODS
    )
    rows = ''.join(
        f'<tr data-direction="{i}"><td>{i + 1}</td><td>{directions.sigma[i]:.1e}</td>'
        f'<td>{abs(directions.component[i]):.1e}</td>'
        + ''.join(f'<td>{_motion(gains[method][i] * directions.component[i])}</td>' for method in METHODS)
        + '</tr>'
        for i in range(len(directions.sigma))
    )
    return (
        f'<h4>{texts["gain of direction"]}</h4>{chart}'
        f'<h4>{texts["motion"]}</h4><table class="directions" data-testid="directions"><tr><th></th><th>s</th>'
        f'<th>{texts["component"]}</th>{heads}</tr>{rows}</table>'
    )


def _motion(value: float) -> str:
    return '∞' if not np.isfinite(value) else f'{abs(value):.1e}'


def _laws(iterate: Iterate, options: SolveOptions) -> Mapping[str, tuple[np.ndarray, np.ndarray]]:
    """Return the gain as a function of the singular value, for methods whose gain depends on nothing else."""
    s = np.logspace(*SIGMAS, 60)
    norm = float(np.linalg.norm(iterate.error))
    directions = iterate.directions
    largest = directions.sigma[0]
    slope = directions.gains('transpose', options)[0] / largest if largest > 0.0 else 0.0
    laws = {'transpose': (s, slope * s)}
    for method in TABLE:
        if method.damping is not None:
            damping = method.damping(options, norm)
            laws[method.name] = (s, s / (s * s + damping * damping))
    return laws


def _x(sigma: float | np.ndarray) -> float | np.ndarray:
    low, high = SIGMAS
    return SIDE * np.clip((np.log10(np.maximum(sigma, 1e-30)) - low) / (high - low), 0.0, 1.0)


def _y(gain: float | np.ndarray) -> float | np.ndarray:
    low, high = GAINS
    return SIDE * np.clip((high - np.log10(np.clip(gain, 1e-30, 1e30))) / (high - low), 0.0, 1.0)


def _curve(method: str, law: tuple[np.ndarray, np.ndarray]) -> str:
    points = 'L'.join(f'{a:.0f} {b:.0f}' for a, b in zip(_x(law[0]), _y(law[1])))
    return f'<path style="stroke:var(--{method})" d="M{points}"/>'


def _dots(method: str, sigma: np.ndarray, gains: np.ndarray) -> str:
    points = ''.join(f'M{_x(s):.0f} {_y(g):.0f}h0' for s, g in zip(sigma, gains) if g > 0.0)
    return f'<path class="dots" style="stroke:var(--{method})" d="{points}"/>'


def _power(k: int) -> str:
    return f'10<sup>{k}</sup>' if k else '1'


def _joints(iterate: Iterate, method: str, names: Sequence[str], rotary: Sequence[bool], texts: Texts) -> str:
    """Return the step of each joint as a bar from the middle, with caps and joints held by a limit marked."""
    longest = max(float(np.abs(iterate.step).max()), 1e-12)
    rows = []
    for i, name in enumerate(names):
        step = float(iterate.step[i])
        width = 50.0 * abs(step) / longest
        left = 50.0 if step >= 0.0 else 50.0 - width
        text = f'{np.degrees(step):+.3g}°' if rotary[i] else f'{1e3 * step:+.3g} mm'
        mark = texts['held'] if iterate.frozen[i] else texts['capped'] if iterate.capped[i] else ''
        rows.append(
            f'<span title="{escape(name)}"><span class="dot" style="background:{joint_colour(i)}"></span>'
            f'{escape(name)}</span><span class="track"><span class="bar" style="left:{left:.1f}%;width:{width:.1f}%;'
            f'background:var(--{method})"></span><span class="zero"></span></span>'
            f'<span data-joint="{i}">{text} {mark}</span>'
        )
    return (
        f'<h4>{texts["joint steps"]}</h4><div class="joints">{"".join(rows)}</div>'
        f'<div class="note" style="white-space:normal">{texts["arrows"]}</div>'
    )
