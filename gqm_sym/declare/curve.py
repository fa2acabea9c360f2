"""A planar curve as it was declared: coordinates, parameter, domain and run-time parameters."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import sympy as sp

from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import check_name, read_expression
from gqm_sym.parameters import Given, Value, names_in_order, read_parameters

Source: TypeAlias = str | int | sp.Expr
Parameters: TypeAlias = Mapping[str, Given | None] | Iterable[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """A curve ``(x(λ), z(λ))``, z upwards; made by one of the constructors below.

    Attributes
    ----------
    kind
        The form in which it was declared: ``graph``, ``parametric`` or ``polar``.
    x, z
        The coordinates, in the parameter and the run-time parameters.
    parameter
        The symbol of λ.
    domain
        Ends of the parameter's range, each an expression in run-time parameters or None (open).
    period
        The parameter period of a closed curve.
    defaults
        The run-time parameters in order, each with its default or None.
    title
        One line for people.
    positive
        Parameters promised to be positive; checked when the emitted module runs.
    radius
        Of a polar curve r(θ): its derivatives give shorter forms than those of x and z.
    """

    kind: str
    x: sp.Expr
    z: sp.Expr
    parameter: sp.Symbol
    domain: tuple[sp.Expr | None, sp.Expr | None] = (None, None)
    period: sp.Expr | None = None
    defaults: tuple[tuple[str, Value | None], ...] = ()
    title: str = ""
    positive: tuple[str, ...] = ()
    radius: sp.Expr | None = None

    def __post_init__(self) -> None:
        if self.parameter not in self.x.free_symbols | self.z.free_symbols:
            raise DeclarationError(
                f"{self.kind} curve: neither coordinate depends on the parameter "
                f"{self.parameter.name!r}; x = {self.x}, z = {self.z} is a point, not a curve"
            )
        _check_ends(self.kind, self.domain, self.period, self.parameter)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the run-time parameters, in order."""
        return tuple(name for name, _ in self.defaults)

    @classmethod
    def graph(
        cls,
        z: Source,
        *,
        parameter: str = "x",
        domain: Iterable[Source | None] | None = None,
        parameters: Parameters | None = None,
        title: str = "",
        positive: Iterable[str] = (),
    ) -> "Curve":
        """Declare the graph ``z = z(x)``.

        Examples
        --------
        >>> Curve.graph("a*x**2 + b*x", parameter="x").parameters
        ('a', 'b')
        """
        symbol = _symbol(parameter, "graph")
        height = read_expression(z, where="graph: z")
        return _declare("graph", symbol, height, symbol, domain, None, parameters, title, positive)

    @classmethod
    def parametric(
        cls,
        *,
        x: Source,
        z: Source,
        parameter: str,
        period: Source | None = None,
        domain: Iterable[Source | None] | None = None,
        parameters: Parameters | None = None,
        title: str = "",
        positive: Iterable[str] = (),
    ) -> "Curve":
        """Declare a curve by both coordinates.

        Examples
        --------
        >>> Curve.parametric(x="L*sin(u)", z="-L*cos(u)", parameter="u", period="2*pi").period
        2*pi
        """
        symbol = _symbol(parameter, "parametric")
        first = read_expression(x, where="parametric: x")
        second = read_expression(z, where="parametric: z")
        return _declare("parametric", first, second, symbol, domain, period, parameters, title, positive)

    @classmethod
    def polar(
        cls,
        r: Source,
        *,
        parameter: str = "theta",
        period: Source | None = None,
        domain: Iterable[Source | None] | None = None,
        parameters: Parameters | None = None,
        title: str = "",
        positive: Iterable[str] = (),
    ) -> "Curve":
        """Declare ``r = r(θ)``, θ from the positive x axis; r may be negative."""
        symbol = _symbol(parameter, "polar")
        radius = read_expression(r, where="polar: r")
        return _declare(
            "polar",
            radius * sp.cos(symbol),
            radius * sp.sin(symbol),
            symbol,
            domain,
            period,
            parameters,
            title,
            positive,
            radius,
        )


def _symbol(name: str, kind: str) -> sp.Symbol:
    return sp.Symbol(_check_parameter_name(name, kind), real=True)


def _check_parameter_name(name: str, kind: str) -> str:
    # "lam" is reserved because emitted functions call their argument so; a curve's own parameter
    # is that argument, so it alone may have the name.
    return name if name == "lam" else check_name(name, where=f"{kind}: parameter")


def _declare(
    kind: str,
    x: sp.Expr,
    z: sp.Expr,
    symbol: sp.Symbol,
    domain: Iterable[Source | None] | None,
    period: Source | None,
    parameters: Parameters | None,
    title: str,
    positive: Iterable[str],
    radius: sp.Expr | None = None,
) -> Curve:
    ends = _read_domain(domain, kind)
    turn = None if period is None else read_expression(period, where=f"{kind}: period")
    written = (x, z) if radius is None else (radius,)
    given = tuple(end for end in (*ends, turn) if end is not None)
    found = tuple(name for name in names_in_order(*written, *given) if name != symbol.name)
    defaults = read_parameters(parameters, found=found, where=f"{kind} curve")
    promised = tuple(positive)
    for name in promised:
        if name not in found:
            raise DeclarationError(f"{kind} curve: {name!r} is promised to be positive but not used; remove it")
    return Curve(
        kind=kind,
        x=x,
        z=z,
        parameter=symbol,
        domain=ends,
        period=turn,
        defaults=defaults,
        title=title,
        positive=promised,
        radius=radius,
    )


def _read_domain(domain: Iterable[Source | None] | None, kind: str) -> tuple[sp.Expr | None, sp.Expr | None]:
    if domain is None:
        return (None, None)
    ends = None if isinstance(domain, str) else tuple(domain)
    if ends is None or len(ends) != 2:
        raise DeclarationError(
            f"{kind}: domain: must be two ends (lo, hi), either of them None where it is open; got {domain!r}"
        )
    low, high = (None if end is None else read_expression(end, where=f"{kind}: domain") for end in ends)
    return (low, high)


def _check_ends(
    kind: str,
    domain: tuple[sp.Expr | None, sp.Expr | None],
    period: sp.Expr | None,
    parameter: sp.Symbol,
) -> None:
    for label, end in (("domain", domain[0]), ("domain", domain[1]), ("period", period)):
        if end is not None and parameter in end.free_symbols:
            raise DeclarationError(
                f"{kind}: {label}: {end} contains the curve's parameter {parameter.name!r}; "
                "only numbers and run-time parameters may stand there"
            )
    low, high = domain
    if low is not None and high is not None and (high - low).is_number and not high > low:
        raise DeclarationError(f"{kind}: domain: must have lo < hi, got ({low}, {high})")
    if period is not None and period.is_number and not period > 0:
        raise DeclarationError(f"{kind}: period: must be positive, got {period}")
