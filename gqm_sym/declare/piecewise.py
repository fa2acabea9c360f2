"""Rails that consist of pieces: lines, arcs, clothoids, transitions in space and curves with formulas."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import pi, tau
from typing import Any, Protocol, runtime_checkable

import sympy as sp

from gqm_sym.arguments import checked, flag, several, short
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import Source, read_expression
from gqm_sym.parameters import Parameters, Value, names_in_order, read_parameters

# The arguments of each standard piece; the first of them must be positive.
STANDARD = {"line": ("length",), "arc": ("radius", "angle"), "clothoid": ("length", "kappa_start", "kappa_end")}
# The highest power of s in the rates of a transition.
MAX_POWER = 5
# A larger angle of an arc was probably meant in degrees.
MAX_ARC = 4.0 * pi
# The SI units of these arguments.
DISTANCE = sp.Symbol("s", real=True)
_UNITS = {"length": "m", "radius": "m", "angle": "1", "kappa_start": "1/m", "kappa_end": "1/m"}


@runtime_checkable
class FormulaCurve(Protocol):
    """The attributes of a piece with formulas that a rail uses; `curve.Curve` has them."""

    @property
    def kind(self) -> str:
        """The form in which it was declared."""

    @property
    def charted(self) -> bool:
        """Whether it has no formulas."""

    @property
    def domain(self) -> tuple[sp.Expr | None, sp.Expr | None]:
        """The ends of its parameter."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of its run-time parameters."""

    @property
    def positive(self) -> tuple[str, ...]:
        """The run-time parameters that must be positive."""

    @property
    def defaults(self) -> tuple[tuple[str, Value | None], ...]:
        """The run-time parameters with their defaults."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A piece of a rail.

    Attributes
    ----------
    kind
        "line", "arc", "clothoid", "transition" or "curve".
    numbers
        The arguments listed in `STANDARD`, or the ends of the curve's parameter; for a transition its length, then the
        coefficients of yaw, of pitch and of roll, lowest power first.
    curve
        The curve, if the piece is one with formulas.
    """

    kind: str
    numbers: tuple[sp.Expr, ...]
    curve: FormulaCurve | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Rail:
    """Pieces joined end to start.

    Attributes
    ----------
    start
        x, z and heading, or x, y and z, heading, climb and roll; None if the first piece has a place of its own.
    pieces
        The pieces, in order.
    closed
        Whether the last piece is joined to the first.
    in_space
        Whether the rail has three coordinates.
    banked
        Whether the roll of the pieces is that of the track.
    """

    start: tuple[sp.Expr, ...] | None
    pieces: tuple[Piece, ...]
    closed: bool
    in_space: bool = False
    banked: bool = False


@checked("line")
def line(*, length: Source) -> Piece:
    """Return a straight piece of a rail.

    Parameters
    ----------
    length
        The length in m: a number, or an expression in run-time parameters.

    Returns
    -------
    Piece

    Raises
    ------
    DeclarationError
        If a number is not allowed, such as a length that is not positive.
    """
    return _standard("line", length)


@checked("arc")
def arc(*, radius: Source, angle: Source) -> Piece:
    """Return a piece of a rail that is an arc of a circle.

    Parameters
    ----------
    radius
        The radius in m: a number, or an expression in run-time parameters.
    angle
        The angle of the turn in radians, positive to the left.

    Returns
    -------
    Piece

    Raises
    ------
    DeclarationError
        If a number is not allowed, such as a length that is not positive.
    """
    return _standard("arc", radius, angle)


@checked("clothoid")
def clothoid(*, length: Source, kappa_start: Source, kappa_end: Source) -> Piece:
    """Return a piece of a rail whose signed curvature is linear in arc length.

    Parameters
    ----------
    length
        The length in m: a number, or an expression in run-time parameters.
    kappa_start, kappa_end
        The signed curvature at both ends in 1/m, positive to the left.

    Returns
    -------
    Piece

    Raises
    ------
    DeclarationError
        If a number is not allowed, such as a length that is not positive.
    """
    return _standard("clothoid", length, kappa_start, kappa_end)


@checked("transition")
def transition(*, length: Source, yaw: Source = 0, pitch: Source = 0, roll: Source = 0) -> Piece:
    """Return a piece in space along which the rail turns and rolls at given rates.

    The rates are those of a rider's frame: tangent, left and up. In the terms of Frenet's formulas, with the normal to
    the left at the start, the curvature is the yaw rate, and the torsion is minus the roll rate.

    Parameters
    ----------
    length
        The length in m: a number, or an expression in run-time parameters.
    yaw, pitch, roll
        The rates in rad/m at which the rail turns to the left, turns upwards and rolls to the left. Each is a number,
        or a polynomial of degree 5 at most in ``s``, the distance from the start of the piece.

    Returns
    -------
    Piece

    Raises
    ------
    DeclarationError
        If a number is not allowed, such as a length that is not positive.
    """
    size = read_expression(length, where="transition: length", unit="m")
    if size.is_number and not size > 0:
        raise DeclarationError(f"transition: length: must be positive, got {size}")
    rates = {"yaw": yaw, "pitch": pitch, "roll": roll}
    return Piece(kind="transition", numbers=(size, *(c for name in rates for c in _polynomial(rates[name], name))))


def _polynomial(given: Source, name: str) -> tuple[sp.Expr, ...]:
    """Return the coefficients of a rate in powers of s, lowest first."""
    rate = sp.expand(read_expression(given, where=f"transition: {name}", unit="1/m"))
    found = tuple(rate.coeff(DISTANCE, power) for power in range(MAX_POWER + 1))
    remainder = sp.expand(rate - sp.Add(*(c * DISTANCE**power for power, c in enumerate(found))))
    if remainder != 0 or any(DISTANCE in c.free_symbols for c in found):
        raise DeclarationError(
            f"transition: {name}: must be a polynomial in s of degree {MAX_POWER} at most, got {short(str(rate))}"
        )
    return found


def _standard(kind: str, *given: Source) -> Piece:
    names = STANDARD[kind]
    numbers = tuple(
        read_expression(value, where=f"{kind}: {name}", unit=_UNITS[name])
        for name, value in zip(names, given, strict=True)
    )
    if numbers[0].is_number and not numbers[0] > 0:
        raise DeclarationError(f"{kind}: {names[0]}: must be positive, got {numbers[0]}")
    if kind == "arc" and numbers[1].is_zero:
        raise DeclarationError("arc: angle: must not be zero; positive turns left, negative right")
    if kind == "arc" and numbers[1].is_number and abs(numbers[1]) > MAX_ARC:
        turns = f"{float(abs(numbers[1])) / tau:.1f} turns"
        raise DeclarationError(f"arc: angle: {numbers[1]} rad are {turns}; for degrees write '{numbers[1]} deg'")
    return Piece(kind=kind, numbers=numbers)


def declare_rail(
    pieces: Iterable[Piece | FormulaCurve],
    *,
    start: Sequence[Source] | None,
    heading: Source | Sequence[Source] | None,
    closed: bool,
    parameters: Parameters | None,
    forms: tuple[sp.Expr, ...] = (),
) -> tuple[Rail, tuple[tuple[str, Value | None], ...], tuple[str, ...]]:
    """Read and check the pieces of a rail; ``forms`` are further expressions in its run-time parameters.

    Returns
    -------
    rail, defaults, positive
        The definition, the run-time parameters with their defaults, and those that must be positive.
    """
    flag(closed, where="piecewise: closed")
    what = "pieces in a list, as in [line(length=2), arc(radius=1, angle=pi)]"
    given = several(pieces, where="piecewise: pieces", what=what)
    if not given:
        raise DeclarationError(
            "piecewise: no pieces; give one or more, as in [line(length=2), arc(radius=1, angle=pi)]"
        )
    joined = tuple(_piece(piece, f"piecewise: piece {count}") for count, piece in enumerate(given, start=1))
    place = (
        None
        if start is None
        else several(start, where="piecewise: start", what="a pair (x, z), or three numbers in space")
    )
    in_space = (place is not None and len(place) == 3) or any(_is_spatial(piece) for piece in joined)
    first = _start(place, heading, joined[0], in_space)
    rail = Rail(start=first, pieces=joined, closed=closed, in_space=in_space)
    defaults, positive = _parameters(rail, parameters, forms)
    return rail, defaults, positive


def _piece(given: Piece | FormulaCurve, where: str) -> Piece:
    if isinstance(given, Piece):
        return given
    if not isinstance(given, FormulaCurve):
        raise DeclarationError(
            f"{where}: must be a line, an arc, a clothoid, a transition or a curve with formulas, got {short(given)}"
        )
    if given.charted:
        raise DeclarationError(f"{where}: a curve of kind {given.kind!r} cannot be a piece; give one with formulas")
    low, high = given.domain
    if low is None or high is None:
        raise DeclarationError(f"{where} ({given.kind}): domain: must have two ends, between which the piece lies")
    return Piece(kind="curve", numbers=(low, high), curve=given)


def _is_spatial(piece: Piece) -> bool:
    return piece.kind == "transition" or (piece.curve is not None and piece.curve.kind == "space")


def _start(place: tuple[Source, ...] | None, heading: Any, first: Piece, in_space: bool) -> tuple[sp.Expr, ...] | None:
    """Return the start of a rail in the form that `Rail` stores."""
    if first.curve is not None:
        if place is not None or heading is not None:
            raise DeclarationError(
                "piecewise: start: the first piece is a curve with a place of its own; leave start and heading out"
            )
        return None
    what, size = ("three numbers (x, y, z)", 3) if in_space else ("a pair (x, z)", 2)
    place = (0,) * size if place is None else place
    if len(place) != size:
        raise DeclarationError(f"piecewise: start: must be {what}, got {short(place)}")
    angles: tuple[Source, ...] = (0,) if heading is None else (heading,)
    if in_space:
        angles = tuple(heading) if isinstance(heading, tuple | list) else angles
        if len(angles) > 3:
            raise DeclarationError(
                f"piecewise: heading: must be an angle, or up to three: heading, climb and roll; got {short(heading)}"
            )
        angles += (0,) * (3 - len(angles))
    return tuple(
        read_expression(number, where=f"piecewise: {name}", unit="1" if name == "heading" else "m")
        for number, name in zip((*place, *angles), (*size * ("start",), *len(angles) * ("heading",)), strict=True)
    )


def _parameters(
    rail: Rail, parameters: Parameters | None, forms: tuple[sp.Expr, ...]
) -> tuple[tuple[tuple[str, Value | None], ...], tuple[str, ...]]:
    """Join the parameters of all pieces; a name has the same meaning in each."""
    found = dict.fromkeys(names_in_order(*(rail.start or ())))
    own: dict[str, Value | None] = {}
    positive: dict[str, None] = {}
    for count, piece in enumerate(rail.pieces, start=1):
        curve = piece.curve
        if curve is None:
            found |= dict.fromkeys(names_in_order(*piece.numbers))
            continue
        found |= dict.fromkeys(curve.parameters)
        positive |= dict.fromkeys(curve.positive)
        for name, value in curve.defaults:
            if own.get(name) not in (None, value) and value is not None:
                raise DeclarationError(
                    f"piecewise: piece {count} ({curve.kind}): {name!r} is {value} there and {own[name]} before; "
                    "give one of them another name"
                )
            own[name] = own.get(name) if value is None else value
    found |= dict.fromkeys(name for name in names_in_order(*forms) if name != DISTANCE.name)
    if "s" in found:
        raise DeclarationError("piecewise: 's' is the arc length of the rail; give the parameter another name")
    defaults = read_parameters(parameters, found=found, where="piecewise")
    return tuple((name, own.get(name) if value is None else value) for name, value in defaults), tuple(positive)
