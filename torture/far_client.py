"""The client of the network section, on a host of its own: streams targets until its input is closed, and prints a line
of JSON ten times a second: how many were sent, the newest that was solved, wrong or stale answers, latencies [s].
"""

from __future__ import annotations

import json
import sys
import threading
from typing import Any

import numpy as np

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.tools.processes import ros_node
from torture.peer import Peer

RATE = 50.0  # Hz
TELL = 5  # targets between two lines
SPREAD = 0.3  # rad
WAYPOINTS = 100


def main() -> None:
    """Stream until the other side closes our input."""
    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    with ros_node('far_client') as node:
        client = FarClient(Peer(node, load_arm('puma560')))
        while not over.is_set():
            client.send()
            if len(client.sent) % TELL == 0:
                print(json.dumps(client.news()), flush=True)


class FarClient:
    """Sends numbered targets and checks the results."""

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self.sent: dict[int, int] = {}  # number of a target by its stamp
        self._answered, self._wrong = -1, 0

    def send(self) -> None:
        """Send the next target, and receive messages until the next period."""
        number = len(self.sent)
        self.sent[self._peer.send(self._peer.pose(self._joints(number)))] = number
        self._peer.spin(1.0 / RATE)

    def _joints(self, number: int) -> np.ndarray:
        return self._peer.arm.home + SPREAD * (number % WAYPOINTS) / WAYPOINTS

    def news(self) -> dict[str, Any]:
        """Check the new results: right, and newer than all earlier ones."""
        latencies = [round(float(latency), 4) for latency in self._peer.latencies()]
        for stamp in self._peer.solutions:
            number = self.sent[stamp]
            fault = self._peer.wrongness(stamp, self._joints(number))
            self._wrong += bool(fault) or number <= self._answered
            self._answered = max(self._answered, number)
        self._peer.solutions.clear()
        self._peer.arrived.clear()
        return {'sent': len(self.sent), 'answered': self._answered, 'wrong': self._wrong, 'latencies': latencies}


if __name__ == '__main__':
    main()
