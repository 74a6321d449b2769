"""Solves for tasks with rows that are wished for only: by descents in order, or if they fail by the usual search."""

from __future__ import annotations

import numpy as np

from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ik.contacts.contacts import Room
from ros_ik_pkg.ik.kernel.data_layout import Tuning
from ros_ik_pkg.ik.options import SolveOptions, demanded_alone
from ros_ik_pkg.ik.search.entry import (
    ATTEMPTS,
    JOINT_DISTANCE,
    LIMITS_MASK,
    ORIENTATION_ERROR,
    POSITION_ERROR,
    STATUS,
    STEPS,
    TIME,
    WIDTH,
    WISHED_ORIENTATION_ERROR,
    WISHED_POSITION_ERROR,
    WISHED_ROWS,
    solve_range,
)
from ros_ik_pkg.ik.search.ordered_entry import NOT_FOUND, solve_in_order
from ros_ik_pkg.ik.solution import Status

ATTEMPTS_PLACE, DEADLINE_PLACE, LIMITS_PLACE, JUMP_PLACE = (
    Tuning._fields.index(name) for name in ('max_attempts', 'deadline', 'respect_limits', 'max_joint_jump')
)
ERRORS = (POSITION_ERROR, ORIENTATION_ERROR, WISHED_ROWS, WISHED_POSITION_ERROR, WISHED_ORIENTATION_ERROR)
NOTHING = np.empty((0, 0))
LEAST_TIME = 1e-6  # s
# A pose that is missed by less than ALMOST [rad] may be one that the arm reaches whole elsewhere: FEW attempts search
# for that, or if it is missed by less than HARDLY as many as the options allow.
ALMOST, HARDLY = 0.5, 0.01
FEW = 20


def search_targets(
    arm: Arm, room: Room | None, options: SolveOptions, targets: np.ndarray, seeds: np.ndarray, references: np.ndarray,
    out: np.ndarray, answers: np.ndarray, touching: np.ndarray, rows: np.ndarray,
) -> int:
    """Do what `solve_range` does, in strict order if the options wish for rows of this arm."""
    model = arm.packed if room is None else room.behind(arm.packed)
    if arm.n >= options.wishes_below:
        return solve_range(model, options.numbers, targets, seeds, references, out, answers, touching, rows)
    starts, free = arm.ordered_starts
    count = solve_in_order(
        model, options.numbers, options.wished_mask, starts, free, targets, seeds, references, out, answers, touching,
        rows,
    )  # fmt: skip
    for k in range(len(out)):
        error = out.item(k, arm.n + WISHED_ORIENTATION_ERROR)
        lost = out.item(k, arm.n + STATUS) == NOT_FOUND
        almost = options.orientation_tolerance < error < ALMOST and options.max_attempts > 1 and not lost
        if not (lost or almost):
            continue
        target, own = targets[4 * k : 4 * k + 4], slice(k * arm.n, (k + 1) * arm.n)
        row, written = out[k], min(count, len(rows))
        before = row.copy()
        numbers = (demanded_alone(options) if lost else options).numbers.copy()
        if almost and error > HARDLY:
            numbers[ATTEMPTS_PLACE] = min(numbers[ATTEMPTS_PLACE], FEW)
        numbers[DEADLINE_PLACE] = _left(options.deadline, before[TIME - WIDTH])
        more = solve_range(
            model, numbers, target, seeds[own], references[own], row.reshape(1, -1), answers if lost else NOTHING,
            touching, rows[written:],
        )  # fmt: skip
        if len(rows) > 0:
            rows[written : written + more, 0] += before[ATTEMPTS - WIDTH]
        count += more
        spent = row[[STEPS - WIDTH, ATTEMPTS - WIDTH, TIME - WIDTH]]
        if almost and row[STATUS - WIDTH] != Status.CONVERGED:
            row[:] = before
        elif lost:
            deadline = _left(numbers[DEADLINE_PLACE], spent[-1])
            _come_near(arm, model, options, target, references[own], row, deadline)
        else:
            measure_wishes(arm, options, target, references[own], row)
            if len(answers) > 0:
                answers[0] = row[: arm.n]
        for figure, own_figure in zip((STEPS, ATTEMPTS, TIME), spent):
            row[figure - WIDTH] = before[figure - WIDTH] + own_figure
    return count


def _left(deadline: float, spent: float) -> float:
    """Return what is left of a deadline [s]; 0: there is none."""
    return max(deadline - spent, LEAST_TIME) if deadline > 0.0 else 0.0


def _come_near(
    arm: Arm, model: np.ndarray, options: SolveOptions, target: np.ndarray, reference: np.ndarray, row: np.ndarray,
    deadline: float,
) -> None:
    """Bring the configuration of a row, which the search for the demanded rows left, nearer to the wished ones if it is
    a solution, and write its errors."""
    if row[STATUS - WIDTH] == Status.CONVERGED:
        one = _look(arm, model, options, 1.0, target, reference, row, deadline)
        if one[STATUS - WIDTH] == Status.CONVERGED:
            row[: arm.n] = one[: arm.n]
            for figure in (LIMITS_MASK, JOINT_DISTANCE):
                row[figure - WIDTH] = one[figure - WIDTH]
    measure_wishes(arm, options, target, reference, row)


def measure_wishes(
    arm: Arm, options: SolveOptions, target: np.ndarray, reference: np.ndarray, row: np.ndarray
) -> None:
    """Write the errors of the configuration of a row, those of the wished rows too."""
    one = _look(arm, arm.packed, options, 0.0, target, reference, row)
    for figure in ERRORS:
        row[figure - WIDTH] = one[figure - WIDTH]


def _look(
    arm: Arm, model: np.ndarray, options: SolveOptions, attempts: float, target: np.ndarray, reference: np.ndarray,
    row: np.ndarray, deadline: float = 0.0,
) -> np.ndarray:
    """Return the row of a solve with this many attempts from the configuration of a row; 0 measures that itself."""
    numbers, one = options.numbers.copy(), np.empty_like(row)
    numbers[ATTEMPTS_PLACE], numbers[DEADLINE_PLACE] = attempts, deadline
    if attempts == 0.0:  # or it is brought within the limits and the jump first
        numbers[[LIMITS_PLACE, JUMP_PLACE]] = 0.0
    solve_in_order(
        model, numbers, options.wished_mask, *arm.ordered_starts, target, row[: arm.n].copy(), reference,
        one.reshape(1, -1), NOTHING, NOTHING, NOTHING,
    )  # fmt: skip
    return one
