"""Command line of scripts/bench."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import yaml
from tqdm import tqdm

from bench.batches import BATCH_HEAD, batch_rows
from bench.cases import KINDS
from bench.iteration import ITERATION_HEAD, iteration_rows
from bench.lifts import LIFT_HEAD, lift_rows
from bench.paths import LONG_HEAD, OPTIMUM_HEAD, SPEED_HEAD, long_rows, optimum_rows, speed_rows
from bench.peers import peer_processes
from bench.process import ROOT, WorkerError, WorkerProcess
from bench.report import Report
from bench.solves import run_solves
from bench.table import markdown
from bench.tips import TIPS_HEAD, tip_rows
from ros_ik_pkg.ik import METHODS, IkError, OptionError, SolveOptions, warm_up

ROBOTS = ('panda', 'ur5', 'iiwa14', 'puma560')
BATCH_TEXT = 'solve_batch on reachable poses from random seeds, best of several runs.'
SECTIONS = {
    'peers': 'also other solvers, in an environment of their own',
    'iteration': 'one iteration of each method, and forward kinematics',
    'path': 'whole paths: reconfigurations beside the fewest possible, and beside other solvers; times',
    'lifts': 'arms on a base, rail or lift',
    'tips': 'two arms of one robot',
    'ros': 'the node: round trip, start, services',
}
CHECKS = {
    'check': 'solve N random targets, check every solution by Pinocchio',
    'zoo': 'solve N poses of every chain of every installed URDF',
    'batches': 'solve N targets at once, on one core and on all; how it compares with one by one',
    'collision': 'solve N targets clear of contact in each room, judged by coal',
    'check-paths': 'follow N random paths, check every motion by SciPy, Pinocchio and coal',
    'servo': 'drive an arm into trouble N times; the lines of the tip; what a command costs',
    'reach': 'judge reach maps of two arms by N random poses each',
}


def main() -> int:
    """Run the requested measurements; return the exit code."""
    arguments = read_arguments()
    try:
        warm_up()
        if arguments.check:
            from bench.check import check_answers

            return check_answers(arguments.check)
        if arguments.zoo:
            return measure_zoo(arguments.zoo)
        if arguments.batches:
            rows = batch_rows(arguments.robots, SolveOptions(**arguments.set), arguments.batches)
            print(markdown([BATCH_HEAD, *rows]))
            return 0
        if arguments.collision:
            return measure_collision(arguments.collision, arguments.peers)
        if arguments.check_paths:
            return check_paths(arguments.check_paths)
        if arguments.servo:
            return measure_servo(arguments.servo)
        if arguments.reach:
            return measure_reach(arguments.reach)
        report = Report('scripts/bench ' + shlex.join(sys.argv[1:]))
        faults = measure(arguments, report)
        report.save(arguments.output)
        return int(faults > 0)
    except (IkError, WorkerError) as error:
        print(f'bench: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def make_parser() -> argparse.ArgumentParser:
    """Return the parser; scripts/bench documents the options."""
    parser = argparse.ArgumentParser(prog='bench', description='Measure, or check random solutions; see scripts/bench.')
    parser.add_argument('--robots', nargs='+', default=ROBOTS, help='by name or file (default: %(default)s)')
    parser.add_argument('--count', type=_positive, default=1000, help='poses of each kind (default: %(default)s)')
    parser.add_argument('--cases', nargs='+', choices=KINDS, default=KINDS, help='kinds of poses (default: all)')
    parser.add_argument('--methods', nargs='+', choices=METHODS, default=METHODS, help='of Jacobian (default: all)')
    parser.add_argument('--set', nargs='+', type=_setting, default=[], metavar='NAME=VALUE', help='solver options')
    for flag, text in SECTIONS.items():
        parser.add_argument(f'--{flag}', action='store_true', help=text)
    parser.add_argument('--all', action='store_true', help='all of these')
    for flag, text in CHECKS.items():
        parser.add_argument(f'--{flag}', type=_positive, metavar='N', help=text)
    parser.add_argument(
        '--branches', type=_positive, nargs='?', const=1000, metavar='N',
        help='all solutions of six-joint arms for N poses, beside closed forms (default: %(const)s)',
    )  # fmt: skip
    parser.add_argument(
        '--secondary', type=_positive, nargs='?', const=1000, metavar='N',
        help='N full poses for five joints, judged by SciPy (default: %(const)s)',
    )  # fmt: skip
    parser.add_argument('--output', type=Path, help='file for the report, its plot beside it')
    return parser


def read_arguments(words: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = make_parser()
    arguments = parser.parse_args(words)
    arguments.set = dict(arguments.set)
    try:
        SolveOptions(**arguments.set)
    except (OptionError, TypeError) as error:
        parser.error(f'--set: {error}')
    if arguments.all:
        for flag in SECTIONS:
            setattr(arguments, flag, True)
        arguments.branches = arguments.branches or arguments.count
        arguments.secondary = arguments.secondary or arguments.count
    if arguments.peers and not arguments.output:
        arguments.output = ROOT / 'docs' / 'benchmark.md'
    if arguments.output and not arguments.output.parent.is_dir():
        parser.error(f'--output: there is no folder {arguments.output.parent}')
    return arguments


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f'{text} is no whole number above 0')
    return int(text)


def _setting(text: str) -> tuple[str, Any]:
    name, _, value = text.partition('=')
    return name, yaml.safe_load(value)


def measure_zoo(count: int) -> int:
    """Solve N poses of every chain of every installed URDF and print what came of it; 1 if a solution is wrong."""
    from bench.zoo import ZOO_HEAD, run_zoo, zoo_row

    result = run_zoo(count)
    print('\n'.join(result.remarks), markdown([ZOO_HEAD, zoo_row(result.counts)]), sep='\n\n')
    return int(result.counts['wrong'] > 0)


def measure_collision(count: int, peers: bool) -> int:
    """Solve N targets in each room with and without the check for contact, and beside others if `peers`; 1 if an
    answer touches."""
    from bench.collision import BATCH_HEAD as COLLISION_BATCH_HEAD
    from bench.collision import COLLISION_HEAD, batch_rows, collision_rows

    rows, wrong = collision_rows(count)
    print(markdown([COLLISION_HEAD, *rows]), markdown([COLLISION_BATCH_HEAD, *batch_rows(count)]), sep='\n\n')
    if peers:
        from bench.collision_peers import PEERS_HEAD, peer_rows

        print(markdown([PEERS_HEAD, *peer_rows(count)]))
    return int(wrong > 0)


def check_paths(count: int) -> int:
    """Follow N random paths and judge every motion; 1 if one violates a limit, leaves its line or touches."""
    from bench.path_check import CHECK_HEAD, check_rows

    rows, wrong = check_rows(count)
    print(markdown([CHECK_HEAD, *rows]))
    return int(wrong > 0)


def measure_servo(count: int) -> int:
    """Print the tables of the servo, and draw its lines; 1 if a reason is wrong more often than in one of 100 runs."""
    from bench.servo_lines import LINES_HEAD, line_rows
    from bench.servo_reasons import REASONS_HEAD, reason_rows
    from bench.servo_stream import COST_HEAD, STREAM_HEAD, cost_rows, stream_rows

    reasons = reason_rows(count)
    tables = (
        [REASONS_HEAD, *reasons], [LINES_HEAD, *line_rows(ROOT / 'docs' / 'servo_lines.png')],
        [COST_HEAD, *cost_rows()], [STREAM_HEAD, *stream_rows()],
    )  # fmt: skip
    print('\n\n'.join(map(markdown, tables)))
    return int(100 * sum(int(row[-1]) for row in reasons) > sum(int(row[2]) for row in reasons))


def measure_reach(count: int) -> int:
    """Map what two arms reach, and judge each map by N random poses; 1 if one is in a cell that is not reached."""
    from bench.reach import REACH_HEAD, reach_rows

    rows, wrong = reach_rows(count)
    print(markdown([REACH_HEAD, *rows]))
    return int(wrong > 0)


def measure(arguments: argparse.Namespace, report: Report) -> int:
    """Fill the report; return how much of it was wrong."""
    faults = 0
    if arguments.peers or not any(getattr(arguments, flag) for flag in (*SECTIONS, 'branches', 'secondary')):
        measure_solves(arguments, report)
        options = SolveOptions(**arguments.set)
        rows = batch_rows(tqdm(arguments.robots, leave=False), options)
        report.add('Batches', BATCH_TEXT, [BATCH_HEAD, *rows])
    if arguments.iteration:
        rows = iteration_rows(arguments.robots)
        text = 'Compiled, no Python in between, time that the core was busy.'
        report.add('One iteration', text, [ITERATION_HEAD, *rows])
    if arguments.path:
        text = ('Reconfigurations beside the fewest of dynamic programming over all branches of EAIK, and over the '
                'samples of ssik; numbers of paths, and the time of these solutions alone as a multiple of ours.')
        report.add('Paths: the optimum', text, [OPTIMUM_HEAD, *optimum_rows(max(1, arguments.count // 5))])
        text = 'A path in the shape of the demo of IKLink, which no branch leads along whole.'
        report.add('Paths: reconfigurations', text, [LONG_HEAD, *long_rows()])
        from bench.path_peers import PEERS_HEAD, peer_rows

        rows, notes = peer_rows(arguments.robots, max(1, arguments.count // 100))
        text = ('500 poses each, from home. A step above 0.3 rad counts as a reconfiguration. Times of those that '
                'follow pose after pose: the median pose, times 500. ')
        report.add('Paths: beside others', text + ' '.join(notes), [PEERS_HEAD, *rows])
        text = 'solve_path with times, time that the core was busy.'
        report.add('Paths: time', text, [SPEED_HEAD, *speed_rows(arguments.robots)])
    if arguments.lifts:
        text = ('Reachable poses from random seeds, and how far the carrier (base, rail, lift) and the arm move to '
                'poses that the arm could reach alone [m, rad].')
        report.add('Arms on a base, rail or lift', text, [LIFT_HEAD, *lift_rows(arguments.count)])
    if arguments.tips:
        text = 'solve_tips: cold from random seeds, tracking from the answer before; judged for both tips by Pinocchio.'
        report.add('Two arms of one robot', text, [TIPS_HEAD, *tip_rows(arguments.count)])
    if arguments.ros:
        from bench.ros import ros_rows  # rclpy is installed only for --ros
        from bench.services import service_rows

        for title, text, table in (*ros_rows(arguments.robots[0]), *service_rows(arguments.robots[0])):
            report.add(title, text, table)
    if arguments.branches:
        from bench.any_branches import any_table
        from bench.branches import branch_tables

        tables, faults = branch_tables(arguments.branches)
        table_of_any, missing = any_table(max(1, arguments.branches // 10))
        for title, text, table in (*tables, table_of_any):
            report.add(title, text, table)
        faults += missing
    if arguments.secondary:
        from bench.wishes import WISH_HEAD, WISH_TEXT, wish_row

        row, wrong = wish_row(arguments.secondary)
        faults += wrong
        report.add('Full poses for five joints', WISH_TEXT, [WISH_HEAD, row])
    return faults


def measure_solves(arguments: argparse.Namespace, report: Report) -> None:
    """Run our methods, and the peers if requested."""
    with ExitStack() as stack:
        processes, faults = [WorkerProcess('ours')], {}
        if arguments.peers:
            peers, faults = peer_processes()
            processes += peers
        for process in processes:
            stack.enter_context(closing(process))
        for runs, absent, versions in run_solves(arguments, processes):
            report.versions |= {name: version for name, version in versions.items() if name != 'ours'}
            notes = [f'{library}: {reason}' for library, reason in {**faults, **absent}.items()]
            report.add_runs(runs, notes, SolveOptions().method if arguments.peers else '')


if __name__ == '__main__':
    sys.exit(main())
