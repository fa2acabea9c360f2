"""Fourier coefficients of a periodic motion, from its states at equal steps of time or, on a curve of pieces, at Gauss
points between its joints.
"""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gqm_sym.arguments import one_of, short
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.compiled.types import Array

Complex: TypeAlias = NDArray[np.complex128]

# The quantities that can be expanded; the first two grow with each lap of a circulation.
QUANTITIES = ("lam", "s", "x", "z", "v", "normal_force")
GROWING = QUANTITIES[:2]

# The number of time steps of the first attempt and of the last one; and the share of the largest term below which terms
# count as zero.
MIN_STEPS, MAX_STEPS, MAX_TAIL = 64, 2**16, 1e-14

# The number of Gauss points on a panel in the first attempt, and the largest size of a block of cosines.
MIN_POINTS, BLOCK = 16, 2**20


class Fourier(NamedTuple):
    """Coefficients of ``f(t) = sum of a[k] cos(2 pi k t/T) + b[k] sin(2 pi k t/T)``, k from 0, with t from launch.

    Attributes
    ----------
    a, b : array
        The coefficients, in the unit of the quantity.
    """

    a: Array
    b: Array


def fourier(motion: Any, quantity: str, n: int, panel_times: Array | None = None) -> Fourier:
    """Return the coefficients of a quantity up to the n-th.

    On a curve without joints the trapezoidal rule in time converges geometrically. At a joint the quantity or one of
    its derivatives jumps, and Gauss's rule on each panel converges geometrically instead.

    Parameters
    ----------
    motion : motion.periodic.PeriodicMotion
        The motion.
    quantity : str
        One of `QUANTITIES`.
    n : int
        The order of the last coefficient.
    panel_times : array, optional
        On a curve with joints, the times in s within one period between which the quantity is smooth.
    """
    one_of(quantity, QUANTITIES, where="fourier: quantity")
    if not (isinstance(n, int) and 0 <= n <= MAX_STEPS // 4):
        raise InputError(f"fourier: n: must be a whole number from 0 to {MAX_STEPS // 4}, got {short(n)}")
    if motion.kind == "circulation" and quantity in GROWING:
        raise SolutionError(f"fourier: {quantity} of a circulation grows and does not repeat; ask for x, z, v or force")
    terms = _trapezoidal(motion, quantity, n) if panel_times is None else _gauss(motion, quantity, n, panel_times)
    factor = np.where(np.arange(n + 1) > 0, 2.0, 1.0)
    return Fourier(factor * terms.real, -factor * terms.imag)


def _trapezoidal(motion: Any, quantity: str, n: int) -> Complex:
    """Return the means of a quantity times exp(-2 pi i k t/T), k from 0 to n, from states at equal steps of time."""
    steps = MIN_STEPS
    while steps <= MAX_STEPS:
        state = motion.state(motion.period * (np.arange(steps) / steps))
        terms = np.fft.rfft(getattr(state, quantity)) / steps
        sizes = np.abs(terms)
        if n < steps // 4 and sizes[steps // 4 :].max() <= MAX_TAIL * sizes.max():
            return terms[: n + 1]
        steps *= 2
    raise _too_sharp(quantity)


def _gauss(motion: Any, quantity: str, n: int, panel_times: Array) -> Complex:
    """Return the same means from states at Gauss points on each panel."""
    ends = panel_times / motion.period
    starts, widths = ends[:-1, None], np.diff(ends)[:, None]
    points, last = MIN_POINTS, np.full(n + 1, np.inf)
    while widths.size * points <= MAX_STEPS:
        x, weights = np.polynomial.legendre.leggauss(points)
        shares = (starts + widths * (0.5 + 0.5 * x)).ravel()
        values = getattr(motion.state(motion.period * shares), quantity)
        terms = _means(values * (widths * (0.5 * weights)).ravel(), shares, n)
        if np.abs(terms - last).max() <= MAX_TAIL * np.abs(values).max():
            return terms
        points, last = 2 * points, terms
    raise _too_sharp(quantity)


def _means(weighted: Array, shares: Array, n: int) -> Complex:
    """Return the sums of weighted values times exp(-2 pi i k t/T), k from 0 to n, at shares t/T of the period."""
    size = max(1, BLOCK // shares.size)
    blocks = (np.arange(k, min(k + size, n + 1)) for k in range(0, n + 1, size))
    return np.concatenate([np.exp(-2j * np.pi * np.outer(block, shares)) @ weighted for block in blocks])


def _too_sharp(quantity: str) -> SolutionError:
    """Return the error of a quantity that no attempt resolves."""
    return SolutionError(f"fourier: {quantity} changes too sharply with time for {MAX_STEPS // 4} terms")
