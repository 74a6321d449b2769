"""Random arms and all shipped ones, all methods, options drawn from their ranges, seeds inside and outside the limits,
targets reachable, singular, out of reach and degenerate. Pinocchio's forward kinematics checks every solution:
converged means within tolerance and limits; every other solve has a reason; nothing is NaN; and no solve takes more
CPU time than its deadline and a millisecond. A solve counts as late if three of three attempts are late: its work
is the same every time, while delays by a busy or virtual machine are not.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from bench.check import Tally, tally_answers
from torture.plan import Check, Plan, unless

COUNT = 1_000_000


def run(plan: Plan) -> Iterator[Check]:
    """Solve `count` times, or as many as there is time for."""
    count = plan.count or COUNT
    end = time.monotonic() + plan.seconds(float('inf'))
    tally = tally_answers(count, plan.seed, 'solves', lambda: time.monotonic() > end, plan.group)
    figure = f'{tally.solves}, {tally.groups} sets of options on {len(tally.arms)} arms'
    yield Check('random solves', figure, unless(bool(tally.solves), 'none: is there such a group?'))
    again = f'--group {tally.faulty[0]}' if tally.faulty else ''
    yield Check('wrong answers', str(tally.wrong), '; '.join(tally.faults), again)
    late = f'at most {1e3 * max(tally.latest, 0.0):.2f} ms; {tally.late_once} late once and in time when tried again'
    yield Check('CPU time beyond the deadline', late)
    reasons = [f'{number} {label}' for label, number in tally.statuses.most_common()]
    yield Check('reasons', ', '.join(reasons), _unless_all_alike(tally, plan))


def _unless_all_alike(tally: Tally, plan: Plan) -> str:
    """Return a fault if all solves of several groups had one outcome, because too little was tried."""
    varied = len(tally.statuses) > 1 or plan.group is not None
    return unless(varied, 'nothing but one outcome: what was tried?')
