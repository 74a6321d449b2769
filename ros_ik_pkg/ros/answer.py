"""What becomes of one target: an answer with an outcome and a reason, or a refusal on the way there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import PoseStamped

from ros_ik_pkg.ik import Arm, Solution

SOLVED, FAILED, REFUSED = 'solved', 'failed', 'refused'
INTERNAL_ERROR = 'internal_error'


class RefusedError(Exception):
    """A target cannot be solved as it stands; `cause` is one word for counters, the text says why."""

    def __init__(self, cause: str, text: str) -> None:
        super().__init__(text)
        self.cause = cause


@dataclass(frozen=True)
class Answer:
    """What the node has to say about one target.

    `cause` is one word: the label of the solver's status, the cause of a refusal, or INTERNAL_ERROR.
    What was solved is `base_from_target` (4, 4) from `seed` (n,). Fields are None where the target did not
    get that far.
    """

    target: PoseStamped
    outcome: str
    cause: str
    reason: str
    method: str
    arm: Arm | None = None
    solution: Solution | None = None
    notes: tuple[str, ...] = ()
    base_from_target: np.ndarray | None = None
    seed: np.ndarray | None = None


def shorten(text: str, limit: int = 300) -> str:
    """Cut a text from outside so that it cannot fill a log or a message."""
    return text if len(text) <= limit else f'{text[:limit]}... ({len(text)} characters)'
