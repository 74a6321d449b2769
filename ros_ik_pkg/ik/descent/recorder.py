"""Records the iterates of a descent if a trace is asked for."""

from __future__ import annotations

import math

from ros_ik_pkg.ik.kernel.compiled import kernel
from ros_ik_pkg.ik.kernel.data_layout import TRACE_WIDTH
from ros_ik_pkg.ik.kernel.linalg import ROWS, assign, svd
from ros_ik_pkg.ik.solution import TRACE_COLUMNS
from ros_ik_pkg.ik.step.limits import count_at_limits

ATTEMPT, ITERATION, POSITION, ORIENTATION, NORM, STEP, DAMPING, SIGMA_MIN, CONDITION, MANIPULABILITY, AT_LIMITS = range(
    TRACE_WIDTH
)
assert TRACE_COLUMNS[STEP] == 'step_norm' and TRACE_COLUMNS[AT_LIMITS] == 'joints_at_limits'


@kernel
def record(recorder, geometry, attempt, iteration, position_error, orientation_error, norm, p, work):
    """Append the iterate in work.q if there is room; work.columns holds its Jacobian."""
    k = recorder.written[0]
    recorder.written[0] = k + 1
    if k >= len(recorder.rows):
        return
    n = len(work.q)
    row = recorder.rows[k]
    row[ATTEMPT], row[ITERATION] = attempt, iteration
    row[POSITION], row[ORIENTATION], row[NORM] = position_error, orientation_error, norm
    row[STEP], row[DAMPING] = 0.0, 0.0
    row[SIGMA_MIN], row[CONDITION], row[MANIPULABILITY] = singular_figures(work.columns, work.weights, recorder)
    row[AT_LIMITS] = count_at_limits(geometry, work.q)
    assign(row[TRACE_WIDTH : TRACE_WIDTH + n], work.q)
    row[TRACE_WIDTH + n], row[TRACE_WIDTH + n + 1], row[TRACE_WIDTH + n + 2] = p


@kernel
def record_step(recorder, damping, step):
    """Complete the last row by the step taken from it."""
    k = recorder.written[0] - 1
    if not 0 <= k < len(recorder.rows):
        return
    square = 0.0
    for i in range(len(step)):
        square += step[i] * step[i]
    recorder.rows[k, STEP] = math.sqrt(square)
    recorder.rows[k, DAMPING] = damping


@kernel
def singular_figures(columns, weights, scratch):
    """Return sigma_min, sigma_max / sigma_min and the product of the singular values, over the min(m, n) that count.

    m is the number of rows that the task has; m = n = 6 gives Yoshikawa's sqrt(det(J J^T)) (1985).
    """
    svd(columns, scratch.U, scratch.W, scratch.sigma)
    rows = 0
    for r in range(ROWS):
        rows += weights[r] > 0.0
    count = max(1, min(rows, len(columns)))
    product = 1.0
    for r in range(count):
        product *= scratch.sigma[r]
    smallest = scratch.sigma[count - 1]
    return smallest, scratch.sigma[0] / smallest if smallest > 0.0 else math.inf, product
