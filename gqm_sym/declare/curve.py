"""A planar curve as it was declared: coordinates, parameter, domain and run-time parameters."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import sympy as sp

from gqm_sym.declare.ends import Ends, check_ends, read_ends
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import check_name, read_expression
from gqm_sym.parameters import Parameters, Value, names_in_order, read_parameters
from gqm_sym.sympy_charts import chart_x, chart_z

if TYPE_CHECKING:
    from gqm_sym.declare.implicit import Level
    from gqm_sym.declare.piecewise import Piece

Source: TypeAlias = str | int | sp.Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """A curve ``(x(λ), z(λ))``, z upwards; made by one of the constructors below.

    Attributes
    ----------
    kind
        The form in which it was declared: ``graph``, ``parametric``, ``polar``; of a charted curve ``implicit``,
        ``sampled`` or ``piecewise``.
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
    definition
        What a charted curve is made from: its coordinates are known by numbers only, as functions of arc length.
    """

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

    def __post_init__(self) -> None:
        if self.parameter not in self.x.free_symbols | self.z.free_symbols:
            raise DeclarationError(
                f"{self.kind} curve: neither coordinate depends on the parameter "
                f"{self.parameter.name!r}; x = {self.x}, z = {self.z} is a point, not a curve"
            )
        check_ends(self.kind, self.domain, self.period, self.parameter)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the run-time parameters, in order."""
        return tuple(name for name, _ in self.defaults)

    @property
    def charted(self) -> bool:
        """Whether the parameter is arc length, and the coordinates are known by numbers only."""
        return self.definition is not None

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

    @classmethod
    def implicit(
        cls,
        F: Source,
        *,
        start: Iterable[Source],
        tangent: int = 1,
        parameter: str = "s",
        domain: Iterable[Source | None] | None = None,
        parameters: Parameters | None = None,
        title: str = "",
        positive: Iterable[str] = (),
    ) -> "Curve":
        """Declare the curve ``F(x, z) = 0`` through a point, in arc length from there.

        Parameters
        ----------
        F
            An expression in x, z and run-time parameters.
        start
            x and z of a point of the curve, where arc length is 0: numbers or expressions in run-time parameters.
        tangent
            1: arc length grows along ``(-F_z, F_x)/|grad F|``; -1: along the opposite.
        domain
            Ends of the arc length, which contain 0. Without them the curve is followed until it closes or comes to a
            singular point, where grad F = 0.

        Examples
        --------
        >>> Curve.implicit("(x/a)**4 + (z/b)**4 - 1", start=("a", 0)).parameters
        ('a', 'b')
        """
        from gqm_sym.declare.implicit import check_domain, read_level

        symbol = _symbol(parameter, "implicit")
        level = read_level(F, start=start, tangent=tangent, parameter=symbol.name)
        ends = read_ends(domain, "implicit")
        check_domain(*ends)
        return _declare(
            "implicit", chart_x(symbol), chart_z(symbol), symbol, ends, None, parameters, title, positive, level=level
        )

    @classmethod
    def sampled(
        cls,
        points: Iterable[Any],
        *,
        kind: str = "spline",
        closed: bool | None = None,
        title: str = "",
    ) -> "Curve":
        """Declare the track through points, in arc length from the first of them.

        Parameters
        ----------
        points
            Rows of x and z: an (n, 2) array, or pairs of numbers or of decimal text, which is kept as it is.
        kind
            "spline": the interpolating quintic spline. "linear": planes stitched together (paper, eq. 1); at their
            corners the speed is kept. A body at rest on a corner stays where both planes rise from it or hold it; on a
            ridge that lets it slide down either side it goes in the direction of launch.
        closed
            Whether the track closes; None: if its last point is its first.

        Raises
        ------
        DeclarationError
            If a row is no point, or points are too few, repeated, out of order or far away.
        """
        from gqm_sym.declare.sampled import read_track

        s = sp.Symbol("s", real=True)
        track = read_track(points, kind=kind, closed=closed)
        return cls(kind="sampled", x=chart_x(s), z=chart_z(s), parameter=s, title=title, definition=track)

    @classmethod
    def piecewise(
        cls,
        pieces: "Iterable[Piece | Curve]",
        *,
        start: Sequence[Source] | None = None,
        heading: Source | None = None,
        closed: bool = False,
        parameters: Parameters | None = None,
        title: str = "",
    ) -> "Curve":
        """Declare a rail of pieces joined end to start, in arc length from its start.

        Parameters
        ----------
        pieces
            `line`, `arc` and `clothoid`, which are placed at the end of the piece before, and curves with formulas and
            a bounded domain, whose place and tangent must match there (within 1e-9 of the rail's length and 1e-9 rad).
        start, heading
            Where the first piece begins, and the angle of its tangent from the x axis; (0, 0) and 0 if not given. A
            curve that comes first has its own.
        closed
            Whether the rail ends where it began, in the same direction.

        Raises
        ------
        DeclarationError
            If a piece is none, or has no ends. What depends on parameters is checked when they are known.

        Examples
        --------
        >>> from gqm_sym.declare.piecewise import arc, line
        >>> Curve.piecewise([line(length=2), arc(radius="R", angle="pi/2")]).parameters
        ('R',)
        """
        from gqm_sym.declare.piecewise import declare_rail

        rail, defaults, positive = declare_rail(
            pieces, start=start, heading=heading, closed=closed, parameters=parameters
        )
        s = sp.Symbol("s", real=True)
        return cls(
            kind="piecewise",
            x=chart_x(s),
            z=chart_z(s),
            parameter=s,
            defaults=defaults,
            title=title,
            positive=positive,
            definition=rail,
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
    level: "Level | None" = None,
) -> Curve:
    ends = read_ends(domain, kind)
    turn = None if period is None else read_expression(period, where=f"{kind}: period")
    written = (x, z) if radius is None else (radius,)
    given = tuple(end for end in (*ends, turn) if end is not None)
    names = (*names_in_order(*written), *(() if level is None else level.names), *names_in_order(*given))
    found = tuple(name for name in dict.fromkeys(names) if name != symbol.name)
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
        definition=level,
    )
