"""A network cable between two network namespaces that loses, delays, doubles and reorders as it is told.

What `tc netem` does, in user space: two TAP devices, one in each namespace, and a thread that carries the frames. Not
every kernel has netem, and here the losses come from a seed.
"""

from __future__ import annotations

import contextlib
import fcntl
import heapq
import os
import select
import struct
import subprocess
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from random import Random

DEVICE = 'cable'
TUNSETIFF, IFF_TAP, IFF_NO_PI = 0x400454CA, 0x0002, 0x1000  # <linux/if_tun.h>
LONGEST_FRAME = 65536
IDLE = 0.1  # s, how often the end is looked for


@dataclass(frozen=True)
class Weather:
    """Conditions on the cable: fractions of lost and duplicated frames, delay [s] and jitter [s]."""

    loss: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    doubled: float = 0.0


CLEAR, CUT = Weather(), Weather(loss=1.0)


class Cable(threading.Thread):
    """Carries frames between two devices until it is closed; `weather` may be changed at any time."""

    def __init__(self, ends: tuple[int, int], seed: int) -> None:
        super().__init__(name='cable')
        self.weather = CLEAR
        self.taken = self.lost = 0  # frames
        self._other = dict(zip(ends, reversed(ends)))
        self._random = Random(seed)
        self._on_the_way: list[tuple[float, int, int, bytes]] = []  # a heap: when due, number, to which end, frame
        self._numbers = count()
        self._over = threading.Event()

    def run(self) -> None:
        """Take frames in and hand them out when they are due."""
        while not self._over.is_set():
            due = self._on_the_way[0][0] - time.monotonic() if self._on_the_way else IDLE
            for end in select.select(list(self._other), [], [], min(max(due, 0.0), IDLE))[0]:
                self._take(os.read(end, LONGEST_FRAME), self._other[end])
            while self._on_the_way and self._on_the_way[0][0] <= time.monotonic():
                _, _, end, frame = heapq.heappop(self._on_the_way)
                with contextlib.suppress(OSError):  # the device is not up
                    os.write(end, frame)

    def _take(self, frame: bytes, end: int) -> None:
        """Send a frame once, twice or not at all, depending on the conditions."""
        weather, random = self.weather, self._random
        for _ in range(2 if random.random() < weather.doubled else 1):
            self.taken += 1
            if random.random() < weather.loss:
                self.lost += 1
            else:
                delay = weather.delay + weather.jitter * random.uniform(-1.0, 1.0)
                heapq.heappush(self._on_the_way, (time.monotonic() + delay, next(self._numbers), end, frame))

    def close(self) -> None:
        """End the thread."""
        self._over.set()
        self.join()


@contextlib.contextmanager
def cable_between(addresses: dict[str, str], seed: int) -> Iterator[Cable]:
    """Make a network namespace for each address (by its name), and lay a cable; all is gone in the end."""
    with contextlib.ExitStack() as stack:
        ends = [stack.enter_context(_end(name, address)) for name, address in addresses.items()]
        cable = Cable((ends[0], ends[1]), seed)
        cable.start()
        stack.callback(cable.close)
        yield cable


@contextlib.contextmanager
def _end(namespace: str, address: str) -> Iterator[int]:
    """Make a namespace with one end of a cable; yield the file through which its frames pass."""
    ip('netns', 'add', namespace)
    end = os.open('/dev/net/tun', os.O_RDWR | os.O_NONBLOCK)
    try:
        made_here = f'tap{os.getpid()}'[:15]
        fcntl.ioctl(end, TUNSETIFF, struct.pack('16sH22x', made_here.encode(), IFF_TAP | IFF_NO_PI))
        ip('link', 'set', made_here, 'netns', namespace, 'name', DEVICE)
        ip('-n', namespace, 'addr', 'add', address, 'dev', DEVICE)
        for device in ('lo', DEVICE):
            ip('-n', namespace, 'link', 'set', device, 'up')
        ip('-n', namespace, 'route', 'add', '224.0.0.0/4', 'dev', DEVICE)  # discovery is multicast
        yield end
    finally:
        os.close(end)
        ip('netns', 'delete', namespace)


def ip(*words: str) -> None:
    """Run `ip`, which reports its errors on standard error."""
    subprocess.run(['ip', *words], check=True)
