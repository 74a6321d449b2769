"""Choose a separate ROS domain, so that programs on one machine do not interfere."""

from __future__ import annotations

import contextlib
import fcntl
import os
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

# Above 101 the ports of a domain meet those that Linux gives to other programs.
DOMAINS = range(1, 102)


@contextlib.contextmanager
def own_domain() -> Iterator[int]:
    """Claim a ROS domain and set ROS_DOMAIN_ID to it for this process and its children.

    The claim is a locked file, which the system releases however the process ends.
    Raises RuntimeError when every domain is claimed.
    """
    with contextlib.ExitStack() as claims:
        domain = next((number for number in _shuffled() if _claim(number, claims)), None)
        if domain is None:
            raise RuntimeError(f'every ROS domain from {DOMAINS[0]} to {DOMAINS[-1]} is claimed')
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        yield domain


def _shuffled() -> list[int]:
    return random.Random().sample(DOMAINS, len(DOMAINS))


def _claim(domain: int, claims: contextlib.ExitStack) -> bool:
    """Try to lock the file of a domain; the lock lasts as long as `claims`."""
    path = Path(tempfile.gettempdir(), f'ros_ik_pkg_domain_{domain}.lock')
    try:
        file = path.open('a')
    except OSError:  # another user's
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        return False
    claims.enter_context(file)
    return True
