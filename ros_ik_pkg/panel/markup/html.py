"""The parts of the page that are text: status, table, read-out of the tip."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

import numpy as np

from ros_ik_pkg.compare import MethodRun, describe
from ros_ik_pkg.compare.table import cells
from ros_ik_pkg.ik import Status
from ros_ik_pkg.panel.markup.texts import Texts

ENGLISH = Texts()
AXES = ('x', 'y', 'z', 'roll', 'pitch', 'yaw')


def status_html(state: str, good: bool, words: str) -> str:
    """Return the status: the node's message, in bold up to the second colon, and the comparison in words."""
    *parts, rest = state.split(': ', 2) if state.count(': ') > 1 else (state, '')
    head = ': '.join(parts) + (':' if rest else '')
    return (
        f'<div class="ik status" data-testid="status"><div data-testid="node">'
        f'<span class="dot {_verdict(good)}"></span><span class="node">{escape(head)}</span> '
        f'{escape(rest)}</div><div class="words" data-testid="words">{escape(words)}</div></div>'
    )


def _verdict(good: bool) -> str:
    return 'good' if good else 'bad'


def node_words(result: Mapping[str, str], texts: Texts = ENGLISH) -> tuple[str, bool]:
    """Say what the node made of the target, and whether that is good."""
    if not result:
        return texts['waiting'], False
    if result['outcome'] != 'solved':
        words = texts.failure(result['outcome'], result['status'], result['message'])
        named = 'touching' not in result or all(name in words for name in result['touching'].split(', '))
        return words if named else f'{words}: {result["touching"]}', False
    attempts = '' if result['attempts'] == '1' else texts.fill('attempts', count=result['attempts'])
    time = f'{1e3 * float(result["solve_time"]):.2g}'
    words = {'method': result['method'], 'iterations': result['iterations'], 'attempts': attempts, 'time': time}
    return texts.fill('solved', **words), True


def comparison_words(runs: Iterable[MethodRun], compared: bool, texts: Texts = ENGLISH) -> str:
    """Say what happened to the methods; nothing while those that are chosen are awaited."""
    done = list(runs)
    return describe(done, texts.language) if done else '' if compared else texts['choose']


def headings(texts: Texts) -> tuple[str, ...]:
    """Return the headings of the table of the methods."""
    return texts['method'], texts['steps'], 'Δp [m]', 'ΔR [rad]', texts['time'], texts['status']


def table_html(runs: Mapping[str, MethodRun], active: str, old: bool = False, texts: Texts = ENGLISH) -> str:
    """Return the table of the methods; the node's own is set in bold, and all of it faint if it is old."""
    head = ''.join(f'<th>{heading}</th>' for heading in headings(texts))
    rows = ''.join(_row(run, run.method == active, texts) for run in runs.values())
    return (
        f'<div class="{_part(old)}"><table class="runs" data-testid="comparison"><tr>{head}</tr>{rows}</table>'
        f'<div class="note">{texts["note"]}</div></div>'
    )


def _part(old: bool) -> str:
    return 'ik old' if old else 'ik'


def row_texts(run: MethodRun, texts: Texts = ENGLISH) -> tuple[str, ...]:
    """Return what the table says of a run, in the order of `headings`."""
    *figures, label = cells(run)
    return *figures, texts.status(label)


def _row(run: MethodRun, active: bool, texts: Texts) -> str:
    method, *figures, status = row_texts(run, texts)
    name = f'<span class="dot" style="background:var(--{method})"></span>{method}'
    numbers = ''.join(f'<td>{figure}</td>' for figure in figures)
    return (
        f'<tr data-method="{method}"{" class=active" if active else ""}><td>{name}</td>{numbers}'
        f'<td class="{_verdict(run.status is Status.CONVERGED)}">{status}</td></tr>'
    )


def tip_html(numbers: np.ndarray | None, text: str) -> str:
    """Return the read-out of a pose: x y z [m], roll pitch yaw [deg], or dashes for None, with its label."""
    texts = ['–'] * 6
    if numbers is not None:
        texts = [f'{value:.3f}' for value in numbers[:3].round(3) + 0.0]  # no minus before a zero
        texts += [f'{value:.1f}°' for value in numbers[3:].round(1) + 0.0]
    cells_of = ''.join(f'<td>{value}</td>' for value in texts)
    names = ''.join(f'<th>{name}</th>' for name in AXES)
    return (
        f'<div class="ik" data-testid="tip"><table class="tip"><tr>{names}</tr><tr>{cells_of}</tr></table>'
        f'<div class="note">{escape(text)}&nbsp;</div></div>'
    )
