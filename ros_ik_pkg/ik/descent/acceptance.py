"""The conditions that make a configuration a solution, for searches and self-motion.

Joint limits are not checked again: every function that moves work.q keeps them (`limits.py`, `descent.update`).
"""

from __future__ import annotations

from ros_ik_pkg.ik.collision.obstruction import touches
from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kinematics.task import within_tolerances

ACCEPTED, BEYOND_JUMP, BEYOND_TOLERANCE, TOUCHING = range(4)


@inlined
def judge(tuning, preferences, position_error, orientation_error, q):
    """Return ACCEPTED if q, with these errors [m, rad], is a solution, else the first condition that it violates.

    The cheapest condition comes first; one that costs more than forward kinematics belongs at the end.
    """
    if not within_tolerances(position_error, orientation_error, tuning):
        return BEYOND_TOLERANCE
    if tuning.max_joint_jump > 0.0:
        for i in range(len(q)):
            if abs(q[i] - preferences.reference[i]) > tuning.max_joint_jump:
                return BEYOND_JUMP
    return TOUCHING if touches(preferences.obstruction, tuning.collision_margin, q) else ACCEPTED
