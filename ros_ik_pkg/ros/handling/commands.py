"""The command for a result: the solution, a step towards it, the closest approach, or nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rclpy.clock import ROSClock

from ros_ik_pkg.ik import Arm, Status, solve
from ros_ik_pkg.ros.handling.commanded_joints import CommandedJoints
from ros_ik_pkg.ros.handling.final_check import contact_of, errors_of, fault_of_command
from ros_ik_pkg.ros.handling.result import CLOSEST, INTERNAL_ERROR, SOLUTION, SOLVED, STEP, Command, Result
from ros_ik_pkg.ros.handling.velocity_limiting import StepError, StepTimer, limited_step, reach_of_step
from ros_ik_pkg.ros.interface.parameters import Settings

# Failures after which nothing is published, even with out_of_reach: closest. After a non-finite step the solve cannot
# be trusted, and solutions beyond max_joint_jump or in contact exist but are not wanted.
HELD = frozenset({Status.NOT_FINITE.label, Status.JOINT_JUMP.label, Status.COLLISION.label, INTERNAL_ERROR})


class Commands:
    """Adds commands to results, and remembers the last one: `last` (n,) [rad, m], None if there was none."""

    def __init__(self, clock: ROSClock) -> None:
        self.last: np.ndarray | None = None
        self._arm: Arm | None = None
        self._memory = CommandedJoints()
        self._velocity_limits = np.empty(0)
        self._timer = StepTimer(clock)

    def take_over(self, settings: Settings, arm: Arm | None) -> None:
        """Use these settings and this arm from the next result on."""
        if arm is None or not arm.same_robot(self._arm):
            self._change_arm(arm)
        if arm is not None:
            self._velocity_limits = settings.velocity_scale * arm.velocity_limits

    def _change_arm(self, arm: Arm | None) -> None:
        """Keep the last commanded positions: reloading the robot does not move it."""
        if self._arm is not None and self.last is not None:
            self._memory.keep(self._arm, self.last)
        self._arm = arm
        self.last = None if arm is None else self._memory.of(arm)
        if self.last is None:
            self._timer.restart()

    def complete(self, result: Result, start: np.ndarray, reference: np.ndarray, settings: Settings) -> None:
        """Add the command, if there is one, and notes about it to a result.

        start: (n,) joint positions [rad, m] from which a step is measured. reference: (n,) from which
        max_joint_jump is measured.
        """
        try:
            command, notes = self._command(result, start, reference, settings)
        except StepError as error:
            result.fail('velocity_limit', _too_far_outside(result.arm.joint_names[error.joint], start[error.joint]))
            return
        result.notes += notes
        if command is None:
            return
        # The solution itself has been checked already.
        if command.errors and (fault := fault_of_command(command.q, result.arm, settings.options)):
            result.fail(INTERNAL_ERROR, f'internal error: a command did not pass the final check, {fault}')
            return
        # So has its contact, if it is published without a step.
        if (command.errors or settings.check_motion) and (contact := contact_of(
                command.q, start, result.room, settings.options, settings.check_motion)):
            result.fail(Status.COLLISION.label, f'not published: {contact}')
            return
        self.last = command.q
        result.command = command
        if command.fraction is not None and command.fraction < 1.0:
            result.reason += f'; published is a step, {100.0 * command.fraction:.3g} % of the way there'

    def _command(
        self, result: Result, start: np.ndarray, reference: np.ndarray, settings: Settings
    ) -> tuple[Command | None, tuple[str, ...]]:
        """Return the command, or None, and notes."""
        if result.outcome == SOLVED:
            return self._towards(result.solution.q, SOLUTION, result, start, settings)
        if settings.out_of_reach != CLOSEST or result.status in HELD:
            return None, ()
        q = closest_approach(result, start, settings)
        jump, most = float(np.abs(q - reference).max()), settings.options.max_joint_jump
        if most and not jump <= most:
            return None, (f'closest approach not published: a joint would jump by {jump:.3g}, beyond max_joint_jump',)
        return self._towards(q, CLOSEST, result, start, settings)

    def _towards(
        self, goal: np.ndarray, published: str, result: Result, start: np.ndarray, settings: Settings
    ) -> tuple[Command, tuple[str, ...]]:
        """Return the command that leads from start towards goal (n,), as far as velocity_limiting allows."""
        limits = self._velocity_limits
        q, step_time, fraction, notes = goal, None, None, ()
        if settings.velocity_limiting != 'none':
            now = self._timer.now()
            step_time = self._timer.elapsed(now, settings.max_step_time)
            reach = reach_of_step(limits, step_time)
            q, fraction = limited_step(start, goal, reach, *_bounds(result, settings), settings.velocity_limiting)
            notes = _notes(limits, fraction)
            published = STEP if fraction < 1.0 and published == SOLUTION else published
            self._timer.step_taken(now)
        errors = None
        if q is not goal or published == CLOSEST:
            errors = errors_of(q, result.base_from_target, result.arm, settings.options)
        return Command(q, start, limits, published, errors, fraction, step_time), notes


def closest_approach(result: Result, start: np.ndarray, settings: Settings) -> np.ndarray:
    """Return the closest approach (n,) by a descent from `start`; that of a search may be in another posture."""
    options = replace(settings.options, max_attempts=0, choice='first', avoid_collisions=False)
    return solve(result.arm, result.base_from_target, start, options).q


def _bounds(result: Result, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """Return the joint limits (n,) of commands."""
    if settings.options.respect_limits:
        return result.arm.lower, result.arm.upper
    return np.full(result.arm.n, -np.inf), np.full(result.arm.n, np.inf)


def _too_far_outside(name: str, position: float) -> str:
    return (
        f'{name} is at {position:.6g}, further outside its limits than one step within the velocity limits leads; '
        'expected a joint within its limits: bring it back by other means'
    )


def _notes(velocity_limits: np.ndarray, fraction: float) -> tuple[str, ...]:
    if np.isinf(velocity_limits).all():
        return ('step not limited: no velocity limit of this arm is known',)
    return (f'velocity limit: {fraction:.3g} of the step taken',) if fraction < 1.0 else ()
