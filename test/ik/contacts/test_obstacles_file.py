"""Obstacles from YAML: read, or refused by name and reason."""

from __future__ import annotations

import numpy as np
import pytest

from ros_ik_pkg.ik import ModelError
from ros_ik_pkg.ik.contacts.obstacles_file import read_obstacles

TEXT = '''
obstacles:
  - {name: table, box: [1.0, 0.8, 0.05], xyz: [0.5, 0, -0.1], rpy: [0, 0, 1.5707963267948966]}
  - {name: ball, sphere: 0.1}
  - {name: rod, cylinder: [0.01, 0.3], link: hand, touches: [left, right]}
'''


def test_obstacles_are_read_from_text_and_file(tmp_path):
    path = tmp_path / 'room.yaml'
    path.write_text(TEXT)
    for source in (TEXT, path, path.as_uri()):
        table, ball, rod = read_obstacles(source)
        assert (table.kind, ball.kind, rod.kind) == ('box', 'sphere', 'cylinder')
        assert np.allclose(table.shape.frame_from_shape[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
        assert np.allclose(table.shape.frame_from_shape[:3, 3], [0.5, 0.0, -0.1])
        assert (rod.link, rod.touches) == ('hand', ('left', 'right'))


@pytest.mark.parametrize(('text', 'reason'), [
    ('a: 1', 'expected the key obstacles'),
    ('obstacles: {a: 1}', 'expected the key obstacles with a list'),
    ('obstacles: [1]', 'obstacle 0 has no name'),
    ('obstacles: [{name: a}]', "'a' has 0 shapes"),
    ('obstacles: [{name: a, box: [1, 1, 1], sphere: 1}]', "'a' has 2 shapes"),
    ('obstacles: [{name: a, box: [1, 0, 1]}]', 'length along y of a box is 0'),
    ('obstacles: [{name: a, box: [1, 1]}]', 'has 2 numbers; expected 3'),
    ('obstacles: [{name: a, bocks: [1, 1, 1]}]', "unknown key 'bocks'; did you mean"),
    ('obstacles: [{name: a, sphere: 1, xyz: [0, 0]}]', 'xyz and rpy are three numbers'),
    ('obstacles: [{name: a, sphere: 1, xyz: [.nan, 0, 0]}]', 'pose is not a finite'),
    ('obstacles: [{name: a, sphere: 1, touches: hand}]', 'expected a list of links'),
    ('obstacles: [}', 'not well-formed YAML'),
    ('/nowhere/room.yaml', 'cannot read'),
])  # fmt: skip
def test_what_makes_no_sense_is_refused(text, reason):
    with pytest.raises(ModelError, match=reason):
        read_obstacles(text)
