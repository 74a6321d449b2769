"""Location of the files that come with the package: robots, parameters, launch files, package.xml."""

from __future__ import annotations

import re
import site
import sys
from pathlib import Path

PACKAGE = 'ros_ik_pkg'


def share_path() -> Path:
    """Return the directory that holds `config/`: the source tree, else the ament share, else pip's share.

    Raises FileNotFoundError, which lists the directories that were searched, if the installation is incomplete.
    """
    here = Path(__file__).resolve().parents[1]
    places = [here, *_ament_share(), *(Path(prefix) / 'share' / PACKAGE
                                       for prefix in (sys.prefix, site.getuserbase(), here))]
    for place in places:
        if (place / 'config' / 'robots').is_dir():
            return place
    raise FileNotFoundError(f'{PACKAGE}: no config/robots in any of {", ".join(map(str, places))}; '
                            'install the package again')


def version() -> str:
    """Return the version in package.xml, the only place that states it."""
    found = re.search(r'<version>(.*?)</version>', (share_path() / 'package.xml').read_text(encoding='utf-8'))
    if found is None:
        raise ValueError(f'{share_path()}/package.xml has no version')
    return found[1]


def _ament_share() -> list[Path]:
    """Return the share directory of a sourced ROS workspace, if there is one."""
    try:
        from ament_index_python import PackageNotFoundError, get_package_share_directory
    except ImportError:
        return []
    try:
        return [Path(get_package_share_directory(PACKAGE))]
    except (PackageNotFoundError, LookupError, OSError):
        return []
