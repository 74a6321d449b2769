"""What the page says and draws of a path: the result in words, joints over time against their limits, sigma_min."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from ros_ik_pkg.ik import Arm
from ros_ik_pkg.panel.markup.iterate_html import joint_colour
from ros_ik_pkg.panel.markup.texts import Texts
from ros_ik_pkg.panel.motion import Motion
from ros_ik_pkg.ros.handling.path_handler import PARTIAL
from ros_ik_pkg.ros.handling.result import SOLVED
from ros_ik_pkg.ros.output.path_messages import SINGULAR

WIDE, HIGH = 1000, 100  # of a drawing; whole numbers on it are fine enough
MARGIN = 0.06  # of the range of a joint, beyond its limits


def path_words(result: Mapping[str, str], texts: Texts) -> str:
    """Say what the node made of a path, how far it goes, and where the joints leave it."""
    if result['outcome'] != SOLVED:
        words = texts.path_failure(result['outcome'], result['status'], result['message'])
        reached = f' {texts.fill("path reached", pose=_figure(result, "reached_pose"))}'
        return words + (reached if result['outcome'] == PARTIAL else '')
    words = texts.fill('path solved', seconds=_figure(result, 'duration'), travel=_figure(result, 'joint_travel'))
    if result['reconfigured_at_poses']:
        words += ' ' + texts.fill('path reconfigured', poses=result['reconfigured_at_poses'].replace(' ', ', '))
    if result['slowed_intervals'] != '0':
        words += f' {texts["path slowed"]}'
    sigma, pose = _figure(result, 'sigma_min'), _figure(result, 'sigma_min_at_pose')
    return f'{words} {texts.fill("path sigma", sigma=sigma, pose=pose)}'


def _figure(result: Mapping[str, str], name: str) -> str:
    return f'{float(result[name]):.3g}'


def path_html(words: str, good: bool | None) -> str:
    """Return what is said of the path; good is None while nothing is known."""
    dot = '' if good is None else f'<span class="dot {"good" if good else "bad"}"></span>'
    return f'<div class="ik said" data-testid="path">{dot}{escape(words)}</div>'


def charts_html(motion: Motion, arm: Arm, names: Sequence[str], texts: Texts) -> str:
    """Return a strip for each joint with its limits, and one for sigma_min; moved_html marks the time in all."""
    strips = ''.join(_joint(motion, arm, joint, name, texts) for joint, name in enumerate(names))
    sigma, top = motion.sigma_min, max(float(motion.sigma_min.max()) * 1.1, 2.0 * SINGULAR)
    heights = 1.0 - sigma / top
    limit = _level(1.0 - SINGULAR / top)
    title = texts.fill('sigma range', low=f'{sigma.min():.3g}', high=f'{sigma.max():.3g}')
    strips += _strip('σ<sub>min</sub>', title, _curve(heights, 'currentColor'), limit, motion, 'tall', 'sigma')
    axis = f'<span></span><span class="axis"><i>0</i><i>{motion.duration:.2f} s</i></span>'
    return (
        f'<div class="ik" data-testid="motion"><h4>{texts["joints in time"]}</h4>'
        f'<div class="strips">{strips}{axis}</div><div class="note wrap">{texts["strips note"]}</div></div>'
    )


def _joint(motion: Motion, arm: Arm, joint: int, name: str, texts: Texts) -> str:
    """Return the strip of a joint: from its lower limit to its upper one; of one without limits, its own range."""
    q = motion.sampled[:, joint]
    lower, upper = float(arm.lower[joint]), float(arm.upper[joint])
    limited = bool(np.isfinite([lower, upper]).all())
    low, high = (lower, upper) if limited else (float(q.min()) - 0.1, float(q.max()) + 0.1)
    margin = MARGIN * (high - low)
    heights = (high + margin - q) / (high - low + 2.0 * margin)
    lines = ''.join(_level((high + margin - limit) / (high - low + 2.0 * margin)) for limit in (low, high))
    span = f'{q.min():.3g} … {q.max():.3g}'
    key = 'joint range' if limited else 'joint range unlimited'
    title = texts.fill(key, name=arm.joint_names[joint], span=span, low=f'{lower:.3g}', high=f'{upper:.3g}')
    colour = joint_colour(joint)
    label = f'<span class="dot" style="background:{colour}"></span>{escape(name)}'
    return _strip(label, title, _curve(heights, colour), lines if limited else '', motion, '', f'{joint}')


def _curve(heights: np.ndarray, colour: str) -> str:
    x = np.linspace(0, WIDE, len(heights)).round().astype(int).tolist()
    y = (HIGH * np.clip(heights, 0.0, 1.0)).round().astype(int).tolist()
    return f'<path class="curve" style="stroke:{colour}" d="M{"L".join(f"{a} {b}" for a, b in zip(x, y))}"/>'


def _level(height: float) -> str:
    return f'<path class="limit" d="M0 {HIGH * height:.0f}H{WIDE}"/>'


def _strip(label: str, title: str, curve: str, limits: str, motion: Motion, kind: str, key: str) -> str:
    bands = ''.join(
        f'<rect class="off" x="{WIDE * begin / motion.duration:.1f}" '
        f'width="{WIDE * (end - begin) / motion.duration:.1f}" height="{HIGH}"/>'
        for begin, end in motion.reconfigurations
    )
    return (
        f'<span title="{escape(title)}">{label}</span><span class="strip {kind}" data-strip="{key}">'
        f'<svg viewBox="0 0 {WIDE} {HIGH}" preserveAspectRatio="none">{bands}{limits}{curve}</svg>'
        f'<b class="now"></b><title>{escape(title)}</title></span>'
    )


def moved_html(time: float, motion: Motion, texts: Texts) -> str:
    """Return the mark of a time [s] in the charts, a rule of style that is cheap to send again, and sigma_min there."""
    share = time / motion.duration
    sigma = float(np.interp(share, np.linspace(0.0, 1.0, len(motion.sigma_min)), motion.sigma_min))
    words = texts.fill('path at', seconds=f'{time:.2f}', sigma=f'{sigma:.3g}')
    return (
        f'<div class="ik"><style>.ik .now {{ left: {100.0 * share:.2f}% }}</style>'
        f'<div class="note" data-testid="moment">{escape(words)}</div></div>'
    )
