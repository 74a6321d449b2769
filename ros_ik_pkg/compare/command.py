"""Compare the methods on one target or on many: table, plot, files."""

from __future__ import annotations

import argparse
import codecs
import io
import shutil
import signal
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ros_ik_pkg.compare.contact import contact_lines
from ros_ik_pkg.compare.files import write_csv, write_json
from ros_ik_pkg.compare.notebook import save_notebook
from ros_ik_pkg.compare.palette import COLOURS
from ros_ik_pkg.compare.problem import NOTES_ROBOT, Problem, as_typed, make_problem, numbers_of
from ros_ik_pkg.compare.progress import progress_bar
from ros_ik_pkg.compare.runs import compare_methods
from ros_ik_pkg.compare.sweep import NEAR, run_sweep, sweep_table
from ros_ik_pkg.compare.table import can_colour, paint, runs_table
from ros_ik_pkg.compare.words import describe
from ros_ik_pkg.ik import METHODS, OPTIONS, ArgumentError, IkError, OptionError, SolveOptions, load_arm, warm_up
from ros_ik_pkg.ik.options import Option

WIDTH = 100  # columns, if the output is not a terminal
PICTURES = ('.png', '.svg', '.pdf')
PLAIN = {'°': ' deg', 'µ': 'u', '█': '#', '░': '.'}  # for encodings that lack these characters
DECLARED = {option.name: option for option in OPTIONS}
OPTIONS_OF = {
    'max_iterations': ('max_iterations',),
    'tolerance': ('position_tolerance', 'orientation_tolerance'),
    'step_size': ('step_size',),
    'damping': ('dls_damping', 'adaptive_dls_damping'),
    'gain': ('adaptive_dls_gain',),
}


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='compare', description=__doc__)
    add = parser.add_argument
    add('--robot', default=NOTES_ROBOT, help='robot of config/robots, .urdf, .xacro or DH .yaml (default: %(default)s)')
    add('--seed', nargs='+', type=float, metavar='Q', help='joints [deg or m] (default: that of the notes, else home)')
    add('--target', nargs=6, type=float, metavar=('X', 'Y', 'Z', 'ROLL', 'PITCH', 'YAW'), help='pose [m], [deg]')
    add('--methods', nargs='+', choices=METHODS, default=METHODS, metavar='NAME', help='default: all')
    add('--tolerance', type=float, default=1e-6, help='for position [m] and orientation [rad] (default: %(default)s)')
    add('--max-iterations', type=int, default=2000, help='default: %(default)s')
    add('--damping', type=float, help='lambda of dls and lambda_0 of adaptive_dls (default: those of the node)')
    add('--gain', type=float, help='damping over error of adaptive_dls (default: that of the node)')
    add('--step-size', type=float, default=1.0, help='factor on every step (default: %(default)s)')
    add('--plot', type=picture, metavar='FILE.png', help='write the picture: errors, way of the tip, joints')
    add('--animate', type=Path, metavar='FILE.gif|.mp4', help='write a moving picture, iteration by iteration')
    add('--notebook', type=Path, metavar='FILE.ipynb', help='write a notebook that repeats this without ROS')
    add('--csv', type=Path, metavar='FILE', help='write every iterate of every method')
    add('--json', type=Path, metavar='FILE', help='write the problem, the options, the figures and every iterate')
    add('--sweep', type=int, metavar='N', help='run the methods on N regular and N singular random targets instead')
    return parser


def picture(text: str) -> Path:
    """Return the path of a plot, with .png as the default suffix; refuses suffixes that are not in PICTURES."""
    path = Path(text) if Path(text).suffix else Path(f'{text}.png')
    if path.suffix.lower() not in PICTURES:
        raise argparse.ArgumentTypeError(f'{text!r}: expected a name that ends in {", ".join(PICTURES)}')
    return path


def read_arguments() -> argparse.Namespace:
    """Return the parsed arguments; exits if they contradict each other."""
    parser = arguments()
    given = parser.parse_args()
    given.methods = tuple(dict.fromkeys(given.methods))
    if given.sweep is not None:
        if given.sweep < 1 or given.plot or given.animate or given.notebook or given.csv or given.json:
            parser.error('--sweep needs a number above 0, and excludes every option that writes a file')
        if given.seed or given.target:
            parser.error('--sweep excludes --seed and --target, because those of a sweep are random')
    return given


def solve_options(given: argparse.Namespace) -> SolveOptions:
    """Return the solve options; raises OptionError that names the argument if one is out of range."""
    values: dict[str, Any] = {}
    for argument, names in OPTIONS_OF.items():
        value = getattr(given, argument)
        if value is not None:
            values |= {name: _checked(argument, value, DECLARED[name]) for name in names}
    return SolveOptions(**values)


def _checked(argument: str, value: Any, option: Option) -> Any:
    try:
        return option.check(value)
    except OptionError:
        typed = f'--{argument.replace("_", "-")} {value:g}'
        raise OptionError(f'{typed} is not allowed: expected {option.expected()}') from None


def given_problem(given: argparse.Namespace) -> Problem:
    """Return the problem; raises an IkError that names the argument if one is wrong.

    A seed outside the limits is clipped to them, with a message.
    """
    arm = load_arm(given.robot)
    if given.seed and (len(given.seed) != arm.n or not np.isfinite(given.seed).all()):
        expected = f'{arm.n} finite numbers: {", ".join(arm.joint_names)}'
        raise ArgumentError(f'--seed {_typed(given.seed)}: it has {len(given.seed)} numbers; expected {expected}')
    if given.target and not np.isfinite(given.target).all():
        raise ArgumentError(f'--target {_typed(given.target)}: expected six finite numbers')
    problem = make_problem(arm, given.seed, given.target)
    seed = np.clip(problem.seed, arm.lower, arm.upper)
    for joint in np.flatnonzero(seed != problem.seed):
        low, high, start = (as_typed(arm, values)[joint] for values in (arm.lower, arm.upper, seed))
        say(f'--seed: {arm.joint_names[joint]} is outside its limits {low:g} to {high:g}; starting at {start:g}')
    return replace(problem, seed=seed)


def _typed(numbers: Sequence[float]) -> str:
    return ' '.join(f'{number:g}' for number in numbers)


def say(text: str) -> None:
    """Print a message of the command to standard error."""
    print(f'compare: {text}', file=sys.stderr)


def main() -> int:
    """Run the command; returns 0 even if methods fail to converge, 1 for a wrong argument."""
    replace_missing_characters()
    given = read_arguments()
    try:
        options = solve_options(given)
        problem = given_problem(given)
        warm_up(report=lambda text: print(text, file=sys.stderr))
        if given.sweep:
            sweep(problem, given, options)
        else:
            compare(problem, given, options)
    except (IkError, OSError, ValueError) as error:
        say(str(error))
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def replace_missing_characters() -> None:
    """Replace characters that the output's encoding lacks, and exit quietly if the reader closes the pipe."""
    codecs.register_error('plain', _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='plain')
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)


def _plain(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    missing = error.object[error.start : error.end]
    return ''.join(PLAIN.get(character, '?') for character in missing), error.end


def compare(problem: Problem, given: argparse.Namespace, options: SolveOptions) -> None:
    """Print the table of one target and write the requested files."""
    question = problem.arm, problem.target, problem.seed, given.methods, options
    compare_methods(*question)  # a warm-up, because the first runs of a process are slower
    runs = compare_methods(*question)
    print(heading(problem, given))
    print(runs_table(runs, can_colour(sys.stdout)))
    print('\n' + textwrap.fill(describe(runs), shutil.get_terminal_size((WIDTH, 0)).columns, break_long_words=False))
    for line in contact_lines(problem.arm, runs):
        print(line)
    if given.plot:
        from ros_ik_pkg.compare.plots import save_picture  # only plots need matplotlib

        save_picture(given.plot, problem, runs)
    if given.animate:
        from ros_ik_pkg.compare.animation import frames_of, save_animation

        save_animation(given.animate, problem, runs, progress_bar(len(frames_of(runs)), 'frames'))
    if given.notebook:
        save_notebook(given.notebook, problem, given.robot, given.methods, options)
    if given.csv:
        write_csv(given.csv, problem, runs)
    if given.json:
        write_json(given.json, problem, runs, options, given.robot)
    for path in filter(None, (given.plot, given.animate, given.notebook, given.csv, given.json)):
        print(f'wrote {path}', file=sys.stderr)


def heading(problem: Problem, given: argparse.Namespace) -> str:
    """Return a line that describes the problem."""
    x, y, z, roll, pitch, yaw = numbers_of(problem.target).round(3) + 0.0  # turns -0.0 into 0.0
    roll, pitch, yaw = (round(angle, 1) + 0.0 for angle in (roll, pitch, yaw))
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
        f'(or m) of a solution in every joint,\none descent of at most {given.max_iterations} iterations, tolerance '
        f'{given.tolerance:g} m and rad\n'
    )
    print(colour_names(table) if can_colour(sys.stdout) else table)


def colour_names(table: str) -> str:
    """Return a table with the method names in its header in their colours."""
    head, _, rest = table.partition('\n')
    words = ((word, COLOURS[word]) for word in head.split())
    for word, colour in words:
        head = head.replace(f' {word}', f' {paint(word, colour)}', 1)
    return f'{head}\n{rest}'


if __name__ == '__main__':
    sys.exit(main())
