"""Exponentials of rows of numbers in vector registers, for the formulas of `compiled.registers.over_rows`."""

from typing import Any

import numpy as np
from llvmlite import ir

from gqm_sym.runtime.arithmetic.elementary import EXPONENTIAL, LOG2, LOG2_LOW, ONE_OVER_LOG2, ROUND
from gqm_sym.runtime.compiled.registers import LANES, REGISTER, Lanes, fused

# The bias of the exponent of a double, and the bit at which the exponent begins.
BIAS, EXPONENT_AT = 1023, 52


def two_to(shifted: Any) -> Any:
    """Return 2**k for numbers ``k + elementary.ROUND`` (`elementary.power_of_two`)."""
    if not isinstance(shifted, Lanes):
        return ((shifted.view(np.int64) + BIAS) << EXPONENT_AT).view(np.float64)
    builder, whole = shifted.builder, ir.VectorType(ir.IntType(64), LANES)
    bits = builder.add(builder.bitcast(shifted.value, whole), ir.Constant(whole, [BIAS] * LANES))
    bits = builder.shl(bits, ir.Constant(whole, [EXPONENT_AT] * LANES))
    return Lanes(builder, builder.bitcast(bits, REGISTER))


def expm1(x: Any) -> Any:
    """Return exp(x) - 1 for numbers from 0 to some hundreds, as `elementary.expm1_below` does for those below 0."""
    shifted = x * ONE_OVER_LOG2 + ROUND
    k = shifted - ROUND
    high, low = x - k * LOG2, k * -LOG2_LOW
    r = high + low
    terms = x * 0.0 + EXPONENTIAL[0]
    for term in EXPONENTIAL[1:]:
        terms = fused(terms, r, term)
    lead = r + 1.0
    tail = fused(terms, r * r, low - (r - high))
    return ((lead - two_to(k * -1.0 + ROUND)) + ((r - (lead - 1.0)) + tail)) * two_to(shifted)
