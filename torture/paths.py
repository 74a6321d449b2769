"""Random paths for a Panda, an xArm7, a UR5 and a Z1: alone, over a floor and among ten boxes; lines, curves and arcs,
with random limits, speeds, seeds and reconfigurations. Of every motion that `solve_path` returns, also along a part of
a path, SciPy's polynomials, Pinocchio and coal judge a grid ten times as fine as its rows: the limits of position,
velocity and acceleration, the tip against the path as it was given (`path.tolerance`), and contact on the meshes.
"""

from __future__ import annotations

from collections.abc import Iterator

from bench.path_check import ROBOTS, check_cases
from torture.plan import Check, Plan, unless

COUNT = 10_000


def run(plan: Plan) -> Iterator[Check]:
    """Judge the paths of all arms; yield a line for each."""
    found = check_cases(plan.count or COUNT, plan.seed)
    for name in ROBOTS:
        cases = [case for case in found if case.arm == name]
        whole, part, none, arcs, rows = (
            sum(case.seen[what] for case in cases) for what in ('whole', 'in part', 'none', 'arcs', 'rows')
        )
        faults = [fault for case in cases for fault in case.faults]
        yield Check(f'{name}: motions along {whole + part + none} paths',
                    f'{whole} whole, {part} in part, {none} none; {arcs} with arcs; {rows} rows',
                    unless(not faults, f'{len(faults)} violations, {"; ".join(faults)}'))  # fmt: skip
