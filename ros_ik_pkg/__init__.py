"""Inverse kinematics with Jacobian methods: `ik` is the solver, `ros` the node and its client."""

from typing import Any


def __getattr__(name: str) -> Any:
    """Return `__version__`, read from package.xml when it is asked for."""
    if name != '__version__':
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    from ros_ik_pkg.share import version

    return version()
