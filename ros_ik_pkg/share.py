"""Where the files that come with the package are: robots, parameters, launch files."""

from __future__ import annotations

import site
import sys
from pathlib import Path

PACKAGE = 'ros_ik_pkg'


def share_path() -> Path:
    """Return the directory that holds `config/`: the source tree, else the ament index, else pip's share.

    Raises FileNotFoundError, with the places that were looked at, where the package is not installed whole.
    """
    here = Path(__file__).resolve().parents[1]
    places = [here, *_ament_share(), *(Path(prefix) / 'share' / PACKAGE
                                       for prefix in (sys.prefix, site.getuserbase(), here))]
    for place in places:
        if (place / 'config' / 'robots').is_dir():
            return place
    raise FileNotFoundError(f'{PACKAGE}: no config/robots in any of {", ".join(map(str, places))}; '
                            'install the package again')


def _ament_share() -> list[Path]:
    """Ask the ament index of a sourced ROS workspace; empty without ROS."""
    try:
        from ament_index_python import PackageNotFoundError, get_package_share_directory
    except ImportError:
        return []
    try:
        return [Path(get_package_share_directory(PACKAGE))]
    except (PackageNotFoundError, LookupError, OSError):
        return []
