"""Any value of any type for any parameter, names that are none included, in any order, one by one and atomically, while
targets stream. Every call is answered, every refusal has a reason, and afterwards the defaults are taken and a good
target is solved. A value whose type ROS does not have gets no answer: rclpy raises before the node sees it; the node
logs that and goes on.
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
from torture.running import RunningNode, running_node

COUNT = 3000
MOST_AT_ONCE = 4
NO_TYPES = 20
EVERY = 100  # calls, then defaults and a good target


def run(plan: Plan) -> Iterator[Check]:
    """Change parameters at random."""
    arm, count = load_arm('puma560'), plan.count or COUNT
    with running_node() as node, connected(arm) as peer:
        yield from fuzz(plan.seed, count, node, peer)
        yield no_such_type(node, peer)


def fuzz(seed: int, count: int, node: RunningNode, peer: Peer) -> Iterator[Check]:
    """Call the parameter services `count` times."""
    random, tally, fault = Random(seed), Counter(), ''
    peer.forget()
    for number in progress(range(count), 'parameter calls'):
        fault = one_call(random, tally, peer) or (recovered(peer) if number % EVERY == EVERY - 1 else '')
        if fault:
            break
    fault = fault or recovered(peer) or node.fault()
    yield Check('changes, each call answered in time', str(sum(tally.values())), fault)
    figure = f'{tally["taken"]}, {tally["refused"]}'
    yield Check('changes taken and refused', figure, unless(len(tally) == 2, 'only one of the two'))
    yield Check('targets sent meanwhile, and answers', f'{len(peer.sent)}, {len(peer.outcomes)}',
                unless(bool(peer.outcomes), 'no answer'))  # fmt: skip

def no_such_type(node: RunningNode, peer: Peer) -> Check:
    """Send values of a type that ROS does not have; the log has the traceback of rclpy."""
    peer.send_unanswered([Parameter(name='method', value=ParameterValue(type=NO_TYPE))] * NO_TYPES)
    fault = recovered(peer) or unless(node.alive, 'the node ended')
    return Check('values of a type that ROS does not have', str(NO_TYPES), fault)


def one_call(random: Random, tally: Counter[str], peer: Peer) -> str:
    """Send a target and change some parameters; say what is wrong with the answer."""
    peer.send(peer.pose(peer.arm.home))
    changes = [any_change(random, peer.arm) for _ in range(random.randint(1, MOST_AT_ONCE))]
    results = peer.set_parameters(changes, atomically=random.random() < 0.5)
    if results is None:
        return f'no answer to {[(change.name, change.value.type) for change in changes]}'
    tally.update('taken' if result.successful else 'refused' for result in results)
    silent = [result for result in results if not result.successful and not result.reason]
    return f'refused without a reason: {changes}' if silent else ''


def recovered(peer: Peer) -> str:
    """Set the defaults and solve a good target; say what went wrong."""
    return peer.set_defaults() or peer.fault(peer.arm.home)

