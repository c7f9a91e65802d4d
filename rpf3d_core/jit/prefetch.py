"""Ask the processor to load data shortly before a loop writes them, so that counting in large grids is faster."""

from collections.abc import Callable
from typing import Any

from rpf3d_core.jit.dispatch import INLINED, numba

if numba is not None:
    from numba.core import types

try:  # a numba release may move these; without them `prefetch` does nothing
    from numba.core import cgutils
    from numba.core.cgutils import ir  # type: ignore[attr-defined]  # `ir` of llvmlite, in the version of numba
except ImportError:
    ir = None


def _ask_for(array, row, column):  # type: ignore[no-untyped-def]  # numba needs equal parameters in all overloads
    """Ask the processor to load the element (row, column) of an array before it is written.

    This is only a hint: the content does not change.
    """


prefetch: Callable[[Any, Any, Any], None] = _ask_for

if numba is not None and ir is None:

    @numba.extending.overload(_ask_for, jit_options=INLINED)
    def _no_prefetch(array, row, column):  # type: ignore[no-untyped-def]
        return lambda array, row, column: None


if numba is not None and ir is not None:

    @numba.extending.intrinsic
    def _prefetch(typing_context, array, row, column):  # type: ignore[no-untyped-def]
        """Call LLVM's prefetch instruction, https://llvm.org/docs/LangRef.html#llvm-prefetch-intrinsic."""

        def build(context, builder, signature, args):  # type: ignore[no-untyped-def]
            word, kind = cgutils.int32_t, signature.args[0]
            parts = context.make_array(kind)(context, builder, args[0])
            place = [context.cast(builder, args[k], signature.args[k], types.intp) for k in (1, 2)]
            at = cgutils.get_item_pointer(context, builder, kind, parts, place, wraparound=False)
            at = builder.bitcast(at, cgutils.voidptr_t)
            hint = ir.FunctionType(ir.VoidType(), [at.type, word, word, word])
            to_write, keep_everywhere, data = (word(value) for value in (1, 3, 1))
            ask = builder.module.declare_intrinsic("llvm.prefetch", [at.type], hint)
            builder.call(ask, [at, to_write, keep_everywhere, data])
            return context.get_dummy_value()

        return types.none(array, row, column), build

    @numba.extending.overload(_ask_for, jit_options=INLINED)
    def _compiled_prefetch(array, row, column):  # type: ignore[no-untyped-def]
        return lambda array, row, column: _prefetch(array, row, column)
