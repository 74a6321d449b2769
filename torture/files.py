"""URDF and DH files: the shipped tables and generated arms with parts cut, doubled, swapped or replaced, and hostile
files: cyclic, endless, nested a million deep, entity bombs, aliases of aliases, wrong types. Each file loads into
an arm with finite kinematics, or is refused with an error that names the file or the robot, and the place in it: a
line or position, or a joint, link, key or element in the file. A separate process with limited memory loads them,
and is ended if a file takes too long.
"""

from __future__ import annotations

import os
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random

import numpy as np

from bench.random_arms import random_urdf
from ros_ik_pkg.ik import robot_names
from ros_ik_pkg.share import share_path
from torture.hostile import HOSTILE
from torture.loader import MOST_MEMORY, Loader
from torture.plan import Check, Plan, progress, unless

COUNT = 20_000
PIECES = (
    '', '0', '-1', '1e308', 'nan', 'inf', '"', '<', '>', '{', '[', ':', '&x;', '\x00', 'base', 'tip', 'revolute', '٣',
    '\t- ',
)  # fmt: skip
MOST_SECONDS = 5.0  # of CPU time for one file; the largest that is read has 32 MB


def run(plan: Plan) -> Iterator[Check]:
    """Load mutated files, then hostile ones, then a pipe."""
    with tempfile.TemporaryDirectory(prefix='ros_ik_pkg_torture_') as folder, Loader() as loader:
        yield from fuzz(Random(plan.seed), plan.count or COUNT, Path(folder), loader)
        yield from hostile(Path(folder), loader)
        yield special(Path(folder), loader)
        fault = unless(loader.peak < MOST_MEMORY, 'too much')
        yield Check('memory at the peak', f'{loader.peak:.0f} MB more', fault)


def fuzz(random: Random, count: int, folder: Path, loader: Loader) -> Iterator[Check]:
    """Load files that were good before something happened to them."""
    tally, slowest, fault = Counter(), 0.0, ''
    originals = _originals(random)
    for _ in progress(range(count), 'files'):
        suffix, text = random.choice(originals)
        path = folder / f'robot{suffix}'
        path.write_text(mutated(random, text), encoding='utf-8')
        done = loader.load(path)
        tally[done.outcome] += 1
        slowest = max(slowest, done.seconds)
        if fault := done.fault:
            break
    yield Check('files with pieces changed: loaded, refused', f'{tally["loaded"]}, {tally["refused"]}', fault)
    yield Check('slowest of them', f'{1e3 * slowest:.0f} ms', unless(slowest < MOST_SECONDS, 'too slow'))


def _originals(random: Random) -> list[tuple[str, str]]:
    """Return suffix and text of good files of both kinds."""
    tables = [share_path() / 'config' / 'robots' / f'{name}.yaml' for name in robot_names()]
    arms = [random_urdf(np.random.default_rng(random.getrandbits(32))) for _ in tables]
    shapes = str(share_path() / 'config' / 'shapes')  # the tables are changed in another folder
    return [*(('.yaml', path.read_text().replace('../shapes', shapes)) for path in tables),
            *(('.urdf', text) for text in arms)]


def mutated(random: Random, text: str) -> str:
    """Change a text in one to three places."""
    for _ in range(random.randint(1, 3)):
        start = random.randrange(len(text) + 1)
        end = min(len(text), start + random.choice((0, 1, 5, 40, 400)))
        piece = random.choice((random.choice(PIECES), text[start:end] * 2, text[end : end + 30], text[start:end][::-1]))
        text = text[:start] + piece + (text[end:] if random.random() < 0.9 else '')
    return text


def hostile(folder: Path, loader: Loader) -> Iterator[Check]:
    """Load each hostile file; all of them must be refused."""
    for name, (suffix, make) in progress(HOSTILE.items(), 'hostile files'):
        path = folder / f'hostile{suffix}'
        content = make()
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        done = loader.load(path)
        slow = unless(done.seconds < MOST_SECONDS, 'too slow')
        fault = done.fault or unless(done.outcome == 'refused', done.outcome) or slow
        yield Check(name, f'{done.outcome} in {1e3 * done.seconds:.0f} ms', fault)


def special(folder: Path, loader: Loader) -> Check:
    """Load a pipe without a writer, which would block a reader forever."""
    path = folder / 'pipe.urdf'
    os.mkfifo(path)
    done = loader.load(path)
    fault = done.fault or unless(done.outcome == 'refused', 'read')
    return Check('a named pipe instead of a file', done.outcome, fault)
