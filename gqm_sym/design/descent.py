"""The curve of quickest descent from rest, with dry friction by the whole contact force of the track.

With the tangent's angle alpha, Y = V**2 exp(2 mu alpha) obeys dY/ds = -2 g exp(2 mu alpha) (sin(alpha) + mu cos(alpha))
where N > 0. The curvature has dropped out, and alpha is the control of a problem with the states x, z and Y.
Pontryagin's conditions give V as a function of alpha; with tau = tan(alpha), of which tau1 is the value at the end,

    dx = C (tau**2 - 2 mu tau + 1 + 2 mu tau1)/(tau**2 + 2 mu tau + 1 - 2 mu tau1)**3 dtau,   dz = tau dx,

beginning with tau = -oo. N is positive on the whole curve. In terms of the angle psi >= 0 with tau + mu = -k cot(psi),
k**2 = 1 - mu**2 - 2 mu tau1, both coordinates are sums of sines and cosines. Without friction the curve is the cycloid.
"""

from collections.abc import Sequence
from typing import Any

import sympy as sp

from gqm_sym.arguments import checked, one_line, several
from gqm_sym.declare.curve import Curve
from gqm_sym.design.tracks import evaluated, extended_precision, read_constant
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import Source

# The tangent at the end is steeper than -pi/2 and flatter than pi/2 - 2 atan(mu) by this at least, in radians.
EDGE = 1e-6


@checked("design.brachistochrone")
def brachistochrone(to: Sequence[Source], *, mu: Source = 0, title: str = "") -> Curve:
    """Return the curve on which a body slides from rest at (0, 0) to another place in the least time.

    Parameters
    ----------
    to : pair of numbers
        x and z of the place in m; z is negative.
    mu : number
        Coefficient of dry friction between body and track (`CoulombFriction`). The friction is that of the whole
        contact force, including the part due to the track's curvature.
    title : str
        One line of text for readers.

    Returns
    -------
    Curve
        The curve with an angle ``psi`` in rad as its parameter, from 0 at the start to the end of its domain at the
        place. It does not depend on gravity. Without friction it is a cycloid whose wheel has turned by 2*psi.

    Raises
    ------
    DeclarationError
        If the place is so high that a body with this friction does not reach it from rest.

    Notes
    -----
    The closed form in textbooks omits the force due to the curvature, so that its curve is slower: with mu = 0.3 the
    body does not even reach (1, -0.45).

    Examples
    --------
    >>> import gqm_sym as gqm
    >>> track = brachistochrone((2, "-4/pi"))  # half an arch of a cycloid
    >>> round(float(track.domain[1]), 9)
    1.570796327
    """
    where = "design.brachistochrone"
    place = several(to, where=f"{where}: to", what="a pair (x, z)")
    if len(place) != 2:
        raise DeclarationError(f"{where}: to: must be a pair (x, z), got {len(place)} numbers")
    across, up = (read_constant(end, "to", where=where, unit="m") for end in place)
    friction = read_constant(mu, "mu", where=where, unit="1")
    if friction < 0:
        raise DeclarationError(f"{where}: mu: must not be negative, got {mu}")
    if across == 0 or not -up > friction * abs(across):
        reach = float(friction * abs(across))
        raise DeclarationError(
            f"{where}: to: must be beside the start and more than mu*|x| = {reach:.6g} m below it, as far as a body "
            f"gets from rest; got ({float(across):.6g}, {float(up):.6g})"
        )
    mp = extended_precision()
    rough, slope = evaluated(mp, friction), evaluated(mp, -up / abs(across))
    angle = _end_angle(mp, rough, float(slope), where)
    tau, k, end = _shape(mp, angle, rough)
    size = evaluated(mp, across) / _along(_waves(k, tau, rough)[0], end, mp)
    given = [sp.Rational(mp.nstr(number, 20)) for number in (k, tau, rough, size, end)]
    psi = sp.Symbol("psi", real=True)
    x, z = (given[3] * _along(row, psi, sp) for row in _waves(*given[:3]))
    return Curve.parametric(
        x=x,
        z=z if across > 0 else -z,
        parameter="psi",
        domain=(0, given[4]),
        title=one_line(title, where=f"{where}: title") or f"Brachistochrone to ({place[0]}, {place[1]}), mu = {mu}",
    )


def _shape(mp: Any, angle: Any, mu: Any) -> tuple[Any, Any, Any]:
    """Return tau1, k and the last psi of the curve that ends with a tangent of this angle."""
    tau = mp.tan(angle)
    k = mp.sqrt(1 - mu * mu - 2 * mu * tau)
    return tau, k, mp.atan2(k, -(tau + mu))


def _waves(k: Any, tau: Any, mu: Any) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Return the coefficients of 1, cos(2 psi), sin(2 psi), cos(4 psi) and sin(4 psi) in dx/dpsi and dz/dpsi."""
    regular_part = 1 + 3 * mu * mu + 2 * mu * tau
    both, gap = regular_part + k * k, regular_part - k * k
    x = (both + gap / 2, -both - gap, 4 * mu * k, gap / 2, -2 * mu * k)
    z = (
        -2 * mu * k * k - mu * both - mu * gap / 2,
        mu * (both + gap),
        -k * both - 4 * mu * mu * k,
        2 * mu * k * k - mu * gap / 2,
        k * gap / 2 + 2 * mu * mu * k,
    )
    return x, z


def _along(row: tuple[Any, ...], psi: Any, op: Any) -> Any:
    """Return the integral from 0 to psi of a sum of sines and cosines."""
    mean, cosine, sine, cosine_2, sine_2 = row
    return (
        mean * psi
        + cosine * op.sin(2 * psi) / 2
        + sine * (1 - op.cos(2 * psi)) / 2
        + cosine_2 * op.sin(4 * psi) / 4
        + sine_2 * (1 - op.cos(4 * psi)) / 4
    )


def _end_angle(mp: Any, mu: Any, slope: float, where: str) -> Any:
    """Return the angle of the tangent at the end of the curve whose chord falls by ``slope``."""
    from scipy.optimize import brentq

    def root_function(angle: float) -> float:
        tau, k, end = _shape(mp, mp.mpf(angle), mu)
        x, z = (_along(row, end, mp) for row in _waves(k, tau, mu))
        return float(-z / x) / slope - 1.0

    low, high = -0.5 * float(mp.pi) + EDGE, float(mp.pi / 2 - 2 * mp.atan(mu)) - EDGE
    if not root_function(low) > 0.0 > root_function(high):
        raise DeclarationError(f"{where}: to: a chord of slope {-slope:.9g} is too steep or too flat to be computed")
    return mp.mpf(brentq(root_function, low, high, xtol=1e-300, rtol=1e-15))
