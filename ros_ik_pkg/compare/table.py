"""Tables for the terminal: aligned, and coloured if the terminal supports it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TextIO

from ros_ik_pkg.compare.palette import BAD, COLOURS, GOOD, rgb
from ros_ik_pkg.compare.runs import MethodRun
from ros_ik_pkg.ik import Status

HEADINGS = ('method', 'iterations', 'position [m]', 'rotation [rad]', 'time [ms]', 'status')
GAP = '  '


def can_colour(stream: TextIO) -> bool:
    """Return whether a stream is a terminal with colours; honours NO_COLOR."""
    return stream.isatty() and 'NO_COLOR' not in os.environ and os.environ.get('TERM') != 'dumb'


def runs_table(runs: Sequence[MethodRun], coloured: bool = False) -> str:
    """Return the table of a comparison, one line per method."""
    rows = [cells(run) for run in runs]
    lines = align([HEADINGS, *rows], left=(0, 5))
    if not coloured:
        return '\n'.join(lines)
    painted = [_paint_run(line, run) for line, run in zip(lines[1:], runs)]
    return '\n'.join([f'\033[1m{lines[0]}\033[0m', *painted])


def cells(run: MethodRun) -> tuple[str, ...]:
    """Return the figures of a run as text, in the order of HEADINGS."""
    return (
        run.method,
        str(run.iterations),
        f'{run.position_error:.1e}',
        f'{run.orientation_error:.1e}',
        f'{run.time * 1e3:.3f}',
        run.status.label,
    )


def align(rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> list[str]:
    """Return rows as lines with aligned columns: those in `left` to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    return [
        GAP.join(
            text.ljust(width) if k in left else text.rjust(width) for k, (text, width) in enumerate(zip(row, widths))
        ).rstrip()
        for row in rows
    ]


def paint(text: str, colour: str) -> str:
    """Return text in a 24-bit colour."""
    red, green, blue = rgb(colour)
    return f'\033[38;2;{red};{green};{blue}m{text}\033[0m'


def _paint_run(line: str, run: MethodRun) -> str:
    """Colour the name as in the plots, and the status by success or failure."""
    status = run.status.label
    head, tail = len(run.method), len(line) - len(status)
    verdict = GOOD if run.status is Status.CONVERGED else BAD
    return paint(line[:head], COLOURS[run.method]) + line[head:tail] + paint(status, verdict)
