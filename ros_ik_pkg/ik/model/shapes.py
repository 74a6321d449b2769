"""The shapes that links and obstacles are made of."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ros_ik_pkg.ik.exceptions import ModelError

SIZES = {
    'box': ('length along x', 'length along y', 'length along z'),
    'sphere': ('radius',),
    'cylinder': ('radius', 'length'),
    'capsule': ('radius', 'length of its cylinder'),
    'mesh': ('scale along x', 'scale along y', 'scale along z'),
}
LARGEST = 1e4  # [m]


@dataclass(frozen=True, eq=False)
class Shape:
    """One shape: its kind, its size and its pose in the frame of its link or obstacle.

    Attributes
    ----------
    kind : str
        One of SIZES.
    size : (k,) array
        The numbers that SIZES names [m]; scales for a mesh. Cylinders and capsules are centred, along their z axis.
    frame_from_shape : (4, 4) array
    file : str
        Path or URI of a mesh.

    Raises ModelError if the size is not that of a body.

    """

    kind: str
    size: np.ndarray
    frame_from_shape: np.ndarray = field(default_factory=lambda: np.eye(4))
    file: str = ''

    def __post_init__(self) -> None:
        names = SIZES.get(self.kind)
        if names is None:
            raise ModelError(f'shape {self.kind!r} is not known; expected one of {", ".join(SIZES)}')
        size = np.array(self.size, dtype=np.float64).reshape(-1)
        object.__setattr__(self, 'size', size)
        if len(size) != len(names):
            raise ModelError(f'a {self.kind} has {len(size)} numbers; expected {len(names)}: {", ".join(names)}')
        for name, value in zip(names, size):
            large = abs(value) if self.kind == 'mesh' else value
            if not 0.0 < large <= LARGEST:
                raise ModelError(f'{name} of a {self.kind} is {value:g}; expected above 0, at most {LARGEST:g}')
