"""The machine and the versions of a measurement."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
from importlib.metadata import version
from pathlib import Path

from bench.process import ROOT

LIBRARIES = ('numpy', 'numba', 'pin')


def describe(command: str) -> list[list[str]]:
    """Return a table of date, machine, versions and command line."""
    load = os.getloadavg()[0]
    versions = {'Python': platform.python_version(), **{name: version(name) for name in LIBRARIES}}
    return [
        ['what', 'value'],
        ['date', f'{datetime.datetime.now().astimezone():%Y-%m-%d %H:%M %Z}'],
        ['command', f'`{command}`'],
        ['commit', _commit()],
        ['processor', f'{_processor()}, {len(os.sched_getaffinity(0))} cores, load {load:.1f} at the start'],
        ['system', f'{platform.system()} {platform.release()}, {platform.machine()}'],
        ['versions', ', '.join(f'{name} {number}' for name, number in versions.items())],
    ]


def _processor() -> str:
    """Return the name of the processor from /proc/cpuinfo."""
    for line in Path('/proc/cpuinfo').read_text().splitlines():
        if line.startswith('model name'):
            return line.split(':', 1)[1].strip()
    return platform.processor() or 'unknown'


def _commit() -> str:
    """Return the measured commit, with a '+' if files are changed."""
    try:
        command = ['git', '-C', str(ROOT), 'describe', '--always', '--dirty=+', '--abbrev=12']
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return 'unknown'
