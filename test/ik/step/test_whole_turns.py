"""Angles that may turn round are moved by whole turns, within their limits."""

from __future__ import annotations

import numpy as np
import pytest

from ros_ik_pkg.ik import load_arm
from ros_ik_pkg.ik.step.limits import unwrap

TURN = 2.0 * np.pi
WIDE = """<robot name="wide"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/>
<child link="b"/><axis xyz="0 0 1"/><limit lower="-7" upper="7" effort="1" velocity="1"/></joint></robot>"""


@pytest.mark.parametrize(
    ('angle', 'reference', 'expected'),
    [
        (0.5, 6.0, 0.5 + TURN),  # the nearest equivalent
        (0.5, -9.0, 0.5 - TURN),  # the reference lies below the limits: the nearest one within them
        (-0.5, 9.0, -0.5 + TURN),
        (0.5, 30.0, 0.5 + TURN),
        (0.5, -30.0, 0.5 - TURN),
        (0.5, 1.0, 0.5),
    ],
)
def test_an_angle_becomes_its_equivalent_nearest_the_reference_that_is_within_the_limits(angle, reference, expected):
    arm = load_arm(WIDE)
    assert arm.wraps.tolist() == [1]
    q = np.array([angle])
    assert unwrap(arm.geometry, q, np.array([reference])) == (angle != expected)
    np.testing.assert_allclose(q, [expected], atol=1e-12)
