"""Node and client on two hosts: two network namespaces of this machine, connected by a cable that loses, delays and
cuts (`torture/cable.py`). UDP only, because shared memory would bypass the network. The client streams targets.
Frames must really be lost and delayed, some targets must be solved all the same, and the newest one after the cable
is restored. No frame leaves the machine.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from bench.process import ROOT
from torture.cable import CLEAR, CUT, Cable, Weather, cable_between
from torture.far_client import RATE
from torture.plan import Check, Plan, skipped, ticking, unless
from torture.running import RunningNode

NODE, CLIENT = f'ros_ik_node_{os.getpid()}', f'ros_ik_client_{os.getpid()}'
ADDRESSES = {NODE: '10.99.99.1/30', CLIENT: '10.99.99.2/30'}
ENVIRONMENT = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
SECONDS = 10.0  # of one weather
WEATHER = {
    'a clear network': CLEAR,
    '10 % loss': Weather(loss=0.1),
    '40 % loss': Weather(loss=0.4),
    '100 ms delay': Weather(delay=0.1),
    '20 % loss, 50 ms delay, 40 ms jitter, 5 % doubled': Weather(loss=0.2, delay=0.05, jitter=0.04, doubled=0.05),
}
LEAST, MOST = 0.5, 2.0  # times the frames that should be lost
PARTITIONS = (5.0, 30.0)  # s; after 20 s each side takes the other for gone and has to find it again
HEALED = 20.0  # s until the newest target must be answered


def run(plan: Plan) -> Iterator[Check]:
    """Try each weather and each partition."""
    if reason := no_namespaces():
        yield skipped('two network namespaces', reason)
        return
    with cable_between(ADDRESSES, plan.seed) as cable, node_in(NODE) as node, Client(CLIENT) as client:
        found = client.wait_for_answer()
        yield Check('found each other', f'{found:.1f} s', unless(found < HEALED, 'never'))
        for name, weather in WEATHER.items():
            yield in_weather(name, weather, plan, cable, client)
        for seconds in PARTITIONS:
            yield cut(seconds, cable, client)
        yield Check('the node after all this', 'runs', node.fault())


def no_namespaces() -> str:
    """Return why network namespaces are unavailable; empty if they are available."""
    if os.geteuid() != 0:
        return 'network namespaces need root'
    if not shutil.which('ip'):
        return 'ip is not installed (Debian, Ubuntu: iproute2)'
    if not os.path.exists('/dev/net/tun'):
        return 'the kernel has no TUN/TAP'
    tried = subprocess.run(['unshare', '--net', 'true'], capture_output=True, text=True)
    return tried.stderr.strip()


@contextlib.contextmanager
def node_in(host: str) -> Iterator[RunningNode]:
    """Run a node on a host."""
    with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as folder:
        words = ('-p', 'seed_source:=home')
        node = RunningNode(Path(folder, 'log'), words, before=('ip', 'netns', 'exec', host), **ENVIRONMENT)
        try:
            node.wait_until_ready()
            yield node
        finally:
            node.stop()


class Client:
    """The client on the other host: a process that streams targets and reports when each was answered."""

    def __init__(self, host: str) -> None:
        self.sent, self.answered, self.wrong = 0, -1, 0
        self.latencies: list[float] = []
        self._process = subprocess.Popen(
            ['ip', 'netns', 'exec', host, sys.executable, '-m', 'torture.far_client'], cwd=ROOT,
            env={**os.environ, **ENVIRONMENT, 'PYTHONPATH': str(ROOT)}, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.stdin.close()
        self._process.wait()
        self._reader.join()

    def _read(self) -> None:
        for line in self._process.stdout:
            told = json.loads(line)
            self.sent, self.answered, self.wrong = told['sent'], told['answered'], told['wrong']
            self.latencies += told['latencies']

    def wait_for_answer(self, timeout: float = HEALED) -> float:
        """Wait until a target that is sent from now on is answered; return the seconds, or infinity."""
        began, since = time.monotonic(), self.sent
        while self.answered <= since:
            if time.monotonic() > began + timeout:
                return float('inf')
            time.sleep(0.05)
        return time.monotonic() - began


def in_weather(name: str, weather: Weather, plan: Plan, cable: Cable, client: Client) -> Check:
    """Stream in a weather, then under a clear sky: the newest target must be solved again."""
    cable.weather, sent, taken, lost = weather, client.sent, cable.taken, cable.lost
    client.latencies.clear()
    for _ in ticking(plan.seconds(SECONDS), name):
        time.sleep(0.5)
    count, latencies = client.sent - sent, sorted(client.latencies)
    share = (cable.lost - lost) / max(cable.taken - taken, 1)
    median = latencies[len(latencies) // 2] if latencies else math.inf
    back, fault = heal(cable, client)
    figure = (
        f'{100.0 * share:.0f} % of {cable.taken - taken} frames lost; {count} sent, {len(latencies)} solved, '
        f'median {1e3 * median:.0f} ms; healed after {back:.1f} s'
    )
    return Check(name, figure, fault or not_tried(weather, share, median, count))


def not_tried(weather: Weather, share: float, median: float, count: int) -> str:
    """Return why a run is void: frames were not lost or delayed as configured, or nothing was sent or solved."""
    if not count or median == math.inf:
        return f'{count} sent, none solved'
    if not LEAST * weather.loss <= share <= MOST * weather.loss:
        return f'{share:.3f} of the frames lost instead of {weather.loss:g}'
    there_and_back = 2.0 * (weather.delay - weather.jitter)
    return unless(median >= there_and_back, f'a median of {median:.3f} s, quicker than the delay')


def cut(seconds: float, cable: Cable, client: Client) -> Check:
    """Cut the cable for a time [s]; the newest target must be solved after healing."""
    cable.weather = CUT
    for _ in ticking(seconds, 'partition'):
        time.sleep(0.5)
    lost = client.sent - client.answered
    back, fault = heal(cable, client)
    fault = fault or unless(lost > RATE * seconds / 2, 'the cut did not cut')
    return Check(f'partition of {seconds:g} s', f'newest target solved {back:.1f} s after healing', fault)


def heal(cable: Cable, client: Client) -> tuple[float, str]:
    """Restore the cable; return the time [s] until a new target is solved, and the fault."""
    cable.weather = CLEAR
    back = client.wait_for_answer()
    wrong = unless(not client.wrong, f'{client.wrong} wrong or stale answers')
    return back, unless(back < HEALED, 'never again') or wrong
