"""One path for one arm, and the arrays that the compiled code takes for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.kernel.compiled import FunctionAddress
from ros_ik_pkg.ik.kernel.data_layout import GEOMETRY_JOINTS, HEADER, Tuning
from ros_ik_pkg.ik.options import SolveOptions
from ros_ik_pkg.ik.path.edges import MOST_PARTS, rotation_vectors
from ros_ik_pkg.ik.path.path_options import PathOptions
from ros_ik_pkg.ik.path.waypoints import Samples
from ros_ik_pkg.ik.search.entry import solve_range

TURN = 2.0 * math.pi
EXACT = 1e-11  # m, rad: error of the rows in the result
INSET = 1e-6  # rad or m that rows keep from a limit
MARGIN = 0.75  # share of the tolerance that an edge may use; the curved motion in time needs the rest
EDGE = (1.0, MOST_PARTS)  # longest step of a joint [rad or m], parts at most
LONG_EDGE = (3.5, MOST_PARTS)  # more than the half turn of a wrist that passes its singularity
EDGE_SPARE = (0.25, 4)  # for redundant arms, which can move without the tip

Clear = Callable[[np.ndarray], np.ndarray]


@dataclass
class Problem:
    """One path for one arm."""

    arm: Arm
    samples: Samples
    seed: np.ndarray  # (n,) where the joints are, or (0,) if the path may begin anywhere
    options: SolveOptions
    path: PathOptions
    least: np.ndarray  # (N - 1,) shortest times of the intervals [s]
    clear: Clear | None
    stop_time: float  # of time.monotonic
    progress: Callable[[int], object] | None
    thorough: bool = False  # whether this is the second search, see joint_path._find_best_route

    @cached_property
    def poses(self) -> np.ndarray:
        """(4 N, 4), as the compiled code takes them."""
        return np.ascontiguousarray(self.samples.poses).reshape(-1, 4)

    @cached_property
    def turns(self) -> np.ndarray:
        """(N - 1, 3) rotations from each sample to the next [rad]."""
        return rotation_vectors(self.poses)

    @cached_property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limits (n,), infinite if they are not respected."""
        if self.options.respect_limits:
            return self.arm.lower, self.arm.upper
        return np.full(self.arm.n, -np.inf), np.full(self.arm.n, np.inf)

    @cached_property
    def row_limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Limits (n,) of the rows, INSET inside those of the joints: so a joint can slide along its limit."""
        lower, upper = self.limits
        inset = np.where(upper - lower > 4.0 * INSET, INSET, 0.0)
        return lower + inset, upper - inset

    @cached_property
    def model(self) -> np.ndarray:
        """The packed arm without the limits of joints that may turn a whole turn: whole turns are added later."""
        packed, n, joints = self.arm.packed.copy(), self.arm.n, len(self.arm.prismatic)
        first = HEADER + 12 * (joints + 1) + GEOMETRY_JOINTS * joints
        if self.options.respect_limits:
            packed[first : first + n], packed[first + n : first + 2 * n] = self.row_limits
        free = self.arm.wraps != 0
        packed[first : first + n][free] = -np.inf
        packed[first + n : first + 2 * n][free] = np.inf
        return packed

    @cached_property
    def solve(self) -> FunctionAddress:
        """`solve_range`, as the compiled code takes it."""
        return solve_range.as_argument()

    @cached_property
    def continuing(self) -> np.ndarray:
        """SolveOptions.numbers of a single descent from a neighbouring solution."""
        return replace(
            self.options, max_attempts=1, choice='first', deadline=0.0, max_joint_jump=0.0, null_space='none'
        ).numbers

    @cached_property
    def exact(self) -> np.ndarray:
        """The same, with tolerances a little above the rounding of double precision."""
        numbers = self.continuing.copy()
        for name, bound in (('position_tolerance', EXACT), ('orientation_tolerance', EXACT)):
            place = Tuning._fields.index(name)
            numbers[place] = min(numbers[place], bound)
        return numbers

    @cached_property
    def spare(self) -> bool:
        """Whether the arm is redundant for the task: its joints can move while the task holds."""
        rows = zip(self.options.task_weights, self.options.task_tolerances)
        return self.arm.n > sum(weight > 0.0 and bound == 0.0 for weight, bound in rows)

    @cached_property
    def bounds(self) -> np.ndarray:
        """Bounds (4,) of an edge, see parts_of_edge."""
        longest = EDGE_SPARE if self.spare else LONG_EDGE if self.thorough else EDGE
        return np.array([MARGIN * self.path.tolerance, MARGIN * self.path.angle_tolerance, *longest])

    @cached_property
    def most_steps(self) -> np.ndarray:
        """How far each joint may move between two samples (N - 1, n); infinite if the tip may slow down."""
        if not self.path.keep_speed:
            return np.full((len(self.least), self.arm.n), np.inf)
        with np.errstate(invalid='ignore'):
            steps = self.least[:, None] * self.arm.velocity_limits
        steps[self.least == 0.0] = np.inf
        return np.nan_to_num(steps, nan=np.inf, posinf=np.inf)

    def report(self, done: int) -> None:
        """Call `progress` with the number of samples done since the last call."""
        if self.progress is not None:
            self.progress(done)
