"""Any value of any type for any parameter, unknown names included, in any order, one by one and atomically, while
another process streams targets. Every call gets a response, every refusal has a reason, a refused atomic call
changes nothing, every target that the node received has its result, and afterwards the defaults are accepted and a
good target is solved. A value with a type that ROS does not have gets no response: rclpy raises before the node
sees it; the node logs that and continues.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from random import Random

from rcl_interfaces.msg import Parameter, ParameterValue

from ros_ik_pkg.ik import load_arm
from torture.makers import NO_TYPE, any_change
from torture.peer import Peer, connected
from torture.plan import Check, Plan, progress, unless
from torture.running import COUNTED_NODE, TARGETS, RunningNode, running_node
from torture.sending import Sender
from torture.stream import Stream

ROBOT = 'puma560'
COUNT = 3000
MOST_AT_ONCE = 4
NO_TYPES = 20
EVERY = 100  # calls, then defaults and a good target
RATE, JOINT_RATE = 100.0, 100.0  # Hz, of the stream meanwhile
AFTER = 0.2  # s
LEAST_TAKEN = 0.2  # of its targets; a node that loads a robot passes some over
WARM_UP = 0.2  # of the calls, before memory is looked at
GROWTH = 16.0  # MB; texts of 100000 characters and robots come and go, and malloc keeps some


def run(plan: Plan) -> Iterator[Check]:
    """Change parameters at random."""
    arm, count = load_arm(ROBOT), plan.count or COUNT
    with running_node(program=COUNTED_NODE) as node, connected(arm) as peer:
        with Sender(ROBOT, plan.seed, [peer.name]) as sender:
            yield from fuzz(plan.seed, count, node, peer, sender)
        yield no_such_type(node, peer)


def fuzz(seed: int, count: int, node: RunningNode, peer: Peer, sender: Sender) -> Iterator[Check]:
    """Call the parameter services `count` times while targets stream."""
    calls, stream = Calls(seed, peer), Stream(peer, seed)
    before, warm, fault = node.taken()[TARGETS] - peer.heard, 0.0, ''
    sender.begin(RATE, joint_rate=JOINT_RATE)
    for number in progress(range(count), 'parameter calls'):
        fault = calls.one() or (recovered(peer) if number % EVERY == EVERY - 1 else '')
        if fault:
            break
        if number == int(WARM_UP * count):
            warm = node.usage().memory
    streamed = answered(before, sender, stream, node, peer)
    fault = fault or recovered(peer) or node.fault()
    yield Check('changes, each call answered in time', str(calls.tally.total()), fault)
    yield from calls.checks()
    if not fault:
        growth = node.usage().memory - warm
        yield Check('memory growth after the first fifth', f'{growth:.1f} MB', unless(growth < GROWTH, 'it grows'))
    yield streamed


def answered(before: int, sender: Sender, stream: Stream, node: RunningNode, peer: Peer) -> Check:
    """Compare the targets that the node received with the results; `before`: results lost earlier.

    The stream continues briefly, so that the last target belongs to it and is not replaced by a newer one.
    """
    peer.spin(AFTER)
    sent = sender.end()
    last = max(sent.last.values())
    peer.wait(lambda: last in stream.outcomes)
    peer.spin(AFTER)
    taken, results = node.taken()[TARGETS] - before, peer.heard
    fault = unless(taken == results, f'{taken} taken, {results} results') or unless(
        last in stream.outcomes, 'none to the last'
    ) or unless(len(stream.outcomes) > LEAST_TAKEN * sent.targets, 'too few')  # fmt: skip
    kinds = ', '.join(f'{number} {kind}' for kind, number in Counter(stream.outcomes.values()).most_common())
    passed_over = sent.targets - len(stream.outcomes)
    figure = f'{sent.targets} sent, {passed_over} replaced by newer ones, results to all others: {kinds}'
    return Check('targets that streamed meanwhile', figure, fault or sent.too_slow(RATE, JOINT_RATE))


class Calls:
    """Random calls of the parameter services, and their results."""

    def __init__(self, seed: int, peer: Peer) -> None:
        self._random, self._peer = Random(seed), peer
        self._values = ''  # of all parameters, before the next call
        self._compared = 0
        self.tally: Counter[str] = Counter()

    def one(self) -> str:
        """Change some parameters; return the fault of the response."""
        random, peer = self._random, self._peer
        changes = [any_change(random, peer.arm) for _ in range(random.randint(1, MOST_AT_ONCE))]
        atomically = random.random() < 0.5
        if atomically:
            self._values = peer.all_values()
        results = peer.set_parameters(changes, atomically)
        if results is None:
            return f'no answer to {[(change.name, change.value.type) for change in changes]}'
        self.tally.update('taken' if result.successful else 'refused' for result in results)
        if any(not result.successful and not result.reason for result in results):
            return f'refused without a reason: {changes}'
        return self._unchanged(changes) if atomically and not results[0].successful else ''

    def _unchanged(self, changes: list[Parameter]) -> str:
        """Say whether a call that was refused has changed something all the same."""
        self._compared += 1
        return unless(self._peer.all_values() == self._values, f'refused, but something changed: {changes}')

    def checks(self) -> Iterator[Check]:
        """Say how many changes were taken, and how often nothing had changed."""
        figure = f'{self.tally["taken"]}, {self.tally["refused"]}'
        yield Check('changes taken and refused', figure, unless(len(self.tally) == 2, 'only one of the two'))
        what = 'atomic calls that were refused and had changed nothing'
        yield Check(what, str(self._compared), unless(bool(self._compared), 'none was refused'))


def no_such_type(node: RunningNode, peer: Peer) -> Check:
    """Send values of a type that ROS does not have; the log has the traceback of rclpy."""
    peer.send_unanswered([Parameter(name='method', value=ParameterValue(type=NO_TYPE))] * NO_TYPES)
    fault = recovered(peer) or unless(node.alive, 'the node ended')
    return Check('values of a type that ROS does not have', str(NO_TYPES), fault)


def recovered(peer: Peer) -> str:
    """Set the defaults and solve a good target; return the fault."""
    return peer.set_defaults() or peer.fault(peer.arm.home)
