"""The records that compiled functions pass to each other: named tuples of arrays and numbers.

An arm is passed as one flat array, because every array argument of compiled code costs 0.06 us; `unpack_model`
makes views of its parts.
"""

from __future__ import annotations

from collections import Counter, namedtuple
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from ros_ik_pkg.ik.kernel.compiled import inlined, variant_of
from ros_ik_pkg.ik.kernel.numba_insides import shaped
from ros_ik_pkg.ik.kernel.sincos import BLOCK
from ros_ik_pkg.ik.solution import TRACE_COLUMNS
from ros_ik_pkg.methods import option_names

TRACE_WIDTH = len(TRACE_COLUMNS)
HEADER = 3  # numbers before the parts of a packed arm
BRANCH_ROWS = 36  # of Workspace.branches: twice 16 starts, and four pairs of angles


# Shapes of arrays: nj joints, n variables. A block of memory holds all arrays of one shape, and the fields of the
# records below give their number.
PerJoint = Annotated[np.ndarray, '(nj,)']
PerVariable = Annotated[np.ndarray, '(n,)']
ByColumn = Annotated[np.ndarray, '(n, 6)']
ByRow = Annotated[np.ndarray, '(6, n)']
Square = Annotated[np.ndarray, '(6, 6)']
Six = Annotated[np.ndarray, '(6,)']


def count_arrays(shape: Any, *records: Any) -> int:
    """Return how many fields of the records have a shape."""
    return sum(len(_names(shape, record)) for record in records)


def places_in_block(*records: Any) -> Any:
    """Return for each record a named tuple with the place of each of its arrays in the block of their shape."""
    taken: Counter[Any] = Counter()
    found = []
    for record in records:
        places = {}
        for shape in (PerJoint, PerVariable, ByColumn, ByRow, Square, Six):
            for name in _names(shape, record):
                places[name] = taken[shape]
                taken[shape] += 1
        found.append(namedtuple(f'PlacesOf{record.__name__}', places)(**places))
    return found


def _names(shape: Any, record: Any) -> list[str]:
    return [name for name, hint in get_type_hints(record, include_extras=True).items() if hint == shape]


class Geometry(NamedTuple):
    """One chain (see Arm): nj joints, n variables; all float64, indices and flags too."""

    placements: np.ndarray  # (nj + 1, 12)
    prismatic: PerJoint
    variable: PerJoint
    multiplier: PerJoint
    offset: PerJoint
    lower: PerVariable
    upper: PerVariable
    wraps: PerVariable


class Reach(NamedTuple):
    """A bound on the reach of the arm (see search/reach.py)."""

    in_base: np.ndarray  # (3,) fixed point of the base [m]
    in_tip: np.ndarray  # (3,) fixed point of the tip frame [m]
    lengths: np.ndarray  # (2,) largest distance of the two points, and of the tip from in_base [m]


GEOMETRY_JOINTS, GEOMETRY_VARIABLES = (count_arrays(shape, Geometry) for shape in (PerJoint, PerVariable))
(PACKED,) = places_in_block(Geometry)

# SolveOptions as numbers, except lists; the columns of the table of methods for the selected method; and the options
# that methods own.
METHOD_COLUMNS = ('step_cap', 'may_hurry', 'finish_by_lm')
Tuning: Any = namedtuple('Tuning', (  # type: ignore[misc]  # its names come from a table
    'method', 'max_iterations', 'max_attempts', 'deadline', 'position_tolerance', 'orientation_tolerance', 'step_size',
    'max_joint_step', 'respect_limits', 'choice', 'max_joint_jump', 'task_frame', 'null_space', 'null_space_step',
    'collision_margin', *METHOD_COLUMNS, *option_names(),
))  # fmt: skip
TUNABLES = len(Tuning._fields)


class Task(NamedTuple):
    """A pose in the base frame, and how its six error components count."""

    R: tuple[float, ...]  # 9, row by row
    p: tuple[float, ...]  # 3 [m]
    weights: np.ndarray  # (6,)
    tolerances: np.ndarray  # (6,) errors within them count as zero [m, rad]
    in_tip_axes: float
    plain: float  # 1 if all weights are 1 and all tolerances 0: then the axes do not matter either
    position_slack: float  # [m] and
    orientation_slack: float  # [rad]: lengths of the two halves up to which the error counts as zero


class Preferences(NamedTuple):
    """Which of several solutions is preferred, and which contacts are not allowed."""

    reference: np.ndarray  # (n,) from which distances, jumps and whole turns are measured [rad, m]
    joint_weights: np.ndarray  # (n,), or (0,) if the option is unset
    posture: np.ndarray  # (n,) [rad, m]
    obstruction: NamedTuple | None  # see collision/obstruction.py; None if contact is left out


class Solutions(NamedTuple):
    """The solutions with the k lowest ranks found so far."""

    rows: np.ndarray  # (k, n) [rad, m]
    ranks: np.ndarray  # (k,) ascending


class Joints(NamedTuple):
    """Results of forward kinematics for each joint; the last three are padded to whole blocks of sincos.py."""

    axes: np.ndarray  # (nj, 6) axis and a point of each
    values: np.ndarray  # [rad, m]
    sines: np.ndarray
    cosines: np.ndarray


class Workspace(NamedTuple):
    """The memory of a search; one serves many targets."""

    joints: Joints
    columns: ByColumn  # Jacobian by columns
    e: Six  # weighted error of the task
    weights: Six  # of its rows at this iterate; 0 drops a row
    y: Six  # solution of the Gram system
    A: Square  # Gram matrix
    rhs: Six  # right-hand side of the normal equations
    U: Square  # left singular vectors, by rows
    W: ByRow  # sigma_i v_i, by rows
    sigma: Six
    dq: PerVariable  # step
    q: PerVariable  # iterate
    near: PerVariable  # iterate of the smallest error in this descent
    best: PerVariable  # closest approach of all descents so far
    seed: PerVariable  # where the search began
    null: PerVariable  # direction in the null space of the task
    went: PerVariable  # last step in it
    trial: ByColumn  # Jacobian by columns of a trial configuration
    scales: PerVariable  # of the Jacobian's columns in a step, or (0,) if the option joint_weights is unset
    branches: np.ndarray  # (BRANCH_ROWS, 6) starts by closed form, see branches/six_joints.py
    scores: np.ndarray  # (m,) how far each start is from the target
    clock: np.ndarray  # (2,) seconds and nanoseconds


# The workspace of solve_usual, which has variants of some functions
UsualWorkspace: Any = namedtuple('UsualWorkspace', Workspace._fields)  # type: ignore[misc]


class Recorder(NamedTuple):
    """Receives the iterates of a trace; it has no rows without one."""

    rows: np.ndarray  # (k, TRACE_WIDTH + n + 3)
    written: np.ndarray  # (1,) number of iterates, also beyond the rows
    U: Square  # scratch of the singular values
    W: ByRow
    sigma: Six


@inlined
def tuning_of(numbers):
    """Return the first numbers as a Tuning."""
    return Tuning(*to_fixed_tuple(numbers, TUNABLES))


def pack_model(geometry: Geometry, reach: Reach, starts: np.ndarray) -> np.ndarray:
    """Put an arm and its starts (n + 7, m) float32, m even, into one flat float64 array that begins with n, nj, m."""
    sizes = len(geometry.lower), len(geometry.prismatic), starts.shape[1]
    numbers = [np.ravel(part).astype(np.float64) for part in (sizes, *geometry, *reach)]
    return np.concatenate([*numbers, np.ravel(starts).view(np.float64)])


@inlined
def unpack_model(model):
    """Return Geometry, Reach and starts as views of what pack_model packed. For kernels only, because the views do not
    count as references."""
    n, joints, m = int(model[0]), int(model[1]), int(model[2])
    a = HEADER + 12 * (joints + 1)
    b = HEADER + 12 * (joints + 1) + GEOMETRY_JOINTS * joints
    c = b + GEOMETRY_VARIABLES * n
    by_joint, by_variable = shaped(model, a, (GEOMETRY_JOINTS, joints)), shaped(model, b, (GEOMETRY_VARIABLES, n))
    geometry = Geometry(
        placements=shaped(model, HEADER, (joints + 1, 12)),
        prismatic=by_joint[PACKED.prismatic], variable=by_joint[PACKED.variable],
        multiplier=by_joint[PACKED.multiplier], offset=by_joint[PACKED.offset],
        lower=by_variable[PACKED.lower], upper=by_variable[PACKED.upper], wraps=by_variable[PACKED.wraps],
    )  # fmt: skip
    reach = Reach(shaped(model, c, (3,)), shaped(model, c + 3, (3,)), shaped(model, c + 6, (2,)))
    return geometry, reach, shaped(model.view(np.float32), 2 * (c + 8), (n + 7, m))


@inlined
def packed_size(model):
    """Return how many numbers a packed arm has; a packed scene may follow them."""
    n, joints, m = int(model[0]), int(model[1]), int(model[2])
    return HEADER + 12 * (joints + 1) + GEOMETRY_JOINTS * joints + GEOMETRY_VARIABLES * n + 8 + (n + 7) * m // 2


@inlined
def blocks(joints):
    """Return the number of angles that sincos.py computes for a number of joints, in whole blocks."""
    return (joints + BLOCK - 1) // BLOCK * BLOCK


@inlined
def joints_size(model):
    """Return how many float64 make_joints needs for a packed arm."""
    joints = int(model[1])
    return 6 * joints + 3 * blocks(joints)


@inlined
def make_joints(model, memory):
    """Return the Joints of a packed arm in a block of memory; for kernels only."""
    joints = int(model[1])
    angles = shaped(memory, 6 * joints, (3, blocks(joints)))
    return Joints(shaped(memory, 0, (joints, 6)), angles[0], angles[1], angles[2])


SQUARES, SIXES, BY_COLUMN, BY_ROW, VECTORS = (
    count_arrays(shape, Workspace, Recorder) for shape in (Square, Six, ByColumn, ByRow, PerVariable)
)
WORK, RECORD = places_in_block(Workspace, Recorder)
FIXED = 36 * SQUARES + 6 * SIXES + 6 * BRANCH_ROWS
PER_VARIABLE = 6 * (BY_COLUMN + BY_ROW) + VECTORS + 1  # and one answer (n,)


@inlined
def buffer_size(model):
    """Return how many float64 make_records needs for a packed arm."""
    return FIXED + PER_VARIABLE * int(model[0]) + joints_size(model)


@inlined
def make_records(model, buffer, scores, integers, rows, weighted):
    """Return a Workspace, a Recorder that writes to `rows`, and one answer (1, n), in three blocks of memory.

    `weighted` is the number of joint weights, n or 0. For kernels only.
    """
    work, squares, sixes, by_row, one = make_workspace(model, buffer, scores, integers, weighted)
    recorder = Recorder(
        rows, shaped(integers, 2, (1,)), U=squares[RECORD.U], W=by_row[RECORD.W], sigma=sixes[RECORD.sigma]
    )
    return work, recorder, one


@inlined
def make_workspace(model, buffer, scores, integers, weighted):
    """Return a Workspace, the blocks of memory of its squares, sixes and rows, and one answer (1, n)."""
    n = int(model[0])
    a = FIXED
    b = a + BY_COLUMN * 6 * n
    c = b + BY_ROW * 6 * n
    d = c + VECTORS * n
    e = d + n
    squares, sixes = shaped(buffer, 0, (SQUARES, 6, 6)), shaped(buffer, SQUARES * 36, (SIXES, 6))
    by_column = shaped(buffer, a, (BY_COLUMN, n, 6))
    by_row, vectors = shaped(buffer, b, (BY_ROW, 6, n)), shaped(buffer, c, (VECTORS, n))
    work = Workspace(
        joints=make_joints(model, shaped(buffer, e, (joints_size(model),))),
        columns=by_column[WORK.columns], trial=by_column[WORK.trial], W=by_row[WORK.W],
        A=squares[WORK.A], U=squares[WORK.U],
        e=sixes[WORK.e], weights=sixes[WORK.weights], y=sixes[WORK.y], rhs=sixes[WORK.rhs], sigma=sixes[WORK.sigma],
        dq=vectors[WORK.dq], q=vectors[WORK.q], near=vectors[WORK.near], best=vectors[WORK.best],
        seed=vectors[WORK.seed], null=vectors[WORK.null], went=vectors[WORK.went],
        branches=shaped(buffer, SQUARES * 36 + 6 * SIXES, (BRANCH_ROWS, 6)),
        scales=shaped(vectors, WORK.scales * n, (weighted,)), scores=scores, clock=shaped(integers, 0, (2,)),
    )  # fmt: skip
    return work, squares, sixes, by_row, shaped(buffer, d, (1, n))


@variant_of(make_records, None)
def make_usual_records(model, buffer, scores, integers, rows, weighted):
    """Return a UsualWorkspace, None and one answer (1, n): without `rows` no code that needs more is compiled."""
    work, _, _, _, one = make_workspace(model, buffer, scores, integers, weighted)
    return UsualWorkspace(*work), None, one


@inlined
def make_solutions(answers, one, ranks, rows):
    """Return Solutions with rows for the answers, or for one."""
    return Solutions(answers if len(answers) > 0 else one, ranks)


@variant_of(make_solutions, None)
def make_no_solutions(answers, one, ranks, rows):
    """Return None, in solve_usual."""
    return None
