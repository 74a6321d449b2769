"""The client of the network section, on a host of its own: streams targets until its input is closed, and prints a line
of JSON ten times a second: how many were sent, the newest that was solved, wrong or stale answers, latencies [s].
"""

from __future__ import annotations

import json
import sys
import threading

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.tools.processes import ros_node
from torture.peer import Peer

RATE = 50.0  # Hz
TELL = 5  # targets between two lines
SPREAD = 0.3  # rad


def main() -> None:
    """Stream until the other side closes our input."""
    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    arm = load_arm('puma560')
    with ros_node('far_client') as node:
        peer, sent, waypoints = Peer(node, arm), 0, {}
        while not over.is_set():
            q = arm.home + SPREAD * (sent % 100) / 100
            waypoints[peer.send(peer.pose(q))] = q, sent
            sent += 1
            peer.spin(1.0 / RATE)
            if sent % TELL == 0:
                print(json.dumps({'sent': sent, **told(peer, waypoints)}), flush=True)


def told(peer: Peer, waypoints: dict) -> dict:
    """Judge what came since the last line, and forget it but for the newest."""
    solved = [stamp for stamp in peer.solutions if stamp in waypoints]
    wrong = sum(bool(peer.wrongness(stamp, waypoints[stamp][0])) for stamp in solved)
    newest = max((waypoints[stamp][1] for stamp in solved), default=-1)
    latencies = [round(float(latency), 4) for latency in peer.latencies()]
    told.wrong = getattr(told, 'wrong', 0) + wrong
    return {'answered': newest, 'wrong': told.wrong, 'latencies': latencies}


if __name__ == '__main__':
    main()
