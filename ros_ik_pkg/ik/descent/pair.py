"""The closest approach of two tips: the variants of functions that change the rows or columns of both."""

from __future__ import annotations

from ros_ik_pkg.ik.descent.closest_approach import freeze, weigh_slack
from ros_ik_pkg.ik.kernel.compiled import variant_of
from ros_ik_pkg.ik.kernel.pair_layout import PairGeometry, PairWorkspace
from ros_ik_pkg.ik.step.limits import freeze_pushed, pushed_outwards
from ros_ik_pkg.ik.step.weights import scale_columns


@variant_of(weigh_slack, PairWorkspace)
def weigh_slack_of_both(work):
    """Weigh all rows of both tips, then stack them again."""
    if len(work.scales) > 0:
        scale_columns(work.scales, work.first.columns)
        scale_columns(work.scales, work.first.trial)
        scale_columns(work.scales, work.second.columns)
        scale_columns(work.scales, work.second.trial)


@variant_of(freeze, PairGeometry)
def freeze_both(geometry, work):
    """Take joints at a limit that dq pushes outwards out of the system and out of the rows that `stack` reads."""
    for i in range(len(work.q)):
        if pushed_outwards(geometry, work, i):
            work.first.columns[i, :] = 0.0
            work.first.trial[i, :] = 0.0
            work.second.columns[i, :] = 0.0
            work.second.trial[i, :] = 0.0
    return freeze_pushed(geometry, work)
