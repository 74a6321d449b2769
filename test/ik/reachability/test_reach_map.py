"""Reach maps, judged by Pinocchio's forward kinematics and by coal."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pinocchio as pin
import pytest
from numerics import get_arm

from ros_ik_pkg.ik import ArgumentError, ReachMap, load_arm, load_reach_map, reach_map
from ros_ik_pkg.ik.reachability.cells import rotation_centres
from ros_ik_pkg.ik.reachability.figures import end_of_scale, position_figure, red_to_blue

QUICK = {'step': 0.2, 'parts': 2, 'samples_count': 200_000, 'rounds': 4}
RAIL = """<robot name="rail"><link name="a"/><link name="b"/><joint name="j" type="prismatic"><parent link="a"/>
<child link="b"/><axis xyz="1 0 0"/><limit lower="{0}" upper="{1}" effort="1" velocity="1"/></joint></robot>"""


@pytest.fixture(scope='module')
def ur5_map():
    return reach_map(get_arm('ur5'), **QUICK)


def poses_by_pinocchio(arm, configurations):
    """Return base_from_tip (k, 4, 4), by Pinocchio alone."""
    data, tip = arm.model.createData(), arm.model.getFrameId(arm.tip_frame)
    base = arm.model.getFrameId(arm.base_frame)
    poses = []
    for q in configurations:
        pin.framesForwardKinematics(arm.model, data, np.asarray(q, dtype=np.float64))
        poses.append(data.oMf[base].actInv(data.oMf[tip]).homogeneous)
    return np.array(poses)


def cells_by_numpy(found, poses):
    """Return the cells of poses: the grid's, and the rotation whose middle is nearest, by NumPy."""
    place = np.floor((poses[:, :3, 3] - found.corner) / found.step).astype(int)
    rotations = []
    for R in poses[:, :3, :3]:
        x = np.roll(pin.Quaternion(R).coeffs(), 1)
        face = int(np.argmax(np.abs(x)))
        angles = np.arctan(np.delete(x, face) / x[face]) / (np.pi / 4)
        i, j, k = np.clip(((angles + 1) / 2 * found.parts).astype(int), 0, found.parts - 1)
        rotations.append(((face * found.parts + i) * found.parts + j) * found.parts + k)
    return np.ravel_multi_index(tuple(place.T), found.shape) * found.rotations + np.array(rotations)


def test_every_reached_cell_has_a_configuration_within_limits_whose_pose_is_in_it(ur5_map):
    arm = get_arm('ur5')
    assert (ur5_map.q >= arm.lower).all() and (ur5_map.q <= arm.upper).all()
    chosen = np.random.default_rng(2).choice(len(ur5_map.cells), 2000, replace=False)
    poses = poses_by_pinocchio(arm, ur5_map.q[chosen])
    assert (cells_by_numpy(ur5_map, poses) == ur5_map.cells[chosen]).mean() > 0.999  # poses on a border aside
    for k in chosen[:50]:
        sigma = np.linalg.svd(arm.jacobian(ur5_map.q[k]), compute_uv=False)[-1]
        assert ur5_map.sigma_min[k] == pytest.approx(sigma, abs=1e-9)


def test_hardly_any_random_pose_is_in_a_cell_that_is_not_reached(ur5_map):
    arm = get_arm('ur5')
    q = np.random.default_rng(3).uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (20000, arm.n))
    missed = ~np.isin(cells_by_numpy(ur5_map, poses_by_pinocchio(arm, q)), ur5_map.cells)
    assert missed.mean() < 5e-4


def test_a_cell_gives_the_configuration_that_reaches_it(ur5_map):
    arm = get_arm('ur5')
    pose = poses_by_pinocchio(arm, [arm.home + 0.3])[0]
    q = ur5_map.configuration(pose[:3, 3], pose[:3, :3])
    assert np.abs(poses_by_pinocchio(arm, [q])[0, :3, 3] - pose[:3, 3]).max() <= ur5_map.step
    assert ur5_map.configuration(pose[:3, 3]) is not None
    assert ur5_map.configuration([5.0, 0.0, 0.0]) is None
    assert ur5_map.configuration(ur5_map.corner + 0.01) is None


def test_an_arm_maps_its_own_reach(ur5_map):
    found = get_arm('ur5').reach(**QUICK)
    assert isinstance(found, ReachMap)
    np.testing.assert_array_equal(found.cells, ur5_map.cells)


def test_without_contact_no_clearance_is_known(ur5_map):
    assert np.isnan(ur5_map.clearance).all() and np.isnan(ur5_map.best_clearance).all()
    with pytest.raises(ArgumentError, match='no clearance: contact does not count; expected share or sigma_min'):
        position_figure(ur5_map, 'clearance')


def test_colours_go_from_red_to_blue_and_end_at_the_largest_finite_figure(ur5_map):
    sigma = position_figure(ur5_map, 'sigma_min')
    end = end_of_scale('sigma_min', sigma)
    assert end == ur5_map.sigma_min.max()
    assert end_of_scale('share', sigma) == 1.0 and end_of_scale('clearance', np.array([0.2, np.inf, np.nan])) == 0.2
    colours = red_to_blue(np.array([0.0, end, np.inf]), end)
    np.testing.assert_allclose(colours, [[1.0, 0.4, 0.0], [0.0, 0.6, 1.0], [0.0, 0.6, 1.0]])


def test_share_and_singular_values_are_those_of_the_cells(ur5_map):
    share, best = ur5_map.share, ur5_map.best_sigma_min
    assert share.shape == best.shape == ur5_map.shape
    assert round(share.sum() * ur5_map.rotations) == len(ur5_map.cells)
    assert np.array_equal(np.isnan(best), share == 0.0)
    assert np.nanmax(best) == ur5_map.sigma_min.max()


def test_a_map_does_not_depend_on_the_threads_and_survives_a_file(ur5_map, tmp_path):
    again = reach_map(get_arm('ur5'), **QUICK, workers=1)
    np.testing.assert_array_equal(again.q, ur5_map.q)
    ur5_map.save(tmp_path / 'map.npz')
    read = load_reach_map(tmp_path / 'map.npz')
    np.testing.assert_array_equal(read.cells, ur5_map.cells)
    assert (read.joint_names, read.shape, read.step) == (ur5_map.joint_names, ur5_map.shape, ur5_map.step)
    (tmp_path / 'text.npz').write_text('no map')
    with pytest.raises(ArgumentError, match=r'text\.npz: no reach map'):
        load_reach_map(tmp_path / 'text.npz')


def test_what_other_threads_have_found_meanwhile_does_not_count(ur5_map, monkeypatch):
    """Each part of the work begins after the results of the one before it are in, the worst that can happen."""

    class OneByOne(ThreadPoolExecutor):
        def map(self, function, *parts):
            return map(function, *parts)

    monkeypatch.setattr(sys.modules[ReachMap.__module__], 'ThreadPoolExecutor', OneByOne)
    found = reach_map(get_arm('ur5'), **QUICK)
    np.testing.assert_array_equal(found.cells, ur5_map.cells)
    np.testing.assert_array_equal(found.q, ur5_map.q)


def rectangle_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Distance between two rectangles (4, 2) that do not overlap, from every corner to every edge of the other."""

    def corners_to_edges(corners, ends):
        edges = np.roll(ends, -1, axis=0) - ends
        along = np.clip(((corners[:, None] - ends) * edges).sum(-1) / (edges**2).sum(-1), 0.0, 1.0)
        return np.linalg.norm(corners[:, None] - ends - along[..., None] * edges, axis=-1).min()

    return min(corners_to_edges(one, other), corners_to_edges(other, one))


def folding_clearance(q: np.ndarray) -> float:
    """Clearance of the planar arm below, whose beams lie in one plane: links joined by a joint do not count. Closed
    form, because the distances of coal and hpp-fcl end with their iterations (hpp-fcl 2.4: 8e-9 m short here)."""
    beam = np.array([[0.1, -0.1], [0.9, -0.1], [0.9, 0.1], [0.1, 0.1]])
    origin, beams = np.zeros(2), []
    for angle in np.cumsum([0.0, *q]):
        axis = np.array([np.cos(angle), np.sin(angle)])
        beams.append(origin + beam @ [axis, [-axis[1], axis[0]]])
        origin = origin + axis
    return min(rectangle_distance(beams[i], beams[j]) for i, j in ((0, 2), (0, 3), (1, 3)))


def test_what_touches_is_not_reached():
    beam = '<collision><origin xyz="0.5 0 0"/><geometry><box size="0.8 0.2 0.2"/></geometry></collision>'
    text = '<robot name="folding">' + ''.join(f'<link name="l{i}">{beam}</link>' for i in range(4)) + ''.join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/><origin xyz="1 0 0"/>'
        '<axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1" effort="1" velocity="1"/></joint>'
        for i in range(3)
    ) + '</robot>'  # fmt: skip
    arm, judge = load_arm(text), load_arm(text)
    found = reach_map(arm, **QUICK)
    assert len(found.cells) > 100
    assert judge.contacts.room().clear(found.q).all()
    exact = np.array([folding_clearance(q) for q in found.q])
    assert (found.clearance <= exact).all()
    assert (exact - found.clearance).max() < 0.01
    best = found.best_clearance
    assert np.array_equal(np.isnan(best), found.share == 0.0)
    assert np.nanmax(best) == found.clearance.max()
    assert len(reach_map(load_arm(text.replace(beam, '')), **QUICK).cells) > len(found.cells)


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        ({'step': 0.0}, 'a length above 0'), ({'step': 0.001}, 'at most 50000000 cells'), ({'parts': 0}, 'parts = 0'),
        ({'box': [[0, 0, 0], [1, 1, 0]]}, 'lowest and its highest corner'), ({'box': [1, 2]}, 'lowest and its highest'),
    ],
)  # fmt: skip
def test_arguments_that_make_no_sense_are_refused(change, message):
    with pytest.raises(ArgumentError, match=message):
        reach_map(get_arm('ur5'), **{**QUICK, **change})


def test_an_endless_slide_needs_a_box_and_a_short_one_is_mapped_exactly():
    with pytest.raises(ArgumentError, match='slides without end'):
        reach_map(load_arm(RAIL.format(-1e9, 1e9)), **QUICK)
    found = reach_map(load_arm(RAIL.format(-0.49, 0.49)), 0.25, 1, [[-1, -1, -1], [1, 1, 1]], 1000, 1)
    reached = np.argwhere(found.share > 0.0)
    assert reached[:, 0].tolist() == [2, 3, 4, 5] and (found.share[tuple(reached.T)] == 0.25).all()
    assert len(rotation_centres(1)) == 4
