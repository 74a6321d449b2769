"""URDF and DH files: the shipped tables and made-up arms with pieces cut, doubled, swapped or replaced, and files that
are built to hurt: cyclic, endless, nested a million deep, entity bombs, aliases of aliases, wrong types. Each loads
into an arm whose kinematics is finite, or is refused with an error that names the file or the robot, and the place in
it, in bounded time and memory.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random

import numpy as np

from bench.process import ROOT
from bench.random_arms import random_urdf
from ros_ik_pkg.ik import ModelError, load_arm, robot_names
from ros_ik_pkg.share import share_path
from torture.hostile import HOSTILE
from torture.plan import Check, Plan, progress, unless

COUNT = 20_000
PIECES = (
    '', '0', '-1', '1e308', 'nan', 'inf', '"', '<', '>', '{', '[', ':', '&x;', '\x00', 'base', 'tip', 'revolute', '٣',
    '\t- ',
)  # fmt: skip
MOST_SECONDS = 5.0  # of CPU time for one file; the largest that is read has 32 MB
MOST_MEMORY = 800.0  # MB that loading may add at its peak
LONGEST_ERROR = 2000  # characters
HANG = 20.0  # s


def run(plan: Plan) -> Iterator[Check]:
    """Mutate good files, then try the hostile ones, then files that are none."""
    with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as folder:
        before, count = _peak_memory(), plan.count or COUNT
        yield from fuzz(Random(plan.seed), count, Path(folder))
        yield from hostile(Path(folder))
        growth = _peak_memory() - before
        yield Check('memory at the peak', f'{growth:.0f} MB more', unless(growth < MOST_MEMORY, 'too much'))
        yield special(Path(folder))


def fuzz(random: Random, count: int, folder: Path) -> Iterator[Check]:
    """Load files that were good before something happened to them."""
    tally, slowest, fault = Counter(), 0.0, ''
    originals = _originals(random)
    for _ in progress(range(count), 'files'):
        suffix, text = random.choice(originals)
        path = folder / f'robot{suffix}'
        path.write_text(mutated(random, text), encoding='utf-8')
        outcome, seconds, fault = load(path)
        tally[outcome] += 1
        slowest = max(slowest, seconds)
        if fault:
            break
    yield Check('files with pieces changed: loaded, refused', f'{tally["loaded"]}, {tally["refused"]}', fault)
    yield Check('slowest of them', f'{1e3 * slowest:.0f} ms', unless(slowest < MOST_SECONDS, 'too slow'))


def _originals(random: Random) -> list[tuple[str, str]]:
    """Return suffix and text of good files of both kinds."""
    tables = [share_path() / 'config' / 'robots' / f'{name}.yaml' for name in robot_names()]
    arms = [random_urdf(np.random.default_rng(random.getrandbits(32))) for _ in tables]
    return [*(('.yaml', path.read_text()) for path in tables), *(('.urdf', text) for text in arms)]


def mutated(random: Random, text: str) -> str:
    """Change a text in one to three places."""
    for _ in range(random.randint(1, 3)):
        start = random.randrange(len(text) + 1)
        end = min(len(text), start + random.choice((0, 1, 5, 40, 400)))
        piece = random.choice((random.choice(PIECES), text[start:end] * 2, text[end : end + 30], text[start:end][::-1]))
        text = text[:start] + piece + (text[end:] if random.random() < 0.9 else '')
    return text


def load(path: Path) -> tuple[str, float, str]:
    """Load a file and use it; return what became of it, the CPU time [s], and what is wrong with that."""
    began = time.thread_time()
    try:
        arm = load_arm(path)
        fault = unless(bool(np.isfinite(arm.forward(arm.home)).all()), 'the kinematics is not finite')
        return 'loaded', time.thread_time() - began, fault and f'{fault}: {path.read_bytes()[:2000]!r}'
    except ModelError as error:
        return 'refused', time.thread_time() - began, _badly_said(path, str(error))
    except Exception as error:
        return 'raised', 0.0, f'{type(error).__name__}: {error}: {path.read_bytes()[:2000]!r}'


def _badly_said(path: Path, error: str) -> str:
    """Say what is wrong with an error: it names the file or the robot, and something in it, and fills no log."""
    if not error.startswith((f'{path}: ', "robot '")) or len(error) < len(str(path)) + 5:
        return f'an error that names no place: {error[:500]}'
    return unless(len(error) < LONGEST_ERROR, f'an error of {len(error)} characters: {error[:200]}')


def hostile(folder: Path) -> Iterator[Check]:
    """Load each of the files that are built to hurt; none of them is a robot."""
    for name, (suffix, make) in progress(HOSTILE.items(), 'hostile files'):
        path = folder / f'hostile{suffix}'
        content = make()
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        outcome, seconds, fault = load(path)
        fault = fault or unless(outcome == 'refused', outcome) or unless(seconds < MOST_SECONDS, 'too slow')
        yield Check(name, f'{outcome} in {1e3 * seconds:.0f} ms', fault)


def special(folder: Path) -> Check:
    """Load a pipe that nobody writes to, in a process of its own because reading it might take for ever."""
    what, path = 'a named pipe instead of a file', folder / 'pipe.urdf'
    subprocess.run(['mkfifo', str(path)], check=True)
    code = 'import sys; from torture.files import load; from pathlib import Path; print(load(Path(sys.argv[1]))[0])'
    try:
        done = subprocess.run(
            [sys.executable, '-c', code, str(path)], cwd=ROOT, timeout=HANG, capture_output=True, text=True
        )
    except subprocess.TimeoutExpired:
        return Check(what, '', 'reading it never ends')
    return Check(what, done.stdout.strip(), unless(done.stdout.strip() == 'refused', done.stderr[-500:]))


def _peak_memory() -> float:
    """Return the largest resident memory of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
