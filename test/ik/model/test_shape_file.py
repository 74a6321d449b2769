"""Shapes of a DH table in a file of their own: read in the frames of the table, and every way the file can be wrong."""

from __future__ import annotations

import numpy as np
import pytest

from ros_ik_pkg.ik import ModelError, load_arm

TABLE = '''name: two
source: made up
convention: standard
angles: radians
base_frame: base
tip_frame: tip
shapes: two.urdf
joints:
  - {name: a, type: revolute, a: 0.5, alpha: 0, d: 0, theta: 0, lower: -3, upper: 3, radius: 0.02}
  - {name: b, type: revolute, a: 0.5, alpha: 0, d: 0, theta: 0, lower: -3, upper: 3}
  - {name: c, type: revolute, a: 0.2, alpha: 0, d: 0, theta: 0, lower: -3, upper: 3}
'''
BALL = '<collision><origin xyz="{0} 0 0"/><geometry><sphere radius="0.05"/></geometry></collision>'
SHAPES = (f'<robot name="two"><link name="base">{BALL.format(0)}</link><link name="link3">{BALL.format(0)}</link>'
          '{}</robot>')
BARE = SHAPES.format('')
ALLOWED = '<disable_collisions link1="base" link2="link3" reason="made up"/>'


def load(folder, shapes=BARE, table=TABLE):
    (folder / 'two.yaml').write_text(table)
    (folder / 'two.urdf').write_text(shapes)
    return load_arm(folder / 'two.yaml')


def test_shapes_are_in_the_frames_of_the_table_beside_the_capsules_of_its_rows(tmp_path):
    arm = load(tmp_path)
    kinds = {link: [shape.kind for shape in shapes] for link, shapes in arm.tree.shapes.items()}
    assert kinds == {'base': ['sphere'], 'link1': ['capsule'], 'link3': ['sphere']}
    for q in ([0.1, 2.5, -0.4], [0.0, 1.2, 0.9]):
        apart = np.linalg.norm(arm.base_from_frame('link3', dict(zip('abc', q)))[:3, 3]) - 0.1
        found = arm.contacts.look(np.array(q))
        assert found.links == ('base', 'link3') and found.clearance == pytest.approx(apart, abs=1e-5)


def test_pairs_of_the_file_may_touch_unless_an_srdf_says_otherwise(tmp_path):
    folded = np.array([0.0, np.pi - 0.5, -1.2])
    free = load(tmp_path)
    assert not free.contacts.left_out[-1].reason.startswith('SRDF')
    arm = load(tmp_path, SHAPES.format(ALLOWED))
    assert ('base', 'link3', 'file of shapes: made up') in arm.contacts.left_out
    other = '<robot name="two"><disable_collisions link1="base" link2="link1" reason="other"/></robot>'
    asked = load_arm(tmp_path / 'two.yaml', srdf=other)
    assert [pair[:2] for pair in asked.contacts.left_out] == [('base', 'link1')]
    assert free.contacts.is_clear(folded) == asked.contacts.is_clear(folded)


def test_a_shape_that_makes_no_sense_is_left_out_with_a_warning_and_the_others_stay(tmp_path):
    arm = load(tmp_path, SHAPES.format('<link name="link2"><collision/></link>'))
    assert arm.contacts.known and len(arm.contacts.warnings) == 1 and "link 'link2'" in arm.contacts.warnings[0]


def test_a_mesh_is_searched_beside_the_file(tmp_path):
    (tmp_path / 'sub').mkdir()
    (tmp_path / 'sub' / 'a.obj').write_text('v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 3 4\n')
    mesh = '<link name="link2"><collision><geometry><mesh filename="a.obj"/></geometry></collision></link>'
    (tmp_path / 'sub' / 'two.urdf').write_text(SHAPES.format(mesh))
    (tmp_path / 'two.yaml').write_text(TABLE.replace('two.urdf', 'sub/two.urdf'))
    arm = load_arm(tmp_path / 'two.yaml')
    assert not arm.contacts.warnings and 'link2' in arm.contacts.links


@pytest.mark.parametrize(('shapes', 'words'), [
    ('', 'line 1, column 1: not well-formed XML'),
    ('<robot name="two"/>', 'two.urdf; expected <robot> with <link> elements'),
    (SHAPES.format(f'<link name="lnk2">{BALL.format(0)}</link>'), "link 'lnk2' does not exist; did you mean link2"),
    ('<robot>' + ' ' * 40_000_000, 'bytes; at most'),
])
def test_a_file_that_cannot_be_used_is_refused_by_name(tmp_path, shapes, words):
    with pytest.raises(ModelError) as caught:
        load(tmp_path, shapes)
    assert "shapes 'two.urdf': " in str(caught.value) and words in str(caught.value)


@pytest.mark.parametrize(('file', 'reason'), [
    ('nowhere.urdf', 'No such file'), ('.', 'no regular file'), ('/dev/null', 'no regular file'),
    ('"a\\0b"', 'null'),
])
def test_a_file_that_is_not_there_is_refused(tmp_path, file, reason):
    with pytest.raises(ModelError, match=f"shapes '.*': cannot read .*{reason}"):
        load(tmp_path, table=TABLE.replace('two.urdf', file))


def test_pairs_of_another_robot_are_refused(tmp_path):
    arm = load(tmp_path, SHAPES.format(ALLOWED).replace('name="two"', 'name="three"'))
    with pytest.raises(ModelError, match="for robot 'three'; expected one for 'two'"):
        _ = arm.contacts
