"""Blocks of results put into their place in large arrays, past the caches where these could not hold them.

A store reads the line of memory that it writes into, and drives another out of the cache: for an array that will be out
of the cache again before anybody reads it, that is two thirds of what there is to do. A streaming store does neither,
but takes whole lines.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gqm_sym.runtime.compiled.jit import Inlined

# Doubles in a line of the cache.
LINE = 8

# Bytes of results from which on they go past the caches.
LARGE = 2**22
_LINE = ir.VectorType(ir.DoubleType(), LINE)


@intrinsic
def before_line(_, array):  # type: ignore[no-untyped-def]
    """How many numbers of an array lie before its first whole line of the cache."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        whole = ir.IntType(64)
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        over = builder.neg(builder.ptrtoint(data, whole))
        return builder.lshr(builder.and_(over, ir.Constant(whole, 8 * LINE - 1)), ir.Constant(whole, 3))

    return types.int64(array), lower


@intrinsic
def stream(_, to, at, given, start):  # type: ignore[no-untyped-def]
    """``to[at : at + LINE] = given[start : start + LINE]``, past the caches; that is a line of the cache."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        target, source = (
            builder.bitcast(
                builder.gep(context.make_array(signature.args[k])(context, builder, args[k]).data, [args[k + 1]]),
                _LINE.as_pointer(),
            )
            for k in (0, 2)
        )
        store = builder.store(builder.load(source, align=8), target, align=8 * LINE)
        store.set_metadata("nontemporal", builder.module.add_metadata([ir.Constant(ir.IntType(32), 1)]))
        return context.get_dummy_value()

    return types.void(to, types.intp, given, types.intp), lower


@intrinsic
def settle(_, array):  # type: ignore[no-untyped-def]
    """Have other threads see what was streamed."""

    def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.fence("seq_cst")
        return context.get_dummy_value()

    return types.void(array), lower


@Inlined
def put(to, at, given, start, n, past):  # type: ignore[no-untyped-def]
    """``to[at : at + n] = given[start : start + n]``; ``past`` the caches, or through them.

    Without slices: who holds an array is counted by locked instructions, and these wait for all stores before them.
    """
    head = min((before_line(to) - at) % LINE, n) if past else n
    last = n - (n - head) % LINE
    for i in range(head):
        to[at + i] = given[start + i]
    for i in range(head, last, LINE):
        stream(to, at + i, given, start + i)
    for i in range(last, n):
        to[at + i] = given[start + i]
