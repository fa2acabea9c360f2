"""Rails put together from pieces: lines, arcs, clothoids and curves with formulas."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import pi, tau
from typing import Protocol, runtime_checkable

import sympy as sp

from gqm_sym.arguments import checked, flag, several, short
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import Source, read_expression
from gqm_sym.parameters import Parameters, Value, names_in_order, read_parameters

# What each standard piece is given by; the first of them must be positive.
STANDARD = {"line": ("length",), "arc": ("radius", "angle"), "clothoid": ("length", "kappa_start", "kappa_end")}
# An arc by a larger angle is meant in degrees.
MAX_ARC = 4.0 * pi
# The SI units of these.
_UNITS = {"length": "m", "radius": "m", "angle": "1", "kappa_start": "1/m", "kappa_end": "1/m"}


@runtime_checkable
class FormulaCurve(Protocol):
    """What a rail needs of a curve with formulas that is one of its pieces (`curve.Curve` is one)."""

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
        """Those promised to be positive."""

    @property
    def defaults(self) -> tuple[tuple[str, Value | None], ...]:
        """The run-time parameters with their defaults."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A piece of a rail.

    Attributes
    ----------
    kind
        "line", "arc", "clothoid" or "curve".
    numbers
        What `STANDARD` says, or the ends of the curve's parameter.
    curve
        Where the piece is a curve with formulas.
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
        x, z and heading; None where the first piece has a place of its own.
    pieces
        In order.
    closed
        Whether the last is joined to the first.
    """

    start: tuple[sp.Expr, ...] | None
    pieces: tuple[Piece, ...]
    closed: bool


@checked("line")
def line(*, length: Source) -> Piece:
    """A straight piece of a rail."""
    return _standard("line", length)


@checked("arc")
def arc(*, radius: Source, angle: Source) -> Piece:
    """A piece of a circle; a positive angle turns left, a negative one right."""
    return _standard("arc", radius, angle)


@checked("clothoid")
def clothoid(*, length: Source, kappa_start: Source, kappa_end: Source) -> Piece:
    """A piece whose signed curvature is linear in arc length."""
    return _standard("clothoid", length, kappa_start, kappa_end)


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
    heading: Source | None,
    closed: bool,
    parameters: Parameters | None,
) -> tuple[Rail, tuple[tuple[str, Value | None], ...], tuple[str, ...]]:
    """Read and check the pieces of a rail.

    Returns
    -------
    rail, defaults, positive
        The definition, the run-time parameters with their defaults, and those promised to be positive.
    """
    flag(closed, where="piecewise: closed")
    what = "pieces in a list, as in [line(length=2), arc(radius=1, angle=pi)]"
    given = several(pieces, where="piecewise: pieces", what=what)
    if not given:
        raise DeclarationError(
            "piecewise: no pieces; give one or more, as in [line(length=2), arc(radius=1, angle=pi)]"
        )
    joined = tuple(_piece(piece, f"piecewise: piece {count}") for count, piece in enumerate(given, start=1))
    rail = Rail(start=_start(start, heading, joined[0]), pieces=joined, closed=closed)
    defaults, positive = _parameters(rail, parameters)
    return rail, defaults, positive


def _piece(given: Piece | FormulaCurve, where: str) -> Piece:
    if isinstance(given, Piece):
        return given
    if not isinstance(given, FormulaCurve):
        raise DeclarationError(f"{where}: {short(given)} given; give line, arc, clothoid or a curve with formulas")
    if given.kind == "space":
        raise DeclarationError(f"{where}: a space curve cannot be a piece yet; give a planar one")
    if given.charted:
        raise DeclarationError(f"{where}: a curve of kind {given.kind!r} cannot be a piece; give one with formulas")
    low, high = given.domain
    if low is None or high is None:
        raise DeclarationError(f"{where} ({given.kind}): domain: must have two ends, which the piece lies between")
    return Piece(kind="curve", numbers=(low, high), curve=given)


def _start(start: Sequence[Source] | None, heading: Source | None, first: Piece) -> tuple[sp.Expr, ...] | None:
    if first.curve is not None:
        if start is not None or heading is not None:
            raise DeclarationError(
                "piecewise: start: the first piece is a curve with a place of its own; leave start and heading out"
            )
        return None
    place = (0, 0) if start is None else several(start, where="piecewise: start", what="a pair (x, z)")
    if len(place) != 2:
        raise DeclarationError(f"piecewise: start: must be a pair (x, z), got {short(start)}")
    numbers = (*place, 0 if heading is None else heading)
    return tuple(
        read_expression(number, where=f"piecewise: {name}", unit="1" if name == "heading" else "m")
        for number, name in zip(numbers, ("start", "start", "heading"), strict=True)
    )


def _parameters(
    rail: Rail, parameters: Parameters | None
) -> tuple[tuple[tuple[str, Value | None], ...], tuple[str, ...]]:
    """Join the parameters of all pieces; a name means the same in each."""
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
    if "s" in found:
        raise DeclarationError("piecewise: 's' is the arc length of the rail; give the parameter another name")
    defaults = read_parameters(parameters, found=found, where="piecewise")
    return tuple((name, own.get(name) if value is None else value) for name, value in defaults), tuple(positive)
