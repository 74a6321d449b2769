"""When the target is sent: one at a time, and again, ever more rarely, if no answer comes."""

from __future__ import annotations

import time

from ros_ik_pkg.panel.answers import Answers

PATIENCE = 1.0  # s for an answer; then the target is sent again
MOST_PATIENCE = 16.0  # s, if it does not come again and again


class Asking:
    """Decides, tick by tick, whether the target is due."""

    def __init__(self) -> None:
        self._dirty = self._seed_changed = False
        self._patience = PATIENCE
        self._sent = 0.0  # time of the last target

    @property
    def waiting(self) -> bool:
        """Whether there is something that the node has not been asked yet."""
        return self._dirty

    def ask_again(self, seed_changed: bool = False) -> None:
        """Have the target sent; if the seed changed, a tick later, so that the seed arrives before it."""
        self._dirty, self._seed_changed = True, self._seed_changed or seed_changed

    def due(self, answers: Answers, compares: bool) -> bool:
        """Return whether the target is to be sent now, and take it as sent."""
        waited = time.monotonic() - self._sent
        silent = waited > self._patience and not answers.result
        if silent or (answers.passing and waited > PATIENCE):
            self._dirty = True  # the seed may have come too late, or the first messages before discovery
        done = answers.result and (answers.compared or answers.refused or not compares)
        if self._seed_changed:
            self._seed_changed = False
            return False
        if not (self._dirty and (done or waited > PATIENCE)):
            return False
        # A slow node would never be heard if it were asked again and again before it answers.
        again = silent and self._sent > 0.0
        self._patience = min(2.0 * self._patience, MOST_PATIENCE) if again else PATIENCE
        self._dirty, self._sent = False, time.monotonic()
        return True
