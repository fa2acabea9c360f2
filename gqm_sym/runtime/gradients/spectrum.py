"""Fourier coefficients of a periodic motion, from its states at equal steps of time."""

from typing import Any, NamedTuple

import numpy as np

from gqm_sym.arguments import one_of, short
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.compiled.types import Array

# The quantities that can be expanded; the first two grow with each lap of a circulation.
QUANTITIES = ("lam", "s", "x", "z", "v", "normal_force")
GROWING = QUANTITIES[:2]

# The number of time steps of the first attempt and of the last one; and the share of the largest term below which terms
# count as zero.
MIN_STEPS, MAX_STEPS, MAX_TAIL = 64, 2**16, 1e-14


class Fourier(NamedTuple):
    """Coefficients of ``f(t) = sum of a[k] cos(2 pi k t/T) + b[k] sin(2 pi k t/T)``, k from 0, with t from launch.

    Attributes
    ----------
    a, b : array
        The coefficients, in the unit of the quantity.
    """

    a: Array
    b: Array


def fourier(motion: Any, quantity: str, n: int) -> Fourier:
    """Return the coefficients of a quantity up to the n-th; the trapezoidal rule in time converges geometrically.

    Parameters
    ----------
    motion : motion.periodic.PeriodicMotion
        The motion.
    quantity : str
        One of `QUANTITIES`.
    n : int
        The order of the last coefficient.
    """
    one_of(quantity, QUANTITIES, where="fourier: quantity")
    if not (isinstance(n, int) and 0 <= n <= MAX_STEPS // 4):
        raise InputError(f"fourier: n: must be a whole number from 0 to {MAX_STEPS // 4}, got {short(n)}")
    if motion.kind == "circulation" and quantity in GROWING:
        raise SolutionError(f"fourier: {quantity} of a circulation grows and does not repeat; ask for x, z, v or force")
    steps = MIN_STEPS
    while steps <= MAX_STEPS:
        state = motion.state(motion.period * (np.arange(steps) / steps))
        terms = np.fft.rfft(getattr(state, quantity)) / steps
        sizes = np.abs(terms)
        if n < steps // 4 and sizes[steps // 4 :].max() <= MAX_TAIL * sizes.max():
            factor = np.where(np.arange(n + 1) > 0, 2.0, 1.0)
            return Fourier(factor * terms[: n + 1].real, -factor * terms[: n + 1].imag)
        steps *= 2
    raise SolutionError(f"fourier: {quantity} changes too sharply with time for {MAX_STEPS // 4} terms")
