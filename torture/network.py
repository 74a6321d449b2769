"""Node and client on two hosts: two network namespaces of this machine, joined by a veth pair on which `tc netem` loses,
delays and cuts. UDP alone, because shared memory would go round the network. The client streams targets; after healing
the newest one must be solved. Nothing leaves the machine.
"""

from __future__ import annotations

import contextlib
import json
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
from torture.plan import Check, Plan, skipped, ticking, unless
from torture.running import RunningNode

SIDES = {'node': '10.99.99.1/30', 'client': '10.99.99.2/30'}
ENVIRONMENT = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
SECONDS = 10.0  # of one weather
WEATHER = {
    'a clear network': '',
    '10 % loss': 'loss 10%',
    '40 % loss': 'loss 40%',
    '100 ms delay, 30 ms jitter': 'delay 100ms 30ms',
    '20 % loss, 50 ms delay, doubles and reordering': 'loss 20% delay 50ms 20ms duplicate 5% reorder 20%',
}
PARTITIONS = (5.0, 30.0)  # s; after 20 s each side takes the other for gone and has to find it again
HEALED = 20.0  # s until the newest target must be answered


def run(plan: Plan) -> Iterator[Check]:
    """Try each weather and each partition."""
    if reason := no_namespaces():
        yield skipped('two network namespaces', reason)
        return
    with two_hosts() as hosts, node_in(hosts['node']) as node, Client(hosts['client']) as client:
        yield Check('found each other', f'{client.wait_for_answer():.1f} s', '')
        for name, netem in WEATHER.items():
            yield from in_weather(name, netem, plan, hosts, client)
        for seconds in PARTITIONS:
            yield cut(seconds, hosts, client)
        yield Check('the node after all this', 'runs', node.fault())


def no_namespaces() -> str:
    """Say why there can be no network namespaces, empty where there can."""
    if os.geteuid() != 0:
        return 'network namespaces need root'
    if not (shutil.which('ip') and shutil.which('tc')):
        return 'ip and tc are not installed (Debian, Ubuntu: iproute2)'
    tried = subprocess.run(['unshare', '--net', 'true'], capture_output=True, text=True)
    return tried.stderr.strip()


@contextlib.contextmanager
def two_hosts() -> Iterator[dict[str, str]]:
    """Make two namespaces with a cable between them; return their names."""
    hosts = {side: f'ros_ik_{side}_{os.getpid()}' for side in SIDES}
    try:
        for name in hosts.values():
            _ip('netns', 'add', name)
        first, second = hosts.values()
        _ip('link', 'add', 'cable', 'netns', first, 'type', 'veth', 'peer', 'name', 'cable', 'netns', second)
        for side, name in hosts.items():
            _ip('-n', name, 'addr', 'add', SIDES[side], 'dev', 'cable')
            for device in ('lo', 'cable'):
                _ip('-n', name, 'link', 'set', device, 'up')
            _ip('-n', name, 'route', 'add', '224.0.0.0/4', 'dev', 'cable')  # discovery is multicast
        yield hosts
    finally:
        for name in hosts.values():
            subprocess.run(['ip', 'netns', 'delete', name], capture_output=True)


def _ip(*words: str) -> None:
    subprocess.run(['ip', *words], check=True)


def set_weather(hosts: dict[str, str], netem: str) -> None:
    """Make both ends of the cable lose and delay; empty for a clear network."""
    for name in hosts.values():
        subprocess.run(['tc', '-n', name, 'qdisc', 'delete', 'dev', 'cable', 'root'], capture_output=True)
        if netem:
            command = ['tc', '-n', name, 'qdisc', 'add', 'dev', 'cable', 'root', 'netem', *netem.split()]
            subprocess.run(command, check=True)


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
    """The client on the other host: a process that streams, and tells for every target when it was answered."""

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


def in_weather(name: str, netem: str, plan: Plan, hosts: dict[str, str], client: Client) -> Iterator[Check]:
    """Stream in a weather, then under a clear sky: the newest target must be solved again."""
    set_weather(hosts, netem)
    sent = client.sent
    client.latencies.clear()
    for _ in ticking(plan.seconds(SECONDS), name):
        time.sleep(0.5)
    count, latencies = client.sent - sent, sorted(client.latencies)
    set_weather(hosts, '')
    back = client.wait_for_answer()
    middle = f', median {1e3 * latencies[len(latencies) // 2]:.0f} ms' if latencies else ''
    figure = f'{count} sent, {len(latencies)} solved{middle}; healed after {back:.1f} s'
    yield Check(name, figure, unless(back < HEALED, 'never again') or unless(not client.wrong, 'wrong or stale answers'))


def cut(seconds: float, hosts: dict[str, str], client: Client) -> Check:
    """Cut the cable for so long; the newest target must be solved after healing."""
    set_weather(hosts, 'loss 100%')
    for _ in ticking(seconds, 'partition'):
        time.sleep(0.5)
    lost = client.sent - client.answered
    set_weather(hosts, '')
    back = client.wait_for_answer()
    fault = unless(back < HEALED, 'never again') or unless(not client.wrong, 'wrong or stale answers')
    fault = fault or unless(lost > 0, 'the cut did not cut')
    return Check(f'partition of {seconds:g} s', f'newest target solved {back:.1f} s after healing', fault)
