"""Orbits whose times need double-double arithmetic, which takes them in blocks.

Those of several batches wait until they are enough, because a block takes hardly less time if it has few orbits.
"""

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.double_double.interpreter import BLOCK
from gqm_sym.runtime.quadrature.trapezoid import LIBRATION
from gqm_sym.runtime.sweep.batch.exact_nodes import leave_unchecked
from gqm_sym.runtime.sweep.batch.rows import CAPACITY, ROWS, Orbits, Waiting, gather
from gqm_sym.runtime.sweep.batch.times import times_by_trapezoid


@Inner
def no_room(waiting):  # type: ignore[no-untyped-def]
    """Return space for no orbits."""
    return Waiting(waiting.number, waiting.rows[:0], waiting.params)


@Inner
def answer_exact_times(fns, mirrored, orbits, buffers, scratch, quantity, answers):  # type: ignore[no-untyped-def]
    """Fill half periods or periods that are corrected by double-double arithmetic.

    ``buffers`` are the number of orbits, what stores some of them meanwhile, and space for orbits that wait.
    """
    number, block, waiting = buffers
    for begin in range(0, number, BLOCK):
        size = min(BLOCK, number - begin)
        for j in range(size):
            scratch.others[j] = begin + j
        full = gather(orbits, scratch.param_count, scratch.others, size, block, ROWS)
        some = Orbits(full, block.rows, block.params)
        leave_unchecked(some)
        times_by_trapezoid(fns, (LIBRATION, mirrored, True), some, no_room(waiting), scratch, quantity, answers)


@Inner
def answer_waiting(fns, mirrored, waiting, block, scratch, quantity, answers):  # type: ignore[no-untyped-def]
    """Answer the orbits that wait; ``block`` stores some of them meanwhile."""
    orbits, buffers = Orbits(CAPACITY, waiting.rows, waiting.params), (waiting.number[0], block, waiting)
    answer_exact_times(fns, mirrored, orbits, buffers, scratch, quantity, answers)
    waiting.number[0] = 0
