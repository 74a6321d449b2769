"""Which methods' descents pass through configurations in which the robot touches itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ros_ik_pkg.compare.runs import MethodRun
from ros_ik_pkg.ik import Arm


def contact_lines(arm: Arm, runs: Sequence[MethodRun]) -> list[str]:
    """Return a sentence for each run that touches, with the first iterate that does and its links, by coal."""
    if not arm.shaped:
        return []
    room, lines = arm.contacts.room(), []
    for run in runs:
        positions = run.iterates.joint_positions
        touching = np.flatnonzero(~room.clear(positions))
        if len(touching):
            links = ' and '.join(room.look(positions[touching[0]]).links)
            last = len(positions) - 1 in touching
            lines.append(
                f'{run.method}: {links} touch at iteration {touching[0]}; {len(touching)} of {len(positions)} iterates '
                f'touch, {"the last one too" if last else "not the last one"}'
            )
    return lines
