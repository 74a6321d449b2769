"""The plot of the solves: for each arm and solver the time of a call, and how many poses were solved."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.measure import Run

KINDS = ('reachable', 'tracking')
OURS, PEER = '#1668b3', '#8a8a8a'


def plot_runs(runs: Sequence[Run], path: Path) -> None:
    """Draw median, 10 to 90 % and 99 % of the times of a call; one panel for each arm and kind of poses."""
    arms = list(dict.fromkeys(run.arm for run in runs))
    height = max(sum(run.arm == arm and run.case.kind == KINDS[0] for run in runs) for arm in arms)
    size = 12.0, len(arms) * (0.8 + 0.28 * height)
    figure = Figure(figsize=size, layout='constrained')
    axes = figure.subplots(len(arms), len(KINDS), sharex='col', squeeze=False)
    for row, arm in zip(axes, arms):
        for axis, kind in zip(row, KINDS):
            _panel(axis, [run for run in runs if (run.arm, run.case.kind) == (arm, kind) and not run.entry.fault])
            axis.set_title(f'{arm}, {kind}', loc='left', fontsize=10)
    for axis in axes[-1]:
        axis.set_xlabel('time of a call [us]: median, bar 10 to 90 %, line to 99 %')
    figure.savefig(path, dpi=110)


def _panel(axis: Axes, runs: Sequence[Run]) -> None:
    for y, run in enumerate(reversed(runs)):
        low, median, high, highest = np.percentile(1e6 * run.seconds, [10, 50, 90, 99])
        color = OURS if run.entry.process.library == 'ours' else PEER
        axis.barh(y, high - low, left=low, height=0.55, color=color, alpha=0.45)
        axis.plot([high, highest], [y, y], color=color)
        axis.plot(median, y, 'o', color=color)
        axis.annotate(f' {100 * run.solved.mean():.1f} %', (highest, y), va='center', fontsize=8)
    axis.set_yticks(range(len(runs)), [run.entry.name for run in reversed(runs)], fontsize=9)
    axis.set_xscale('log')
    axis.margins(x=0.15)
    axis.grid(axis='x', alpha=0.3)
