"""Tracks from the contact force that a body without friction feels on them."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import sympy as sp

from gqm_sym.arguments import checked, one_line, short
from gqm_sym.budgets import budget, check_budget
from gqm_sym.declare.curve import Curve
from gqm_sym.design.tracks import (
    TERMS,
    Piece,
    evaluated,
    extended_precision,
    function_in,
    interpolated,
    polynomial_curve,
    powers,
    read_constant,
    read_law,
    read_positive,
    with_unit,
)
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import Source, read_expression
from gqm_sym.parameters import Given, Parameters

# The last two coefficients of a piece of a track are below this share of its length.
MAX_LAST_TERM = 1e-22

# A piece that is shorter than this share of the track shows that the track ends there.
MIN_SHARE = 1e-4

# Under a larger load, in multiples of the weight, a loop would be a rounding of its height.
MAX_LOAD = 1e15


@checked("design.constant_load")
def constant_load(
    n: Source,
    v0: Source,
    *,
    g: Source = "9.81",
    domain: Any = None,
    parameters: Parameters | None = None,
    title: str = "",
) -> Curve:
    """Return the loop on which a body without friction presses on the track with the same force everywhere.

    Parameters
    ----------
    n : number or expression
        The contact force in units of the weight, N/(m*g), greater than 1.
    v0 : number or expression
        The speed in m/s at the lowest places, where the tangent is horizontal; launch with this speed at ``psi = 0``.
    g : number or expression
        Acceleration of gravity in m/s**2. ``"g"`` makes the track follow the model's own.
    domain : pair, optional
        Ends of the range of ``psi``; without them, loops follow one another without end.
    parameters : mapping, optional
        Defaults of names in ``n`` and ``v0``.
    title : str
        One line of text for readers.

    Returns
    -------
    Curve
        The curve with an angle ``psi`` in rad as its parameter. The tangent's angle alpha equals psi at the lowest and
        the highest places, 0 and pi, and between them tan(alpha/2) = sqrt((n - 1)/(n + 1))*tan(psi/2). At psi = 0, x =
        z = 0.

    Raises
    ------
    DeclarationError
        If the load is not greater than the weight: such a track does not close a loop, see `from_load`.

    Notes
    -----
    From N = m*(kappa*V**2 + g*cos(alpha)) and energy follows V*(n - cos(alpha)) = const: the hodograph is a conic of
    eccentricity 1/n, and psi is its eccentric anomaly. V = v0*(n + cos(psi))/(n + 1), and the time is
    v0*(n*psi + sin(psi))/(g*(n + 1)*sqrt(n**2 - 1)), as in Kepler's equation.

    Examples
    --------
    A load of 3 g from 12 m/s: the loop is 600/109 m = 5.5 m high.

    >>> import sympy
    >>> track = constant_load(3, 12)
    >>> track.z.subs(track.parameter, sympy.pi)
    600/109
    """
    where = "design.constant_load"
    load, speed = (
        read_expression(value, where=f"{where}: {name}", unit=unit)
        for value, name, unit in ((n, "n", "1"), (v0, "v0", "m/s"))
    )
    gravity = read_expression(g, where=f"{where}: g", unit="m/s**2")
    if load.is_number and not load > 1:
        raise DeclarationError(
            f"{where}: n: must be greater than 1, got {short(n)}: under a smaller load no track closes a loop; "
            "design.from_load takes any load"
        )
    if load.is_number and not load < MAX_LOAD:
        raise DeclarationError(f"{where}: n: must be less than {MAX_LOAD:g}, got {short(n)}")
    for value, name in ((speed, "v0"), (gravity, "g")):
        if value.is_number and not value > 0:
            raise DeclarationError(f"{where}: {name}: must be positive, got {value}")
    psi = sp.Symbol("psi", real=True)
    scale = speed**2 / (gravity * (load + 1) ** 2 * sp.sqrt(load**2 - 1))
    return Curve.parametric(
        x=scale * (3 * load * psi / 2 + (load**2 + 1) * sp.sin(psi) + load * sp.sin(2 * psi) / 4),
        z=speed**2 / (2 * gravity) * (1 - ((load + sp.cos(psi)) / (load + 1)) ** 2),
        parameter="psi",
        domain=domain,
        parameters=parameters,
        title=one_line(title, where=f"{where}: title")
        or f"Loop of constant contact force, N/(m*g) = {n}, from v0 = {with_unit(v0, 'm/s')}",
    )


class _Motion(NamedTuple):
    """The prescribed motion: the load as a function of s or t, the launch speed, gravity, and the variable."""

    mp: Any
    load: Callable[[Any], Any]
    v0: Any
    g: Any
    by_time: bool


class _State(NamedTuple):
    """The end of a track so far: the tangent's angle, and coordinates."""

    alpha: Any
    x: Any
    z: Any


@checked("design.from_load")
@budget("design.from_load", 60.0, "give a simpler law, or a shorter track")
def from_load(
    law: Source,
    v0: Source,
    *,
    until: Source,
    heading: Source = 0,
    g: Source = "9.81",
    parameters: Mapping[str, Given] | None = None,
    title: str = "",
) -> Curve:
    """Return the track on which a body without friction feels a prescribed contact force.

    Parameters
    ----------
    law : str, number or SymPy expression
        The contact force in units of the weight, N/(m*g), as a function of ``s``, the arc length in m, or ``t``, the
        time in s, both since launch. It is positive where the track pushes to its left. It must be smooth.
    v0 : number
        Launch speed in m/s, at s = 0.
    until : number
        The arc length, or the time, at which the track ends.
    heading : number
        The angle of the tangent at the beginning in rad.
    g : number
        Acceleration of gravity in m/s**2.
    parameters : mapping, optional
        Values of the parameters in ``law``.
    title : str
        One line of text for readers.

    Returns
    -------
    Curve
        The curve with the arc length s in m from x = z = 0 as its parameter.

    Raises
    ------
    DeclarationError
        If the body comes to rest before the end of the track.

    Notes
    -----
    dalpha/ds = g*(law - cos(alpha))/V**2 is integrated by Taylor series to 22 digits.

    Examples
    --------
    A load that grows from the weight to three times it:

    >>> print(from_load("2 - cos(s)", 12, until="pi", title="Entry"))
    Entry: 8 polynomials joined, in arc length s [m]
      parameters: none
    """
    where = "design.from_load"
    mp = extended_precision()
    form = read_law(law, ("s", "t"), parameters, where=where, unit="1")
    by_time = "t" in {symbol.name for symbol in form.free_symbols}
    place = "t" if by_time else "s"
    speed, gravity, length = (
        evaluated(mp, read_positive(value, name, where=where, unit=unit))
        for value, name, unit in ((v0, "v0", "m/s"), (g, "g", "m/s**2"), (until, "until", "s" if by_time else "m"))
    )
    state = _State(evaluated(mp, read_constant(heading, "heading", where=where, unit="1")), mp.mpf(0), mp.mpf(0))
    motion = _Motion(mp, function_in(mp, place, form), speed, gravity, by_time)
    pieces: list[Piece] = []
    u, width = mp.mpf(0), length / 4
    while u < length:
        check_budget()
        width = min(width, length - u)
        try:
            piece, ahead = _piece(motion, state, u, width)
        except (ArithmeticError, ValueError, TypeError):
            what = f"between {place} = {float(u):.6g} and {float(u + width):.6g}"
            raise DeclarationError(
                f"{where}: law: has no finite value everywhere {what}; end the track before"
            ) from None
        if piece is None:
            if width < MIN_SHARE * length:
                raise DeclarationError(
                    f"{where}: the track ends near {place} = {float(u):.6g}, at a height of "
                    f"{float(state.z):.6g} m, where the law is not smooth or the body comes to rest; "
                    "end it before by until, or launch faster"
                )
            width /= 2
            continue
        pieces.append(piece)
        u, state, width = u + width, ahead, 2 * width
    title = (
        one_line(title, where=f"{where}: title")
        or f"Track of contact force N/(m*g) = {law}, from v0 = {with_unit(v0, 'm/s')}"
    )
    return polynomial_curve(mp, pieces, origin=0, breaks=(), title=title)


def _piece(motion: _Motion, state: _State, at: Any, width: Any) -> tuple[Piece | None, _State]:
    """Return a piece of a track by its Taylor series in u, its parameter as a share of ``width``, and its end.

    The piece is None if the series is not resolved.
    """
    mp, function, v0, g, by_time = motion
    energy = v0 * v0 - 2 * g * state.z
    (terms,), resolved = interpolated(mp, lambda place: (mp.mpf(function(place)),), at, at + width)
    if not resolved:
        return None, state
    load = powers(mp, terms, 0)
    alpha, x, z = ([number] for number in state)
    cosines, sines = [mp.cos(state.alpha)], [mp.sin(state.alpha)]
    # V, and the factor of dalpha/du: V**2 for a law in s, V for one in t.
    speeds = [mp.sqrt(energy)]
    turned: list[Any] = []
    for k in range(TERMS - 1):
        factors = speeds if by_time else [energy, *(-2 * g * term for term in z[1:])]
        known = mp.fdot((factors[i], turned[k - i]) for i in range(1, k + 1))
        turned.append((width * g * (load[k] - cosines[k]) - known) / factors[0])
        alpha.append(turned[k] / (k + 1))
        if by_time:
            x.append(width * mp.fdot((speeds[i], cosines[k - i]) for i in range(k + 1)) / (k + 1))
            z.append(width * mp.fdot((speeds[i], sines[k - i]) for i in range(k + 1)) / (k + 1))
            speeds.append(-width * g * sines[k] / (k + 1))
        else:
            x.append(width * cosines[k] / (k + 1))
            z.append(width * sines[k] / (k + 1))
        cosines.append(-mp.fdot((turned[i], sines[k - i]) for i in range(k + 1)) / (k + 1))
        sines.append(mp.fdot((turned[i], cosines[k - i]) for i in range(k + 1)) / (k + 1))
    length = width * speeds[0] if by_time else width
    last_terms = max(abs(term) for row in (x, z) for term in row[-2:]) / length
    if max(last_terms, *map(abs, alpha[-2:])) > MAX_LAST_TERM or sum(z) * 2 * g >= v0 * v0:
        return None, state
    return Piece(0, 1, x, z), _State(sum(alpha), sum(x), sum(z))
