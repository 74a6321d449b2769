"""Input and findings of a section."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar('Item')
LONGEST = 500  # characters of a fault in the summary


@dataclass(frozen=True)
class Plan:
    """The size of a run: the random `seed`, and `count` or `minutes`, or the section's default.

    `group`: the only group of the section solves to run, None for all.
    """

    seed: int = 2026
    count: int | None = None
    minutes: float | None = None
    group: int | None = None

    @property
    def whole(self) -> bool:
        """Whether every section is as large as it should be."""
        return self.count is None and self.minutes is None and self.group is None

    def words(self, again: str = '') -> str:
        """Return the options of a command line that does the same; `again` are those of one check."""
        given = {'seed': self.seed, 'count': self.count, 'minutes': self.minutes, 'group': self.group}
        words = [f'--{name} {value}' for name, value in given.items() if value is not None]
        return ' '.join([*words, again]) if again and self.group is None else ' '.join(words)

    def seconds(self, default: float) -> float:
        """Return a duration [s]: that of the user, or `default`."""
        return default if self.minutes is None else 60.0 * self.minutes


@dataclass(frozen=True)
class Check:
    """One line of the summary: the subject, its figure, and the fault, which is empty if it is right.

    again: options that reproduce the fault with less of the section.
    """

    what: str
    figure: str
    fault: str = ''
    again: str = ''

    @property
    def verdict(self) -> str:
        """The last column of the summary."""
        if self.skipped:
            return self.fault
        return f'WRONG: {self.fault[:LONGEST]!r}'.replace('|', '\\|') if self.fault else 'right'

    @property
    def skipped(self) -> bool:
        """Whether this machine cannot try it."""
        return self.fault.startswith('skipped')

    @property
    def wrong(self) -> bool:
        """Return whether this is a fault; checks that this machine cannot run are not."""
        return bool(self.fault) and not self.skipped


def skipped(what: str, reason: str) -> Check:
    """Return the line of something that this machine does not allow."""
    return Check(what, '', f'skipped: {reason}')


def unless(holds: bool, fault: str) -> str:
    """Return the fault, or an empty text if the condition is true."""
    return '' if holds else fault


def progress(items: Iterable[Item], text: str, total: int | None = None) -> Iterator[Item]:
    """Go through items with a progress bar that is gone afterwards."""
    return iter(tqdm(items, desc=text, total=total, leave=False))


def watching(seconds: float, text: str, over: Callable[[], bool]) -> Iterator[float]:
    """Yield the time [s] since the begin until it is over, however long that takes; the caller does the waiting."""
    began = time.monotonic()
    with tqdm(total=round(seconds), desc=text, unit='s', leave=False) as bar:
        while not over():
            elapsed = time.monotonic() - began
            bar.update(min(int(elapsed), bar.total) - bar.n)
            yield elapsed


def ticking(seconds: float, text: str) -> Iterator[float]:
    """Yield the time [s] since the begin until it is over, with a progress bar; the caller does the waiting."""
    began = time.monotonic()
    with tqdm(total=round(seconds), desc=text, unit='s', leave=False) as bar:
        while (elapsed := time.monotonic() - began) < seconds:
            bar.update(int(elapsed) - bar.n)
            yield elapsed
