"""What generated modules and the runtime agree on.

A generated module fills arrays at many places a call. Its functions reach the runtime by address, so the
runtime is compiled once per installation and shared by every module.

=========== ============================================= ==========================================
function    arguments                                     rows of ``out``
=========== ============================================= ==========================================
frame       n, lam, v2, p, out                            x, z, ds, kappa, normal force
climb       n, lam, p, out                                climb, d climb/d lam
rise        n, a, lam, d, p, out                          climb[a, lam], ds(lam); d = lam - a
bend        n, a, b, da, db, p, out                       climb[a, lam, b], ds(lam)
bounds      lo, hi, p, out                                enclosure of climb', enclosure of ds
=========== ============================================= ==========================================

``climb`` is twice the potential per unit mass over the inertia factor, so that ``V**2 + climb`` is constant
(MATHS, section 2). Square brackets are divided differences (MATHS, section 3): ``da = lam - a`` and
``db = b - lam`` are given as computed, never re-subtracted.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from numba import types

# Raised with every change of a signature here, or of a number that runtime code puts into generated modules.
INTERFACE = 1

REAL = types.float64
MANY = types.CPointer(REAL)

FRAME = types.void(types.intp, MANY, MANY, MANY, MANY)
CLIMB = types.void(types.intp, MANY, MANY, MANY)
RISE = types.void(types.intp, REAL, MANY, MANY, MANY, MANY)
BEND = types.void(types.intp, REAL, REAL, MANY, MANY, MANY, MANY)
BOUNDS = types.void(REAL, REAL, MANY, MANY)

FRAME_ROWS = 5


class Addresses(NamedTuple):
    """Where the compiled functions of one generated module lie in memory."""

    frame: int
    climb: int
    rise: int
    bend: int
    bounds: int


class ExactFormulas(NamedTuple):
    """The same formulas as plain Python over a namespace of operations: ``f(op, lam, p)``."""

    x: Callable[..., Any]
    z: Callable[..., Any]
    ds: Callable[..., Any]
    kappa: Callable[..., Any]
    reaction: Callable[..., Any]
    climb: Callable[..., Any]
    climb_slope: Callable[..., Any]
    domain: Callable[..., Any]
