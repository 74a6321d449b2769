"""Joint weights in a step: it is the shortest in the norm sqrt(sum (w_i dq_i)^2), by which solutions are ranked too.

With W = diag(w^2), dq = W^-1 J^T (J W^-1 J^T + lambda^2 I)^-1 e (Whitney 1969). This is the unweighted step dq' of the
Jacobian J S with S = W^-1/2, and dq = S dq', so no method needs a formula of its own.
"""

from __future__ import annotations

from ros_ik_pkg.ik.kernel.compiled import inlined, kernel

MOST_RATIO = 30.0  # between two weights in a step; with more, damping stops the heavier joint even if it must move


@kernel
def scale_joints(weights, scales):
    """Write the diagonal of S, scaled to 1 for the smallest weight because only ratios count."""
    heaviest = 0.0
    for i in range(len(scales)):
        heaviest = max(heaviest, weights[i])
    lightest = heaviest
    for i in range(len(scales)):
        lightest = min(lightest, max(weights[i], heaviest / MOST_RATIO))
    for i in range(len(scales)):
        scales[i] = lightest / max(weights[i], lightest) if heaviest > 0.0 else 1.0


@inlined
def weigh(work):
    """Replace the Jacobian J by J S."""
    if len(work.scales) > 0:
        scale_columns(work.scales, work.columns)


@kernel
def scale_columns(scales, columns):
    """Multiply each column of a Jacobian by its scale."""
    for i in range(len(columns)):
        for r in range(columns.shape[1]):
            columns[i, r] *= scales[i]


@inlined
def take_back_weights(work):
    """Replace the step dq' of J S by dq = S dq'."""
    if len(work.scales) > 0:
        scale_step(work.scales, work.dq)


@kernel
def scale_step(scales, dq):
    """Multiply each component of a step by its scale."""
    for i in range(len(dq)):
        dq[i] *= scales[i]
