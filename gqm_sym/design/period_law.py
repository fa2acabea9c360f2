"""Tracks from their period as a function of height, by Abel's inversion.

With w = sqrt(z), z the height above the bottom, the sum of the arc lengths of both sides is

    S(w) = sqrt(2 g)/pi * w * integral of T(w**2 cos(psi)**2) cos(psi) over psi from 0 to pi/2.

A given share of it lies on the right. Each side exists as far as its arc length grows at least as fast as its height,
ds/dw >= 2 w; there dx/dw = sqrt((ds/dw)**2 - 4 w**2).
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import sympy as sp
from numpy.polynomial.legendre import leggauss

from gqm_sym.arguments import checked, one_line, short
from gqm_sym.budgets import budget
from gqm_sym.declare.curve import Curve
from gqm_sym.design.tracks import (
    MAX_HALVINGS,
    TERMS,
    Piece,
    evaluated,
    extended_precision,
    function_in,
    interpolated,
    polynomial_curve,
    powers,
    read_law,
    read_positive,
    with_unit,
)
from gqm_sym.errors import DeclarationError, SolutionError
from gqm_sym.expressions import Source
from gqm_sym.parameters import Given
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.multiprecision.gauss_legendre import gauss

# The number of decimal digits of the integral.
RULE_DIGITS = 28

# The height at which a track ends if no height is given, as a share of the largest possible one.
SHARE_OF_LIMIT = sp.Rational(999, 1000)

# The limit is searched for up to so many times the height of the track whose period is T(0) everywhere, in steps of
# this ratio.
SEARCHED, STEP = 100.0, 1.0 / 64.0

# If odd derivatives at the bottom are below this share, both sides form one smooth curve.
MAX_ODD_SHARE = 1e-15


class _Law(NamedTuple):
    """A period law: T + 2 h dT/dh as a SymPy expression, gravity, and the smaller and the larger share."""

    form: sp.Expr
    g: sp.Expr
    shares: tuple[sp.Expr, sp.Expr]


@checked("design.from_period")
@budget("design.from_period", 60.0, "give a simpler law, or a smaller height as up_to")
def from_period(
    law: Source,
    share: Source = "1/2",
    *,
    up_to: Source | None = None,
    g: Source = "9.81",
    parameters: Mapping[str, Given] | None = None,
    title: str = "",
) -> Curve:
    """Return the track on which a body without friction swings with a given period.

    Parameters
    ----------
    law : str, number or SymPy expression
        The full period in s as a function of ``h``, the height in m above the bottom at which the body turns. It must
        be positive and smooth.
    share : number
        The share of the arc length between two places of equal height that lies to the right of the bottom, between 0
        and 1. One half gives the symmetric track.
    up_to : number, optional
        The height in m up to which the track is built. Without it, it is 99.9 % of `height_limit`.
    g : number
        Acceleration of gravity in m/s**2.
    parameters : mapping, optional
        Values of the parameters in ``law``.
    title : str
        One line of text for readers.

    Returns
    -------
    Curve
        The curve with the arc length s in m as its parameter, which is 0 at the bottom, where x = z = 0.

    Raises
    ------
    DeclarationError
        If no track has this period, at the bottom or up to the given height.

    Notes
    -----
    The track is known to 22 digits. At its greatest height one of its sides is vertical.

    Examples
    --------
    A period that does not depend on the height gives the cycloid; for 2 s its height is g*T**2/(8*pi**2):

    >>> round(height_limit("2"), 5), round(9.81 / 3.141592653589793**2 / 2, 5)
    (0.49698, 0.49698)
    """
    where = "design.from_period"
    mp = extended_precision()
    found, right = _read(law, share, g, parameters, where)
    height = _limit(found, where)
    note = "" if height is None else f" (such a track reaches up to {float(height):.9g} m)"
    if up_to is None:
        if height is None:
            raise DeclarationError(f"{where}: up_to: such a track has no greatest height; give the height in m")
        end = SHARE_OF_LIMIT * sp.Rational(height)
    else:
        end = read_positive(up_to, "up_to", where=where, unit="m")
        if height is not None and end >= height:
            raise DeclarationError(
                f"{where}: up_to: a track of period {short(str(law))} exists up to a height of {height!r} m only, "
                f"got {float(end):.9g}; there one side is vertical. Give a smaller height"
            )
    top = mp.sqrt(evaluated(mp, end))
    rate = _rate(mp, found, where)
    alike = right.equals(sp.Rational(1, 2))
    ahead = _side(mp, rate, evaluated(mp, right), top, height, right == found.shares[0])
    behind = ahead if alike else _side(mp, rate, evaluated(mp, 1 - right), top, height, right != found.shares[0])
    smooth = alike and _is_odd(ahead[0])
    pieces = [piece.mirrored() for piece in reversed(behind)] + ahead
    count = len(behind)
    return polynomial_curve(
        mp,
        pieces,
        origin=count,
        breaks=() if smooth else (count,),
        title=one_line(title, where=f"{where}: title")
        or f"Track of period {with_unit(law, 's')}, up to h = {float(end):.9g} m{note}",
    )


@checked("design.height_limit")
def height_limit(
    law: Source,
    share: Source = "1/2",
    *,
    g: Source = "9.81",
    parameters: Mapping[str, Given] | None = None,
) -> float:
    """Return the height in m up to which a track of a given period exists.

    Parameters
    ----------
    law, share, g, parameters
        As in `from_period`.

    Returns
    -------
    float
        The height at which one side of the track becomes vertical; infinite if neither side does within a hundred times
        the height of the cycloid with the period at the bottom.

    Raises
    ------
    DeclarationError
        If no track has this period.
    """
    found, _ = _read(law, share, g, parameters, "design.height_limit")
    height = _limit(found, "design.height_limit")
    return float("inf") if height is None else height


def _read(
    law: Source, share: Source, g: Source, parameters: Mapping[str, Given] | None, where: str
) -> tuple[_Law, sp.Expr]:
    """Return the law, and the share of the right side."""
    form = read_law(law, ("h",), parameters, where=where, unit="s")
    right = read_positive(share, "share", where=where, unit="1")
    if not right < 1:
        raise DeclarationError(f"{where}: share: must be between 0 and 1, got {short(share)}")
    h = sp.Symbol("h", real=True)
    at_bottom = form.xreplace({h: sp.Integer(0)})
    if not (at_bottom.is_finite and at_bottom.is_real):
        raise DeclarationError(
            f"{where}: law: the period at the bottom, h = 0, must be positive and finite, but {short(str(law))} has no "
            "finite real value there; give a law that has one, as 2 + log(1 + h) has and 2 + log(h) has not"
        )
    if not at_bottom > 0:
        raise DeclarationError(
            f"{where}: law: the period at the bottom must be positive, got {short(str(at_bottom))} at h = 0 "
            "(a track of period 0 there has a corner)"
        )
    gravity = read_positive(g, "g", where=where, unit="m/s**2")
    return _Law(form + 2 * h * sp.diff(form, h), gravity, tuple(sorted((right, 1 - right)))), right


def _limit(law: _Law, where: str) -> float | None:
    """Return the height at which the side of the smaller share becomes vertical; None if none was found."""
    h = sp.Symbol("h", real=True)
    function = sp.lambdify(h, law.form, "numpy")
    nodes, weights = leggauss(64)
    angles = 0.25 * np.pi * (1.0 + nodes)
    squares, weights = np.cos(angles) ** 2, 0.25 * np.pi * weights * np.cos(angles)
    scale = float(law.shares[0]) * np.sqrt(2.0 * float(law.g)) / np.pi

    def ds_excess(w: Array) -> Array:
        """Return ds/dw - 2 w."""
        with np.errstate(all="ignore"):
            values = np.broadcast_to(function(np.square(w)[:, None] * squares), (w.size, squares.size))
        out: Array = scale * (values @ weights) - 2.0 * w
        return out

    unit = 0.5 * float(ds_excess(np.zeros(1))[0])
    w = unit * np.arange(0.0, np.sqrt(SEARCHED), STEP)
    values = ds_excess(w)
    bad = np.flatnonzero(~(values > 0.0))
    if not bad.size:
        return None
    k = int(bad[0])
    if not np.isfinite(values[k]):
        raise DeclarationError(
            f"{where}: law: has no finite value at or below h = {w[k] ** 2:.6g}, and no greatest height is reached "
            "before; give a law that is smooth there"
        )
    from scipy.optimize import brentq

    root = brentq(lambda u: float(ds_excess(np.array([u]))[0]), w[k - 1], w[k], xtol=1e-300, rtol=1e-15)
    return float(root) ** 2


def _rate(mp: Any, law: _Law, where: str) -> Callable[[Any], Any]:
    """Return dS/dw as a function of w."""
    function, scale = function_in(mp, "h", law.form), mp.sqrt(2 * evaluated(mp, law.g)) / mp.pi

    def rate(w: Any) -> Any:
        def integrand(psi: Any) -> Any:
            c = mp.cos(psi)
            return mp.mpf(function((w * c) ** 2)) * c

        try:
            return scale * gauss(mp, integrand, (mp.mpf(0), mp.pi / 2), RULE_DIGITS)[0]
        except (ArithmeticError, ValueError, TypeError, SolutionError):
            raise DeclarationError(
                f"{where}: law: is not smooth, or has no finite value, up to h = {float(w * w):.6g}"
            ) from None

    return rate


def _side(
    mp: Any, rate: Callable[[Any], Any], share: Any, top: Any, height: float | None, limited: bool
) -> list[Piece]:
    """Return the pieces of one side from the bottom to the top, to the right.

    If the side ends shortly before it becomes vertical, at w = w1, everything is smooth in the angle v with w = w1
    sin(v).
    """
    near = limited and height is not None and top * top > 0.25 * height
    most = mp.sqrt(height) if near else None

    def place(v: Any) -> tuple[Any, Any]:
        """Return w and dw/dv."""
        return (v, mp.mpf(1)) if most is None else (most * mp.sin(v), most * mp.cos(v))

    def rows(v: Any) -> tuple[Any, Any]:
        """Return dx/dv and z."""
        w, speed = place(v)
        arc = share * rate(w)
        return speed * mp.sqrt(arc * arc - 4 * w * w), w * w

    end = top if most is None else mp.asin(top / most)
    pieces: list[Piece] = []
    u, width = mp.mpf(0), end
    for _ in range(MAX_HALVINGS * TERMS):
        if u >= end:
            return pieces
        width = min(width, end - u)
        terms, resolved = interpolated(mp, rows, u, u + width)
        if not resolved:
            width /= 2
            continue
        begin = -1 if pieces else 0
        slope, z = (powers(mp, row, begin) for row in terms)
        x = [mp.mpf(0), *(width / (1 - begin) * term / (j + 1) for j, term in enumerate(slope))]
        if not pieces:  # the track is horizontal at the bottom
            z[0] = z[1] = mp.mpf(0)
        pieces.append(Piece(begin, 1, x, [*z, mp.mpf(0)]))
        u += width
        width *= 2
    raise DeclarationError("design.from_period: law: the track is not smooth; give a smooth law, or a smaller height")


def _is_odd(piece: Piece) -> bool:
    """Return whether x is an odd function of the parameter at the bottom, so that the mirror image continues it
    smoothly.
    """
    largest = max(map(abs, piece.x))
    return bool(max(map(abs, piece.x[2::2])) <= MAX_ODD_SHARE * largest)
