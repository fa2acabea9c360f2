"""The checked data of a declared curve: coordinates, parameter, ends, period and run-time parameters."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeAlias, TypeVar

import sympy as sp

from gqm_sym.arguments import names, one_line, short
from gqm_sym.declare.banking import Banking
from gqm_sym.declare.closing import check_period, found_period
from gqm_sym.declare.ends import Ends, check_ends, check_order, read_ends
from gqm_sym.declare.measures import parameter_dimension, units_of
from gqm_sym.dimensions import unit_of
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import check_name, read_expression
from gqm_sym.parameters import Parameters, Value, check_measured, names_in_order, read_parameters

Source: TypeAlias = str | int | sp.Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class Declaration:
    """The data of a curve; the subclass `Curve` describes the attributes."""

    kind: str
    x: sp.Expr
    z: sp.Expr
    parameter: sp.Symbol
    domain: Ends = (None, None)
    period: sp.Expr | None = None
    defaults: tuple[tuple[str, Value | None], ...] = ()
    title: str = ""
    positive: tuple[str, ...] = ()
    radius: sp.Expr | None = None
    definition: object = None
    y: sp.Expr = sp.S.Zero
    banking: Banking | None = None

    def __post_init__(self) -> None:
        if not any(self.parameter in form.free_symbols for form in self.point):
            forms = ", ".join(f"{name} = {form}" for name, form in self.coordinates)
            raise DeclarationError(
                f"{self.kind} curve: {'no' if self.in_space else 'neither'} coordinate depends on the parameter "
                f"{self.parameter.name!r}; {forms} is a point, not a curve"
            )
        one_line(self.title, where=f"{self.kind} curve: title")
        check_ends(self.kind, self.domain, self.period, self.parameter)
        check_order(self.kind, self.domain, self.period, dict(self.defaults))
        if self.period is not None:
            check_period(self.kind, self.point, self.parameter, self.period, dict(self.defaults))

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the run-time parameters, in order."""
        return tuple(name for name, _ in self.defaults)

    @property
    def in_space(self) -> bool:
        """Whether the curve has three coordinates."""
        return self.kind == "space" or getattr(self.definition, "in_space", False)

    @property
    def coordinates(self) -> tuple[tuple[str, sp.Expr], ...]:
        """The coordinates by name: x and z, or x, y and z."""
        return self.named(self.x, self.y, self.z)

    def named(self, x: sp.Expr, y: sp.Expr, z: sp.Expr) -> tuple[tuple[str, sp.Expr], ...]:
        """Pair three expressions with the names of the coordinates; a planar curve has no y.

        Parameters
        ----------
        x, y, z
            The expressions that belong to the three coordinates.

        Returns
        -------
        tuple of (str, sympy.Expr)
        """
        return (("x", x), *((("y", y),) if self.in_space else ()), ("z", z))

    @property
    def point(self) -> tuple[sp.Expr, ...]:
        """The coordinates without their names."""
        return tuple(form for _, form in self.coordinates)

    @property
    def charted(self) -> bool:
        """Whether the curve has no formulas: the parameter is arc length, and the coordinates are numbers."""
        return self.definition is not None


Declared = TypeVar("Declared", bound=Declaration)


def parameter_symbol(name: str, kind: str) -> sp.Symbol:
    """Return the symbol of a curve's own parameter."""
    return sp.Symbol(check_parameter_name(name, kind), real=True)


def check_parameter_name(name: str, kind: str) -> str:
    """Return the name of a curve's own parameter, which is the only one that may be called ``lam``."""
    # "lam" is reserved because it is the name of the argument of emitted functions that is the curve's parameter.
    own = isinstance(name, str) and name == "lam"
    return name if own else check_name(name, where=f"{kind}: parameter")


def declare(
    forms: Declared,
    domain: Iterable[Source | None] | None,
    parameters: Parameters | None,
    positive: Iterable[str],
    period: Source | None = None,
    names_of_level: tuple[str, ...] = (),
) -> Declared:
    """Return the curve with its domain, its period and its run-time parameters, which are read and checked."""
    kind, symbol = forms.kind, forms.parameter
    unit = unit_of(parameter_dimension(forms)) or None
    ends = read_ends(domain, kind, unit)
    turn = None if period is None else read_expression(period, where=f"{kind}: period", unit=unit)
    written = (*forms.point, *(forms.banking.forms if forms.banking else ()))
    written = written if forms.radius is None else (forms.radius,)
    given = tuple(end for end in (*ends, turn) if end is not None)
    used = (*names_in_order(*written), *names_of_level, *names_in_order(*given))
    found = tuple(name for name in dict.fromkeys(used) if name != symbol.name)
    if confused := {name for name, _ in forms.coordinates}.intersection(found):
        raise DeclarationError(
            f"{kind} curve: {min(confused)!r} is a coordinate and cannot be a run-time parameter; write the curve as a "
            f"function of its parameter {symbol.name!r}, or rename it"
        )
    defaults = read_parameters(parameters, found=found, where=f"{kind} curve")
    if turn is None and kind in ("parametric", "polar", "space") and ends == (None, None):
        turn = found_period(forms.point, symbol)
    promised = names(positive, where=f"{kind}: positive")
    for name in promised:
        if name not in found:
            raise DeclarationError(f"{kind} curve: {short(name)} is promised to be positive but not used; remove it")
    curve = replace(forms, domain=ends, period=turn, defaults=defaults, positive=promised)
    check_measured(dict(defaults), units_of(curve), where=f"{kind} curve", final=False)
    return curve
