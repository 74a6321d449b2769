"""Command line of scripts/torture."""

from __future__ import annotations

import argparse
import importlib
import math
import shlex
import signal
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

from bench.process import ROOT
from bench.table import markdown
from ros_ik_pkg.ik import warm_up
from ros_ik_pkg.tools.domain import own_domain
from torture.plan import Check, Plan
from torture.reliability import Reliability

SECTIONS = (
    'solves', 'messages', 'parameters', 'files', 'load', 'heard', 'faults', 'network', 'servo', 'tools', 'contact',
    'paths', 'soak', 'mutants',
)  # fmt: skip
REPORT = ROOT / 'docs' / 'reliability.md'


def main() -> int:
    """Run the sections; return 0 if all is right, else 1."""
    given = make_parser().parse_args()
    plan = Plan(given.seed, given.count, given.minutes, given.group)
    output = given.output or (REPORT if plan.whole else None)  # a small run is no news about the large one
    found: dict[str, list[Check]] = {}
    try:
        warm_up()
        with own_domain():
            for name in given.sections or SECTIONS:
                found[name] = run_section(name, plan, output)
    except KeyboardInterrupt:
        return 130
    print('\n' + '\n'.join(closing_lines(found, plan)))
    return 1 if any(check.wrong for checks in found.values() for check in checks) else 0


def make_parser() -> argparse.ArgumentParser:
    """Return the parser; scripts/torture documents the options."""
    parser = argparse.ArgumentParser(prog='torture')
    parser.add_argument('sections', nargs='*', type=section, metavar='SECTION')
    parser.add_argument('--seed', type=whole_number, default=Plan.seed)
    parser.add_argument('--count', type=some)
    parser.add_argument('--minutes', type=some_minutes)
    parser.add_argument('--group', type=whole_number)
    parser.add_argument('--output', type=Path)
    return parser


def section(text: str) -> str:
    """Read the name of a section."""
    if text not in SECTIONS:
        raise argparse.ArgumentTypeError(f'{text!r} is no section; expected {", ".join(SECTIONS)}')
    return text


def whole_number(text: str) -> int:
    """Read 0 or more."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'{text!r}; expected a whole number')
    return int(text)


def some(text: str) -> int:
    """Read 1 or more."""
    if not (number := whole_number(text)):
        raise argparse.ArgumentTypeError('nothing would be tried; expected 1 or more')
    return number


def some_minutes(text: str) -> float:
    """Return a time [min] above 0."""
    try:
        minutes = float(text)
    except ValueError:
        minutes = math.nan
    if not 0.0 < minutes < math.inf:
        raise argparse.ArgumentTypeError(f'{text!r}; expected minutes, more than 0')
    return minutes


def run_section(name: str, plan: Plan, output: Path | None) -> list[Check]:
    """Run one section, print its table, and write it to the report at once: later ones may take hours."""
    report = Reliability(name, 'scripts/torture ' + shlex.join(sys.argv[1:]))
    module = importlib.import_module(f'torture.{name}')
    checks = list(whatever_happens(module.run(plan)))
    table = markdown([['what', 'figure', 'verdict'], *([check.what, check.figure, check.verdict] for check in checks)])
    print(f'\n## {name}\n\n{table}', flush=True)
    if output:
        report.write(output, module.__doc__ or '', table)
    return checks


def whatever_happens(checks: Iterator[Check]) -> Iterator[Check]:
    """Yield the checks of a section, and the exception that ended it, as a finding."""
    try:
        yield from checks
    except Exception as error:
        traceback.print_exc()
        yield Check('the section to its end', '', f'{type(error).__name__}: {error}')


def closing_lines(found: dict[str, list[Check]], plan: Plan) -> Iterator[str]:
    """Print how to run each wrong section again, and in the last line what was wrong or skipped."""
    for name, checks in found.items():
        for again in dict.fromkeys(check.again for check in checks if check.wrong):
            yield f'reproduce with scripts/torture {name} {plan.words(again)}'
    every = [(name, check) for name, checks in found.items() for check in checks]
    left_out = [f'{name}: {check.what}' for name, check in every if check.skipped]
    wrong = sum(check.wrong for _, check in every)
    yield f'{len(every)} checks, {wrong} wrong' + (f', skipped {", ".join(left_out)}' if left_out else '')


if __name__ == '__main__':
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # or the nodes would go on without us
    sys.exit(main())
