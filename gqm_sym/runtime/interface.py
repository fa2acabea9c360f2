"""What generated modules and the runtime agree on.

A generated module fills arrays at many places a call. Its functions reach the runtime by address, so the
runtime is compiled once per installation and shared by every module.

=========== ============================================= ==========================================
function    arguments                                     rows of ``out``
=========== ============================================= ==========================================
frame       n, lam, v2, p, out                            x, z, ds, kappa, normal force
loads       n, w0, level, lam, p, out                     x, z, ds, kappa, V**2, normal force, size
climb       n, lam, p, out                                climb, d climb/d lam
rise        n, a, lam, d, p, out                          climb[a, lam], ds(lam); d = lam - a
bend        n, a, b, da, db, p, out                       climb[a, lam, b], ds(lam)
bounds      lo, hi, p, out                                enclosure of climb', enclosure of ds
rise_each   n, a, lam, d, p, out                          climb[a, lam], ds(lam), climb'(lam)
bend_each   n, a, b, da, db, p, out                       climb[a, lam, b], ds(lam)
bounds_each n, lo, hi, p, out                             enclosure of climb', enclosure of ds
orbit_each  n, a, b, p, out                               what bend_each finds behind p
swing_each  n, fall, rise, p, out                         (dt/du)**2, what that is divided by
top_each    n, half, p, out                               what swing_each finds behind p
crest_each  n, offset, v2, p, out                         half an orbit's width, growth of the climb, sine squared
mean_each   n, half, p, out                               squares of two numbers, of pi over the half period
drive       n, lam, v2, v, nu, p, out                     ds, P, Q, n0, kappa
hold        n, lam, p, out                                A(lam, 0; +1), A(lam, 0; -1), static friction
segment     n, lam, p, out                                x, z, ds, dx/ds, dz/ds, kappa
field       n, x, z, p, out                               F, F_x, F_z, F_xx, F_xz, F_zz
=========== ============================================= ==========================================

A conservative model has ``climb``, ``rise``, ``bend`` and ``bounds``; a dissipative one ``drive`` and ``hold`` instead.

The functions ``_each`` are for sweeps: their ``a``, ``b``, ``lo``, ``hi`` and ``p`` are arrays too, a launch and
parameters for each place (``p`` has a row for each parameter). They are compiled when a sweep first asks for them.
``bend_each`` may give NaN where points lie too far apart for its closed forms; ``bend`` never does. What is the same
all along an orbit, ``orbit_each`` works out once: those rows stand behind the parameters in the ``p`` of ``bend_each``.

Orbits about an axis of symmetry may have ``swing_each``: their time as an integral over u in which the square of the
coordinate sqrt(top)*sin(u) is the share ``fall`` = sin(u)**2 of its largest, ``rise`` being the rest. ``half`` is half
of an orbit's width. Where that is a complete elliptic integral of the first kind they have ``mean_each`` instead: pi
over the half period is the arithmetic-geometric mean of two numbers. In a well that is monotone on either side, where
V**2 is used up may have a closed form: ``crest_each``, from the offset and V**2 of a launch.

A curve with formulas that is a piece of a rail has ``segment`` (`rail`), in its own parameter; an implicit curve F = 0
has ``field``, by which it is traced (`tracing`).

``loads`` is for load maps: V**2 is ``w0`` less the climb from ``level``, and ``size`` is what the climb's roundings are
shares of. There is none where that is not known.

``climb`` is twice the potential per unit mass over the inertia factor, so that ``V**2 + climb`` is constant
(MATHS, section 2). Square brackets are divided differences (MATHS, section 3): ``da = lam - a`` and
``db = b - lam`` are given as computed, never re-subtracted.

On a leg with signs v = sgn(ds/dt) and nu = sgn(N), ``dW/dlam = P - Q W`` with W = V**2 (MATHS, section 2). For a law
that is not linear in W, P and Q are its linearisation at the ``v2`` given: ``P - Q v2`` is the law itself there. The
contact force is ``N = m (kappa W + n0)``.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from numba import types

# Raised with every change of a signature here, or of a number that runtime code puts into generated modules.
INTERFACE = 8

REAL = types.float64
MANY = types.CPointer(REAL)

FRAME = types.void(types.intp, MANY, MANY, MANY, MANY)
LOADS = types.void(types.intp, REAL, REAL, MANY, MANY, MANY)
CLIMB = types.void(types.intp, MANY, MANY, MANY)
RISE = types.void(types.intp, REAL, MANY, MANY, MANY, MANY)
BEND = types.void(types.intp, REAL, REAL, MANY, MANY, MANY, MANY)
BOUNDS = types.void(REAL, REAL, MANY, MANY)

RISE_EACH = types.void(types.intp, MANY, MANY, MANY, MANY, MANY)
BEND_EACH = types.void(types.intp, MANY, MANY, MANY, MANY, MANY, MANY)
BOUNDS_EACH = types.void(types.intp, MANY, MANY, MANY, MANY)
ORBIT_EACH = types.void(types.intp, MANY, MANY, MANY, MANY)
SWING_EACH = types.void(types.intp, REAL, REAL, MANY, MANY)
TOP_EACH = types.void(types.intp, MANY, MANY, MANY)
CREST_EACH = types.void(types.intp, MANY, MANY, MANY, MANY)
MEAN_EACH = types.void(types.intp, MANY, MANY, MANY)

DRIVE = types.void(types.intp, MANY, MANY, REAL, REAL, MANY, MANY)
HOLD = types.void(types.intp, MANY, MANY, MANY)

FIELD = types.void(types.intp, MANY, MANY, MANY, MANY)
SEGMENT = types.void(types.intp, MANY, MANY, MANY)

FRAME_ROWS, LOAD_ROWS = 5, 7


class Addresses(NamedTuple):
    """Where the compiled functions of one generated module lie in memory; 0 for those that it has none of."""

    path_and_contact_force: int
    effective_potential: int = 0
    potential_divdiff1: int = 0
    potential_divdiff2: int = 0
    bounds: int = 0


class BatchAddresses(NamedTuple):
    """Where the compiled functions of one module that serve many orbits at once lie in memory; 0 for missing ones."""

    potential_divdiff1: int
    potential_divdiff2: int
    bounds: int
    orbit_invariants: int = 0
    time_integrand: int = 0
    integrand_invariants: int = 0
    agm_arguments: int = 0
    turning_point: int = 0


class Each(NamedTuple):
    """The functions of a sweep over many orbits at once: each has an ``address`` (`jit.Later`).

    ``held`` and ``top_held`` are how many rows ``orbit`` and ``top`` fill. None and 0 where nothing is the same all
    along an orbit, and where orbits have no swing.
    """

    rise: Any
    bend: Any
    bounds: Any
    orbit: Any = None
    swing: Any = None
    top: Any = None
    mean: Any = None
    crest: Any = None
    held: int = 0
    top_held: int = 0

    def addresses(self) -> BatchAddresses:
        """Where they lie in memory; 0 for one that there is not."""
        return BatchAddresses(*(function.address if function else 0 for function in self[:8]))


class Dissipation(NamedTuple):
    """What a dissipative model adds: the addresses of ``drive`` and ``hold``, and of what kind its forces are.

    Attributes
    ----------
    friction : bool
        Whether the force depends on the sign of N: then a leg ends where N changes sign.
    kinked : bool
        Whether it has a kink where the curvature changes sign: a leg is computed in parts there.
    linear : bool
        Whether it is linear in V**2.
    """

    drive: int
    hold: int
    friction: bool
    kinked: bool
    linear: bool


class ExactClimb(NamedTuple):
    """What a module of a charted curve has of them: ``f(op, x, z, p)``, the climb and its derivatives by x and z."""

    climb: Callable[..., Any]


class ExactFormulas(NamedTuple):
    """The same formulas as plain Python over a namespace of operations: ``f(op, lam, p)``."""

    x: Callable[..., Any]
    z: Callable[..., Any]
    ds: Callable[..., Any]
    kappa: Callable[..., Any]
    reaction: Callable[..., Any]
    climb: Callable[..., Any]
    climb_slope: Callable[..., Any]
