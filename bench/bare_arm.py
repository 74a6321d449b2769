"""Arms without shapes, for measurements beside solvers that know nothing of contact."""

from __future__ import annotations

import os
from dataclasses import replace

from ros_ik_pkg.ik import Arm, load_arm


def bare_arm(source: str | os.PathLike[str], base: str | None = None, tip: str | None = None) -> Arm:
    """Load an arm and leave out its shapes, so that its solutions are not checked for contact."""
    arm = load_arm(source, base, tip)
    return replace(arm, tree=replace(arm.tree, shapes={}))
