"""moveit_msgs for tests and measurements: the real package, or the stand-in, made once and kept."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

STAND_IN = Path(__file__).parent / 'moveit_stand_in'


def why_not() -> str:
    """Say why there can be no moveit_msgs here; empty if it is there or can be made."""
    if importlib.util.find_spec('moveit_msgs'):
        return ''
    if not (Path(sys.prefix) / 'share' / 'rosidl_generator_py').is_dir():
        return f'neither moveit_msgs nor the generators of rosidl in {sys.prefix}'
    missing = [name for name in ('catkin_pkg', 'em', 'lark') if not importlib.util.find_spec(name)]
    if missing:  # which the wheels of the generators import without asking for them; those of colcon bring them
        return f'neither moveit_msgs nor {", ".join(missing)}, which the generators of rosidl need'
    if not Path(sysconfig.get_path('include'), 'Python.h').exists():
        return 'neither moveit_msgs nor the headers of Python'
    return '' if shutil.which('g++') else 'neither moveit_msgs nor a C++ compiler'


def provide(cache: Path) -> None:
    """Let this process, and those that it starts, import moveit_msgs; the stand-in is kept in the folder `cache`."""
    if importlib.util.find_spec('moveit_msgs'):
        return
    sources = b''.join(path.read_bytes() for path in sorted(STAND_IN.glob('*.py')))
    key = hashlib.sha256(sources + f'{sys.prefix} {sys.version}'.encode()).hexdigest()[:16]
    subprocess.run([sys.executable, STAND_IN / 'build.py', cache / key], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)  # fmt: skip
    sys.path.insert(0, str(cache / key))
    os.environ['PYTHONPATH'] = os.pathsep.join([str(cache / key), *filter(None, [os.environ.get('PYTHONPATH')])])
