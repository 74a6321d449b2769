"""Targets at 500 Hz and joint states at 1000 Hz, from a process that only sends, with a subscriber to every topic of
the node. Parameters change every two seconds; the changes include loading the robot again and comparing all
methods. Memory, file handles and threads of the node are read from /proc every second; their growth is measured
after the first tenth of the time, in short runs after two minutes or half of the time. The rates must reach 90 %,
and the node must solve at least a tenth of the targets.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import cycle

import numpy as np

from ros_ik_pkg.ik import METHODS, load_arm
from torture.everything import Everything
from torture.peer import Peer, connected
from torture.plan import Check, Plan, unless, watching
from torture.running import RunningNode, Usage, running_node
from torture.sending import Sender, Sent
from torture.stream import Stream

ROBOT = 'puma560'
SECONDS = 20 * 60.0
RATE = 500.0  # Hz
LEAST_ANSWERED = 0.1  # of the targets; others are passed over for newer ones
STEP = 1.0  # s between two looks at the node
STRETCH = 60.0  # s per run; afterwards the results are checked and dropped, so that this process does not grow
WARM_UP = 0.1  # of the time
SETTLING = 120  # looks, in a short run
GROWTH = 2.0  # MB
# Changes that leave every target of the stream solvable.
CHANGES = (
    *({'method': method} for method in METHODS if method not in ('transpose', 'pinv')),
    {'compare': ['all']},
    {'choice': 'nearest'},
    {'task_weights': [1.0, 1.0, 1.0, 0.5, 0.5, 0.5]},
    {'robot': ROBOT},
    {'max_attempts': 400, 'dls.damping': 0.02},
    {'seed_source': 'last_solution'},
    {'diagnostics.warn_latency': 0.01},
    {'choice': 'first', 'task_weights': [1.0] * 6, 'seed_source': 'joint_states'},
    {'max_attempts': 500, 'dls.damping': 0.01},
    {'compare': ['dls', 'sdls']},
)


def run(plan: Plan) -> Iterator[Check]:
    """Stream for a long time."""
    seconds = plan.seconds(SECONDS)
    with running_node() as node, connected(load_arm(ROBOT)) as peer, Sender(ROBOT, plan.seed, [peer.name]) as sender:
        soak = Soak(plan.seed, node, peer, sender)
        fault = soak.stream(seconds)
    yield Check(f'{seconds / 60:g} minutes', soak.figure(), fault)
    yield Check('rates', soak.sent().figure(), soak.sent().too_slow(RATE) or soak.too_few())
    silent = soak.everything.missing()
    yield Check('messages on all topics', str(soak.everything.counts.total()), unless(not silent, f'none on {silent}'))
    yield from judged(after_warm_up(soak.usages))


class Soak:
    """Sent messages, results, and the resources of the node every second."""

    def __init__(self, seed: int, node: RunningNode, peer: Peer, sender: Sender) -> None:
        self._seed, self._node, self._peer, self._sender = seed, node, peer, sender
        self._changes, self._parts, self._made = cycle(CHANGES), [], Counter()
        self.everything = Everything(peer)
        self.usages: list[Usage] = []

    def stream(self, seconds: float) -> str:
        """Stream and change parameters in several runs; return the fault."""
        fault, rest = '', seconds
        while rest > 0.0 and not fault:
            fault = self._stretch(min(rest, STRETCH))
            rest -= STRETCH
        return fault

    def _stretch(self, seconds: float) -> str:
        """Stream for one run and check the results."""
        stream = Stream(self._peer, self._seed)
        self._sender.begin(RATE, seconds)
        fault = self._change_meanwhile(seconds)
        sent = self._sender.end()
        self._parts.append(sent)
        fault = fault or stream.fault_at_end(sent.last[0]) or self._node.fault()
        self._made.update({'solved': stream.solved(), 'answered': len(stream.results), 'stale': stream.stale()})
        return fault

    def _change_meanwhile(self, seconds: float) -> str:
        """Read resources every second and change parameters every two seconds; return the fault."""
        for _ in watching(seconds, 'soak', self._sender.finished):
            self._peer.spin(STEP)
            self.usages.append(self._node.usage())
            if len(self.usages) % 2 == 0:
                if fault := self._peer.set_values(next(self._changes)):
                    return fault
                self._made['changes'] += 1
        return ''

    def sent(self) -> Sent:
        """Return what was sent in all runs."""
        counts = [(sent.targets, sent.joint_states, sent.seconds) for sent in self._parts]
        return Sent(*(sum(numbers) for numbers in zip(*counts)), {})

    def too_few(self) -> str:
        """Say that too few targets were answered."""
        least = LEAST_ANSWERED * self.sent().targets
        return unless(self._made['answered'] > least, f'only {self._made["answered"]} answered')

    def figure(self) -> str:
        """Say the counts."""
        sent, made = self.sent(), self._made
        return (
            f'{sent.targets} targets, {made["solved"]} solved, {sent.joint_states} joint states, '
            f'{made["changes"]} changes, {made["stale"]} after a newer one'
        )


def after_warm_up(usages: Sequence[Usage]) -> Sequence[Usage]:
    """Leave out the first tenth, of a short run two minutes or half: DDS keeps buffers of the largest messages."""
    return usages[min(max(int(WARM_UP * len(usages)), SETTLING), len(usages) // 2) :]


def judged(usages: Sequence[Usage]) -> Iterator[Check]:
    """Compare the end with the start, by medians of a tenth of the samples, because memory fluctuates."""
    tenth = max(1, len(usages) // 10)
    begin, end = (float(np.median([usage.memory for usage in part])) for part in (usages[:tenth], usages[-tenth:]))
    growth = end - begin
    yield Check('memory growth', f'{growth:+.2f} MB, from {begin:.1f} MB', unless(growth < GROWTH, 'it grows'))
    for name in ('files', 'threads'):
        numbers = {getattr(usage, name) for usage in usages}
        yield Check(name, f'{min(numbers)} to {max(numbers)}', unless(len(numbers) == 1, 'not constant'))
