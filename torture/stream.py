"""A stream of good targets beside joint states, at given rates, and what is wrong with what comes back."""

from __future__ import annotations

import time

import numpy as np

from torture.peer import Peer

JOINT_RATE = 1000.0  # Hz
SPREAD = 0.4  # rad around home
WAYPOINTS = 500


class Stream:
    """Targets of one peer, made beforehand so that sending is quick."""

    def __init__(self, peer: Peer, seed: int) -> None:
        self.peer = peer
        peer.spin(0.2)  # what is still on the way belongs to the stretch before
        peer.forget()
        random, arm = np.random.default_rng(seed), peer.arm
        self._joints = np.clip(arm.home + random.uniform(-SPREAD, SPREAD, (WAYPOINTS, arm.n)), arm.lower, arm.upper)
        self._poses = [peer.pose(q) for q in self._joints]
        self._seconds, self._joint_states = 0.0, 0
        self._which: dict[int, int] = {}  # waypoint by stamp

    def send(self) -> None:
        """Send the next target."""
        which = len(self._which) % WAYPOINTS
        self._which[self.peer.send(self._poses[which])] = which

    def go(self, rate: float, seconds: float) -> None:
        """Send at a rate [Hz] for so long, joint states at theirs; what comes in meanwhile is taken."""
        began, targets, joints = time.monotonic(), 0, 0
        while (elapsed := time.monotonic() - began) < seconds:
            if joints <= elapsed * JOINT_RATE:
                self.peer.send_joints(self._joints[len(self._which) % WAYPOINTS])
                joints += 1
            if targets <= elapsed * rate:
                self.send()
                targets += 1
            self.peer.spin(min(targets / rate, joints / JOINT_RATE) - (time.monotonic() - began))
            self.peer.spin_once()
        self._seconds += seconds
        self._joint_states += joints

    def counts(self) -> dict[str, int]:
        """Say how many were sent, and what became of them."""
        return {
            'targets': len(self._which),
            'solved': len(self.peer.solutions),
            'joint states': self._joint_states,
            'after a newer one': self.peer.stale(),
        }

    def figure(self) -> str:
        """Say the counts in words, with the rates that were reached."""
        counts, rates = self.counts(), ''
        if self._seconds:
            targets, joints = (counts[what] / self._seconds for what in ('targets', 'joint states'))
            rates = f' at {targets:.0f} Hz, joint states at {joints:.0f}'
        stale = counts['after a newer one']
        return f'{counts["targets"]} sent{rates}, {counts["solved"]} solved, {stale} after a newer one'

    def fault_at_end(self) -> str:
        """Wait for the last answer; say what is wrong: it, or a solution that is stale or misses its target."""
        last = max(self._which)
        self.peer.wait(lambda: last in self.peer.solutions or self.peer.outcomes.get(last, 'solved') != 'solved')
        if last not in self.peer.solutions:
            return f'the last target: {self.peer.outcomes.get(last, "no answer")}'
        wrong = [text for stamp in self.peer.solutions
                 if (text := self.peer.wrongness(stamp, self._joints[self._which[stamp]]))]  # fmt: skip
        if wrong:
            return f'{len(wrong)} wrong, such as {wrong[0]}'
        return f'{stale} answers after one to a newer target' if (stale := self.peer.stale()) else ''
