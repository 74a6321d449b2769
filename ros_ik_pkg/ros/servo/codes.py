"""How the servo reports its state: one code and one sentence."""

from __future__ import annotations

import enum
import math
from typing import NamedTuple


class Code(enum.IntEnum):
    """Why the arm moves as it does; numbers and labels stay the same from release to release."""

    FOLLOWING = 0
    STANDING = 1
    SLOWED_SINGULARITY = 2
    HALTED_SINGULARITY = 3
    LEAVING_SINGULARITY = 4
    SLOWED_JOINT_LIMIT = 5
    HALTED_JOINT_LIMIT = 6
    SLOWED_CONTACT = 7
    HALTED_CONTACT = 8
    LEAVING_CONTACT = 9
    SLOWED_VELOCITY = 10
    SLOWED_ACCELERATION = 11
    HALTED_BLOCKED = 12
    COMMANDS_STOPPED = 13
    JOINT_STATES_STOPPED = 14
    PAUSED = 15
    REFUSED = 16
    WAITING = 17

    @property
    def label(self) -> str:
        """Lower-case word for messages and docs, such as 'slowed_singularity'."""
        return self.name.lower()

    @property
    def at_standstill(self) -> Code:
        """The code to report once the arm has been slowed down to a standstill."""
        return STANDSTILLS.get(self, self)

    @property
    def halted(self) -> bool:
        """Whether the arm stands or comes to rest although a command wants it to move."""
        return self in HALTS


STANDSTILLS = {
    Code.SLOWED_SINGULARITY: Code.HALTED_SINGULARITY,
    Code.SLOWED_JOINT_LIMIT: Code.HALTED_JOINT_LIMIT,
    Code.SLOWED_CONTACT: Code.HALTED_CONTACT,
}
HALTS = frozenset(code for code in Code if code.name.startswith('HALTED')) | {
    Code.COMMANDS_STOPPED, Code.JOINT_STATES_STOPPED, Code.PAUSED, Code.REFUSED, Code.WAITING,
}  # fmt: skip


class Finding(NamedTuple):
    """The result of one rule: the share of the velocity that it allows, its code, and the reason."""

    share: float
    code: Code
    text: str

    @property
    def sentence(self) -> str:
        """The whole sentence: `slowed to 30 %: ...`, `halted: ...`, or the text alone if nothing is held back."""
        if self.code.halted:
            return f'halted: {self.text}'
        return f'slowed to {100.0 * self.share:.2g} %: {self.text}' if self.share < 0.995 else self.text


FOLLOWING = Finding(math.inf, Code.FOLLOWING, 'follows the commands')


def strictest(findings: list[Finding]) -> Finding:
    """Return the finding with the smallest share, the first of several."""
    return min(findings, key=lambda finding: finding.share)
