"""The functions that use Numba's internals, or their versions in plain Numba if a release of Numba lacks the internals.

The releases from TESTED[0] to TESTED[1] have them. With another release they are tried at import, which takes a third
of a second. ROS_IK_PLAIN_NUMBA=1 always selects plain Numba, which is slower and gives the same results.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numba
import numpy as np

TESTED = (0, 60), (0, 68)


def _why_plain() -> str:
    """Return why plain Numba is used, or '' if it is not."""
    if os.environ.get('ROS_IK_PLAIN_NUMBA', '0') not in ('', '0'):
        return 'ROS_IK_PLAIN_NUMBA is set'
    try:
        if not TESTED[0] <= numba.version_info[:2] <= TESTED[1]:
            _try_out()
    except Exception as error:  # whatever another version does
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        return f'Numba {numba.__version__} lacks what the solver uses of its insides ({reason})'
    return ''


def _try_out() -> None:
    """Raise an error if a function that uses all internals does not compile or returns wrong numbers."""
    from ros_ik_pkg.ik.kernel.array_views import on_stack, shaped
    from ros_ik_pkg.ik.kernel.disk_cache import cache_in
    from ros_ik_pkg.ik.kernel.llvm_hints import on_its_own, small_loops
    from ros_ik_pkg.ik.kernel.parts import PartCompiler, make_part
    from ros_ik_pkg.ik.kernel.wide import LANES, bits_of, where, wide_view

    cache_in(Path(tempfile.gettempdir()), [])(cache_in)  # makes no files

    def part(array):
        on_its_own()
        small_loops()
        return shaped(array, 1, (2, 2))[1, 1]

    inner = numba.njit(part, pipeline_class=PartCompiler, _nrt=False)
    make_part(inner, numba.njit(part), [])

    @numba.njit
    def outer():
        array = on_stack(5)
        for i in range(5):
            array[i] = i
        return inner(array)

    @numba.njit
    def side_by_side():
        array = on_stack(LANES)
        for k in range(LANES):
            array[k] = k
        numbers = wide_view(array, 0, (1,))
        numbers[0] = where(numbers[0] >= 2.0, 1.0 - numbers[0], 9)
        return bits_of(numbers[0] + 1.0 > 9.0), array[3]

    if side_by_side() != (3, -2.0):
        raise ValueError(f'it computes {side_by_side()} side by side; expected 3 and -2')
    for result in (outer(), inner(np.arange(5.0))):
        if result != 4.0:
            raise ValueError(f'it computes {result}; expected 4')


WHY_PLAIN = _why_plain()

if WHY_PLAIN:
    from ros_ik_pkg.ik.kernel.plain import on_its_own, on_stack, shaped, small_loops
else:
    from ros_ik_pkg.ik.kernel.array_views import on_stack, shaped
    from ros_ik_pkg.ik.kernel.llvm_hints import on_its_own, small_loops

__all__ = ['on_its_own', 'on_stack', 'shaped', 'small_loops']
