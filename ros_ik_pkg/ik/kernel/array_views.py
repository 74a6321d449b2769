"""Blocks of memory and views of them, for compiled code."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array


@intrinsic
def shaped(_typing, array, start, shape):
    """Return a view of a contiguous array's numbers from the one at `start` on, in the given shape.

    Slices and `reshape` do the same but check every bound, which takes ten times as long; here the caller guarantees
    them. The view does not keep its memory alive: for use in kernels only.
    """
    view = types.Array(array.dtype, len(shape), 'C')

    def build(context, builder, signature, arguments):
        size = context.get_abi_sizeof(context.get_data_type(array.dtype))
        return build_view(context, builder, signature, arguments, size, lambda data: data)

    return view(array, start, shape), build


def build_view(context, builder, signature, arguments, size, cast):
    """Return the LLVM value of what `shaped` returns; items are of `size` bytes, `cast` makes a pointer to them from
    that of the array."""
    array, start, shape = signature.args
    whole = context.make_array(array)(context, builder, arguments[0])
    first = context.cast(builder, arguments[1], start, types.intp)
    lengths = [
        context.cast(builder, length, kind, types.intp)
        for length, kind in zip(cgutils.unpack_tuple(builder, arguments[2]), shape)
    ]
    itemsize = context.get_constant(types.intp, size)
    strides = [itemsize]
    for length in lengths[:0:-1]:
        strides.insert(0, builder.mul(strides[0], length))
    made = context.make_array(signature.return_type)(context, builder)
    data = builder.gep(cast(whole.data), [first])
    populate_array(made, data=data, shape=lengths, strides=strides, itemsize=itemsize, meminfo=None)
    return made._getvalue()


@intrinsic
def on_stack(_typing, count):
    """Return uninitialised memory for `count` float64; it lasts until the function returns. Not for loops."""
    view = types.Array(types.float64, 1, 'C')

    def build(context, builder, signature, arguments):
        length = context.cast(builder, arguments[0], signature.args[0], types.intp)
        data = builder.alloca(ir.DoubleType(), length)
        data.align = 64
        size = context.get_constant(types.intp, 8)
        made = context.make_array(view)(context, builder)
        populate_array(made, data=data, shape=[length], strides=[size], itemsize=size, meminfo=None)
        return made._getvalue()

    return view(count), build
