"""Find a motion of the joints along the path of a file and print its figures."""

from __future__ import annotations

import argparse
import csv
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ros_ik_pkg.compare.command import picture
from ros_ik_pkg.compare.problem import NOTES_ROBOT, is_rotary
from ros_ik_pkg.ik import Arm, IkError, PathOptions, PathSolution, load_arm, solve_path
from ros_ik_pkg.tools.path_files import read_path_file

NOTICE_AFTER = 3.0  # s
STILL_SOLVING = 'path: still solving; the first path on a machine also compiles, for some 12 s'


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='path', description=__doc__)
    add = parser.add_argument
    add('file', type=Path, help='.csv or .yaml, see docs/paths.md')
    add('--robot', default=NOTES_ROBOT, help='robot of config/robots, .urdf, .xacro or DH .yaml (default: %(default)s)')
    add('--degrees', action='store_true', help='the angles are degrees, also those of --seed')
    add('--seed', nargs='+', type=float, metavar='Q', help='where the joints are [rad or m] (default: anywhere)')
    add('--set', nargs='+', type=setting, default=[], metavar='NAME=VALUE', help='options of the path')
    add('--plot', type=picture, metavar='FILE.png', help='write the picture: joints, speed of the tip, sigma_min')
    add('--csv', type=Path, metavar='FILE', help='write times, positions, velocities and accelerations of all rows')
    return parser


def setting(text: str) -> tuple[str, Any]:
    """Return name and value of NAME=VALUE."""
    name, _, value = text.partition('=')
    return name, yaml.safe_load(value)


def main() -> int:
    """Solve the path and print the figures; 0 when it is followed whole, 2 when not, 1 for bad input."""
    given = arguments().parse_args()
    try:
        # No deadline unless it is set: the first path on a machine compiles.
        arm, path = load_arm(given.robot), PathOptions(**{'deadline': 0.0, **dict(given.set)})
        file = read_path_file(given.file, given.degrees)
        seed = given.seed
        if seed is not None and given.degrees and len(seed) == arm.n:
            seed = np.where(is_rotary(arm), np.radians(seed), seed)
        notice = threading.Timer(NOTICE_AFTER, print, [STILL_SOLVING], {'file': sys.stderr})
        notice.start()
        try:
            solution = solve_path(arm, file.poses, seed, path=path, stamps=file.times, vias=file.vias)
        finally:
            notice.cancel()
        if given.csv:
            write_rows(given.csv, arm, solution)
        if given.plot:
            from ros_ik_pkg.compare.path_plot import save_path_picture  # matplotlib is installed only for this

            save_path_picture(given.plot, arm, solution)
    except (IkError, ValueError, OSError) as error:
        print(f'path: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    print_figures(solution)
    return 0 if solution.complete else 2


def print_figures(solution: PathSolution) -> None:
    """Print how far the path is followed, and what the motion is like."""
    for found in solution.breaks:
        print(f'breaks: {found.text} ({found.reason.value})')
    if not len(solution.q):
        return
    lowest = int(np.argmin(solution.sigma_min))
    changes = ' '.join(f'at pose {solution.place[row]:.6g}' for row in solution.reconfigurations)
    figures = {
        'points': len(solution.q),
        'duration [s]': f'{solution.times[-1]:.3f}',
        'reached pose': f'{solution.place[-1]:.6g}',
        'joints travel [rad or m]': f'{solution.length:.4g}',
        'reconfigurations': changes or 'none',
        'off the line, at most': f'{solution.line_error:.2g} m, {solution.line_angle:.2g} rad',
        'least singular value': f'{solution.sigma_min[lowest]:.3g} at pose {solution.place[lowest]:.6g}',
        'solve time [ms]': f'{1e3 * solution.solve_time:.1f}',
    }
    for name, value in figures.items():
        print(f'{name:>26}: {value}')


def write_rows(file: Path, arm: Arm, solution: PathSolution) -> None:
    """Write all rows of the motion, SI units."""
    names = [f'{name}{suffix}' for suffix in ('', '_velocity', '_acceleration') for name in arm.joint_names]
    rows = np.column_stack([solution.times, solution.q, solution.velocities, solution.accelerations])
    with file.open('w', newline='') as stream:
        writer = csv.writer(stream)
        writer.writerow(['time', *names])
        writer.writerows(rows.tolist())


if __name__ == '__main__':
    sys.exit(main())
