"""Shapes of URDFs, DH tables and mesh files: what is read, what is left out and named, what covers them."""

from __future__ import annotations

import numpy as np
import pytest

from ros_ik_pkg.ik import ModelError, SolveOptions, Status, World, load_arm, solve
from ros_ik_pkg.ik.collision.scene import contacts_of
from ros_ik_pkg.ik.contacts import mesh_files
from ros_ik_pkg.ik.contacts.bodies import load_shape
from ros_ik_pkg.ik.contacts.coal_library import coal
from ros_ik_pkg.ik.contacts.mesh_files import MOST_TRIANGLES, read_hulls
from ros_ik_pkg.ik.model.collision_elements import read_collisions
from ros_ik_pkg.ik.model.dh import parse_dh
from ros_ik_pkg.ik.model.shapes import Shape
from ros_ik_pkg.ik.model.urdf import parse_xml

TABLE = '''name: two
source: made up
convention: {convention}
angles: radians
base_frame: base
tip_frame: tip
joints:
  - {{name: a, type: revolute, a: 0.3, alpha: 0.4, d: 0.2, theta: 0.1, lower: -3, upper: 3, radius: 0.05}}
  - {{name: b, type: revolute, a: 0.25, alpha: 0.0, d: 0.1, theta: 0.0, lower: -3, upper: 3, radius: 0.04}}
  - {{name: c, type: prismatic, a: 0.0, alpha: 0.2, d: 0.1, theta: 0.0, lower: 0, upper: 1}}
'''
FOLDING = '''name: folding
source: made up
convention: standard
angles: radians
base_frame: base
tip_frame: tip
home: [0, 0.5, 0.5, 0.5]
joints:
''' + ''.join(f'  - {{name: j{k}, type: revolute, a: 0.3, alpha: 0, d: 0, theta: 0, lower: -2.6, upper: 2.6, '
              'radius: 0.02}\n' for k in range(4))


def collisions(elements):
    return read_collisions(parse_xml(f'<robot><link name="l">{elements}</link></robot>'))


def element(geometry, origin=''):
    return f'<collision>{origin}<geometry>{geometry}</geometry></collision>'


def test_every_shape_of_a_link_is_read_with_its_place_and_scale():
    shapes, faults = collisions(
        element('<box size="1 2 3"/>', '<origin xyz="0 0 1" rpy="0 0 0"/>') + element('<sphere radius="0.5"/>')
        + element('<cylinder radius="0.1" length="2"/>') + element('<capsule radius="0.1" length="2"/>')
        + element('<mesh filename="package://p/a.stl" scale="0.001 0.001 -0.002"/>'))
    assert not faults
    assert [shape.kind for shape in shapes['l']] == ['box', 'sphere', 'cylinder', 'capsule', 'mesh']
    assert shapes['l'][0].frame_from_shape[2, 3] == 1.0
    assert np.array_equal(shapes['l'][4].size, [0.001, 0.001, -0.002]) and shapes['l'][4].file == 'package://p/a.stl'


@pytest.mark.parametrize(('broken', 'reason'), [
    ('<collision/>', '0 shapes'),
    (element('<box size="0 1 1"/>'), 'length along x of a box is 0'),
    (element('<box size="1 1"/>'), "'1 1'; expected three numbers"),
    (element('<sphere/>'), "radius is ''"),
    (element('<sphere radius="nan"/>'), "radius is 'nan'"),
    (element('<mesh/>'), 'no filename'),
    (element('<mesh filename="a.stl" scale="0 1 1"/>'), 'scale along x of a mesh is 0'),
    (element('<cone radius="1"/>'), '0 shapes'),
    (element('<sphere radius="1"/>', '<origin xyz="a b c"/>'), "'a'; expected a finite number"),
])  # fmt: skip
def test_a_shape_that_makes_no_sense_is_named_and_left_out_and_the_others_stay(broken, reason):
    shapes, faults = collisions(broken + element('<sphere radius="0.5"/>'))
    assert len(shapes['l']) == 1
    assert len(faults) == 1 and reason in faults[0] and "link 'l'" in faults[0] and 'left out' in faults[0]


@pytest.mark.parametrize('convention', ['standard', 'modified'])
def test_capsules_of_a_dh_table_follow_its_links(convention):
    tree = parse_dh(TABLE.format(convention=convention))
    ends = []
    for shapes in tree.shapes.values():
        for shape in shapes:
            assert shape.kind == 'capsule' and shape.size[0] in (0.05, 0.04)
            ends.append(shape.size[1])
    assert np.allclose(sorted(ends), [0.1, 0.2, 0.25, 0.3])


def test_capsules_of_a_dh_table_connect_the_joints(tmp_path):
    path = tmp_path / 'two.yaml'
    path.write_text(TABLE.format(convention='standard').replace('alpha: 0.4', 'alpha: 0.0'))
    arm = load_arm(path)
    q = np.array([0.7, -1.1, 0.3])
    room = arm.contacts.room()
    judge = room._judge(False)
    judge.clear(room._values_at(q), 0.0)
    starts = []
    for k, piece in enumerate(room._pieces):
        pose = judge._placed.oMg[k]
        half = 0.5 * piece.shape.size[1] * pose.rotation[:, 2]
        starts.append((pose.translation - half, pose.translation + half))
    ends = np.concatenate(starts)
    elbow = arm.base_from_frame('link1', dict(zip('abc', q)))[:3, 3]
    assert np.linalg.norm(ends, axis=1).min() < 1e-12  # one begins at the base
    assert np.sum(np.linalg.norm(ends - elbow, axis=1) < 1e-9) == 2  # two meet where the second joint is


def test_a_table_without_radius_has_nothing_to_touch():
    contacts = load_arm('ur5').contacts
    assert not contacts.known and contacts.look(np.zeros(6)).clearance == np.inf
    assert contacts.is_clear(np.zeros(6), 1.0)


def test_a_table_with_radius_is_checked_against_the_floor(tmp_path):
    path = tmp_path / 'two.yaml'
    path.write_text(TABLE.format(convention='standard').replace('alpha: 0.4', 'alpha: 1.5707963'))
    arm = load_arm(path)
    down, up = np.array([0.0, -1.5, 0.0]), np.array([0.0, 1.5, 0.0])
    world = World(floor=0.0)
    assert arm.contacts.is_clear(up, 0.0, world) and not arm.contacts.is_clear(down, 0.0, world)
    assert arm.contacts.look(down, world).links == ('link2', 'floor')


def test_a_solution_of_a_table_with_radius_is_clear_of_itself_by_the_bound_and_by_coal(tmp_path):
    path = tmp_path / 'folding.yaml'
    path.write_text(FOLDING)
    arm, tight = load_arm(path), SolveOptions(task_weights=(1, 1, 1, 0, 0, 0), deadline=0.0)
    room, rng = arm.contacts.room(), np.random.default_rng(2)
    q = rng.uniform(arm.lower, arm.upper, (400, arm.n))
    touches = np.array([not apart(arm, row) for row in q])
    suspect = contacts_of(room.packed, q, 0.0) >= 0
    coal_says = np.array([not room.is_clear(row) for row in q])
    assert 0.02 < touches.mean() < 0.6
    assert np.array_equal(coal_says, touches) and not np.any(touches & ~suspect) and np.mean(suspect[~touches]) < 0.01
    solutions = [solve(arm, arm.forward(row), row, tight) for row in q[touches]]
    found = [solution for solution in solutions if solution.status is Status.CONVERGED]
    assert all(apart(arm, solution.q) for solution in found)
    assert {solution.status for solution in solutions} <= {Status.CONVERGED, Status.COLLISION}
    assert len(found) > 5


def apart(arm, q):
    """Return whether the capsules of FOLDING, segments in a plane, are apart; neighbours may touch."""
    angles = np.cumsum(q)
    corners = np.vstack([np.zeros(2), np.cumsum(0.3 * np.column_stack([np.cos(angles), np.sin(angles)]), axis=0)])
    pairs = [(i, j) for i in range(4) for j in range(i + 2, 4)]
    return all(segment_gap(corners[i : i + 2], corners[j : j + 2]) > 0.04 for i, j in pairs)


def segment_gap(one, other):
    """Return the distance of two segments (2, 2) in a plane."""
    (a, b), (c, d) = one, other
    along, across, start = b - a, d - c, c - a
    det = along[0] * across[1] - along[1] * across[0]
    if abs(det) > 1e-12:
        s, t = ((start[0] * w[1] - start[1] * w[0]) / det for w in (across, along))
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            return 0.0
    return min(point_gap(p, *seg) for p, seg in ((a, other), (b, other), (c, one), (d, one)))


def point_gap(point, start, end):
    t = np.clip((point - start) @ (end - start) / ((end - start) @ (end - start)), 0.0, 1.0)
    return float(np.linalg.norm(point - start - t * (end - start)))


def write_stl(path, triangles):
    """Write a binary STL."""
    record = np.zeros(len(triangles), dtype=[('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('rest', '<u2')])
    record['corners'] = triangles
    path.write_bytes(b' ' * 80 + np.array([len(triangles)], '<u4').tobytes() + record.tobytes())


def sphere(count):
    """Return triangles with their corners on the unit sphere."""
    corners = np.random.default_rng(0).normal(size=(count, 3, 3))
    return corners / np.linalg.norm(corners, axis=2)[:, :, None]


@pytest.mark.parametrize('count', [50, MOST_TRIANGLES + 1])
def test_covers_of_a_mesh_hold_all_its_corners(tmp_path, count):
    write_stl(tmp_path / 'a.stl', sphere(count))
    (piece,) = load_shape('l', Shape('mesh', np.array([0.1, 0.2, -0.1]), file='a.stl'), tmp_path)
    corners = (sphere(count).astype('f4') * [0.1, 0.2, -0.1]).reshape(-1, 3)[:: max(1, count // 500)]
    cover = piece.cover
    few = coal.Convex.convexHull(_points(cover.points[: cover.few]), True, 'Qt')
    for body, radius in ((few, cover.radius), (piece.convex, 0.0)):
        gaps = [coal.distance(body, coal.Transform3s(), coal.Sphere(1e-9), coal.Transform3s(np.eye(3), corner),
                              coal.DistanceRequest(), coal.DistanceResult()) for corner in corners]
        assert max(gaps) < radius + 1e-6


def _points(corners):
    points = coal.StdVec_Vec3s()
    points.extend(list(corners))
    return points


COLLADA = '''<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.001" name="millimeter"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">0 0 0 1000 0 0 0 1000 0 0 0 1000</float_array><technique_common>
<accessor source="#a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 2 3 0 3 1 1 3 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>'''


def test_a_text_stl_an_obj_a_dae_and_a_binary_stl_are_the_same_body(tmp_path):
    triangles = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 1, 0], [0, 0, 1]],
                          [[0, 0, 0], [0, 0, 1], [1, 0, 0]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]], float)
    write_stl(tmp_path / 'binary.stl', triangles)
    facets = ''.join('facet normal 0 0 1\nouter loop\n' + ''.join(f'vertex {x} {y} {z}\n' for x, y, z in corners)
                     + 'endloop\nendfacet\n' for corners in triangles)
    (tmp_path / 'text.stl').write_text(f'solid a\n{facets}endsolid a\n')
    (tmp_path / 'a.obj').write_text('v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 3 4\n')
    (tmp_path / 'a.dae').write_text(COLLADA)
    names = 'binary.stl', 'text.stl', 'a.obj', 'a.dae'
    found = [np.array(sorted(map(tuple, read_hulls(tmp_path / name)[0].corners))) for name in names]
    assert found[0].shape == (4, 3)
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], atol=1e-6)


def test_hulls_are_kept_by_the_content_of_the_file(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_files, 'CACHE_FOLDER', tmp_path / 'cache' / 'code')
    write_stl(tmp_path / 'a.stl', box_mesh([0, 0, 0], [1.0, 1.0, 1.0]))
    (first,) = read_hulls(tmp_path / 'a.stl')
    with monkeypatch.context() as patched:
        patched.setattr(mesh_files, 'make_hulls', None)
        (tmp_path / 'a.stl').rename(tmp_path / 'b.stl')
        assert np.array_equal(read_hulls(tmp_path / 'b.stl')[0].corners, first.corners)
    write_stl(tmp_path / 'b.stl', box_mesh([0, 0, 0], [1.0, 1.0, 2.0]))
    assert read_hulls(tmp_path / 'b.stl')[0].corners.max() == 2.0
    for kept in (tmp_path / 'cache' / 'hulls').iterdir():
        kept.write_bytes(b'broken')
    assert read_hulls(tmp_path / 'b.stl')[0].corners.max() == 2.0


def test_the_unit_of_a_dae_counts_for_its_triangles_too_and_one_that_makes_no_sense_is_named(tmp_path):
    (tmp_path / 'a.dae').write_text(COLLADA)
    (piece,) = load_shape('l', Shape('mesh', np.array([2.0, 1.0, 1.0]), file='a.dae'), tmp_path)
    assert np.max(piece.mesh.vertices(), axis=0) == pytest.approx([2.0, 1.0, 1.0], rel=1e-6)
    (tmp_path / 'b.dae').write_text(COLLADA.replace('0.001', '0'))
    with pytest.raises(ModelError, match=r'b\.dae.*its unit is 0 m'):
        load_shape('l', Shape('mesh', np.ones(3), file='b.dae'), tmp_path)


@pytest.mark.parametrize('content', [b'', b'solid', b'\0' * 84, b'not a mesh at all' * 20])
def test_a_broken_mesh_is_named_and_left_out(tmp_path, content):
    (tmp_path / 'a.stl').write_bytes(content)
    urdf = tmp_path / 'a.urdf'
    urdf.write_text(
        '<robot name="r"><link name="a"><collision><geometry><mesh filename="a.stl"/></geometry></collision></link>'
        '<link name="b"/><joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>')
    contacts = load_arm(urdf).contacts
    assert not contacts.known and len(contacts.warnings) == 1
    assert "link 'a'" in contacts.warnings[0] and 'a.stl' in contacts.warnings[0]


def test_a_flat_mesh_is_a_body_too(tmp_path):
    write_stl(tmp_path / 'a.stl', np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]] * 4, float))
    (piece,) = load_shape('l', Shape('mesh', np.ones(3), file='a.stl'), tmp_path)
    ball = coal.Sphere(0.1)
    for height, expected in ((0.3, 0.2), (-0.3, 0.2)):
        gap = coal.distance(piece.convex, coal.Transform3s(), ball,
                            coal.Transform3s(np.eye(3), np.array([0.2, 0.2, height])),
                            coal.DistanceRequest(), coal.DistanceResult())
        assert abs(gap - expected) < 1e-3


def box_mesh(low, high):
    """Return the triangles of a box."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (np.array(high) - low) + low
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.array([corners[list(side)] for a, b, c, d in quads for side in ((a, b, c), (a, c, d))])


def test_a_bent_mesh_is_held_in_parts_that_leave_its_corner_free_and_hold_its_inside(tmp_path):
    bent = np.concatenate([box_mesh([0, 0, 0], [1.0, 0.1, 0.1]), box_mesh([0, 0, 0], [0.1, 0.1, 1.0])])
    write_stl(tmp_path / 'a.stl', bent)
    pieces = load_shape('l', Shape('mesh', np.ones(3), file='a.stl'), tmp_path)
    assert len(pieces) in (2, 3, 4)
    rng = np.random.default_rng(0)
    inside = np.concatenate([rng.uniform([0, 0, 0], [1.0, 0.1, 0.1], (200, 3)),
                             rng.uniform([0, 0, 0], [0.1, 0.1, 1.0], (200, 3))])

    def gap(point):
        ball, at = coal.Sphere(1e-9), coal.Transform3s(np.eye(3), point)
        return min(coal.distance(piece.convex, coal.Transform3s(), ball, at, coal.DistanceRequest(),
                                 coal.DistanceResult()) for piece in pieces)

    assert max(gap(point) for point in inside) < 1e-6
    assert gap(np.array([0.45, 0.05, 0.45])) > 0.05
