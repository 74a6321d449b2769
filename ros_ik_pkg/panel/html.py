"""The parts of the page that are text: status line, table, read-out of the tip."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

import numpy as np

from ros_ik_pkg.compare import MethodRun, describe
from ros_ik_pkg.compare.palette import BAD, COLOURS, GOOD
from ros_ik_pkg.compare.table import cells
from ros_ik_pkg.ik import Status

STYLE = """<style>
.ik { font: 14px/1.45 Inter, system-ui, sans-serif; padding: 4px 12px 0 }
.ik table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums }
.ik th { font-weight: 500; opacity: .6; text-align: right; padding: 2px 5px; font-size: 12px; white-space: nowrap }
.ik td { text-align: right; padding: 3px 5px; border-top: 1px solid rgba(128,128,128,.22); white-space: nowrap }
.ik .runs :is(th, td):is(:first-child, :last-child) { text-align: left }
.ik .dot { display: inline-block; width: 11px; height: 11px; border-radius: 50%; margin-right: 7px }
.ik .node { font-weight: 600; font-size: 15px } .ik .active td:first-child { font-weight: 650 }
.ik .tip :is(th, td) { padding: 2px 3px; font-size: 13px }
.ik .words { opacity: .8; min-height: 4.2em; margin-top: 4px }
</style>"""
HEADINGS = ('method', 'iterations', 'Δp [m]', 'ΔR [rad]', 'time [ms]', 'status')


def status_html(state: str, good: bool, words: str) -> str:
    """Return the status line: what the node says, and the comparison in words."""
    dot = f'<span class="dot" style="background:{GOOD if good else BAD}"></span>'
    return (
        f'{STYLE}<div class="ik" data-testid="status"><div class="node">{dot}<span data-testid="node">{escape(state)}'
        f'</span></div><div class="words" data-testid="words">{escape(words)}</div></div>'
    )


def node_words(result: Mapping[str, str]) -> tuple[str, bool]:
    """Say what the node made of the target, and whether that is good."""
    if not result:
        return 'waiting for the node …', False
    if result['outcome'] != 'solved':
        return f'{result["outcome"]}: {result["message"]}', False
    attempts = '' if result['attempts'] == '1' else f' and {result["attempts"]} attempts'
    milliseconds = 1e3 * float(result['solve_time'])
    return f'solved by {result["method"]} in {result["iterations"]} iterations{attempts}, {milliseconds:.2g} ms', True


def comparison_words(runs: Iterable[MethodRun]) -> str:
    """Say what happened to the methods."""
    done = list(runs)
    return describe(done) if done else 'Choose methods to compare.'


def table_html(runs: Mapping[str, MethodRun], active: str) -> str:
    """Return the table of the methods; the node's own is set in bold."""
    head = ''.join(f'<th>{heading}</th>' for heading in HEADINGS)
    rows = ''.join(_row(run, run.method == active) for run in runs.values())
    return f'<div class="ik"><table class="runs" data-testid="comparison"><tr>{head}</tr>{rows}</table></div>'


def _row(run: MethodRun, active: bool) -> str:
    method, *figures, status = cells(run)
    verdict = GOOD if run.status is Status.CONVERGED else BAD
    name = f'<span class="dot" style="background:{COLOURS[method]}"></span>{method}'
    numbers = ''.join(f'<td>{figure}</td>' for figure in figures)
    return (
        f'<tr data-method="{method}"{" class=active" if active else ""}><td>{name}</td>{numbers}'
        f'<td style="color:{verdict}">{status}</td></tr>'
    )


def tip_html(numbers: np.ndarray) -> str:
    """Return the read-out of a pose: x y z [m], roll pitch yaw [deg]."""
    x, y, z = numbers[:3].round(3) + 0.0  # no minus before a zero
    roll, pitch, yaw = numbers[3:].round(1) + 0.0
    cells_of = ''.join(f'<td>{value}</td>' for value in (
        f'{x:.3f}', f'{y:.3f}', f'{z:.3f}', f'{roll:.1f}°', f'{pitch:.1f}°', f'{yaw:.1f}°'
    ))  # fmt: skip
    names = ''.join(f'<th>{name}</th>' for name in ('x', 'y', 'z', 'roll', 'pitch', 'yaw'))
    return f'<div class="ik"><table class="tip" data-testid="tip"><tr>{names}</tr><tr>{cells_of}</tr></table></div>'
