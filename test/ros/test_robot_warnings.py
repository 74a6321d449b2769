"""What is odd about a robot's description is logged when the node loads it."""

from __future__ import annotations

import pytest
from chains import chain
from ros_helpers import Client, allow_lark, connected

pytestmark = [allow_lark, pytest.mark.newest]

WARNING = "robot made_up: joint 'one': <limit velocity> is -1.0; it is read as no limit"


def test_warnings_are_logged_once_each_time_the_robot_is_loaded(tmp_path):
    odd, log = tmp_path / 'odd.urdf', tmp_path / 'log'
    odd.write_text(chain(('one', 'revolute', {'velocity': -1.0}), ('two', 'revolute', {})))
    with connected(Client, log, '-p', f'robot:={odd}') as client:
        assert log.read_text().count(WARNING) == 1
        client.set_parameters({'method': 'sdls'})
        assert log.read_text().count(WARNING) == 1
        client.set_parameters({'robot': str(odd)})
        assert log.read_text().count(WARNING) == 2
