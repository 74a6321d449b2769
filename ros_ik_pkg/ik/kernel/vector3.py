"""Vectors of three numbers that stay in one vector register, for compiled code.

The compiler does not notice that the three rows of a rotation take part in the same operations; a type that maps to
one register says so. docs/performance.md has the gain.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, register_model

SPACE = ir.VectorType(ir.DoubleType(), 4)  # the fourth lane is not used: registers hold two, four or eight
INDEX = ir.IntType(32)
FUSE = ('contract',)  # as for all compiled code of this package


class Lanes(types.Type):
    """Three float64 in one vector register."""

    def __init__(self) -> None:
        super().__init__(name='Lanes')


LANES = Lanes()


@register_model(Lanes)
class LanesModel(models.PrimitiveModel):
    """Represents Lanes in LLVM as one vector."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, SPACE)


@intrinsic
def lanes(_typing, x, y, z):
    """Return three numbers as one vector."""

    def build(_context, builder, _signature, arguments):
        vector = ir.Constant(SPACE, [0.0] * 4)
        for k, number in enumerate(arguments):
            vector = builder.insert_element(vector, number, INDEX(k))
        return vector

    return LANES(types.float64, types.float64, types.float64), build


@intrinsic
def split(_typing, vector):
    """Return the three numbers."""

    def build(context, builder, signature, arguments):
        numbers = [builder.extract_element(arguments[0], INDEX(k)) for k in range(3)]
        return context.make_tuple(builder, signature.return_type, numbers)

    return types.UniTuple(types.float64, 3)(LANES), build


@intrinsic
def times(_typing, vector, number):
    """Return vector * number."""

    def build(_context, builder, _signature, arguments):
        return builder.fmul(arguments[0], _everywhere(builder, arguments[1]), flags=FUSE)

    return LANES(LANES, types.float64), build


@intrinsic
def plus_times(_typing, start, vector, number):
    """Return start + vector * number."""

    def build(_context, builder, _signature, arguments):
        product = builder.fmul(arguments[1], _everywhere(builder, arguments[2]), flags=FUSE)
        return builder.fadd(arguments[0], product, flags=FUSE)

    return LANES(LANES, LANES, types.float64), build


def _everywhere(builder, number):
    """Return a vector with the number in every lane."""
    nothing = ir.Constant(SPACE, ir.Undefined)
    first = builder.insert_element(nothing, number, INDEX(0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(INDEX, 4), [0] * 4))
