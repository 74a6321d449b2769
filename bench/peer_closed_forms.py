"""Closed forms of others, derived for each arm before the run; Python is called once for each pose."""

from __future__ import annotations

import hashlib
import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from bench.peer_solvers import TURN, finite_limits
from bench.solver import Answer, Model, Solver, UnsupportedError

BUILD_TIMEOUT = 300.0  # s


class Ssik(Solver):
    """ssik, the module that `ssik build` writes for the arm: the answer nearest the seed, within the limits."""

    def __init__(self, module: ModuleType) -> None:
        self.module = module

    def call(self, target: np.ndarray, seed: np.ndarray) -> Any:
        return self.module.solve(target, max_solutions=1, q_seed=seed)

    def read(self, result: Any, seed: np.ndarray) -> Answer:
        return Answer(result[0].q if result else None)

    def forward(self, q: np.ndarray) -> np.ndarray:
        return self.module.fk(q)


def make_ssik(model: Model, options: dict[str, Any]) -> dict[str, Solver]:
    """Build the arm's module, once for each URDF."""
    if any(model.prismatic):
        raise UnsupportedError('supports only revolute joints')
    urdf = Path(model.urdf)
    name = f'arm_{hashlib.sha256(urdf.read_bytes()).hexdigest()[:16]}'
    path = Path(sys.prefix) / 'ssik_built' / f'{name}.py'
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        _build(urdf, path, name)
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return {'ssik': Ssik(module)}


def _build(urdf: Path, path: Path, name: str) -> None:
    """Let ssik derive the arm's closed form."""
    command = [str(Path(sys.executable).with_name('ssik')), 'build', str(urdf), '--base', 'base', '--ee', 'tip']
    command += ['--out', str(path), '--module-name', name, '--no-validate']
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=BUILD_TIMEOUT, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        raise UnsupportedError(f'its build took more than {BUILD_TIMEOUT:.0f} s') from None
    if done.returncode:
        raise UnsupportedError(f'its build failed: {(done.stderr.strip() or done.stdout.strip()).splitlines()[-1]}')


class Eaik(Solver):
    """EAIK: all branches, limits unknown to it; the nearest one within the limits is chosen outside the timed call."""

    def __init__(self, robot: Any, limits: tuple[np.ndarray, np.ndarray]) -> None:
        self.robot = robot
        self.lower, self.upper = limits

    def prepare(self, target: np.ndarray, seed: np.ndarray) -> tuple[Any, ...]:
        return (target,)

    def call(self, target: np.ndarray) -> Any:
        return self.robot.IK(target)

    def read(self, result: Any, seed: np.ndarray) -> Answer:
        exact = [q for q, least_squares in zip(result.Q, result.is_LS) if not least_squares]
        inside = [turned for q in exact if self._is_inside(turned := self._turn(np.asarray(q), seed))]
        return Answer(min(inside, key=lambda q: np.abs(q - seed).max(), default=None))

    def _turn(self, q: np.ndarray, seed: np.ndarray) -> np.ndarray:
        """Move each joint by whole turns towards the seed, as far as the limits allow."""
        q = q + TURN * np.round((seed - q) / TURN)
        q = np.where(q > self.upper, q - TURN, q)
        return np.where(q < self.lower, q + TURN, q)

    def _is_inside(self, q: np.ndarray) -> bool:
        return bool(((q >= self.lower) & (q <= self.upper)).all())

    def forward(self, q: np.ndarray) -> np.ndarray:
        return self.robot.fwdKin(q)


def make_eaik(model: Model, options: dict[str, Any]) -> dict[str, Solver]:
    """Decompose the arm from its joint frames at zero."""
    from eaik.IK_Homogeneous import HomogeneousRobot

    transforms = model.transforms()
    if any(model.prismatic) or len(transforms) > 7:
        raise UnsupportedError('takes arms of up to six revolute joints')
    frames = [np.eye(4)]
    for transform in transforms:
        frames.append(frames[-1] @ transform)
    robot = HomogeneousRobot(np.array(frames[1:]))
    if not robot.hasKnownDecomposition():
        raise UnsupportedError(f'knows no closed form of this arm ({robot.getKinematicFamily()})')
    return {'EAIK': Eaik(robot, finite_limits(model))}
