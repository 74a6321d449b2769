"""Round trips over ROS, from a target to its answer: the IK node and a node that only echoes, in turns."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import IO

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from tqdm import tqdm

from bench.cases import make_case
from bench.process import ROOT
from ros_ik_pkg.ik import Arm, load_arm
from ros_ik_pkg.ros.client import NodeError
from ros_ik_pkg.ros.interface import topics
from ros_ik_pkg.ros.runtime.spin import make_executor
from ros_ik_pkg.tools import processes
from ros_ik_pkg.tools.domain import own_domain
from ros_ik_pkg.tools.processes import ros_node
from ros_ik_pkg.tools.send_target import pose_message

ROS_HEAD = ['listeners', 'targets a second', 'node', 'p50 us', 'p99 us', 'p50 over echo', 'answered %', 'newest lost']
START_HEAD = ['started', 'compiled code', 's to ready', 's to first answer', 'processor s']
START_TEXT = (
    'From the start of the process to its log line `ready`, and to the answer to a target that is sent every 20 ms: '
    'the median of several starts. Below, one start with nothing compiled, of the node and of `scripts/demo`, which '
    'starts a node and sends it a target. Processor seconds are those of all processes that were started, until the '
    "answer. Python's bytecode is kept, as it is by default."
)
READY = b'ready: '  # in the log of the node
SOLVED = b'the first target is solved'  # in the output of the demonstration
SIDES = ('echo', 'ik')  # namespaces of the two nodes
RATES = (100, 1000)  # Hz
SECONDS = 1.0  # of one stretch: short, so that both nodes see the same moods of the machine
ROUNDS = 10
STARTS = 3
PATIENCE = 1.0  # s that the last answer of a stretch may take
ASK_AGAIN = 0.02  # s from a target to the next while a node does not answer yet
TIMEOUT = 120.0  # s for a node to answer at all
LISTENERS: dict[str, tuple[str, ...]] = {
    'none': (),
    'result': ('~/result',),
    'all': ('~/result', '~/iterations', '~/trace', '~/tcp_path'),
}


class Side:
    """A node under measurement as its client sees it."""

    def __init__(self, node: Node, name: str, poses: list[PoseStamped]) -> None:
        self.name, self._poses = name, poses
        self._arrived: dict[tuple[int, int], float] = {}
        self._stretch = 0
        topic, answers, full_name = topics.TARGET_POSE, topics.SOLUTION, f'/{name}/{topics.NODE_NAME}'
        self._targets = node.create_publisher(topic.type, topic.of(full_name), topic.qos)
        node.create_subscription(answers.type, answers.of(full_name), self._on_answer, answers.qos)

    def _on_answer(self, message: JointState) -> None:
        stamp = message.header.stamp
        self._arrived[stamp.sec, stamp.nanosec] = time.perf_counter()

    def stretch(self, spin: Callable[[float], None], rate: float, count: int) -> np.ndarray:
        """Send targets at a rate; return the round trip of each [s], NaN if it was dropped."""
        self._stretch += 1
        self._arrived.clear()
        sent, begin = np.empty(count), time.perf_counter()
        for k in range(count):
            pose = self._poses[k % len(self._poses)]
            pose.header.stamp.sec, pose.header.stamp.nanosec = self._stretch, k
            while (left := begin + k / rate - time.perf_counter()) > 0.0:
                spin(left)
            sent[k] = time.perf_counter()
            self._targets.publish(pose)
        last = self._stretch, count - 1
        while last not in self._arrived and time.perf_counter() < sent[-1] + PATIENCE:
            spin(0.01)
        arrived = np.array([self._arrived.get((self._stretch, k), np.nan) for k in range(count)])
        return arrived - sent

    def wait(self, spin: Callable[[float], None]) -> None:
        """Send a target every ASK_AGAIN until one is answered."""
        self._stretch += 1
        self._arrived.clear()
        pose, asked, began = self._poses[0], (self._stretch, 0), time.perf_counter()
        pose.header.stamp.sec, pose.header.stamp.nanosec = asked
        while asked not in self._arrived:
            now = time.perf_counter()
            if now > began + TIMEOUT:
                raise NodeError(f'{self.name} did not answer within {TIMEOUT:g} s')
            self._targets.publish(pose)
            while asked not in self._arrived and (left := now + ASK_AGAIN - time.perf_counter()) > 0.0:
                spin(left)


def ros_rows(robot: str) -> Iterator[tuple[str, str, list[list[str]]]]:
    """Measure round trips and starts; yield title, text and table of each."""
    arm = load_arm(robot)
    with own_domain(), ros_node('bench') as node:
        executor = make_executor()
        executor.add_node(node)
        sides = [Side(node, name, poses_of(arm)) for name in SIDES]
        with contextlib.ExitStack() as nodes:
            for side in sides:
                nodes.enter_context(running(command_of(side.name, arm, robot), side.name))
            for side in sides:
                side.wait(executor.spin_once)
            rows = [row for name in LISTENERS for row in _measure(name, sides, executor.spin_once)]
            yield 'Round trip over ROS', f'{arm.name}, a closed path, targets from another process.', [ROS_HEAD, *rows]
        rows = [[side.name, 'kept', *_start_times(side, arm, robot, executor.spin_once, STARTS)] for side in sides]
        with tempfile.TemporaryDirectory() as folder:
            first = _start_times(sides[1], arm, robot, executor.spin_once, 1, NUMBA_CACHE_DIR=folder)
        rows.append([sides[1].name, 'none', *first])
        rows.append(['scripts/demo', 'none', '', *_demo_times(robot)])
        yield 'Start over ROS', START_TEXT, [START_HEAD, *rows]


def poses_of(arm: Arm) -> list[PoseStamped]:
    return [pose_message(target, arm.base_frame) for target in make_case(arm, 'tracking', 1000).targets]


def command_of(side: str, arm: Arm, robot: str) -> list[str]:
    """Return the command that starts one of the two nodes."""
    if side == 'echo':
        return ['bench.ros_nodes', 'echo', str(arm.n), '--ros-args']
    parameters = f'robot:={robot}', 'seed_source:=last_solution', 'avoid_collisions:=false'
    return ['ros_ik_pkg.ros.ik_node', '--ros-args', *(word for text in parameters for word in ('-p', text))]


def running(
    command: list[str], namespace: str, log: IO[bytes] | None = None, **environment: str
) -> contextlib.AbstractContextManager[subprocess.Popen[bytes]]:
    """Run a node in its own process and namespace; write all that it logs to `log`, if given."""
    arguments = [*command, '-r', f'__ns:=/{namespace}', '--log-level', 'info' if log else 'warn']
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get('PYTHONPATH')])])
    usual = {name: value for name, value in os.environ.items() if name != 'PYTHONDONTWRITEBYTECODE'}
    return processes.running(*arguments, cwd=ROOT, stderr=log, env={**usual, 'PYTHONPATH': path, **environment})


def _measure(name: str, sides: list[Side], spin: Callable[[float], None]) -> list[list[str]]:
    """Measure both nodes at every rate, alternating, with subscribers to these topics of the IK node."""
    with contextlib.ExitStack() as listening:
        if LISTENERS[name]:
            listening.enter_context(running(['bench.ros_nodes', 'listen', *LISTENERS[name], '--ros-args'], 'ik'))
        for side in sides:
            side.stretch(spin, 100.0, int(100 * SECONDS))  # also the time in which listeners are found
        trips: dict[tuple[int, str], list[np.ndarray]] = {(rate, side.name): [] for rate in RATES for side in sides}
        for _ in tqdm(range(ROUNDS), desc=f'listeners: {name}', leave=False):
            for rate in RATES:
                for side in sides:
                    trips[rate, side.name].append(side.stretch(spin, rate, int(rate * SECONDS)))
    return [_row(name, rate, side, trips[rate, side], trips[rate, SIDES[0]]) for rate, side in trips]


def _row(listeners: str, rate: int, side: str, trips: list[np.ndarray], echo: list[np.ndarray]) -> list[str]:
    """Write one row of ROS_HEAD."""
    all_trips, median = np.concatenate(trips), np.nanmedian(np.concatenate(trips))
    answered = np.isfinite(all_trips).mean()
    lost = sum(bool(np.isnan(stretch[-1])) for stretch in trips)
    ratio = median / np.nanmedian(np.concatenate(echo))
    times = f'{1e6 * median:.0f}', f'{1e6 * np.nanpercentile(all_trips, 99):.0f}'
    return [listeners, str(rate), side, *times, f'{ratio:.2f}', f'{100 * answered:.1f}', f'{lost} of {len(trips)}']


def _start_times(
    side: Side, arm: Arm, robot: str, spin: Callable[[float], None], starts: int, **environment: str
) -> list[str]:
    """Return the median times of several starts [s]: from the start of a process to its log line READY and to its first
    answer, and of processors until it was stopped then."""
    ready, answered, used = [], [], []
    for _ in range(starts):
        with tempfile.TemporaryFile() as log:
            began, at, before = time.perf_counter(), time.time(), _children_time()
            with running(command_of(side.name, arm, robot), side.name, log, **environment):
                side.wait(spin)
                answered.append(time.perf_counter() - began)
            used.append(_children_time() - before)
            log.seek(0)
            ready += [stamp_of(line) - at for line in log if READY in line]
    return [f'{np.median(times):.2f}' if times else '' for times in (ready, answered, used)]


def stamp_of(line: bytes) -> float:
    """Return the time [s] of a line of a ROS log, such as `[INFO] [1764150000.123456789] [ik_node]: ready`."""
    return float(line.split(b'[')[2].split(b']')[0])


def _demo_times(robot: str) -> list[str]:
    """Return the times [s] from the start of scripts/demo with nothing compiled to its first solved target, and of
    processors until it was stopped then."""
    with tempfile.TemporaryDirectory() as folder:
        began, before = time.perf_counter(), _children_time()
        demo = subprocess.Popen(
            [ROOT / 'scripts' / 'demo', '--robot', robot], stdout=subprocess.PIPE, start_new_session=True,
            env={**os.environ, 'NUMBA_CACHE_DIR': folder, 'PYTHONUNBUFFERED': '1'},
        )  # fmt: skip
        with demo:
            solved = any(SOLVED in line for line in demo.stdout)
            took = time.perf_counter() - began
            demo.send_signal(signal.SIGINT)
        used = _children_time() - before
    if not solved:
        raise NodeError(f'scripts/demo ended with exit code {demo.returncode} before a target was solved')
    return [f'{took:.2f}', f'{used:.2f}']


def _children_time() -> float:
    """Return the processor time [s] of the processes that this one started and that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
