"""Curves given by an equation F(x, z) = 0 and a start point."""

from collections.abc import Iterable
from dataclasses import dataclass
from numbers import Real

import sympy as sp

from gqm_sym.arguments import several, short
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import Source, read_expression
from gqm_sym.literals.rationals import is_numpy_span
from gqm_sym.parameters import COORDINATES, names_in_order

X, Z = (sp.Symbol(name, real=True) for name in COORDINATES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """The definition of an implicit curve.

    Attributes
    ----------
    value
        F, in x, z and run-time parameters.
    start
        x and z of the start point, where arc length is 0.
    tangent
        If it is 1, arc length grows along (-F_z, F_x)/|grad F|; if it is -1, along the opposite direction.
    """

    value: sp.Expr
    start: tuple[sp.Expr, sp.Expr]
    tangent: int

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the run-time parameters in it, in the order of their first appearance."""
        return tuple(name for name in names_in_order(self.value, *self.start) if name not in COORDINATES)


def read_level(F: Source, *, start: Iterable[Source], tangent: int, parameter: str) -> Level:
    """Read and check the declaration of an implicit curve.

    Parameters
    ----------
    F
        An expression in x and z, which vanishes on the curve.
    start
        x and z of a point of the curve: numbers, or expressions in run-time parameters.
    tangent
        1 or -1.
    parameter
        The name of the arc length.

    Raises
    ------
    DeclarationError
        If F has neither x nor z, the start is not a pair or contains coordinates, the tangent is neither 1 nor -1, or a
        name has two meanings.
    """
    if parameter in COORDINATES:
        raise DeclarationError(
            f"implicit: parameter: {parameter!r} is a coordinate; give arc length another name, as s"
        )
    value = read_expression(F, where="implicit: F")
    if not value.free_symbols & {X, Z}:
        raise DeclarationError(f"implicit: F: contains neither x nor z, got {value}; the curve is where F(x, z) = 0")
    pair = several(start, where="implicit: start", what="a point (x, z) of the curve")
    if len(pair) != 2:
        raise DeclarationError(f"implicit: start: must be a point (x, z) of the curve, got {short(start)}")
    x, z = (read_expression(coordinate, where="implicit: start", unit="m") for coordinate in pair)
    place = (x, z)
    for coordinate in place:
        if coordinate.free_symbols & {X, Z}:
            raise DeclarationError(
                f"implicit: start: {coordinate} contains a coordinate; "
                "only numbers and run-time parameters may stand there"
            )
    is_number = isinstance(tangent, Real | sp.Integer) and not (isinstance(tangent, bool) or is_numpy_span(tangent))
    if not is_number or tangent not in (1, -1):
        raise DeclarationError(
            f"implicit: tangent: must be 1, for (-F_z, F_x)/|grad F|, or -1, for the opposite; got {short(tangent)}"
        )
    level = Level(value=value, start=place, tangent=int(tangent))
    if parameter in level.names:
        raise DeclarationError(
            f"implicit: {parameter!r} is the curve's arc length and stands in F or start; give one of them another name"
        )
    return level


def check_domain(low: sp.Expr | None, high: sp.Expr | None) -> None:
    """Refuse a range of arc length without the start point, as far as its ends are numbers."""
    for end, sign in ((low, 1), (high, -1)):
        if end is not None and end.is_number and sign * end > 0:
            raise DeclarationError(
                f"implicit: domain: must contain 0, where the start point is; got ({low}, {high}) in arc length"
            )
