"""The parts of the page that are text: status, table, read-out of the tip."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

import numpy as np

from ros_ik_pkg.compare import MethodRun, describe
from ros_ik_pkg.compare.table import cells
from ros_ik_pkg.ik import Status

HEADINGS = ('method', 'steps', 'Δp [m]', 'ΔR [rad]', 'time [ms]', 'status')
SHORT = {Status.MAX_ITERATIONS: 'out of steps'}  # if the label is too long for the column
NOTE = 'One descent each; the search of the node strides longer and restarts.'
NUMBERS = ('No methods', 'One method', 'Two methods', 'Three methods', 'Four methods', 'Five methods')
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


def node_words(result: Mapping[str, str]) -> tuple[str, bool]:
    """Return the outcome of the target as text, and whether it is a success."""
    if not result:
        return 'waiting for the node …', False
    if result['outcome'] != 'solved':
        return f'{result["outcome"]}: {result["message"]}', False
    attempts = '' if result['attempts'] == '1' else f' and {result["attempts"]} attempts'
    milliseconds = 1e3 * float(result['solve_time'])
    return f'solved by {result["method"]} in {result["iterations"]} iterations{attempts}, {milliseconds:.2g} ms', True


def comparison_words(runs: Iterable[MethodRun], compared: bool) -> str:
    """Return the comparison in words, or an empty text while it is incomplete."""
    done = list(runs)
    return describe(done) if done else '' if compared else 'Choose methods to compare.'


def title(count: int) -> str:
    """Return the title of the page for a number of compared methods."""
    return f'{NUMBERS[count]}, one target'


def table_html(runs: Mapping[str, MethodRun], active: str, old: bool = False) -> str:
    """Return the table of the methods, with the node's own in bold; all of it faint if outdated."""
    head = ''.join(f'<th>{heading}</th>' for heading in HEADINGS)
    rows = ''.join(_row(run, run.method == active) for run in runs.values())
    return (
        f'<div class="{_part(old)}"><table class="runs" data-testid="comparison"><tr>{head}</tr>{rows}</table>'
        f'<div class="note">{NOTE}</div></div>'
    )


def _part(old: bool) -> str:
    return 'ik old' if old else 'ik'


def row_texts(run: MethodRun) -> tuple[str, ...]:
    """Return the cells of a run, in the order of HEADINGS."""
    *texts, label = cells(run)
    return *texts, SHORT.get(run.status, label)


def _row(run: MethodRun, active: bool) -> str:
    method, *figures, status = row_texts(run)
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
