"""The inside of one iteration: the five stages of the notes with their numbers, and the singular directions.

Everything here is computed from the joint positions of an iterate, the target and the options, with NumPy and
Pinocchio; the solver contributes the iterates alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ros_ik_pkg.ik import METHODS, Arm, SolveOptions
from ros_ik_pkg.methods import BY_NAME, HURRIED_STRIDE

RANK_TOLERANCE = 1e-10  # singular values below this count as zero
AT_LIMIT = 1e-9  # rad, m


@dataclass(frozen=True)
class Iterate:
    """One configuration of a descent and the step that was taken from it.

    Attributes
    ----------
    iteration : int
    q, step : (n,) arrays
        Joint positions and the step to the next iterate [rad, m]; the step is zero in the last iterate.
    base_from_tip : (4, 4) array
    error : (6,) array
        Twist error [p* - p ; log(R* R^T)] [m, rad], base axes.
    jacobian : (6, n) array
        Geometric Jacobian of the tip, rows [v ; w], base axes.
    damping : float
        lambda of this iteration; 0 for methods without damping.
    capped, frozen : (n,) bool arrays
        Joints whose step was cut, and joints that a limit holds.
    directions : Directions

    """

    iteration: int
    q: np.ndarray
    step: np.ndarray
    base_from_tip: np.ndarray
    error: np.ndarray
    jacobian: np.ndarray
    damping: float
    capped: np.ndarray
    frozen: np.ndarray
    directions: Directions

    @property
    def position_error(self) -> float:
        """Distance of the tip from the target [m]."""
        return float(np.linalg.norm(self.error[:3]))

    @property
    def orientation_error(self) -> float:
        """Angle of the tip from the target [rad]."""
        return float(np.linalg.norm(self.error[3:]))


@dataclass(frozen=True)
class Directions:
    """The singular value decomposition J = U S V^T, r = min(6, n) directions, and the error along each.

    Attributes
    ----------
    u : (6, r) array
        Directions of the task, in columns.
    sigma : (r,) array
    v : (n, r) array
        Directions of the joints, in columns.
    component : (r,) array
        <u_i, e>, the error along each direction.

    """

    u: np.ndarray
    sigma: np.ndarray
    v: np.ndarray
    component: np.ndarray

    def gains(self, method: str, options: SolveOptions) -> np.ndarray:
        """Return what a method multiplies the error along each direction with, (r,).

        The step of the method is V (gains * component), before caps and limits. With s for sigma: transpose alpha s,
        pinv 1 / s, dls and adaptive_dls s / (s^2 + lambda^2); sdls 1 / s, scaled down where the motion along a
        direction, or the sum of all motions, exceeds its bound (Buss and Kim 2005).

        Raises
        ------
        ValueError
            If the method is unknown.

        """
        s = self.sigma
        if method == 'transpose':
            return _transpose_gain(s, self.component) * s
        with np.errstate(divide='ignore'):
            inverse = np.where(s > RANK_TOLERANCE, 1.0 / s, np.inf)
        if method == 'sdls':
            return self._selective_gains(np.where(np.isfinite(inverse), inverse, 0.0), options.sdls_max_step)
        if method not in BY_NAME:
            raise ValueError(f'method {method!r} is unknown; expected one of {", ".join(METHODS)}')
        damping = damping_of(method, float(np.linalg.norm(self.component)), options)
        if damping == 0.0:
            return inverse
        return s / (s * s + damping * damping)

    def _selective_gains(self, gains: np.ndarray, largest_step: float) -> np.ndarray:
        """Bound the motion along each direction, then the largest joint step of their sum."""
        jacobian = self.u * self.sigma @ self.v.T
        halves = slice(0, 3), slice(3, 6)
        reach = sum(np.linalg.norm(jacobian[half], axis=0) for half in halves)
        gains = gains.copy()
        for i in np.flatnonzero(gains):
            task = sum(np.linalg.norm(self.u[half, i]) for half in halves)
            motion = gains[i] * (np.abs(self.v[:, i]) @ reach)
            bound = min(1.0, task / motion) * largest_step
            largest = abs(gains[i] * self.component[i]) * np.abs(self.v[:, i]).max()
            gains[i] *= min(1.0, bound / largest) if largest > 0.0 else 1.0
        total = np.abs(self.v @ (gains * self.component)).max()
        return gains * min(1.0, largest_step / total) if total > 0.0 else gains


def _transpose_gain(sigma: np.ndarray, component: np.ndarray) -> float:
    """Return alpha = <e, J J^T e> / |J J^T e|^2, 0 if the gradient vanishes."""
    image = sigma**2 * component
    square = float(image @ image)
    return float(component @ image) / square if square > 0.0 else 0.0


def damping_of(method: str, error_norm: float, options: SolveOptions) -> float:
    """Return lambda of a method at an error of this norm; 0 for methods without damping."""
    damping = BY_NAME[method].damping
    return 0.0 if damping is None else damping(options, error_norm)


def directions_of(jacobian: np.ndarray, error: np.ndarray) -> Directions:
    """Return the singular directions of a Jacobian (6, n) and the error (6,) along them."""
    u, sigma, vt = np.linalg.svd(jacobian, full_matrices=False)
    return Directions(u, sigma, vt.T, u.T @ error)


def twist_error(target: np.ndarray, base_from_tip: np.ndarray) -> np.ndarray:
    """Return [p* - p ; log(R* R^T)] (6,) [m, rad] of two poses (4, 4)."""
    rotation = np.ascontiguousarray(target[:3, :3] @ base_from_tip[:3, :3].T)
    return np.concatenate([target[:3, 3] - base_from_tip[:3, 3], pin.log3(rotation)])


def make_iterate(
    arm: Arm, target: np.ndarray, method: str, options: SolveOptions, positions: np.ndarray, iteration: int
) -> Iterate:
    """Look into one iteration of a descent.

    Parameters
    ----------
    target : (4, 4) array
        Pose of the tip frame in the base frame [m].
    positions : (k, n) array
        Joint positions of all iterates of the descent [rad, m].
    iteration : int
        Which of them.

    """
    q = positions[iteration]
    last = iteration == len(positions) - 1
    step = np.zeros_like(q) if last else positions[iteration + 1] - q
    base_from_tip, jacobian = arm.forward(q), arm.jacobian(q)
    error = twist_error(target, base_from_tip)
    directions = directions_of(jacobian, error)
    cap = options.max_joint_step or BY_NAME[method].step_cap
    held = (q <= arm.lower + AT_LIMIT) | (q >= arm.upper - AT_LIMIT)
    return Iterate(
        iteration=iteration,
        q=q,
        step=step,
        base_from_tip=base_from_tip,
        error=error,
        jacobian=jacobian,
        damping=damping_of(method, float(np.linalg.norm(error)), options),
        capped=_equal(np.abs(step), cap) | _equal(np.abs(step), HURRIED_STRIDE * cap),
        frozen=held & (step == 0.0) & (not last),
        directions=directions,
    )


def _equal(values: np.ndarray, bound: float) -> np.ndarray:
    return np.abs(values - bound) <= AT_LIMIT


def ellipsoid_of(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return axes (3, 3), in columns, and half lengths (3,) of the manipulability ellipsoid of the tip's position.

    It holds the velocities J_v q' of the tip for all joint velocities of length 1 (Yoshikawa 1985).
    """
    axes, lengths, _ = np.linalg.svd(jacobian[:3] @ jacobian[:3].T)
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] = -axes[:, 2]
    return axes, np.sqrt(lengths)
