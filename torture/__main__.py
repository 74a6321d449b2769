"""Command line of scripts/torture."""

from __future__ import annotations

import argparse
import importlib
import shlex
import sys
from pathlib import Path

from bench.process import ROOT
from bench.table import markdown
from ros_ik_pkg.ik import warm_up
from ros_ik_pkg.tools.domain import own_domain
from torture.plan import Check, Plan
from torture.reliability import Reliability

SECTIONS = ('solves', 'messages', 'parameters', 'files', 'load', 'faults', 'network', 'soak')


def main() -> int:
    """Run the sections; 0 where all is right, 1 where something is wrong."""
    given = make_parser().parse_args()
    plan = Plan(given.seed, given.count, given.minutes)
    try:
        warm_up()
        with own_domain():
            checks = [check for name in given.sections or SECTIONS for check in run_section(name, plan, given.output)]
    except KeyboardInterrupt:
        return 130
    wrong = sum(check.wrong for check in checks)
    print(f'\n{len(checks)} checks, {wrong} wrong' + (f'; reproduce with --seed {plan.seed}' if wrong else ''))
    return 1 if wrong else 0


def make_parser() -> argparse.ArgumentParser:
    """Describe the command line; scripts/torture says what its options mean."""
    parser = argparse.ArgumentParser(prog='torture')
    parser.add_argument('sections', nargs='*', choices=(*SECTIONS, []), metavar='SECTION')
    parser.add_argument('--seed', type=int, default=Plan.seed)
    parser.add_argument('--count', type=int)
    parser.add_argument('--minutes', type=float)
    parser.add_argument('--output', type=Path, default=ROOT / 'docs' / 'reliability.md')
    return parser


def run_section(name: str, plan: Plan, output: Path) -> list[Check]:
    """Run one section, print its table, and write it to the report at once: later ones may take hours."""
    report = Reliability(name, 'scripts/torture ' + shlex.join(sys.argv[1:]))
    section = importlib.import_module(f'torture.{name}')
    checks = list(section.run(plan))
    table = [['what', 'figure', 'verdict'], *([check.what, check.figure, check.verdict] for check in checks)]
    print(f'\n## {name}\n\n{markdown(table)}', flush=True)
    report.write(output, section.__doc__ or '', markdown(table))
    return checks


if __name__ == '__main__':
    sys.exit(main())
