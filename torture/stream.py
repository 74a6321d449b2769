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
        random = np.random.default_rng(seed)
        arm = peer.arm
        self._joints = np.clip(arm.home + random.uniform(-SPREAD, SPREAD, (WAYPOINTS, arm.n)), arm.lower, arm.upper)
        self._poses = [peer.pose(q) for q in self._joints]
        self._count, self._seconds, self._joint_states = 0, 0.0, 0
        self._which: dict[int, int] = {}  # waypoint by stamp

    def send(self) -> None:
        """Send the next target."""
        which = self._count % WAYPOINTS
        self._which[self.peer.send(self._poses[which])] = which
        self._count += 1

    def go(self, rate: float, seconds: float) -> None:
        """Send at a rate [Hz] for so long, joint states at theirs; what came in between is taken."""
        began = time.monotonic()
        targets = joints = 0
        while (elapsed := time.monotonic() - began) < seconds:
            if joints <= elapsed * JOINT_RATE:
                self.peer.send_joints(self._joints[self._count % WAYPOINTS])
                joints += 1
            if targets <= elapsed * rate:
                self.send()
                targets += 1
            self.peer.spin(max(0.0, min(targets / rate, joints / JOINT_RATE) - (time.monotonic() - began)))
            self.peer.spin_once()
        self._seconds += seconds
        self._joint_states += joints

    def figure(self) -> str:
        """Wait for the last answer, and say what was sent and what came back."""
        self.peer.wait(lambda: max(self._which) in self.peer.outcomes)
        solved = len(self.peer.solutions)
        rates = ''
        if self._seconds:
            targets, joints = (count / self._seconds for count in (self._count, self._joint_states))
            rates = f' at {targets:.0f} Hz, joint states at {joints:.0f}'
        return f'{self._count} sent{rates}, {solved} solved, {self.peer.stale()} after a newer one'

    def fault(self) -> str:
        """Say what is wrong: a solution that is stale or misses its target, or no answer to the last one."""
        wrong = [text for stamp, which in self._which.items() if stamp in self.peer.solutions
                 and (text := self.peer.wrongness(stamp, self._joints[which]))]  # fmt: skip
        if wrong:
            return f'{len(wrong)} wrong, such as {wrong[0]}'
        if self.peer.stale():
            return f'{self.peer.stale()} answers after one to a newer target'
        last = max(self._which)
        return '' if last in self.peer.solutions else f'the last target: {self.peer.outcomes.get(last, "no answer")}'
