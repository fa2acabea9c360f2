"""The interface between generated modules and the runtime.

A generated module evaluates its formulas at many places in one call. Its functions reach the runtime by address, so
the runtime is compiled once per installation and shared by every module.

Below, U is the effective potential per unit mass, Φ/(1 + β), so that ``V**2 = v0**2 - 2*(U(lam) - U(lam0))`` (MATHS,
section 2). Square brackets are divided differences (MATHS, section 3), whose gaps ``d = lam - a``, ``da = lam - a`` and
``db = b - lam`` are given as they were computed, and are never subtracted again. Units are SI; [lam] is the unit of the
curve's parameter.

====================== ============================== ===============================================================
function               arguments                      rows of ``out``
====================== ============================== ===============================================================
path_and_contact_force n, lam, v2, p, out             x [m], z [m], ds/dlam [m/[lam]], curvature kappa [1/m], contact
                                                      force N = m*(kappa*v2 + n0) [N]
path_in_space          n, lam, v2, v, p, out          y [m], and the contact force along x, y and z [N]; v = sgn(ds/dt)
rider_loads            n, lam, v2, v, nu, p, out      loads on a rider upwards, to the left and ahead, in units of
                                                      9.80665 m/s2; the rates of these [1/s]; cosine and sine of the
                                                      roll angle, times a positive number; x, y and z of the track [m];
                                                      (dx/ds)**2 + (dy/ds)**2 where the roll angle is from the level
load_map               n, w0, level, lam, p, out      x, z, ds/dlam, kappa, V**2 [m2/s2], N, and the size of the terms
                                                      of U [m2/s2], whose roundings are shares of it; for a space curve
                                                      that does not turn the rows of path_in_space as well
effective_potential    n, lam, p, out                 U [m2/s2], dU/dlam [m2/s2/[lam]]
potential_divdiff1     n, a, lam, d, p, out           U[a, lam] [m2/s2/[lam]], ds/dlam at lam
potential_divdiff2     n, a, b, da, db, p, out        U[a, lam, b] [m2/s2/[lam]**2], ds/dlam at lam
bounds                 lo, hi, p, out                 lower and upper bound of dU/dlam, then of ds/dlam
speed_equation         n, lam, v2, v, nu, p, out      ds/dlam, P [m2/s2/[lam]], Q [1/[lam]], n0 [m/s2], kappa
squared_contact        n, lam, p, out                 coefficients of 1, V**2 and V**4 in (N/m)**2; f, where -v f |N|/m
                                                      is the part of dV**2/dlam that is due to friction
static_balance         n, lam, p, out                 tangential acceleration of a body at rest that is about to move
                                                      forwards, and backwards, its static friction included [m/s2]
separated_terms        n, a, lam, d, p, out           parts of U[a, lam], ds/dlam, kappa, parts of n0 = N/m at rest
segment                n, lam, p, out                 x, z, ds/dlam, dx/ds, dz/ds, kappa of a piece of a rail
field                  n, x, z, p, out                F, F_x, F_z, F_xx, F_xz, F_zz of an implicit curve F = 0
====================== ============================== ===============================================================

A conservative model has ``effective_potential``, ``potential_divdiff1``, ``potential_divdiff2`` and ``bounds``; a
dissipative one has ``speed_equation`` and ``static_balance`` instead. For its energy and its equilibria it also has
``effective_potential`` and ``bounds``, which are compiled when these are first asked for. On a leg with the signs v =
sgn(ds/dt) and nu = sgn(N), ``dW/dlam = P - Q*W`` with W = V**2 (MATHS, section 2). For a law that is not linear in W, P
and Q are its linearisation at the given ``v2``, where ``P - Q*v2`` is the law itself. The contact force is ``N =
m*(kappa*W + n0)``.

``squared_contact`` belongs to laws on curves in no vertical plane in which N/m is the root of a polynomial in V**2, and
which apart from friction are linear in V**2.

Only modules of space curves have ``path_in_space``. If such a curve lies in no vertical plane, the contact force has a
length and no sign: N is that length, kappa the length of the curvature vector, and n0 the value of N/m at rest. With
friction the rows n0 and kappa of ``speed_equation`` are N/m at the given ``v2``, and 0; on a banked track whose riders
have an upward direction, they belong to the component of N along that direction. In a rotating frame the contact force
depends on the sign of ds/dt too: in ``path_and_contact_force`` and ``load_map`` it is then that of a forward motion.

Only modules of tracks with a declared roll have ``rider_loads``.

``separated_terms`` belongs to charted curves: U and n0 are sums of its parts times factors (`SeparatedTerms`). It reads
only the run-time parameters listed there as ``held``, and is compiled when a sweep first asks for it.

``load_map`` fills all rows of a load map, with V**2 = ``w0`` - 2*(U(lam) - ``level``). A module has it only if the size
of the terms of U is known.

The functions of a batch serve sweeps. Their arguments ``a``, ``b``, ``lo``, ``hi`` and ``p`` are arrays too: every
place belongs to a launch with run-time parameters of its own, and ``p`` has one row for each parameter. They are
compiled when a sweep first asks for them.

========================== ======================== =================================================================
function of a batch        arguments                rows of ``out``
========================== ======================== =================================================================
potential_divdiff1_batch   n, a, lam, d, p, out     U[a, lam], ds/dlam, dU/dlam
potential_divdiff2_batch   n, a, b, da, db, p, out  U[a, lam, b], ds/dlam; NaN where the points lie too far apart for
                                                    the closed form
orbit_invariants_batch     n, a, b, middle, rest,   terms that are constant along an orbit, which
                           half, p, out             potential_divdiff2_batch reads behind the parameters
bounds_batch               n, lo, hi, p, out        lower and upper bound of dU/dlam, then of ds/dlam
time_integrand_batch       n, sine2, cosine2, p,    (dt/du)**2 [s2], and its divisor: where that is small, digits are
                           out                      lost
integrand_invariants_batch n, half, p, out          terms that are constant along an orbit, which
                                                    time_integrand_batch reads behind the parameters
agm_arguments_batch        n, half, p, out          squares of two numbers [1/s2]
turning_point_batch        n, offset, v2, p, out    half the orbit's width [[lam]]; loss of V**2 for each unit of the
                                                    square that it is written in; the square of the sine at the
                                                    turning point, above 1 where V**2 never vanishes
========================== ======================== =================================================================

``time_integrand_batch`` may exist for orbits about an axis of symmetry. Their half period is an integral over the angle
u, where ``sine2`` = sin(u)**2 is the square of a coordinate divided by its largest value, and ``cosine2`` = cos(u)**2.
``half`` is half of an orbit's width, and ``middle + rest`` is the middle of both ends in two doubles.
If that integral is a complete elliptic integral of the first kind, a module has ``agm_arguments_batch`` instead: pi
over the half period is the arithmetic-geometric mean of two numbers. This function and ``integrand_invariants_batch``
are given two rows: what rounding took from half the width follows it. In a well that is monotone on either side, the
turning point may have a closed form, ``turning_point_batch``, in terms of the launch's offset from the axis and its
V**2.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

from numba import types

# This number is raised with every change of a signature here, of the rows that an argument or a result has, or of a
# number that runtime code puts into generated modules.
INTERFACE = 21

REAL = types.float64
MANY = types.CPointer(REAL)

# How many places. It is unsigned, because numba counts negative subscripts from the end, and in a long function LLVM
# then does not see that the places follow each other, and does not vectorise the loop over them.
COUNT = types.uintp

PATH_AND_CONTACT_FORCE = types.void(COUNT, MANY, MANY, MANY, MANY)
PATH_IN_SPACE = types.void(COUNT, MANY, MANY, REAL, MANY, MANY)
LOAD_MAP = types.void(COUNT, REAL, REAL, MANY, MANY, MANY)
EFFECTIVE_POTENTIAL = types.void(COUNT, MANY, MANY, MANY)
POTENTIAL_DIVDIFF1 = types.void(COUNT, REAL, MANY, MANY, MANY, MANY)
POTENTIAL_DIVDIFF2 = types.void(COUNT, REAL, REAL, MANY, MANY, MANY, MANY)
BOUNDS = types.void(REAL, REAL, MANY, MANY)
SEPARATED_TERMS = POTENTIAL_DIVDIFF1

POTENTIAL_DIVDIFF1_BATCH = types.void(COUNT, MANY, MANY, MANY, MANY, MANY)
POTENTIAL_DIVDIFF2_BATCH = types.void(COUNT, MANY, MANY, MANY, MANY, MANY, MANY)
BOUNDS_BATCH = types.void(COUNT, MANY, MANY, MANY, MANY)
ORBIT_INVARIANTS_BATCH = types.void(COUNT, MANY, MANY, MANY, MANY, MANY, MANY, MANY)
TIME_INTEGRAND_BATCH = types.void(COUNT, REAL, REAL, MANY, MANY)
INTEGRAND_INVARIANTS_BATCH = types.void(COUNT, MANY, MANY, MANY)
AGM_ARGUMENTS_BATCH = types.void(COUNT, MANY, MANY, MANY)
TURNING_POINT_BATCH = types.void(COUNT, MANY, MANY, MANY, MANY)

SPEED_EQUATION = types.void(COUNT, MANY, MANY, REAL, REAL, MANY, MANY)
RIDER_LOADS = SPEED_EQUATION
SQUARED_CONTACT = STATIC_BALANCE = types.void(COUNT, MANY, MANY, MANY)

FIELD = types.void(COUNT, MANY, MANY, MANY, MANY)
SEGMENT = types.void(COUNT, MANY, MANY, MANY)

# Rows of path_and_contact_force, of path_in_space, of rider_loads and of load_map.
PATH_ROWS, SPACE_ROWS, RIDER_ROWS, LOAD_MAP_ROWS = 5, 4, 12, 7


class Addresses(NamedTuple):
    """The memory cells with the addresses of one generated module's functions; 0 for missing functions."""

    path_and_contact_force: int
    effective_potential: int = 0
    potential_divdiff1: int = 0
    potential_divdiff2: int = 0
    bounds: int = 0


class CompiledFunctions(NamedTuple):
    """The functions of one module that serve one motion, each a `emitted.Emitted`.

    A function that a module does not have is None.
    """

    path_and_contact_force: Any
    effective_potential: Any = None
    potential_divdiff1: Any = None
    potential_divdiff2: Any = None
    bounds: Any = None

    def addresses(self) -> Addresses:
        """Return the memory cells with their addresses; 0 for missing functions."""
        return Addresses(*_addresses(self))


def _addresses(functions: Iterable[Any]) -> Iterator[int]:
    return (function.address if function else 0 for function in functions)


class BatchAddresses(NamedTuple):
    """The memory cells with the addresses of one module's functions for many orbits at once; 0 for missing
    functions.
    """

    potential_divdiff1: int
    potential_divdiff2: int
    bounds: int
    orbit_invariants: int = 0
    time_integrand: int = 0
    integrand_invariants: int = 0
    agm_arguments: int = 0
    turning_point: int = 0


class BatchFunctions(NamedTuple):
    """The functions of one module that serve many orbits at once, each a `emitted.Emitted`.

    A function that a module does not have is None. ``orbit_rows`` and ``integrand_rows`` are the numbers of rows that
    ``orbit_invariants`` and ``integrand_invariants`` fill. The latter is given half the width of each orbit, and behind
    these numbers what rounding took from them, which it reads where the curve has a pole.
    """

    potential_divdiff1: Any
    potential_divdiff2: Any
    bounds: Any
    orbit_invariants: Any = None
    time_integrand: Any = None
    integrand_invariants: Any = None
    agm_arguments: Any = None
    turning_point: Any = None
    orbit_rows: int = 0
    integrand_rows: int = 0

    def addresses(self) -> BatchAddresses:
        """Return the memory cells with their addresses; 0 for missing functions."""
        return BatchAddresses(*_addresses(getattr(self, name) for name in BatchAddresses._fields))


class Dissipation(NamedTuple):
    """The arguments for a dissipative model: the memory cells of two functions, and the kind of its forces.

    Attributes
    ----------
    speed_equation, static_balance : int
        The memory cells with the addresses of these functions.
    friction : bool
        Whether the force depends on the sign of N. A leg then ends where N changes sign.
    kinked : bool
        Whether it has a kink where the curvature changes sign. A leg is then computed in parts.
    linear : bool
        Whether it is linear in V**2.
    has_radius : bool
        Whether the body rolls and has a radius. Where it does not fit into its track, ds/dlam is negative; where it
        only just fits, the contact force varies over shorter distances than ds/dlam and the force along the path.
    squared_contact : int
        The memory cell with the address of this function; 0 if there is none.
    path_in_space : int
        That of this function where the contact force is read by it, as a length in N; 0 elsewhere.
    """

    speed_equation: int
    static_balance: int
    friction: bool
    kinked: bool
    linear: bool
    has_radius: bool
    squared_contact: int
    path_in_space: int


class DissipativeFunctions(NamedTuple):
    """The functions that a dissipative module adds (`emitted.Emitted`), with the flags of `Dissipation`."""

    speed_equation: Any
    static_balance: Any
    friction: bool
    kinked: bool
    linear: bool
    squared_contact: Any = None

    def addresses(self, *, has_radius: bool) -> Dissipation:
        """Return the memory cells with their addresses, and the flags."""
        speed_equation, static_balance = _addresses(self[:2])
        squared_contact = self.squared_contact.address if self.squared_contact else 0
        flags = self.friction, self.kinked, self.linear, has_radius
        return Dissipation(speed_equation, static_balance, *flags, squared_contact, 0)


class SeparatedTerms(NamedTuple):
    """Potential and load along a charted curve as sums of products, so that one table serves all factors.

    Attributes
    ----------
    function : emitted.Emitted
        The function that fills the parts, which depend on the place.
    factors : callable
        ``f(op, p)`` gives the factors, which depend on parameters alone: one for each part of U, then one for each part
        of n0. ``p`` contains the run-time parameters and the numbers that follow them.
    potentials, loads : int
        The numbers of parts of U and n0.
    held : tuple of int
        The indices in ``p`` of the numbers that ``function`` reads.
    parts : callable or None
        ``f(op, x, z, p)`` gives the parts of U; None if they depend on more than coordinates.
    """

    function: Any
    factors: Callable[..., Any]
    potentials: int
    loads: int
    held: tuple[int, ...]
    parts: Callable[..., Any] | None = None


class ExactPotential(NamedTuple):
    """The exact formula of a charted curve: ``f(op, x, z, p)`` gives U and its derivatives with respect to x and z.

    In space it is ``f(op, x, y, z, p)``, with the derivatives with respect to x, y and z. In a rotating frame there,
    ``coriolis`` gives the vector that V = ds/dt adds to t x N/m for each unit of V, along x, y and z, where t is the
    tangent: ``f(op, dxds, dyds, dzds, p)``. ``upright_force`` is that of `ExactChartLaw`.
    """

    effective_potential: Callable[..., Any]
    coriolis: Callable[..., Any] | None = None
    upright_force: Callable[..., Any] | None = None


class ExactChartLaw(NamedTuple):
    """The formulas of a dissipative module along a charted curve, in terms of the chart's values at a point.

    ``static_normal_load`` is n0 [m/s2]: ``f(op, x, z, dxds, dzds, kappa, p)``. ``speed_slope`` is dW/ds [m/s2] with W =
    V**2: ``f(op, x, z, dxds, dzds, kappa, w, v, nu, p)`` with v = sgn(ds/dt), nu = sgn(N). In space x, y and z take the
    place of x and z, so that there are three derivatives too, and their second derivatives that of kappa; n0 then is
    the length |N|/m at rest, and ``load_along_curvature`` and ``coriolis_loads`` are those of `ExactFormulas`. So is
    ``upright_force``, which depends on the roll angle and the arc length as well: ``f(op, x, ..., ddzds2, roll, arc,
    p)``.
    """

    static_normal_load: Callable[..., Any]
    speed_slope: Callable[..., Any]
    load_along_curvature: Callable[..., Any] | None = None
    coriolis_loads: Callable[..., Any] | None = None
    upright_force: Callable[..., Any] | None = None


class ExactFormulas(NamedTuple):
    """The same formulas as plain Python over a namespace of operations: ``f(op, lam, p)``.

    ``static_normal_load`` is n0 [m/s2], the contact force per unit mass of a body at rest. A space curve has ``y``; one
    that lies in no vertical plane also has ``load_along_curvature``, half of the factor [1/s2] of V**2 in (N/m)**2. In
    a rotating frame ``coriolis_loads`` has half of the factors of V = ds/dt [m/s3] and of V**3 [1/(m s)]. On a banked
    track whose riders have an upward direction, ``upright_force`` has n0 and kappa for the component of N along it, in
    a rotating frame also what is added to N/m for each unit of V. Where the time of orbits about an axis of symmetry
    has a closed form, the formulas of ``agm_arguments_batch``, ``f(op, half, p)``, or of ``time_integrand_batch``,
    ``f(op, half, sine2, cosine2, p)``, follow.
    """

    x: Callable[..., Any]
    z: Callable[..., Any]
    ds: Callable[..., Any]
    kappa: Callable[..., Any]
    static_normal_load: Callable[..., Any]
    effective_potential: Callable[..., Any]
    effective_potential_slope: Callable[..., Any]
    y: Callable[..., Any] | None = None
    load_along_curvature: Callable[..., Any] | None = None
    coriolis_loads: Callable[..., Any] | None = None
    agm_arguments: Callable[..., Any] | None = None
    time_integrand: Callable[..., Any] | None = None
    upright_force: Callable[..., Any] | None = None


class ExactLaw(NamedTuple):
    """The formulas of a dissipative module: those of the path, as in `ExactFormulas`, and the law of motion.

    ``speed_slope`` is dW/dlam [m2/s2/[lam]] with W = V**2: ``f(op, lam, w, v, nu, p)`` with v = sgn(ds/dt), nu =
    sgn(N).
    """

    x: Callable[..., Any]
    z: Callable[..., Any]
    ds: Callable[..., Any]
    kappa: Callable[..., Any]
    static_normal_load: Callable[..., Any]
    speed_slope: Callable[..., Any]
    y: Callable[..., Any] | None = None
    load_along_curvature: Callable[..., Any] | None = None
    coriolis_loads: Callable[..., Any] | None = None
    upright_force: Callable[..., Any] | None = None
