"""One line of the demo: the reply to a target and its verdict."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio

from ros_ik_pkg.ik import SolveOptions
from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ros.reply import Reply

BARS = '▁▂▃▄▅▆▇█'
CURVE_WIDTH = 24
ITERATION_COLUMNS = ('iteration', 'position_error', 'orientation_error', 'step_norm', 'damping', 'sigma_min')
ROUNDING = 1.001  # the tolerances are checked in another arithmetic than the solver's


@dataclass(frozen=True)
class Check:
    """A reply and its verdict; `fault` is empty if it is right."""

    method: str
    number: int
    reply: Reply
    fault: str

    @staticmethod
    def heading() -> str:
        """Names of the columns."""
        errors = 'first |e|', 'last |e|', 'log |e|'
        return columns('method', 'target', 'attempts', 'iterations', *errors, 'answer')

    def line(self) -> str:
        """Write one line of the table."""
        errors = [float(row['error_norm']) for row in self.reply.iterations]
        figures = self.reply.figures
        first, last = (f'{errors[0]:.1e}', f'{errors[-1]:.1e}') if errors else ('', '')
        counts = figures.get('attempts', ''), figures.get('iterations', '')
        return columns(self.method, str(self.number), *counts, first, last, curve(errors), self._answer())

    def _answer(self) -> str:
        if self.fault:
            return f'WRONG: {self.fault}'
        if self.reply.solved:
            return 'solved'
        return f'{self.reply.figures["status"]}, {float(self.reply.figures["position_error"]):.1f} m off'

    def iterations(self) -> str:
        """Write a table of every iteration, its figures as the node gave them."""
        lines = [' '.join(f'{name:>17}' for name in ITERATION_COLUMNS)]
        for row in self.reply.iterations:
            lines.append(' '.join(f'{float(row[name]):17.4g}' for name in ITERATION_COLUMNS))
        return '\n'.join(lines)


def columns(*cells: str) -> str:
    """Lay out one line: the method to the left, figures to the right."""
    method, target, attempts, iterations, first, last, drawing, answer = cells
    figures = f'{target:>6}  {attempts:>8}  {iterations:>10}  {first:>9}  {last:>8}'
    return f'{method:12}  {figures}  {drawing:{CURVE_WIDTH}}  {answer}'


def judge_reachable(arm: Arm, method: str, number: int, target: np.ndarray, reply: Reply) -> Check:
    """Judge the reply to a target within reach by Pinocchio's forward kinematics."""
    return Check(method, number, reply, _foreign_method(method, reply) or _not_at_target(arm, target, reply))


def judge_unreachable(arm: Arm, method: str, number: int, target: np.ndarray, reply: Reply) -> Check:
    """Judge the reply to a target out of reach: a reason, and no joint positions."""
    fault = 'solved a target that is out of reach' if reply.solved or reply.joints else ''
    return Check(method, number, reply, _foreign_method(method, reply) or fault)


def _foreign_method(method: str, reply: Reply) -> str:
    used = reply.figures.get('method')
    return '' if used == method else f'method {used} was used'


def _not_at_target(arm: Arm, target: np.ndarray, reply: Reply) -> str:
    """Return the distance from the target if it exceeds the tolerance."""
    if not reply.solved:
        return f'not solved: {reply.message}'
    if not reply.iterations:
        return 'no iterations received'
    reached = arm.base_from_frame(arm.tip_frame, reply.joints)
    distance = float(np.linalg.norm(target[:3, 3] - reached[:3, 3]))
    angle = float(np.linalg.norm(pinocchio.log3(target[:3, :3] @ reached[:3, :3].T)))
    options = SolveOptions()
    if distance > ROUNDING * options.position_tolerance or angle > ROUNDING * options.orientation_tolerance:
        return f'the tip is {distance:.1e} m and {angle:.1e} rad from the target'
    return ''


def curve(errors: list[float]) -> str:
    """Draw errors over the iterations as bars of their logarithm, from the smallest to the largest."""
    finite = [max(error, 1e-300) for error in errors if math.isfinite(error)]
    if not finite:
        return ''
    drawn = np.linspace(0, len(finite) - 1, min(CURVE_WIDTH, len(finite))).round().astype(int)
    logs = np.log10(finite)[drawn]
    height = (logs - logs.min()) / max(np.ptp(logs), 1e-9)
    return ''.join(BARS[round(share * (len(BARS) - 1))] for share in height)
