"""Numerical solvers of other libraries, each by its fastest call, with a tolerance of 1e-5 m and 1e-5 rad.

Imports are inside the functions, because each process needs only one library.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from bench.solver import Answer, Model, Solver, UnsupportedError

TOLERANCE = 1e-5  # m and rad
TURN = 2.0 * np.pi


def finite_limits(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits, or a turn if there are none; refuses unlimited prismatic joints."""
    lower, upper = np.array(model.lower), np.array(model.upper)
    endless = ~np.isfinite(lower) | ~np.isfinite(upper)
    if (endless & (np.array(model.prismatic) > 0)).any():
        raise UnsupportedError('needs limits of a sliding joint')
    return np.where(endless, -np.pi, lower), np.where(endless, np.pi, upper)


class RoboticsToolbox(Solver):
    """Levenberg-Marquardt of Robotics Toolbox in C++, Chan's damping."""

    def __init__(self, ets: Any, gain: float) -> None:
        self.ets = ets
        # E is half the square of the error norm.
        self.settings = {'ilimit': 30, 'slimit': 100, 'tol': 0.5 * TOLERANCE**2, 'joint_limits': True, 'k': gain}

    def call(self, target: np.ndarray, seed: np.ndarray) -> Any:
        return self.ets.ik_LM(target, seed, method='chan', **self.settings)

    def read(self, result: Any, seed: np.ndarray) -> Answer:
        return Answer(result.q if result.success else None, result.iterations, result.searches)

    def forward(self, q: np.ndarray) -> np.ndarray:
        return self.ets.fkine(q).A


def make_rtb(model: Model, options: dict[str, Any]) -> dict[str, Solver]:
    """Build the arm from elementary transforms; the gain is the default, and the quickest of 0.01, 0.1, 1."""
    from roboticstoolbox import ET, ETS

    lower, upper = finite_limits(model)
    *before, last = model.transforms()
    parts = []
    for k, transform in enumerate(before):
        make = ET.tz if model.prismatic[k] else ET.Rz
        parts += [ET.SE3(transform), make(jindex=k, qlim=[lower[k], upper[k]])]
    ets = ETS([*parts, ET.SE3(last)])
    return {f'RTB ik_LM k={gain}': RoboticsToolbox(ets, gain) for gain in (1.0, 0.1)}


class TracIk(Solver):
    """TRAC-IK in C++: KDL and SQP in two threads until one holds; Speed mode."""

    def __init__(self, module: Any, urdf: str, timeout: float) -> None:
        self.module = module
        # Its epsilon applies to each component.
        self.solver = module.TRAC_IK('base', 'tip', urdf, timeout, TOLERANCE / 2.0, module.SolveType.Speed)

    def prepare(self, target: np.ndarray, seed: np.ndarray) -> tuple[Any, ...]:
        return self.solver, seed, *target[:3, 3], *quaternion(target)

    def call(self, *arguments: Any) -> Any:
        return self.module.ik(*arguments)

    def read(self, result: Any, seed: np.ndarray) -> Answer:
        return Answer(result[1:] if result[0] >= 0 else None)

    def forward(self, q: np.ndarray) -> np.ndarray:
        return self.module.fk(self.solver, q)


def quaternion(target: np.ndarray) -> np.ndarray:
    """Return (x, y, z, w) of a pose."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(target[:3, :3]).as_quat()


def make_trac_ik(model: Model, options: dict[str, Any]) -> dict[str, Solver]:
    """Load the arm's URDF with two time-outs."""
    import pytracik

    urdf = Path(model.urdf).read_text()
    return {f'TRAC-IK {1e3 * timeout:.0f} ms': TracIk(pytracik, urdf, timeout) for timeout in (0.005, 0.05)}


class Optik(Solver):
    """optik in Rust, one thread."""

    def __init__(self, robot: Any, config: Any) -> None:
        self.robot, self.config = robot, config

    def prepare(self, target: np.ndarray, seed: np.ndarray) -> tuple[Any, ...]:
        return self.config, target.tolist(), seed.tolist()

    def call(self, *arguments: Any) -> Any:
        return self.robot.ik(*arguments)

    def read(self, result: Any, seed: np.ndarray) -> Answer:
        return Answer(None if result is None else np.array(result[0]))

    def forward(self, q: np.ndarray) -> np.ndarray:
        return np.array(self.robot.fk(q.tolist()))


def make_optik(model: Model, options: dict[str, Any]) -> dict[str, Solver]:
    """Load the arm's URDF."""
    import optik

    if not np.isfinite([model.lower, model.upper]).all():
        raise UnsupportedError('takes no joint without limits')
    robot = optik.Robot.from_urdf_file(model.urdf, 'base', 'tip')
    robot.set_parallelism(1)
    config = optik.SolverConfig(solution_mode='speed', max_time=0.005, tol_f=TOLERANCE**2)
    return {'optik 5 ms': Optik(robot, config)}


class PinocchioDls(Solver):
    """The loop of Pinocchio's inverse kinematics example, in Python: damped steps clipped to the limits, random
    restarts, 50 ms."""

    DAMPING, STEP_SIZE, STEPS, SECONDS = 1e-6, 0.5, 100, 0.05

    def __init__(self, pin: Any, model: Any, limits: tuple[np.ndarray, np.ndarray]) -> None:
        self.pin, self.model, self.data = pin, model, model.createData()
        self.tip = model.getFrameId('tip')
        self.lower, self.upper = limits
        self.random = np.random.default_rng(5)

    def prepare(self, target: np.ndarray, seed: np.ndarray) -> tuple[Any, ...]:
        return self.pin.SE3(target), seed

    def call(self, target: Any, seed: np.ndarray) -> np.ndarray | None:
        stop, q = time.perf_counter() + self.SECONDS, seed.copy()
        while time.perf_counter() < stop:
            for _ in range(self.STEPS):
                self.pin.framesForwardKinematics(self.model, self.data, q)
                difference = self.data.oMf[self.tip].actInv(target)
                e = self.pin.log6(difference).vector
                if max(np.linalg.norm(e[:3]), np.linalg.norm(e[3:])) < 0.99 * TOLERANCE:
                    return q
                J = self.pin.computeFrameJacobian(self.model, self.data, q, self.tip, self.pin.LOCAL)
                J = self.pin.Jlog6(difference.inverse()) @ J
                dq = J.T @ np.linalg.solve(J @ J.T + self.DAMPING * np.eye(6), e)
                q = np.clip(q + self.STEP_SIZE * dq, self.lower, self.upper)
            q = self.random.uniform(self.lower, self.upper)
        return None

    def read(self, result: np.ndarray | None, seed: np.ndarray) -> Answer:
        return Answer(result)

    def forward(self, q: np.ndarray) -> np.ndarray:
        self.pin.framesForwardKinematics(self.model, self.data, q)
        return self.data.oMf[self.tip].homogeneous


def make_pinocchio(model: Model, options: dict[str, Any]) -> dict[str, Solver]:
    """Build the arm joint by joint, with scalar variables also for continuous joints."""
    import pinocchio as pin

    built, carrier = pin.Model(), 0
    *before, last = model.transforms()
    for k, transform in enumerate(before):
        motion = pin.JointModelPZ() if model.prismatic[k] else pin.JointModelRZ()
        carrier = built.addJoint(carrier, motion, pin.SE3(transform), f'q{k}')
    built.addFrame(pin.Frame('tip', carrier, 0, pin.SE3(last), pin.FrameType.BODY))
    return {'Pinocchio + NumPy 50 ms': PinocchioDls(pin, built, finite_limits(model))}
