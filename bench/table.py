"""Runs -> rows of a table, and tables -> aligned Markdown, readable in a terminal too."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from bench.measure import Run

Table = list[list[str]]
SOLVE_HEAD = [
    'arm', 'poses', 'solver', 'solved %', 'wrong', 'median us', 'mean us', 'p99 us', 'iterations', 'attempts',
    'distance', 'jumps',
]  # fmt: skip
RATIO_HEAD = ['median ratio', 'mean ratio', 'p99 ratio']


def solve_table(runs: Sequence[Run], reference: str = '') -> Table:
    """Make a table of runs; with `reference`, a solver's name, also the ratios of all times to its own."""
    table = [SOLVE_HEAD + (RATIO_HEAD if reference else [])]
    for run in runs:
        if run.entry.fault:
            table.append([run.arm, run.case.kind, run.entry.name, run.entry.fault, *[''] * (len(table[0]) - 4)])
            continue
        same = (other for other in runs if other.case is run.case)
        ours = next((other for other in same if other.entry.name == reference), run)
        ratios = [f'{a / b:.1f}' for a, b in zip(times(run), times(ours))] if reference else []
        table.append([run.arm, f'{len(run.case)} {run.case.kind}', run.entry.name, *solve_cells(run), *ratios])
    return table


def times(run: Run) -> tuple[float, float, float]:
    """Return median, mean and 99th percentile of the time of a call [us], failures included."""
    microseconds = 1e6 * run.seconds
    return float(np.median(microseconds)), float(microseconds.mean()), float(np.percentile(microseconds, 99))


def solve_cells(run: Run) -> list[str]:
    """Write the figures of one run."""
    solved = f'{100 * run.solved.mean():.2f}' if run.case.reachable else f'{run.solved.sum()} of {len(run.case)}'
    wrong = str(np.count_nonzero(run.answered & ~run.solved))
    distance, jumps = '', ''
    if run.case.path is not None:
        jumps = f'{run.jumps}' + (f' ({run.forced_jumps} forced)' if run.forced_jumps else '')
    elif run.solved.any():
        distance = f'{np.median(np.abs(run.q - run.case.seeds)[run.solved].max(axis=1)):.2f}'
    speed, counts = map(_time, times(run)), map(_mean, (run.iterations, run.attempts))
    return [solved, wrong, *speed, *counts, distance, jumps]


def _time(microseconds: float) -> str:
    return f'{microseconds:.1f}' if microseconds < 100.0 else f'{microseconds:.0f}'


def _mean(values: np.ndarray) -> str:
    return f'{values.mean():.1f}' if np.isfinite(values).all() else ''


def markdown(table: Iterable[Sequence[str]]) -> str:
    """Lay a table out as Markdown with columns of even width."""
    rows = [list(row) for row in table]
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = ['| ' + ' | '.join(cell.ljust(width) for cell, width in zip(row, widths)) + ' |' for row in rows]
    lines.insert(1, '|' + '|'.join('-' * (width + 2) for width in widths) + '|')
    return '\n'.join(lines)
