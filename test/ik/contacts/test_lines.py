"""Lines of the joints that are said to be clear do not touch anywhere, and few others are refused."""

from __future__ import annotations

import numpy as np
import pytest

from bench.collision import CROWDED, add_room
from bench.published_robots import PANDA, UrdfJudge, configurations, moving_pairs
from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ik.contacts.lines import clear_lines

STEP = 0.02  # rad
PLACES = np.linspace(0.0, 1.0, 41)[None, :, None]


@pytest.fixture(scope='module')
def crowded():
    """A Panda among boxes, its room, and the judge: the meshes of the URDF as they are."""
    urdf, srdf, tip = PANDA
    arm = load_arm(urdf, tip=tip, srdf=srdf)
    room = arm.contacts.room(CROWDED)
    judge = UrdfJudge(urdf, moving_pairs(room), room.positions, base=arm.base_frame)
    add_room(judge, arm, room, CROWDED)
    return arm, room, judge


def lines_near_contact(arm, room):
    """Short lines of which both ends are clear, those that come nearest to contact first."""
    random = np.random.default_rng(5)
    start = configurations(arm, 20000, seed=6)
    start = start[room.clear(start)]
    start = start[np.argsort(room.least_clearances(start))[:300]]
    end = start + random.uniform(-STEP, STEP, start.shape)
    kept = room.clear(end)
    return start[kept], end[kept]


def test_a_line_that_is_called_clear_touches_nowhere_and_thin_contacts_are_found(crowded):
    arm, room, judge = crowded
    start, end = lines_near_contact(arm, room)
    clear = clear_lines(room, start, end)
    places = start[:, None] + PLACES * (end - start)[:, None]
    touching = np.array([any(judge.touches(arm.joint_names, q) for q in line) for line in places])
    assert not (clear & touching).any()
    assert touching.any() and clear.any()
    assert touching[~clear].any()  # both ends of all lines are clear


def test_a_line_that_is_not_called_clear_comes_very_near(crowded):
    arm, room, _ = crowded
    start, end = lines_near_contact(arm, room)
    refused = ~clear_lines(room, start, end)
    places = (start[:, None] + PLACES * (end - start)[:, None])[refused]
    nearest = np.array([min(room.look(q).clearance for q in line) for line in places])
    assert refused.any() and nearest.max() < 1.5e-3


def test_a_margin_is_kept_on_the_whole_line(crowded):
    arm, room, _ = crowded
    start, end = lines_near_contact(arm, room)
    wide = clear_lines(room, start, end, 0.001)
    assert not (wide & ~clear_lines(room, start, end)).any()
    for line in (start[:, None] + PLACES * (end - start)[:, None])[wide]:
        assert min(room.look(q).clearance for q in line) >= 0.001
    assert wide.any()
