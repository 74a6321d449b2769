"""Where the package finds its own files, in each way that it can be installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest


@pytest.fixture
def installed(root, tmp_path):
    """Copy the module away from the source tree; return what asks it for the share directory."""
    package = tmp_path / 'site' / 'ros_ik_pkg'
    package.mkdir(parents=True)
    (package / '__init__.py').touch()
    shutil.copy(root / 'ros_ik_pkg' / 'share.py', package)

    script = f"""import sys
sys.prefix = {str(tmp_path / 'python')!r}
from ros_ik_pkg.share import share_path
print(share_path())
"""

    def ask(**places):
        environment = {**os.environ, 'PYTHONPATH': str(package.parent), 'AMENT_PREFIX_PATH': '', **places}
        command = [sys.executable, '-c', script]
        return subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )

    return ask


def make_share(prefix):
    """Install a share directory under a prefix, and the marker that the ament index looks for."""
    share = prefix / 'share' / 'ros_ik_pkg'
    (share / 'config' / 'robots').mkdir(parents=True)
    marker = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages'
    marker.mkdir(parents=True)
    (marker / 'ros_ik_pkg').touch()
    return share


def test_a_sourced_workspace_is_asked_through_the_ament_index(installed, tmp_path):
    pytest.importorskip('ament_index_python')
    share = make_share(tmp_path / 'workspace')
    assert installed(AMENT_PREFIX_PATH=str(tmp_path / 'workspace')).stdout.strip() == str(share)


@pytest.mark.parametrize('place', ['python', 'user', 'site'])
def test_without_ros_the_share_that_pip_fills_is_found(installed, tmp_path, place):
    share = make_share(tmp_path / place)
    assert installed(PYTHONUSERBASE=str(tmp_path / 'user')).stdout.strip() == str(share)


def test_an_installation_without_its_files_says_where_it_looked(installed, tmp_path):
    result = installed(PYTHONUSERBASE=str(tmp_path / 'user'))
    assert result.returncode != 0
    assert 'no config/robots in any of' in result.stderr
    assert str(tmp_path / 'python' / 'share' / 'ros_ik_pkg') in result.stderr
