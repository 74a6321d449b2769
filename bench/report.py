"""The report: printed as it grows, then saved as Markdown with a plot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bench import machine
from bench.measure import Run
from bench.table import Table, markdown, solve_table

INTRODUCTION = """# Benchmark

Written by `scripts/bench`; run it again instead of editing this.
"""

SOLVES = """Every solver gets the same arm, the same poses and the same seeds; they take turns within one run, one
process each, one at a time, and only the library's own call is timed, failures included. A pose counts as solved
where Pinocchio's forward kinematics says that the answer is within 1e-5 m and 1e-5 rad, and within the joint limits
but for 1e-6 (TRAC-IK keeps them in single precision);
`wrong` counts answers that were claimed and are not. `distance` is the median of the largest joint motion from the
seed [rad, m]; `jumps` counts steps of a path with a joint that moves more than 0.5, and how many of them the path
forces. Ratios are times over those of our default method.

- reachable: poses of random configurations within the limits, from random seeds.
- tracking: closed paths of 1000 poses, each solve starts from the answer before.
- singular: of 100 random configurations the one nearest to a singularity, from random seeds.
- beyond: further away than the arm is long. inside: positions within reach, orientations that are not; here nothing
  can be solved, and what counts is the time until the solver says so.
"""


class Report:
    """Sections of one run."""

    def __init__(self, command: str) -> None:
        self.command = command
        self.versions: dict[str, str] = {}
        self.runs: list[Run] = []
        self._machine = machine.describe(command)
        self._parts: list[str] = []

    def add(self, title: str, text: str, table: Table | None = None) -> None:
        """Add a section and print it."""
        blocks = [f'## {title}', text.strip(), markdown(table) if table else '']
        part = '\n\n'.join(block for block in blocks if block)
        print(f'\n{part}', flush=True)
        self._parts.append(part)

    def add_runs(self, runs: Sequence[Run], notes: Sequence[str], reference: str) -> None:
        """Add the solves of one arm; `reference` is the solver that the others' times are divided by."""
        self.runs += runs
        title = f'{runs[0].arm}, {runs[0].q.shape[1]} joints'
        self.add(title, '\n'.join(f'- {note}' for note in notes), solve_table(runs, reference))

    def save(self, path: Path | None) -> None:
        """Write the report and a plot of the runs."""
        if path is None:
            return
        picture = ''
        if self.runs:
            from bench.plot import plot_runs

            plot_runs(self.runs, path.with_suffix('.png'))
            picture = f'![time of a call]({path.with_suffix(".png").name})\n\n{SOLVES}'
        versions = ', '.join(f'{name} {number}' for name, number in self.versions.items())
        table = [*self._machine, *([['measured against', versions]] if versions else [])]
        path.write_text('\n\n'.join([INTRODUCTION.strip(), markdown(table), picture.strip(), *self._parts]) + '\n')
        print(f'\nsaved: {path}')
