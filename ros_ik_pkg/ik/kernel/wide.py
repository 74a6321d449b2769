"""A number type of LANES float64 side by side, for compiled code that does the same to several problems at once.

Functions that are written for numbers work with Wide numbers too, if they have no branches on them: + - * / and
comparisons, abs, math.sqrt and math.floor work lane by lane, and a float64 counts as the same number in every lane.
Comparisons give a Mask. The compiler splits a Wide number into as many registers as the processor needs: one with
AVX-512, two with AVX2, four with NEON.
"""

from __future__ import annotations

import math
import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model, type_callable

from ros_ik_pkg.ik.kernel.array_views import build_view

LANES = 8
NUMBERS = ir.VectorType(ir.DoubleType(), LANES)
FLAGS = ir.VectorType(ir.IntType(1), LANES)
INDEX = ir.IntType(32)
FUSE = ('contract',)  # as for all compiled code of this package
SIZE = 8 * LANES  # bytes


class Wide(types.Type):
    """LANES float64."""

    def __init__(self) -> None:
        super().__init__(name='Wide')

    def can_convert_from(self, _typing, other):
        """Let a number be the same in every lane."""
        return Conversion.safe if isinstance(other, (types.Float, types.Integer)) else None


class Mask(types.Type):
    """LANES truth values."""

    def __init__(self) -> None:
        super().__init__(name='Mask')


WIDE, MASK = Wide(), Mask()


@register_model(Wide)
class WideModel(models.PrimitiveModel):
    """Represents Wide in LLVM as one vector."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, NUMBERS)


@register_model(Mask)
class MaskModel(models.PrimitiveModel):
    """Represents Mask in LLVM as one vector."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, FLAGS)


@lower_cast(types.Float, Wide)
@lower_cast(types.Integer, Wide)
def _spread(context, builder, kind, _wide, number):
    """Put a number into every lane."""
    nothing = ir.Constant(NUMBERS, ir.Undefined)
    first = builder.insert_element(nothing, context.cast(builder, number, kind, types.float64), INDEX(0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(INDEX, LANES), [0] * LANES))


def _define(function, kinds, result, build):
    """Let a function or operator take arguments of these kinds; a number among them counts as Wide."""

    def type_if_fits(*arguments):
        fits = any(all(isinstance(a, kind) for a, kind in zip(arguments, some)) for some in kinds)
        return result if fits else None

    @type_callable(function)
    def type_of(_context):
        # Numba looks at the names of the arguments
        return (lambda a: type_if_fits(a)) if len(kinds[0]) == 1 else (lambda a, b: type_if_fits(a, b))

    def lower(context, builder, signature, arguments):
        same = WIDE if WIDE in signature.args else MASK
        return build(context, builder, [
            context.cast(builder, argument, kind, same) for argument, kind in zip(arguments, signature.args)
        ])  # fmt: skip

    for some in kinds:
        lower_builtin(function, *some)(lower)


TWO = ((Wide, Wide), (Wide, types.Number), (types.Number, Wide))
ONE = ((Wide,),)


def _define_arithmetic():
    """Define what Wide numbers and Masks can do."""
    function: Any
    for function, name in (
        (operator.add, 'fadd'), (operator.iadd, 'fadd'), (operator.sub, 'fsub'), (operator.mul, 'fmul'),
        (operator.truediv, 'fdiv'),
    ):  # fmt: skip
        _define(function, TWO, WIDE, lambda _, builder, two, name=name: getattr(builder, name)(*two, flags=FUSE))
    for function, sign in ((operator.lt, '<'), (operator.le, '<='), (operator.gt, '>'), (operator.ge, '>=')):
        _define(function, TWO, MASK, lambda _, builder, two, sign=sign: builder.fcmp_ordered(sign, *two))
    for function, name in ((math.sqrt, 'sqrt'), (math.floor, 'floor'), (abs, 'fabs')):
        _define(
            function, ONE, WIDE,
            lambda _, builder, one, name=name: builder.call(cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(NUMBERS, [NUMBERS]), f'llvm.{name}.v{LANES}f64'
            ), one),
        )  # fmt: skip
    _define(operator.neg, ONE, WIDE, lambda _, builder, one: builder.fneg(one[0]))
    _define(operator.and_, ((Mask, Mask),), MASK, lambda _, builder, two: builder.and_(*two))
    _define(operator.or_, ((Mask, Mask),), MASK, lambda _, builder, two: builder.or_(*two))
    _define(operator.invert, ((Mask,),), MASK, lambda _, builder, one: builder.not_(one[0]))


_define_arithmetic()


@intrinsic
def wide(_typing, number):
    """Return a number in every lane."""

    def build(context, builder, signature, arguments):
        return context.cast(builder, arguments[0], signature.args[0], WIDE)

    return WIDE(number), build


@intrinsic
def where(_typing, mask, one, other):
    """Return `one` in the lanes of the mask, `other` in the rest."""

    def build(context, builder, signature, arguments):
        flags, *numbers = arguments
        return builder.select(
            flags, *(context.cast(builder, number, kind, WIDE) for number, kind in zip(numbers, signature.args[1:]))
        )

    return WIDE(mask, one, other), build


@intrinsic
def smaller(_typing, a, b):
    """Return the smaller of two numbers, lane by lane; `a` if one is NaN."""
    return WIDE(a, b), _second_if('<')


@intrinsic
def larger(_typing, a, b):
    """Return the larger of two numbers, lane by lane; `a` if one is NaN."""
    return WIDE(a, b), _second_if('>')


def _second_if(sign):
    """Return code for the second of two numbers in those lanes in which it compares so with the first."""

    def build(context, builder, signature, arguments):
        first, second = (context.cast(builder, *pair, WIDE) for pair in zip(arguments, signature.args))
        return builder.select(builder.fcmp_ordered(sign, second, first), second, first)

    return build


@intrinsic
def bits_of(_typing, mask):
    """Return a number whose bit k is set if lane k is in the mask."""

    def build(_context, builder, _signature, arguments):
        return builder.zext(builder.bitcast(arguments[0], ir.IntType(LANES)), ir.IntType(64))

    return types.int64(mask), build


@intrinsic
def wide_view(_typing, memory, start, shape):
    """Return a view of aligned memory as Wide numbers in the given shape, from the float64 at LANES * `start` on.

    As `shaped`, it checks no bounds and does not keep its memory alive.
    """
    view = types.Array(WIDE, len(shape), 'C')

    def build(context, builder, signature, arguments):
        def cast(data):
            return builder.bitcast(data, NUMBERS.as_pointer())

        return build_view(context, builder, signature, arguments, SIZE, cast)

    return view(memory, start, shape), build
