"""Random arms and all shipped ones, all methods, options drawn from their ranges, seeds inside and outside the
limits, targets reachable, singular, out of reach and degenerate. Pinocchio's forward kinematics judges every answer:
converged means within tolerance and limits; all else has a reason; nothing is NaN; and no solve takes more CPU time
than its deadline and a millisecond.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from bench.check import tally_answers
from torture.plan import Check, Plan, unless

COUNT = 1_000_000


def run(plan: Plan) -> Iterator[Check]:
    """Solve `count` times, or as many as there is time for."""
    count = plan.count or COUNT
    end = time.monotonic() + plan.seconds(float('inf'))
    tally = tally_answers(count, plan.seed, 'solves', lambda: time.monotonic() > end)
    yield Check('random solves', f'{tally.solves}, {tally.groups} sets of options on {tally.arms} arms')
    yield Check('wrong answers', str(tally.wrong), '; '.join(tally.faults))
    yield Check('CPU time beyond the deadline', f'at most {1e3 * max(tally.latest, 0.0):.2f} ms')
    reasons = [f'{number} {label}' for label, number in tally.statuses.most_common()]
    yield Check('reasons', ', '.join(reasons), unless(len(reasons) > 1, 'nothing but one outcome: what was tried?'))
