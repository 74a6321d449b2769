"""coal's answer about a configuration depends on nothing else, and is the same however it is asked."""

from __future__ import annotations

import numpy as np
import pytest

from bench.collision import boxes
from bench.published_robots import Z1, configurations
from ros_ik_pkg.ik import World, load_arm
from ros_ik_pkg.ik.collision.scene import contacts_of
from ros_ik_pkg.ik.contacts.judge import SURE


def make_room():
    """Return a new room with a Z1 among boxes, so a judge that has seen nothing yet."""
    arm = load_arm(Z1[0], tip=Z1[2], srdf=Z1[1])
    return arm, arm.contacts.room(World(floor=-0.05, obstacles=boxes()))


@pytest.fixture(scope='module')
def unsure():
    """Return configurations of which the bound is not sure: most touch, in all depths."""
    arm, room = make_room()
    q = configurations(arm, 6000, seed=5)
    return q[contacts_of(room.packed, q, 0.0) >= 0]


def test_coal_answers_alike_in_any_order(unsure):
    _, room = make_room()
    forwards = np.array([room.is_clear(row) for row in unsure])
    backwards = np.array([room.is_clear(row) for row in unsure[::-1]])[::-1]
    assert np.array_equal(forwards, backwards)
    distances = np.array([room.look(row).clearance for row in unsure])
    again = np.array([room.look(row).clearance for row in unsure[::-1]])[::-1]
    assert np.allclose(distances, again, rtol=0.0, atol=1e-6)  # coal's tolerance


def test_coal_calls_nothing_clear_that_touches(unsure):
    _, room = make_room()
    clear = np.array([room.is_clear(row) for row in unsure])
    distances = np.array([room.look(row).clearance for row in unsure])
    assert 0 < clear.sum() < 0.1 * len(clear)
    assert np.array_equal(clear[abs(distances - SURE) > SURE], distances[abs(distances - SURE) > SURE] > 0.0)
    assert np.all(distances[clear] > 0.0)


def test_a_margin_counts_from_one_question_to_the_next(unsure):
    _, room = make_room()
    row = next(row for row in unsure if room.is_clear(row))
    clearance = room.look(row).clearance
    assert not room.is_clear(row, clearance + 1e-3)
    assert room.is_clear(row)
    assert room.is_clear(row, clearance - 1e-4)
