"""The environments of the peers: lists of requirements in setup.cfg, each installed as far as pip can."""

from __future__ import annotations

import configparser
import json
import os
import subprocess
import sys
from pathlib import Path

from tqdm import tqdm

from bench.process import ROOT, WorkerError, WorkerProcess

PEERS, COLLISION_PEERS = 'peers', 'collision_peers'  # lists in setup.cfg
# Name of a requirement in setup.cfg -> library in worker.py or collision_loops.py; longer names first
BRINGS = {
    'pin-pink': 'pink', 'mink': 'mink',
    'roboticstoolbox-python': 'rtb', 'pytracik': 'trac_ik', 'optik-py': 'optik', 'pin': 'pinocchio', 'ssik': 'ssik',
    'EAIK': 'eaik',
}  # fmt: skip


def peer_processes() -> tuple[list[WorkerProcess], dict[str, str]]:
    """Start a process for each library that is there; return them, and of the others why not."""
    python, faults = make_environment()
    processes = []
    for library in map(library_of, read_requirements()[1]):
        if library not in faults:
            try:
                processes.append(WorkerProcess(library, python))
            except WorkerError as problem:
                faults[library] = f'does not start: {problem}'
    return processes, faults


def make_environment(group: str = PEERS) -> tuple[str, dict[str, str]]:
    """Create an environment if it is missing; return its Python, and the failed requirements with reasons."""
    folder = Path(os.environ.get(f'ROS_IK_{group.upper()}_VENV') or ROOT / f'.venv-{group.replace("_", "-")}')
    python, stamp = folder / 'bin' / 'python', folder / 'bench.json'
    common, requirements = read_requirements(group)
    wanted = {'python': sys.version, 'requirements': [common, *requirements]}
    if stamp.exists() and (made := json.loads(stamp.read_text()))['wanted'] == wanted:
        return str(python), made['faults']
    print(f'bench: making {folder} for the other solvers, once: a few minutes, about 1 GB', file=sys.stderr)
    subprocess.run([sys.executable, '-m', 'venv', '--clear', str(folder)], check=True)
    faults = {}
    for requirement in tqdm(requirements, desc='installing', leave=False):
        pip = [str(python), '-m', 'pip', 'install', '--quiet', '--disable-pip-version-check', common, requirement]
        done = subprocess.run(pip, capture_output=True, text=True)
        if done.returncode:
            faults[library_of(requirement)] = f'not installable: {last_error(done.stderr)}'
    stamp.write_text(json.dumps({'wanted': wanted, 'faults': faults}))
    return str(python), faults


def read_requirements(group: str = PEERS) -> tuple[str, list[str]]:
    """Return the first line of a list of setup.cfg, which all of it share, and the other lines."""
    config = configparser.ConfigParser()
    config.read(ROOT / 'setup.cfg')
    common, *requirements = config['options.extras_require'][group].split()
    return common, requirements


def library_of(requirement: str) -> str:
    """Return the library that a requirement brings."""
    return next(library for name, library in BRINGS.items() if requirement.startswith(name))


def last_error(text: str) -> str:
    """Return pip's last line with ERROR."""
    lines = [line for line in text.splitlines() if line.startswith('ERROR')]
    return lines[-1].removeprefix('ERROR:').strip() if lines else 'pip failed without a reason'
