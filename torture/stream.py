"""Results for a stream of good targets, and their faults."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ros_ik_pkg.ros.handling.result import SOLVED
from torture.peer import TIMEOUT, TOLERANCE, Peer
from torture.plan import watching
from torture.sending import JOINT_RATE, Sender, Sent
from torture.waypoints import client_of, sent_at, waypoints, which_of

STEP = 0.1  # s between checks of the senders


class Stream:
    """The results of a peer's node for targets of all senders, or only of `client`."""

    def __init__(self, peer: Peer, seed: int, client: int | None = None) -> None:
        self._peer, self._client = peer, client
        self._joints = waypoints(peer.arm, seed)
        peer.spin(0.2)  # messages still in transit belong to the previous run
        self.solutions: dict[int, tuple[Sequence[str], Sequence[float]]] = {}  # names and positions by stamp
        self.arrived: dict[int, float] = {}  # time [s] of a solution
        self.results: list[int] = []  # stamps in the order of the results
        self.outcomes: dict[int, str] = {}
        peer.on_others = self

    def solution(self, stamp: int, names: Sequence[str], positions: Sequence[float], arrived: float) -> None:
        """Note a solution."""
        self.solutions[stamp], self.arrived[stamp] = (names, positions), arrived

    def result(self, stamp: int, outcome: str) -> None:
        """Note a result."""
        self.results.append(stamp)
        self.outcomes[stamp] = outcome

    def go(
        self, senders: Sequence[Sender], text: str, rate: float, seconds: float, joint_rate: float = JOINT_RATE
    ) -> list[Sent]:
        """Let several senders send at the same time and handle the results; return what each has sent."""
        for sender in senders:
            sender.begin(rate, seconds, joint_rate)
        for _ in watching(seconds, text, lambda: all(sender.finished() for sender in senders)):
            self._peer.spin(STEP)
        return [sender.end() for sender in senders]

    def latency(self, percent: float) -> float:
        """Return the percentile of the times from sending a target to its solution [s], infinite if there is none."""
        times = [arrived - sent_at(stamp) for stamp, arrived in self.arrived.items()]
        return float(np.percentile(times, percent)) if times else float('inf')

    def solved(self, client: int | None = None) -> int:
        """Return how many targets were solved, of all or of one client."""
        return sum(client is None or client_of(stamp) == client for stamp in self.solutions)

    def stale(self) -> int:
        """Return the number of results that came after one for a newer target of the same client."""
        newest: dict[int, int] = {}
        late = 0
        for stamp in self.results:
            late += stamp <= newest.get(client_of(stamp), -1)
            newest[client_of(stamp)] = max(stamp, newest.get(client_of(stamp), -1))
        return late

    def figure(self, sent: Sent) -> str:
        """Return a summary of the sent targets and their results."""
        over = 100.0 * (1.0 - len(self.results) / max(sent.targets, 1))
        return (
            f'{sent.figure()}, {self.solved()} solved, {max(over, 0.0):.0f} % passed over, '
            f'{self.stale()} after a newer one'
        )

    def fault_at_end(self, last: int, timeout: float = TIMEOUT) -> str:
        """Wait for the result of the last target; return the fault of it or any other."""
        self._peer.wait(lambda: last in self.outcomes, timeout)
        self._peer.wait(lambda: last in self.solutions or self.outcomes.get(last) != SOLVED, timeout)
        if last not in self.solutions:
            return f'the last target: {self.outcomes.get(last, "no answer")}'
        if foreign := [stamp for stamp in self.results if self._client not in (None, client_of(stamp))]:
            return f"{len(foreign)} answers to another's target, such as of client {client_of(foreign[0])}"
        return self._wrong() or (f'{stale} answers after one to a newer target' if (stale := self.stale()) else '')

    def _wrong(self) -> str:
        """Say how many solutions miss their targets, judged by Pinocchio."""
        named = self._peer.arm.joint_names
        if odd := [names for names, _ in self.solutions.values() if tuple(names) != named]:
            return f'{len(odd)} solutions for other joints, such as {odd[0]}'
        judge, which = self._peer.judge, [which_of(stamp) for stamp in self.solutions]
        positions = np.array([positions for _, positions in self.solutions.values()])
        right = judge.solved(judge.forward(self._joints)[which], positions, TOLERANCE)
        first = int(np.argmin(right))
        return '' if right.all() else f'{np.sum(~right)} wrong, such as {positions[first].tolist()} for {which[first]}'
