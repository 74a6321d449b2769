"""What goes wrong around a node: it is killed while targets stream, also in the middle of a solve, and started again;
the joint states stop; simulated time stands still, jumps back and leaps while targets have a timeout and steps a
velocity limit; disks are full, the installation is read-only, two first starts share one cache; locale, time zone and
hash seed differ. Locales that are not installed are made in a folder that is gone afterwards; mounts, in a mount
namespace of the node's own (root; `unshare`).
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from bench.process import ROOT
from ros_ik_pkg.ik import Arm, load_arm
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.tools.processes import ros_node
from torture.clock import clock_jumps
from torture.habitats import habitats
from torture.kills import killed
from torture.peer import Peer, connected
from torture.plan import Check, Plan, skipped, unless
from torture.running import RunningNode, running_node

SILENCE = 0.5  # s
# Mounts a small disk at $0, fills it except for $1 kB, and executes the node.
SMALL_DISK = (
    'mount -t tmpfs -o size=1m tmpfs "$0" || exit 9\n'
    'head -c "$((1024 - $1))k" /dev/zero > "$0/full" 2>/dev/null\n'
    'shift; exec "$@"'
)
READ_ONLY = 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && exec "$@"'


def run(plan: Plan) -> Iterator[Check]:
    """Try each fault once, the kill several times."""
    arm = load_arm('puma560')
    yield from killed(arm, plan)
    yield from silent_joint_states(arm)
    yield from clock_jumps(arm)
    yield from habitats(arm)
    yield from disks(arm)
    yield from first_starts(arm)


def silent_joint_states(arm: Arm) -> Iterator[Check]:
    """Stop the joint states, and start them again from another publisher."""
    levels: list[DiagnosticStatus] = []
    with running_node('-p', f'diagnostics.joint_states_silence:={SILENCE}') as node, connected(arm) as peer:
        topic = topics.DIAGNOSTICS
        peer.node.create_subscription(DiagnosticArray, topic.name, lambda m: levels.append(m.status[0]), topic.qos)
        told = peer.wait(lambda: any('no joint states for' in level.message for level in levels))
        yield Check('joint states stop', 'WARN in /diagnostics', unless(told, 'no word of it') or node.fault())
        stamp = peer.send(peer.pose(arm.home))
        fault = unless(peer.wait(lambda: stamp in peer.solutions), 'the last ones no longer count')
        yield Check('a target meanwhile', 'solved from the last ones', fault)
        peer.node.destroy_publisher(peer.joint_states)
        peer.joint_states = peer.publisher(topics.JOINT_STATES)
        fault = peer.fault(arm.home + 0.1)
        levels.clear()
        well = peer.wait(lambda: peer.send_joints(arm.home) or any(level.level == b'\0' for level in levels))
        yield Check('they return', 'OK in /diagnostics', fault or unless(well, 'still a warning'))


def disks(arm: Arm) -> Iterator[Check]:
    """Start on full disks and on a read-only installation."""
    names = ('log disk full', 'installation read-only')
    if reason := no_mounts():
        yield from (skipped(name, reason) for name in names)
        return
    with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as folder:
        yield Check(names[0], 'solved', started(arm, (SMALL_DISK, folder, '0'), ROS_LOG_DIR=folder))
    yield Check(names[1], 'solved', started(arm, (READ_ONLY, str(ROOT))))


def first_starts(arm: Arm) -> Iterator[Check]:
    """Compile with a cache disk that is full or too small, and twice at once into one cache; minutes of CPU."""
    for room, name in ((0, 'cache disk full'), (400, 'cache disk full while compiling')):
        if reason := no_mounts():
            yield skipped(name, reason)
            continue
        with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as folder:
            said: list[str] = []
            fault = started(arm, (SMALL_DISK, folder, str(room)), said.append, NUMBA_CACHE_DIR=folder)
            yield Check(name, 'solved, compiled in memory', fault or unless('memory' in said[0], 'does not say so'))
    with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as cache:
        yield two_at_once(arm, cache)


def two_at_once(arm: Arm, cache: str) -> Check:
    """Start two nodes with one empty cache at once, then a third one with the filled cache."""
    with contextlib.ExitStack() as stack:
        nodes = [stack.enter_context(unready_node(f'arm{k}', cache)) for k in range(2)]
        seconds = max([node.wait_until_ready() for node in nodes])
        fault = ''.join(answer(arm, f'arm{k}') for k in range(2)) or ''.join(node.fault() for node in nodes)
        third = stack.enter_context(unready_node('arm2', cache))
        again = third.wait_until_ready()
        fault = fault or answer(arm, 'arm2')
    slow = unless(again < seconds / 2, 'the third one compiled again')
    return Check('two first starts, one cache', f'{seconds:.0f} s, a third one {again:.1f} s', fault or slow)


def answer(arm: Arm, namespace: str) -> str:
    """Return the fault of a result in a namespace."""
    with ros_node('torture') as own:
        return Peer(own, arm, namespace).fault(arm.home + 0.1)


@contextlib.contextmanager
def unready_node(namespace: str, cache: str) -> Iterator[RunningNode]:
    """Start a node with a separate cache, and stop it at the end."""
    with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as folder:
        node = RunningNode(Path(folder, 'log'), ('-r', f'__ns:=/{namespace}'), NUMBA_CACHE_DIR=cache)
        try:
            yield node
        finally:
            node.stop()


def started(arm: Arm, mount: tuple[str, ...], say: Callable[[str], object] = str, **environment: str) -> str:
    """Start a node with a private mount and send it a target; return the fault, and pass its log to `say`."""
    with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as folder:
        before = ('unshare', '--mount', 'sh', '-c', *mount)
        node = RunningNode(Path(folder, 'log'), before=before, **environment)
        try:
            node.wait_until_ready()
            fault = answer(arm, '') or node.fault()
        except RuntimeError as error:
            fault = str(error)
        finally:
            node.stop()
        say(node.said())
        return fault


def no_mounts() -> str:
    """Return why this process cannot mount; empty if it can."""
    if os.geteuid() != 0:
        return 'mounts need root'
    return '' if shutil.which('unshare') else 'there is no unshare'
