"""Run every method on one target: one descent each, from the same seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ros_ik_pkg.ik import METHODS, Arm, SolveOptions, Status, Trace, solve
from ros_ik_pkg.ik.options import all_demanded


@dataclass(frozen=True)
class MethodRun:
    """Outcome of one method on one target.

    position_error [m], orientation_error [rad]: of the last configuration.
    time: of a solve without a trace, which is what a user waits for [s].
    sigma_min: smallest singular value of the Jacobian over the iterates.
    joints_at_limits: names of the joints that are at a limit in the last configuration.
    trace: every iterate, or None if only the figures are known.
    """

    method: str
    status: Status
    iterations: int
    position_error: float
    orientation_error: float
    time: float
    sigma_min: float
    joints_at_limits: tuple[str, ...] = ()
    trace: Trace | None = None

    @property
    def iterates(self) -> Trace:
        """The trace; raises ValueError if only the figures are known."""
        if self.trace is None:
            raise ValueError(f'the run of {self.method} has no trace')
        return self.trace


def compare_methods(
    arm: Arm,
    target: np.ndarray,
    seed: np.ndarray,
    methods: Sequence[str] = METHODS,
    options: SolveOptions | None = None,
) -> list[MethodRun]:
    """Run each method once from the seed.

    Parameters
    ----------
    arm : Arm
    target : (4, 4) array
        Pose of the tip frame in the base frame [m].
    seed : (n,) array
        Configuration that every method starts from [rad, m].
    methods : sequence of str
        Names from METHODS, in the order in which they run.
    options : SolveOptions, optional
        Tolerances, damping and so on. Each run is a single descent without a deadline, so that only the
        iterations bound it.

    Raises
    ------
    ArgumentError
        As `solve` does.
    OptionError
        If a method is unknown.

    """
    options = options or SolveOptions()
    return [_run(arm, target, seed, single_descent(options, method)) for method in methods]


def single_descent(options: SolveOptions, method: str) -> SolveOptions:
    """Return the options of one descent with a method: all rows demanded, no restarts, no deadline, first solution."""
    options = all_demanded(options)
    return replace(options, method=method, max_attempts=1, deadline=0.0, choice='first', max_joint_jump=0.0)


def _run(arm: Arm, target: np.ndarray, seed: np.ndarray, options: SolveOptions) -> MethodRun:
    traced = solve(arm, target, seed, options, trace=True)
    timed = solve(arm, target, seed, options)
    assert traced.trace is not None  # because trace=True
    return MethodRun(
        method=options.method,
        status=traced.status,
        iterations=traced.iterations,
        position_error=traced.position_error,
        orientation_error=traced.orientation_error,
        time=timed.solve_time,
        sigma_min=float(np.nanmin(traced.trace.column('sigma_min'))),
        joints_at_limits=tuple(arm.joint_names[i] for i in traced.joints_at_limits),
        trace=traced.trace,
    )
