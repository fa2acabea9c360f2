"""Whether the curvature keeps its sign on a leg from turn to turn, or on a part of one, by a law with a kink where it
does not.
"""

from gqm_sym.runtime.compiled.jit import Inner
from gqm_sym.runtime.compiled.registers import over_rows
from gqm_sym.runtime.legs.panels.equation import DS, KAPPA, LOAD, NODES, D, product
from gqm_sym.runtime.legs.panels.polynomials import WIDE
from gqm_sym.runtime.legs.panels.resolution import CANCELLATION_NOISE
from gqm_sym.runtime.legs.runs.whole_rows import sign_of_row, size_of_row

quotient_row = over_rows(lambda one, other: one / other, WIDE)
quotient_before_end_row = over_rows(lambda one, y: one / (y - 1.0), WIDE)


@Inner
def curvature_sign(is_stretched, blocks, kinks, work):  # type: ignore[no-untyped-def]
    """Return `sign_of_row` for the curvature, with a ratio that is compared with TAIL_RATIO; 0 if it is resolved.

    The law at the nodes has the curvature itself, and only its sign matters here. Along a graph its coefficients
    decrease more slowly than those of all that the law is made of. ``kinks`` says of the start and of the end whether
    the curvature vanishes there; it is divided by the place with respect to them.
    """
    for at in range(0, blocks * WIDE, WIDE):
        product(work, blocks * LOAD + at, blocks * DS + at, blocks * KAPPA + at)
        if is_stretched:  # without the factor J, the bound of the sign is closer
            quotient_row(work, blocks * LOAD + at, blocks * LOAD + at, blocks * D + at)
        if kinks[0]:
            quotient_row(work, blocks * LOAD + at, blocks * LOAD + at, blocks * NODES + at)
        if kinks[1]:
            quotient_before_end_row(work, blocks * LOAD + at, blocks * LOAD + at, blocks * NODES + at)
    size = size_of_row(blocks, work, LOAD)
    sign = 1 if work[blocks * LOAD] > 0.0 else -1
    fine, kept, ratio = sign_of_row(blocks, work, LOAD, sign, (size, CANCELLATION_NOISE * size))
    # FAR_FROM_ZERO_RATIO is about the root of TAIL_RATIO.
    return fine, kept, 0.0 if fine else ratio * ratio
