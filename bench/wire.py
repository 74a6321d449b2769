"""Messages between processes with different NumPy releases: a line of JSON, then float64 arrays."""

from __future__ import annotations

import json
import math
from typing import Any, BinaryIO

import numpy as np


def send(stream: BinaryIO, header: dict[str, Any], *arrays: np.ndarray) -> None:
    """Write one message."""
    shapes = [np.shape(array) for array in arrays]
    stream.write(json.dumps({**header, 'shapes': shapes}).encode() + b'\n')
    for array in arrays:
        stream.write(np.asarray(array, dtype=np.float64).tobytes())
    stream.flush()


def receive(stream: BinaryIO) -> tuple[dict[str, Any], list[np.ndarray]] | None:
    """Return one message, or None if the other side has closed the stream."""
    line = stream.readline()
    if not line:
        return None
    header = json.loads(line)
    return header, [_read_array(stream, shape) for shape in header.pop('shapes')]


def _read_array(stream: BinaryIO, shape: list[int]) -> np.ndarray:
    """Read one array, writable."""
    return np.frombuffer(stream.read(8 * math.prod(shape)), dtype=np.float64).reshape(shape).copy()
