"""The units of a curve's formulas, in which coordinates are lengths and angles are numbers; and a description of the
curve.
"""

from typing import Protocol, cast

import sympy as sp

from gqm_sym.declare.banking import Banking
from gqm_sym.declare.implicit import Level
from gqm_sym.declare.piecewise import MAX_POWER, FormulaCurve, Rail
from gqm_sym.declare.polynomials import PolynomialPieces
from gqm_sym.declare.sampled import Track
from gqm_sym.dimensions import COMMON, LENGTH, NUMBER, Dimension, Formulas, dimension, found_dimensions, unit_of
from gqm_sym.parameters import in_words


class DeclaredCurve(FormulaCurve, Protocol):
    """The attributes of a curve that are used here; `curve.Curve` has them."""

    @property
    def coordinates(self) -> tuple[tuple[str, sp.Expr], ...]:
        """The coordinates by name."""

    @property
    def radius(self) -> sp.Expr | None:
        """The radius of a polar curve; None for any other."""

    @property
    def parameter(self) -> sp.Symbol:
        """The curve's own parameter."""

    @property
    def period(self) -> sp.Expr | None:
        """The period of a closed curve's parameter; None for any other."""

    @property
    def title(self) -> str:
        """One line of text for readers."""

    @property
    def definition(self) -> object:
        """The definition of a curve without formulas."""

    @property
    def banking(self) -> Banking | None:
        """The banking of a space curve; None for any other."""


PER_LENGTH = dimension(metre=-1)
SPEED = dimension(metre=1, second=-1)
_PIECES: dict[str, tuple[Dimension, ...]] = {
    "line": (LENGTH,),
    "arc": (LENGTH, NUMBER),
    "clothoid": (LENGTH, PER_LENGTH, PER_LENGTH),
    "transition": (LENGTH, *3 * tuple(dimension(metre=-1 - power) for power in range(MAX_POWER + 1))),
}
_PLANE: dict[str, Dimension | None] = {"x": LENGTH, "z": LENGTH}


def curve_formulas(curve: DeclaredCurve) -> Formulas:
    """Return the formulas of a curve with their dimensions."""
    lam = curve.parameter
    if isinstance(curve.definition, Level):
        level = curve.definition
        places = [(form, LENGTH) for form in (*level.start, *curve.domain) if form is not None]
        return Formulas([(level.value, None), *places], _PLANE)
    if isinstance(curve.definition, Rail):
        banked = [] if curve.banking is None else _banked(curve.banking)
        return _rail_formulas(curve.definition) + Formulas(banked, {curve.parameter.name: LENGTH})
    own = parameter_dimension(curve)
    banked = [] if curve.banking is None else _banked(curve.banking)
    if curve.charted:
        return Formulas(banked, {lam.name: own})
    coordinates = [form for _, form in curve.coordinates] if curve.radius is None else [curve.radius]
    ends = [(end, own) for end in (*curve.domain, curve.period) if end is not None and own is not None]
    return Formulas([*((form, LENGTH) for form in coordinates), *ends, *banked], {lam.name: own})


def _banked(banking: Banking) -> list[tuple[sp.Expr, Dimension | None]]:
    """Return the formulas of a banking with their dimensions."""
    forms = ((banking.angle, NUMBER), (banking.speed, SPEED), (banking.heartline, LENGTH))
    return [(form, wanted) for form, wanted in forms if form is not None]


def parameter_dimension(curve: DeclaredCurve) -> Dimension | None:
    """Return the dimension of a curve's parameter; None if its formulas do not determine it immediately."""
    lam = curve.parameter
    if curve.kind in ("parametric", "space"):
        # The argument of a sine or cosine whose rate is a number is an angle.
        waves = [node for _, form in curve.coordinates for node in form.atoms(sp.sin, sp.cos, sp.tan)]
        return NUMBER if any(node.args[0].free_symbols == {lam} for node in waves) else None
    return NUMBER if curve.kind == "polar" else LENGTH


def _rail_formulas(rail: Rail) -> Formulas:
    total = Formulas()
    if rail.start is not None:
        places, angles = (3, 3) if rail.in_space else (2, 1)
        total += Formulas(list(zip(rail.start, (*places * (LENGTH,), *angles * (NUMBER,)), strict=True)))
    for count, piece in enumerate(rail.pieces, start=1):
        if piece.curve is None:
            total += Formulas(list(zip(piece.numbers, _PIECES[piece.kind], strict=True)))
            continue
        # Each curve has a parameter of its own, with any name.
        curve = cast(DeclaredCurve, piece.curve)
        lam = curve.parameter
        own = sp.Symbol(f"{lam.name} of {count}", real=True)
        inside = curve_formulas(curve)
        equal = [(form.xreplace({lam: own}), wanted) for form, wanted in inside.equal]
        total += Formulas(equal, {own.name: inside.variables[lam.name]})
    return total


def units_of(curve: DeclaredCurve) -> dict[str, str]:
    """Return the SI units of a curve's parameters, as far as its formulas determine them."""
    return {name: unit_of(found) for name, found in found_dimensions(curve_formulas(curve), COMMON).items()}


def description(curve: DeclaredCurve) -> str:
    """Describe a curve in a few lines."""
    units = units_of(curve)
    lines = [
        f"{curve.title or 'Curve'}: {_definition_in_words(curve)}",
        *(f"  {name} = {form}" for name, form in _forms(curve)),
    ]
    low, high = curve.domain
    if low is not None or high is not None:
        ends = f"{'-oo' if low is None else low} <= {curve.parameter} <= {'oo' if high is None else high}"
        lines.append(f"  domain: {ends}")
    if curve.period is not None:
        lines.append(f"  closed: period {curve.period} of {curve.parameter}")
    lines.append(f"  parameters: {in_words(dict(curve.defaults), units)}")
    return "\n".join(lines)


def _definition_in_words(curve: DeclaredCurve) -> str:
    made = curve.definition
    if isinstance(made, Track):
        count = made.points.count("\n") + 1
        between = f"{'a quintic spline' if made.kind == 'spline' else 'stitched planes'} through {count} points"
        if made.smoothing is not None:
            between = f"a smoothing spline of {len(made.smoothing.points)} points"
        return f"{between}, {'closed' if made.closed else 'open'}, in arc length s [m]"
    if isinstance(made, Rail):
        kinds = ", ".join(piece.kind for piece in made.pieces[:8]) + (", ..." if len(made.pieces) > 8 else "")
        return f"{'closed ' if made.closed else ''}rail of {len(made.pieces)} pieces ({kinds}), in arc length s [m]"
    if isinstance(made, PolynomialPieces):
        return f"{made.pieces.count(chr(10)) + 1} polynomials joined, in arc length s [m]"
    if isinstance(made, Level):
        return f"implicit, in arc length {curve.parameter} [m] from its start"
    own = parameter_dimension(curve)
    unit = {NUMBER: " [rad]", LENGTH: " [m]"}.get(own, "") if own is not None else ""
    return f"{curve.kind}, in {curve.parameter}{unit}; coordinates in m, z upwards"


def _forms(curve: DeclaredCurve) -> list[tuple[str, sp.Expr]]:
    made = curve.definition
    if isinstance(made, Level):
        x, z = made.start
        return [("F", made.value), ("start", sp.Tuple(x, z))]
    if curve.charted:
        return []
    return [("r", curve.radius)] if curve.radius is not None else list(curve.coordinates)
