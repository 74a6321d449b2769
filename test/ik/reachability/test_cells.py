"""Cells of rotations and positions."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from ros_ik_pkg.ik.reachability.cells import position_cell, rotation_cell, rotation_centres, rotation_neighbours


@pytest.mark.parametrize('parts', [1, 2, 3, 5])
def test_the_middle_of_each_cell_is_a_rotation_in_that_cell(parts):
    for cell, R in enumerate(rotation_centres(parts)):
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) > 0.0
        assert rotation_cell(tuple(R.ravel()), parts) == cell


def test_cells_have_nearly_equal_shares_of_random_rotations_and_none_is_wide():
    rng, parts, count = np.random.default_rng(1), 2, 8000
    middles = rotation_centres(parts)
    quaternions = rng.normal(size=(count, 4))
    cells = np.empty(count, int)
    for k, x in enumerate(quaternions):
        R = pin.Quaternion(x / np.linalg.norm(x)).matrix()
        cells[k] = rotation_cell(tuple(R.ravel()), parts)
        assert np.linalg.norm(pin.log3(middles[cells[k]].T @ R)) < np.radians(75.0)
    shares = np.bincount(cells, minlength=4 * parts**3) * len(middles) / count
    assert shares.min() > 0.6 and shares.max() < 1.5


def test_neighbours_are_near_and_mutual_enough_to_connect_all_cells():
    neighbours = rotation_neighbours(3)
    reached = {0}
    while more := {int(n) for cell in reached for n in neighbours[cell]} - reached:
        reached |= more
    assert len(reached) == 108


def test_positions_have_cells_in_row_order_and_none_outside_the_grid():
    corner, shape = np.array([-1.0, 0.0, 0.0]), np.array([2, 3, 4])
    assert position_cell((-0.9, 0.1, 0.1), corner, 1.0, shape) == 0
    assert position_cell((0.9, 2.5, 3.5), corner, 1.0, shape) == 23
    for outside in ((-1.1, 0.1, 0.1), (1.1, 0.1, 0.1), (0.0, 3.1, 0.0), (0.0, 0.0, np.nan), (0.0, 0.0, np.inf)):
        assert position_cell(outside, corner, 1.0, shape) == -1
