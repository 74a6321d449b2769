"""The records that the compiled functions hand to each other: named tuples of arrays and numbers.

Python hands a whole arm over as one flat array, because every array that crosses into compiled code costs a quarter
of a microsecond; `unpack_model` cuts it into views again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ros_ik_pkg.ik.kernel.compiled import inlined
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kernel.sincos import BLOCK
from ros_ik_pkg.ik.solution import TRACE_COLUMNS

TRACE_WIDTH = len(TRACE_COLUMNS)
HEADER = 3  # numbers before the parts of a packed arm


class Geometry(NamedTuple):
    """One chain (see Arm): nj joints, n variables; all float64, indices and flags too."""

    placements: np.ndarray  # (nj + 1, 12)
    prismatic: np.ndarray  # (nj,)
    variable: np.ndarray  # (nj,)
    multiplier: np.ndarray  # (nj,)
    offset: np.ndarray  # (nj,)
    lower: np.ndarray  # (n,)
    upper: np.ndarray  # (n,)
    wraps: np.ndarray  # (n,)


class Reach(NamedTuple):
    """A bound on where the arm can be (see reach.py)."""

    in_base: np.ndarray  # (3,) fixed point of the base [m]
    in_tip: np.ndarray  # (3,) fixed point of the tip frame [m]
    lengths: np.ndarray  # (2,) largest distance of the two points, and of the tip from in_base [m]


class Tuning(NamedTuple):
    """SolveOptions as numbers, but for those that are lists."""

    method: float
    max_iterations: float
    max_attempts: float
    deadline: float
    position_tolerance: float
    orientation_tolerance: float
    step_size: float
    max_joint_step: float
    dls_damping: float
    adaptive_dls_damping: float
    adaptive_dls_gain: float
    sdls_max_step: float
    respect_limits: float
    choice: float
    max_joint_jump: float
    task_frame: float
    null_space: float
    null_space_step: float
    collision_margin: float


TUNABLES = len(Tuning._fields)


class Task(NamedTuple):
    """What is asked for: a pose in the base frame, and how its six error components count."""

    R: tuple[float, ...]  # 9, row by row
    p: tuple[float, ...]  # 3 [m]
    weights: np.ndarray  # (6,)
    tolerances: np.ndarray  # (6,) within which an error counts as none [m, rad]
    in_tip_axes: float
    plain: float  # whether all six count alike, without tolerances: then the axes do not matter either
    position_slack: float  # [m] and
    orientation_slack: float  # [rad]: lengths of the two halves up to which the error counts as none


class Preferences(NamedTuple):
    """Which of many solutions is wanted, and what none may touch."""

    reference: np.ndarray  # (n,) from which distances, jumps and whole turns are measured [rad, m]
    joint_weights: np.ndarray  # (n,), or (0,) if the option is unset
    posture: np.ndarray  # (n,) [rad, m]
    obstruction: NamedTuple  # see collision/obstruction.py


class Solutions(NamedTuple):
    """The solutions with the k lowest ranks so far."""

    rows: np.ndarray  # (k, n) [rad, m]
    ranks: np.ndarray  # (k,) rising


class Joints(NamedTuple):
    """What forward kinematics leaves of the joints; the last three are filled up to whole blocks of sincos.py."""

    axes: np.ndarray  # (nj, 6) axis and a point of each
    values: np.ndarray  # [rad, m]
    sines: np.ndarray
    cosines: np.ndarray


class Workspace(NamedTuple):
    """Everything that a search writes to, made once for many."""

    joints: Joints
    columns: np.ndarray  # (n, 6) Jacobian by columns
    e: np.ndarray  # (6,) weighted error of the task
    weights: np.ndarray  # (6,) of its rows at this iterate; 0 drops a row
    y: np.ndarray  # (6,) solution of the Gram system
    A: np.ndarray  # (6, 6) Gram matrix
    rhs: np.ndarray  # (6,) right-hand side of the normal equations
    U: np.ndarray  # (6, 6) left singular vectors, by rows
    W: np.ndarray  # (6, n) sigma_i v_i, by rows
    sigma: np.ndarray  # (6,)
    dq: np.ndarray  # (n,) step
    q: np.ndarray  # (n,) iterate
    near: np.ndarray  # (n,) iterate of the smallest error in this descent
    best: np.ndarray  # (n,) closest approach of all descents so far
    seed: np.ndarray  # (n,) where the search began
    null: np.ndarray  # (n,) direction in the null space of the task
    went: np.ndarray  # (n,) last step in it
    trial: np.ndarray  # (n, 6) Jacobian by columns of a configuration that is only looked at
    scores: np.ndarray  # (m,) how far each start is from the target
    clock: np.ndarray  # (2,) seconds and nanoseconds


class Recorder(NamedTuple):
    """Where the iterates go when somebody wants them; without rows when nobody does."""

    rows: np.ndarray  # (k, TRACE_WIDTH + n + 3)
    written: np.ndarray  # (1,) iterates that there were
    U: np.ndarray  # (6, 6) scratch of the singular values
    W: np.ndarray  # (6, n)
    sigma: np.ndarray  # (6,)


@inlined
def tuning_of(numbers):
    """Give the first numbers their names."""
    return Tuning(
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], numbers[6], numbers[7], numbers[8],
        numbers[9], numbers[10], numbers[11], numbers[12], numbers[13], numbers[14], numbers[15], numbers[16],
        numbers[17], numbers[18],
    )  # fmt: skip


def pack_model(geometry: Geometry, reach: Reach, starts: np.ndarray) -> np.ndarray:
    """Put an arm and its starts (n + 7, m) float32, m even, into one flat float64 array that begins with n, nj, m."""
    sizes = len(geometry.lower), len(geometry.prismatic), starts.shape[1]
    numbers = [np.ravel(part).astype(np.float64) for part in (sizes, *geometry, *reach)]
    return np.concatenate([*numbers, np.ravel(starts).view(np.float64)])


@inlined
def unpack_model(model):
    """Return Geometry, Reach and starts, views of what pack_model packed. To be called by kernels only: the views are
    not counted as references."""
    n, joints, m = int(model[0]), int(model[1]), int(model[2])
    a = HEADER + 12 * (joints + 1)
    b = a + 4 * joints
    c = b + 3 * n
    per_joint, per_variable = shaped(model, a, (4, joints)), shaped(model, b, (3, n))
    geometry = Geometry(
        shaped(model, HEADER, (joints + 1, 12)),
        per_joint[0], per_joint[1], per_joint[2], per_joint[3],
        per_variable[0], per_variable[1], per_variable[2],
    )  # fmt: skip
    reach = Reach(shaped(model, c, (3,)), shaped(model, c + 3, (3,)), shaped(model, c + 6, (2,)))
    return geometry, reach, shaped(model.view(np.float32), 2 * (c + 8), (n + 7, m))


@inlined
def packed_size(model):
    """Return how many numbers a packed arm has; a packed scene may follow them."""
    n, joints, m = int(model[0]), int(model[1]), int(model[2])
    return HEADER + 12 * (joints + 1) + 4 * joints + 3 * n + 8 + (n + 7) * m // 2


@inlined
def blocks(joints):
    """Return how many angles sincos.py is given for so many joints."""
    return (joints + BLOCK - 1) // BLOCK * BLOCK


@inlined
def joints_size(model):
    """Return how many numbers make_joints cuts up for a packed arm."""
    joints = int(model[1])
    return 6 * joints + 3 * blocks(joints)


@inlined
def make_joints(model, memory):
    """Cut the Joints of a packed arm from a block of memory; to be called by kernels only."""
    joints = int(model[1])
    angles = shaped(memory, 6 * joints, (3, blocks(joints)))
    return Joints(shaped(memory, 0, (joints, 6)), angles[0], angles[1], angles[2])


@inlined
def buffer_size(model):
    """Return how many numbers make_records cuts up for a packed arm."""
    return 144 + 32 * int(model[0]) + joints_size(model)


@inlined
def make_records(model, buffer, scores, integers, rows):
    """Cut a Workspace, a Recorder that writes to `rows` and one answer (1, n) from three blocks of memory.

    Where `rows` is None the Recorder is too: then nothing that needs one is compiled (see entry.solve_usual).
    To be called by kernels only, as unpack_model.
    """
    n = int(model[0])
    a = 144
    b, c, d = a + 12 * n, a + 24 * n, a + 31 * n
    e = d + n
    squares, sixes = shaped(buffer, 0, (3, 6, 6)), shaped(buffer, 108, (6, 6))
    by_column = shaped(buffer, a, (2, n, 6))
    by_row, vectors = shaped(buffer, b, (2, 6, n)), shaped(buffer, c, (7, n))
    work = Workspace(
        make_joints(model, shaped(buffer, e, (joints_size(model),))), by_column[0],
        sixes[0], sixes[5], sixes[1], squares[0], sixes[2], squares[1], by_row[0], sixes[3],
        vectors[0], vectors[1], vectors[2], vectors[3], vectors[6], vectors[4], vectors[5], by_column[1],
        scores, shaped(integers, 0, (2,)),
    )  # fmt: skip
    if rows is None:  # noqa: SIM108 Numba drops the other branch of an `if` alone
        recorder = None
    else:
        recorder = Recorder(rows, shaped(integers, 2, (1,)), squares[2], by_row[1], sixes[4])
    return work, recorder, shaped(buffer, d, (1, n))
