"""Map what an arm can reach, or rank where its base stands best; needs no ROS."""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np

from ros_ik_pkg.compare.command import picture
from ros_ik_pkg.compare.progress import progress_bar
from ros_ik_pkg.ik import (
    ArgumentError,
    Arm,
    IkError,
    ReachMap,
    SolveOptions,
    World,
    load_arm,
    rank_placements,
    reach_map,
    warm_up,
)
from ros_ik_pkg.ik.reachability import placement
from ros_ik_pkg.ik.reachability.figures import MEANINGS, end_of_scale, position_figure, position_figures, red_to_blue
from ros_ik_pkg.ik.reachability.reach_map import CHUNKS, ROUNDS, SAMPLES
from ros_ik_pkg.tools.path_files import read_path_file

SHOWN = 10  # placements


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='reach', description=__doc__)
    add = parser.add_argument
    add('--robot', default='ur5', help='robot of config/robots, .urdf, .xacro or DH .yaml (default: %(default)s)')
    add('--base', help='link that the chain begins at (default: the root)')
    add('--tip', help='link that the chain ends at (default: the flange or tool)')
    add('--floor', type=float, metavar='Z', help='height of a floor in the base frame [m] (default: none)')
    add('--ignore-collisions', action='store_true', help='count configurations that touch, too')
    add('--plot', type=picture, metavar='FILE.png', help='picture: three slices and a cloud')
    add('--npz', type=Path, metavar='FILE', help='the whole map for NumPy (ros_ik_pkg.ik.load_reach_map)')
    add('--ply', type=Path, metavar='FILE', help='the positions as a coloured point cloud')
    add('--colour', choices=MEANINGS, default='share',
        help='what the colours of the picture and the point cloud show (default: %(default)s)')
    grid = parser.add_argument_group('the map')
    grid.add_argument('--step', type=float, help='edge of a cell [m] (default: a 21st of the diameter of the reach)')
    grid.add_argument('--parts', type=int, default=3,
                      help='4 N^3 cells of rotations, each about 90 / N degrees wide (default: %(default)s)')
    grid.add_argument('--box', type=float, nargs=6, metavar=('X0', 'Y0', 'Z0', 'X1', 'Y1', 'Z1'),
                      help='lowest and highest corner in the base frame [m] (default: all that can be reached)')
    grid.add_argument('--samples', type=int, default=SAMPLES, help='random configurations (default: %(default)s)')
    place = parser.add_argument_group('the base')
    place.add_argument('--place', type=Path, metavar='FILE', help='instead: rank places of the base for the poses of a '
                       '.csv or .yaml (columns x y z roll pitch yaw or qx qy qz qw)')
    place.add_argument('--degrees', action='store_true', help='the angles in FILE are degrees')
    place.add_argument('--height', type=float, default=0.0, help='of the base in the frame of the poses [m]')
    return parser


def main() -> int:
    """Make the map or the ranking; 1 for a wrong argument."""
    given = arguments().parse_args()
    try:
        arm = load_arm(given.robot, given.base, given.tip)
        options = SolveOptions(avoid_collisions=not given.ignore_collisions)
        warm_up(report=lambda text: print(text, file=sys.stderr))
        if given.place:
            rank(arm, given, options)
        else:
            write_map(arm, given, options)
    except (IkError, OSError, ValueError) as error:
        print(f'reach: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def write_map(arm: Arm, given: argparse.Namespace, options: SolveOptions) -> None:
    """Make the map, print what it says and write the files."""
    if given.colour == 'clearance' and not (options.avoid_collisions and arm.shaped):
        raise ArgumentError('the map has no clearance: contact does not count; expected share or sigma_min')
    began = time.monotonic()
    box = None if given.box is None else np.reshape(given.box, (2, 3))
    found = reach_map(
        arm, given.step, given.parts, box, given.samples, ROUNDS, options, World(floor=given.floor),
        progress=progress_bar(CHUNKS + ROUNDS, 'reach'),
    )  # fmt: skip
    print(summary(arm, found, time.monotonic() - began))
    if given.plot:
        from ros_ik_pkg.tools.reach_picture import save_picture  # only pictures need matplotlib

        save_picture(given.plot, arm.name, found, given.colour)
    if given.npz:
        found.save(given.npz)
    if given.ply:
        write_ply(given.ply, found, given.colour)
    for path in filter(None, (given.plot, given.npz, given.ply)):
        print(f'wrote {path}', file=sys.stderr)


def summary(arm: Arm, found: ReachMap, seconds: float) -> str:
    """Say in words what a map holds."""
    share = found.share
    positions, whole = int((share > 0.0).sum()), int((share == 1.0).sum())
    x, y, z = found.centres()[np.unravel_index(np.argmax(share), share.shape)]
    cells = math.prod(found.shape) * found.rotations
    return (
        f'{arm.name}, {arm.base_frame} to {arm.tip_frame}: {len(found.cells)} of {cells} cells reached '
        f'in {seconds:.1f} s\n'
        f'  cells: {found.step:.3g} m, {found.rotations} rotations\n'
        f'  positions: {positions} reached ({positions * found.step**3:.3g} m^3), {whole} with every rotation\n'
        f'  most rotations: {share.max():.0%} at x {x:.3f} y {y:.3f} z {z:.3f} m'
    )


def write_ply(path: Path, found: ReachMap, colour: str) -> None:
    """Write the reached positions and their figures as a point cloud (PLY, ASCII), from red, where the one that is
    chosen is 0, to blue."""
    reached = found.share > 0.0
    chosen, figures = position_figure(found, colour)[reached], position_figures(found)
    colours = np.round(255 * red_to_blue(chosen, end_of_scale(colour, chosen))).astype(int)
    head = ['ply', 'format ascii 1.0', f'element vertex {len(chosen)}', *(f'property float {name}' for name in 'xyz'),
            *(f'property uchar {name}' for name in ('red', 'green', 'blue')),
            *(f'property float {name}' for name in figures), 'end_header']  # fmt: skip
    values = np.stack([figure[reached] for figure in figures.values()], -1)
    rows = [
        ' '.join([*(f'{x:.6g}' for x in point), *map(str, channels), *(f'{value:.6g}' for value in row)])
        for point, channels, row in zip(found.centres()[reached].tolist(), colours.tolist(), values.tolist())
    ]
    path.write_text('\n'.join([*head, *rows, '']))


def rank(arm: Arm, given: argparse.Namespace, options: SolveOptions) -> None:
    """Print the best places of the base."""
    poses, *_ = read_path_file(given.place, given.degrees)
    bar = progress_bar(placement.ACROSS**2 * placement.TURNS, 'places')
    ranked = rank_placements(arm, poses, given.height, options, bar)
    if not ranked:
        print(f'{arm.name}: none of the {len(poses)} poses is solved from any place')
        return
    print(f'{arm.name}: the best of {len(ranked)} places of the base from which any of {len(poses)} poses is solved\n')
    print('  x [m]   y [m]   yaw [deg]   solved   smallest sigma_min')
    for place in ranked[:SHOWN]:
        yaw = math.degrees(place.yaw)
        print(f'{place.x:7.3f} {place.y:7.3f} {yaw:9.0f} {place.solved:9d}   {place.sigma_min:10.4f}')


if __name__ == '__main__':
    sys.exit(main())
