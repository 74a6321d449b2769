"""Compare the methods on one target, or over many: table, picture, files."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ros_ik_pkg.compare.files import write_csv, write_json
from ros_ik_pkg.compare.palette import COLOURS
from ros_ik_pkg.compare.problem import NOTES_ROBOT, Problem, make_problem, numbers_of
from ros_ik_pkg.compare.progress import progress_bar
from ros_ik_pkg.compare.runs import compare_methods
from ros_ik_pkg.compare.sweep import NEAR, run_sweep, sweep_table
from ros_ik_pkg.compare.table import can_colour, paint, runs_table
from ros_ik_pkg.compare.words import describe
from ros_ik_pkg.ik import METHODS, IkError, SolveOptions, load_arm, warm_up


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='compare', description=__doc__)
    add = parser.add_argument
    add('--robot', default=NOTES_ROBOT, help='robot of config/robots, .urdf, .xacro or DH .yaml (default: %(default)s)')
    add('--seed', nargs='+', type=float, metavar='Q', help='joints [deg or m] (default: of the notes, else home)')
    add('--target', nargs=6, type=float, metavar=('X', 'Y', 'Z', 'ROLL', 'PITCH', 'YAW'), help='pose [m], [deg]')
    add('--methods', nargs='+', choices=METHODS, default=METHODS, metavar='NAME', help='default: all five')
    add('--tolerance', type=float, default=1e-6, help='for position [m] and orientation [rad] (default: %(default)s)')
    add('--max-iterations', type=int, default=2000, help='default: %(default)s')
    add('--damping', type=float, help='lambda of dls and lambda_0 of adaptive_dls (default: those of the node)')
    add('--gain', type=float, help='damping over error of adaptive_dls (default: that of the node)')
    add('--step-size', type=float, default=1.0, help='factor on every step (default: %(default)s)')
    add('--plot', type=Path, metavar='FILE.png', help='write the picture: errors, way of the tip, joints')
    add('--csv', type=Path, metavar='FILE', help='write every iterate of every method')
    add('--json', type=Path, metavar='FILE', help='write the problem, the figures and every iterate')
    add('--sweep', type=int, metavar='N', help='instead: the methods on N regular and N singular random targets')
    return parser


def solve_options(given: argparse.Namespace) -> SolveOptions:
    """Return the options that were given; raises OptionError for a value out of range."""
    values = {
        'max_iterations': given.max_iterations,
        'position_tolerance': given.tolerance,
        'orientation_tolerance': given.tolerance,
        'step_size': given.step_size,
    }
    if given.damping is not None:
        values |= {'dls_damping': given.damping, 'adaptive_dls_damping': given.damping}
    if given.gain is not None:
        values['adaptive_dls_gain'] = given.gain
    return SolveOptions(**values)


def main() -> int:
    """Run the command line; 0 when it did what was asked, whatever the methods made of it."""
    parser = arguments()
    given = parser.parse_args()
    if given.sweep is not None and (given.sweep < 1 or given.plot or given.csv or given.json):
        parser.error('--sweep takes a number above 0, and writes no files')
    try:
        options = solve_options(given)
        problem = make_problem(load_arm(given.robot), given.seed, given.target)
        warm_up(report=lambda text: print(text, file=sys.stderr))
        if given.sweep:
            sweep(problem, given, options)
        else:
            compare(problem, given, options)
    except (IkError, OSError, ValueError) as error:
        print(f'compare: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def compare(problem: Problem, given: argparse.Namespace, options: SolveOptions) -> None:
    """Print the table of one target and write the files that were asked for."""
    question = problem.arm, problem.target, problem.seed, given.methods, options
    compare_methods(*question)  # the first runs of a process take longer than those that a user waits for
    runs = compare_methods(*question)
    print(heading(problem, given))
    print(runs_table(runs, can_colour(sys.stdout)))
    print(f'\n{describe(runs)}')
    if given.plot:
        from ros_ik_pkg.compare.plots import save_picture  # matplotlib is asked for by this alone

        save_picture(given.plot, problem, runs)
    if given.csv:
        write_csv(given.csv, problem, runs)
    if given.json:
        write_json(given.json, problem, runs)
    for path in filter(None, (given.plot, given.csv, given.json)):
        print(f'wrote {path}', file=sys.stderr)


def heading(problem: Problem, given: argparse.Namespace) -> str:
    """Say what is being solved."""
    x, y, z, roll, pitch, yaw = numbers_of(problem.target)
    return (
        f'{problem.arm.name}: target x {x:.3f} y {y:.3f} z {z:.3f} m, '
        f'roll {roll:.1f} pitch {pitch:.1f} yaw {yaw:.1f}°, tolerance {given.tolerance:g} m and rad\n'
    )


def sweep(problem: Problem, given: argparse.Namespace, options: SolveOptions) -> None:
    """Print the table over many targets."""
    bar = progress_bar(2 * given.sweep, 'targets')
    table = sweep_table(run_sweep(problem.arm, given.sweep, given.methods, options, bar))
    print(
        f'{problem.arm.name}: {given.sweep} regular and {given.sweep} singular targets, seeds within {NEAR:g} rad '
        f'(or m) of an answer in every joint,\none descent of {given.max_iterations} iterations at most, tolerance '
        f'{given.tolerance:g} m and rad\n'
    )
    print(colour_names(table) if can_colour(sys.stdout) else table)


def colour_names(table: str) -> str:
    """Colour the methods' names in the head of a table as their curves."""
    head, _, rest = table.partition('\n')
    words = ((word, COLOURS[word]) for word in head.split())
    for word, colour in words:
        head = head.replace(f' {word}', f' {paint(word, colour)}', 1)
    return f'{head}\n{rest}'


if __name__ == '__main__':
    sys.exit(main())
