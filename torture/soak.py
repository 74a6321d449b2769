"""Targets at 500 Hz beside joint states at 1000 Hz, a change of parameters every two seconds, the robot loaded anew
among them. Memory, file handles and threads of the node are read from /proc every second; what counts is what they do
after the first tenth of the time. Rates are those that the client reached.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import cycle

import numpy as np
from rclpy.parameter import Parameter

from ros_ik_pkg.ik import METHODS, load_arm
from torture.peer import Peer, connected
from torture.plan import Check, Plan, progress, unless
from torture.running import RunningNode, Usage, running_node
from torture.stream import Stream

SECONDS = 20 * 60.0
RATE = 500.0  # Hz
STEP = 1.0  # s between two looks at the node
STRETCH = 60  # steps after which what came is judged and forgotten, or this process would grow
WARM_UP = 0.1  # of the time
GROWTH = 2.0  # MB
# Changes that leave every target of the stream solvable.
CHANGES = (
    *({'method': method} for method in METHODS if method not in ('transpose', 'pinv')),
    {'choice': 'nearest'},
    {'task_weights': [1.0, 1.0, 1.0, 0.5, 0.5, 0.5]},
    {'robot': 'puma560'},
    {'max_attempts': 400, 'dls.damping': 0.02},
    {'seed_source': 'last_solution'},
    {'diagnostics.warn_latency': 0.01},
    {'choice': 'first', 'task_weights': [1.0] * 6, 'seed_source': 'joint_states'},
    {'max_attempts': 500, 'dls.damping': 0.01},
)


def run(plan: Plan) -> Iterator[Check]:
    """Stream for a long time."""
    seconds = plan.seconds(SECONDS)
    with running_node() as node, connected(load_arm('puma560')) as peer:
        usages, figures, fault = stream(seconds, plan.seed, node, peer)
    yield Check(f'{seconds / 60:g} minutes', ', '.join(f'{number} {what}' for what, number in figures.items()), fault)
    yield from judged(usages[int(WARM_UP * len(usages)) :])


def stream(seconds: float, seed: int, node: RunningNode, peer: Peer) -> tuple[list[Usage], dict[str, int], str]:
    """Stream and change parameters; return what the node held every second, counts, and what went wrong."""
    usages, changes, part = [], cycle(CHANGES), Stream(peer, seed)
    figures = dict.fromkeys(('targets', 'solved', 'joint states', 'changes', 'after a newer one'), 0)
    steps = max(1, round(seconds / STEP))
    for step in progress(range(1, steps + 1), 'soak'):
        part.go(RATE, STEP)
        usages.append(node.usage())
        if step % 2 == 0 and (fault := change(next(changes), peer)):
            return usages, figures, fault
        figures['changes'] += step % 2 == 0
        if step % STRETCH == 0 or step == steps:
            if fault := part.fault_at_end() or node.fault():
                return usages, figures, fault
            for what, number in part.counts().items():
                figures[what] += number
            part = Stream(peer, seed + step)
    return usages, figures, ''


def change(values: dict, peer: Peer) -> str:
    """Set parameters; say what went wrong."""
    results = peer.set_parameters([Parameter(name, value=value).to_parameter_msg() for name, value in values.items()])
    if results is None:
        return f'no answer to {values}'
    return '' if results[0].successful else results[0].reason


def judged(usages: Sequence[Usage]) -> Iterator[Check]:
    """Compare the end with the begin: medians of a tenth of the samples each, for memory goes up and down."""
    tenth = max(1, len(usages) // 10)
    begin, end = (float(np.median([usage.memory for usage in part])) for part in (usages[:tenth], usages[-tenth:]))
    growth = end - begin
    yield Check('memory growth', f'{growth:+.2f} MB, from {begin:.1f} MB', unless(growth < GROWTH, 'it grows'))
    for name in ('files', 'threads'):
        numbers = {getattr(usage, name) for usage in usages}
        yield Check(name, f'{min(numbers)} to {max(numbers)}', unless(len(numbers) == 1, 'not constant'))
