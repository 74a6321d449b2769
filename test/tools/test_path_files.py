"""Paths in files: what is read, and which row is refused."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from ros_ik_pkg.tools.path_files import read_path_file

CSV = 'x,y,z,roll,pitch,yaw,time\n0.5,0,0.3,0,90,0,0\n0.5,0.1,0.3,0,90,10,2\n'
YAML = '- {x: 0.5, y: 0, z: 0.3, qx: 0, qy: 0, qz: 0, qw: 1}\n- {x: 1e-1, y: 0, z: 0.3, qx: 1, qy: 0, qz: 0, qw: 0}\n'


def write(tmp_path, text, name='path.csv'):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_rows_of_a_csv_are_poses_with_times(tmp_path):
    poses, times, vias = read_path_file(write(tmp_path, CSV), degrees=True)
    assert vias == ()
    np.testing.assert_allclose(times, [0.0, 2.0])
    np.testing.assert_allclose(poses[1, :3, 3], [0.5, 0.1, 0.3])
    np.testing.assert_allclose(poses[1, :3, :3], pin.rpy.rpyToMatrix(0.0, np.pi / 2, np.radians(10.0)), atol=1e-12)


def test_a_list_of_a_yaml_is_poses_without_times(tmp_path):
    poses, times, _ = read_path_file(write(tmp_path, YAML, 'path.yaml'))
    assert times is None and poses.shape == (2, 4, 4)
    np.testing.assert_allclose(poses[1, :3, :3], np.diag([1.0, -1.0, -1.0]), atol=1e-12)
    assert poses[1, 0, 3] == 0.1


def test_rows_in_the_middle_of_an_arc_are_marked(tmp_path):
    rows = 'x,y,z,roll,pitch,yaw,via\n0.5,0,0.3,0,0,0,\n0.5,0.1,0.3,0,0,0,1\n0.6,0.1,0.3,0,0,0,0\n'
    assert read_path_file(write(tmp_path, rows)).vias == (1,)
    rows = ''.join(f'- {{x: {x}, y: 0, z: 0.3, qx: 0, qy: 0, qz: 0, qw: 1{via}}}\n'
                   for x, via in enumerate(('', ', via: true', ', via: false', ', via: yes', '')))  # fmt: skip
    assert read_path_file(write(tmp_path, rows, 'path.yaml')).vias == (1, 3)


@pytest.mark.parametrize(
    ('text', 'name', 'reason'),
    [
        ('x,y,z,roll,pitch,yaw\n0,0,0,0,0,0\n0,0,nan,0,0,0\n', 'path.csv', 'row 1: z'),
        ('x,y,z\n0,0,0\n', 'path.csv', 'row 0 has no roll'),
        ('x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,2\n', 'path.csv', 'row 0: the quaternion'),
        ('x,y,z,rol,pitch,yaw\n0,0,0,0,0,0\n', 'path.csv', "'rol' is not known"),
        ('- {x: 0, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0, time: 1}\n- {x: 0, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0}\n',
         'path.yaml', 'row 1 has no time'),
        ('x,y,z,roll,pitch,yaw,via\n0,0,0,0,0,0,0\n0,0,0,0,0,0,2\n', 'path.csv', 'row 1: via'),
        ('x: 1\n', 'path.yaml', 'list of mappings'),
        ('- [\n', 'path.yaml', 'no YAML'),
    ],
)  # fmt: skip
def test_a_file_that_holds_no_path_is_refused_by_row(tmp_path, text, name, reason):
    with pytest.raises(ValueError, match=reason):
        read_path_file(write(tmp_path, text, name))
