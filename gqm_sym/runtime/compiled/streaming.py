"""Stores of results into large arrays that bypass the caches.

An ordinary store first reads the cache line that it writes into, and evicts another one. For an array too large for the
caches, which will be evicted before anybody reads it, that is two thirds of the memory traffic. A streaming store does
neither, but it must write whole cache lines.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.jit import Inlined
from gqm_sym.runtime.compiled.uncompiled import in_python

# Doubles in a cache line.
LINE = 8

# Results of at least so many bytes bypass the caches.
LARGE = 2**22
_LINE = ir.VectorType(ir.DoubleType(), LINE)


@intrinsic
def before_line(_, array):  # type: ignore[no-untyped-def]
    """Return how many numbers of an array lie before its first whole cache line."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        whole = ir.IntType(64)
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        over = builder.neg(builder.ptrtoint(data, whole))
        return builder.lshr(builder.and_(over, ir.Constant(whole, 8 * LINE - 1)), ir.Constant(whole, 3))

    return types.int64(array), lower


@intrinsic
def stream(_, to, at, source, start):  # type: ignore[no-untyped-def]
    """Store ``to[at : at + LINE] = source[start : start + LINE]``, which must be one cache line, past the caches."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        into, values = (
            builder.bitcast(
                builder.gep(context.make_array(signature.args[k])(context, builder, args[k]).data, [args[k + 1]]),
                _LINE.as_pointer(),
            )
            for k in (0, 2)
        )
        store = builder.store(builder.load(values, align=8), into, align=8 * LINE)
        store.set_metadata("nontemporal", builder.module.add_metadata([ir.Constant(ir.IntType(32), 1)]))
        return context.get_dummy_value()

    return types.void(to, types.intp, source, types.intp), lower


@intrinsic
def settle(_, array):  # type: ignore[no-untyped-def]
    """Make streamed results visible to other threads."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.fence("seq_cst")
        return context.get_dummy_value()

    return types.void(array), lower


@in_python(stream)
def _store(to: Any, at: int, source: Any, start: int) -> None:
    to[at : at + LINE] = source[start : start + LINE]


in_python(before_line)(lambda array: 0)
in_python(settle)(lambda array: None)


@Inlined
def put(to, at, source, start, n, bypass):  # type: ignore[no-untyped-def]
    """Store ``to[at : at + n] = source[start : start + n]``, past the caches if ``bypass``.

    It takes no slices, because numba counts references to them with locked instructions, which wait for all earlier
    stores.
    """
    head = min((before_line(to) - at) % LINE, n) if bypass else n
    last = n - (n - head) % LINE
    for i in range(head):
        to[at + i] = source[start + i]
    for i in range(head, last, LINE):
        stream(to, at + i, source, start + i)
    for i in range(last, n):
        to[at + i] = source[start + i]
