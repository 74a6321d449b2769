"""Start the IK node, send it targets from this second process with each method, and check every answer."""

from __future__ import annotations

import argparse
import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np

from ros_ik_pkg.ik import METHODS, IkError, SolveOptions, load_arm
from ros_ik_pkg.ik.arm import Arm
from ros_ik_pkg.ros.client import IkClient, NodeError
from ros_ik_pkg.ros.reply import Reply
from ros_ik_pkg.tools.check import Check, judge_reachable, judge_unreachable
from ros_ik_pkg.tools.domain import own_domain
from ros_ik_pkg.tools.processes import ros_node, running
from ros_ik_pkg.tools.send_target import pose_message

REACHABLE = 5
CANDIDATES = 50  # configurations that the reachable targets are picked from
SPREAD = 0.4  # fraction of the motion from home to a random configuration; enough for the methods to differ
OUT_OF_REACH = 100.0  # m
START_TIMEOUT = 900.0  # s; the first start compiles the solver, which takes minutes on a busy machine
REPLY_TIMEOUT = 60.0  # s
ASK_AGAIN = 0.1  # s
# One long descent instead of many short ones, so that even the transpose method shows its whole curve.
PARAMETERS = {'max_iterations': 20000, 'deadline': 5.0}


def arguments() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(prog='demo', description=__doc__)
    parser.add_argument(
        '--robot', default='puma560', help='robot of config/robots, .urdf, .xacro or DH .yaml (default: %(default)s)'
    )
    return parser


def main() -> int:
    """Run the demonstration; 0 when all of it was right."""
    robot = arguments().parse_args().robot
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the node is stopped too
    try:
        arm = load_arm(robot)
        with (
            own_domain(),
            running_node(robot) as process,
            ros_node('demo') as node,
            IkClient(node, with_iterations=True, with_joint_states=True) as client,
        ):
            began = time.monotonic()
            wait_for_start(client, process)
            targets = reachable_targets(arm)
            ask(client, home_of(arm), targets[0], complete=False)
            print(f'the first target is solved {time.monotonic() - began:.1f} s after the start of the node')
            return report(list(checks(client, arm, targets)))
    except (IkError, NodeError) as error:
        print(f'demo: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def running_node(robot: str) -> contextlib.AbstractContextManager[subprocess.Popen[bytes]]:
    """Run the IK node as a separate process."""
    quoted = robot.replace("'", "''")
    return running('ros_ik_pkg.ros.ik_node', '--ros-args', '-p', f"robot:='{quoted}'")


def wait_for_start(client: IkClient, process: subprocess.Popen[bytes]) -> None:
    """Wait until the node answers, or say that it ended."""
    deadline = time.monotonic() + START_TIMEOUT
    while True:
        try:
            return client.connect(timeout=3.0)
        except NodeError:
            if process.poll() is not None:
                raise NodeError(f'the node ended with exit code {process.returncode}, see above') from None
            if time.monotonic() > deadline:
                raise


def home_of(arm: Arm) -> dict[str, float]:
    """Return the home of the arm as joint states have it [rad, m]."""
    return dict(zip(arm.joint_names, map(float, arm.home)))


def checks(client: IkClient, arm: Arm, targets: list[np.ndarray]) -> Iterator[Check]:
    """Send every target with every method; print each line as it comes in."""
    home = home_of(arm)
    ask(client, home, targets[0])  # until all of the solver is compiled
    beyond = targets[0].copy()
    beyond[:3, 3] = OUT_OF_REACH
    print(Check.heading())
    for method in METHODS:
        client.set_parameters({'method': method, **PARAMETERS})
        for number, target in enumerate([*targets, beyond], start=1):
            reply = ask(client, home, target)
            judge = judge_reachable if number <= REACHABLE else judge_unreachable
            check = judge(arm, method, number, target, reply)
            print(check.line(), flush=True)
            yield check


def ask(client: IkClient, home: dict[str, float], target: np.ndarray, complete: bool = True) -> Reply:
    """Send joints and target (4, 4), both again while the target is taken first: two topics have no common order.

    A `complete` reply has iterations, which a node at its first start compiles after it is ready.
    """
    deadline = time.monotonic() + START_TIMEOUT
    while True:
        client.publish_joints(home)
        reply = client.solve(pose_message(target), REPLY_TIMEOUT)
        figures = reply.figures
        without_iterations = figures.get('outcome') in ('solved', 'failed') and not reply.iterations
        too_early = figures['status'] in ('joint_states', 'compiling') or (complete and without_iterations)
        if not too_early or time.monotonic() > deadline:
            return reply
        time.sleep(ASK_AGAIN)


def reachable_targets(arm: Arm) -> list[np.ndarray]:
    """Return tip poses (4, 4) of configurations within the limits, the same ones on every run."""
    random = np.random.default_rng(2026)
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    candidates = arm.home + SPREAD * (random.uniform(lower, upper, (CANDIDATES, arm.n)) - arm.home)
    smallest_singular_value = [np.linalg.svd(arm.jacobian(q), compute_uv=False)[-1] for q in candidates]
    # Away from singularities, where the transpose method needs up to a million iterations.
    return [arm.forward(candidates[i]) for i in np.argsort(smallest_singular_value)[-REACHABLE:]]


def report(done: list[Check]) -> int:
    """Print one solve in full and the verdict; return the exit code."""
    shown = next(check for check in done if check.method == SolveOptions().method)
    print(f'\nEvery iteration of {shown.method}, target {shown.number}:\n{shown.iterations()}\n')
    wrong = [check for check in done if check.fault]
    for check in wrong:
        print(f'wrong: {check.method}, target {check.number}: {check.fault}')
    print(f'{len(done) - len(wrong)} of {len(done)} answers right, judged by forward kinematics of Pinocchio')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
