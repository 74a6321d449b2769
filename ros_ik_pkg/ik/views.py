"""Views of one block of memory, for compiled code."""

from __future__ import annotations

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array


@intrinsic
def shaped(_typing, vector, shape):
    """Return a view of a contiguous array from its first number on, in the given shape.

    `reshape` does the same and checks that it can, which takes ten times as long as the view; here the caller knows.
    The view does not keep its memory alive: for use in kernels only.
    """
    view = types.Array(vector.dtype, len(shape), 'C')

    def build(context, builder, _signature, arguments):
        whole = context.make_array(vector)(context, builder, arguments[0])
        lengths = [
            context.cast(builder, length, kind, types.intp)
            for length, kind in zip(cgutils.unpack_tuple(builder, arguments[1]), shape)
        ]
        size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(vector.dtype)))
        strides = [size]
        for length in lengths[:0:-1]:
            strides.insert(0, builder.mul(strides[0], length))
        made = context.make_array(view)(context, builder)
        populate_array(made, data=whole.data, shape=lengths, strides=strides, itemsize=size, meminfo=None)
        return made._getvalue()

    return view(vector, shape), build
