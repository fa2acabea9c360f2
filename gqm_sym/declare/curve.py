"""Curves, and the ways to declare one: by formulas, by an equation, by points or by pieces."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import sympy as sp

from gqm_sym.arguments import checked, unknown_argument
from gqm_sym.declare.banking import OF_PIECES, read_banking
from gqm_sym.declare.declaration import Declaration, Source, declare, parameter_symbol
from gqm_sym.declare.ends import read_ends
from gqm_sym.declare.measures import description
from gqm_sym.errors import ArgumentError, DeclarationError
from gqm_sym.expressions import read_expression
from gqm_sym.parameters import Parameters
from gqm_sym.sympy_charts import SPACE, chart_x, chart_z, space_roll

if TYPE_CHECKING:
    from gqm_sym.declare.piecewise import Piece
    from gqm_sym.smoothing import Smoothing


class SpaceOptions(TypedDict, total=False):
    """Arguments of `Curve.space` and `Curve.sampled` that are rarely given; they are described there."""

    roll: Any
    heartline: Source
    parameters: Parameters | None
    title: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve(Declaration):
    """A curve ``(x(λ), z(λ))``, or ``(x(λ), y(λ), z(λ))``, z upwards; made by one of the constructors below.

    Attributes
    ----------
    kind
        The form in which it was declared: ``graph``, ``parametric``, ``polar``, ``space``; of a charted curve
        ``implicit``, ``sampled``, ``piecewise`` or ``polynomial``.
    x, z, y
        The coordinates, in the parameter and the run-time parameters; y is 0 on curves in the plane of x and z.
    parameter
        The symbol of λ.
    domain
        Ends of the parameter's range, each an expression in run-time parameters or None (open).
    period
        The parameter period of a closed curve: as given, or found where the formulas tell it.
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
    banking
        Of a space curve how it is banked; None where that is not declared.
    """

    def in_arc_length(self) -> "Curve":
        """Return the same curve with arc length from its beginning as its parameter.

        Raises
        ------
        DeclarationError
            If it has no beginning or no end.
        """
        if self.charted:
            return self
        closed = self.period is not None
        ends = (sp.S.Zero, self.period) if closed else self.domain
        if None in ends:
            raise DeclarationError(f"{self.kind} curve: has no end to measure arc length from; give it a domain")
        whole = replace(self, domain=ends, period=None)
        return Curve.piecewise([whole], closed=closed, parameters=dict(self.defaults), title=self.title)

    def __str__(self) -> str:
        """A few lines for people: what it is, where it goes, and what its parameters are measured in."""
        return description(self)

    def plot(self, lam: Any = None, *, axes: Any = None, **parameters: Any) -> Any:
        """Draw the curve with Matplotlib, its start marked and its direction shown by an arrow.

        Parameters
        ----------
        lam
            The range of the parameter to draw, a pair of numbers. Without it the domain is drawn or one period; where
            there is neither, a graph from -1 to 1, and other curves from 0 to 2*pi.
        axes
            The Matplotlib axes to draw on; a new figure if not given.
        parameters
            Values of run-time parameters, by name; others have their defaults.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ArgumentError
            If there is no such parameter.
        ParameterError
            If a parameter has no value.
        """
        from gqm_sym.building import draw_curve

        return draw_curve(self, lam, axes, parameters)

    @property
    def smoothing(self) -> "Smoothing | None":
        """What smoothing did to the points of a sampled track; None where nothing was smoothed."""
        return getattr(self.definition, "smoothing", None)

    @classmethod
    @checked("Curve.graph")
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
        symbol = parameter_symbol(parameter, "graph")
        height = read_expression(z, where="graph: z")
        forms = cls(kind="graph", x=symbol, z=height, parameter=symbol, title=title)
        return declare(forms, domain, parameters, positive)

    @classmethod
    @checked("Curve.parametric")
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

        Without ``period`` and ``domain`` it is closed where both are made of waves of commensurate rates.

        Examples
        --------
        >>> Curve.parametric(x="L*sin(u)", z="-L*cos(u)", parameter="u", period="2*pi").period
        2*pi
        """
        symbol = parameter_symbol(parameter, "parametric")
        first = read_expression(x, where="parametric: x")
        second = read_expression(z, where="parametric: z")
        forms = cls(kind="parametric", x=first, z=second, parameter=symbol, title=title)
        return declare(forms, domain, parameters, positive, period)

    @classmethod
    @checked("Curve.polar")
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
        symbol = parameter_symbol(parameter, "polar")
        radius = read_expression(r, where="polar: r")
        x, z = radius * sp.cos(symbol), radius * sp.sin(symbol)
        forms = cls(kind="polar", x=x, z=z, parameter=symbol, title=title, radius=radius)
        return declare(forms, domain, parameters, positive, period)

    @classmethod
    @checked("Curve.space")
    def space(
        cls,
        *,
        x: Source,
        y: Source,
        z: Source,
        parameter: str,
        period: Source | None = None,
        domain: Iterable[Source | None] | None = None,
        **more: Unpack[SpaceOptions],
    ) -> "Curve":
        """Declare a curve in space by its three coordinates; z is up.

        Without ``period`` and ``domain`` it is closed where its coordinates are made of waves of commensurate rates.
        The contact force of a space curve is a vector, and ``normal_force`` its length; on a curve in a vertical plane
        it has the sign that it has on planar curves.

        Parameters
        ----------
        roll
            How the track is banked, so that states tell what a rider feels: a roll angle in radians, positive to the
            left; "coordinated", so that there is no lateral force at the speed of the motion; or ("coordinated", v), at
            the speed v. The angle is measured from the level, which a vertical tangent does not have; on a curve in a
            vertical plane from the normal of that plane along which the contact force is positive. None: not banked.
        heartline
            The height of the declared curve, which the rider follows, over the track; 0 if not given.
        parameters, title
            As of other curves.

        Examples
        --------
        >>> Curve.space(x="R*cos(u)", y="R*sin(u)", z="c*u", parameter="u").parameters
        ('R', 'c')
        """
        _refuse_others(more, "Curve.space", ("x", "y", "z", "parameter", "period", "domain"))
        symbol, title = parameter_symbol(parameter, "space"), more.get("title", "")
        at = {name: read_expression(form, where=f"space: {name}") for name, form in (("x", x), ("y", y), ("z", z))}
        banking = read_banking(more.get("roll"), more.get("heartline", 0))
        forms = cls(kind="space", **at, parameter=symbol, title=title, banking=banking)
        return declare(forms, domain, more.get("parameters"), (), period)

    @classmethod
    @checked("Curve.implicit")
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

        symbol = parameter_symbol(parameter, "implicit")
        level = read_level(F, start=start, tangent=tangent, parameter=symbol.name)
        ends = read_ends(domain, "implicit", "m")
        check_domain(*ends)
        x, z = chart_x(symbol), chart_z(symbol)
        forms = cls(kind="implicit", x=x, z=z, parameter=symbol, title=title, definition=level)
        return declare(forms, ends, parameters, positive, names_of_level=level.names)

    @classmethod
    @checked("Curve.sampled")
    def sampled(
        cls,
        points: Any,
        z: Any = None,
        *,
        kind: str = "spline",
        closed: bool | None = None,
        smoothing: float | str | None = None,
        **more: Unpack[SpaceOptions],
    ) -> "Curve":
        """Declare the track through points, in arc length from the first of them.

        Parameters
        ----------
        points
            Rows of x and z, or in space of x, y and z: an array, or numbers or decimal text, which is kept as it is; or
            a table with these columns, as a DataFrame or a mapping; or, where ``z`` is given, the x of all points. In
            space the track is a spline; of a table in space the column roll is read too.
        z
            The heights of the points, where ``points`` are their x: ``Curve.sampled(x, z)``.
        kind
            "spline": the interpolating quintic spline. "linear": planes stitched together (paper, eq. 1); at their
            corners the speed is kept. A body at rest on a corner stays where both planes rise from it or hold it; on a
            ridge that lets it slide down either side it goes in the direction of launch. A moving body that only one
            side of the track holds (``contact="above"`` or ``"below"``) leaves it at a corner that bends away from the
            body, with the event "liftoff", and passes one that bends towards it.
        closed
            Whether the track closes; None: if its last point is its first.
        smoothing
            For measured points, whose scatter would be a hundredfold in curvature and loads: their standard deviation
            in metres, or "auto", to find it by cross-validation. The track is then the smoothing spline of degree 5;
            what it changed, and how good its curvature is, is in the attribute ``smoothing`` of the curve. None: the
            track goes through the points.
        roll
            In space, how the track is banked, so that states tell what a rider feels: an array of the roll angle at
            each point in radians, through which a spline goes as well; or what `Curve.space` takes, with formulas in
            the arc length s.
        heartline, parameters
            As of `Curve.space`.
        title
            One line for people.

        Raises
        ------
        DeclarationError
            If a row is no point, or points are too few, repeated, out of order or far away.

        Warns
        -----
        NoisyPointsWarning
            If the curvature of the track goes up and down from point to point.

        Examples
        --------
        >>> from math import cos
        >>> ruler = [(x / 10, round(cos(x / 10), 2)) for x in range(60)]  # heights to the centimetre
        >>> track = Curve.sampled(ruler, smoothing=0.003)
        >>> round(track.smoothing.rms, 4)
        0.0021
        """
        from gqm_sym.declare.sampled import read_track

        _refuse_others(more, "Curve.sampled", ("points", "z", "kind", "closed", "smoothing"))
        s, roll, title = sp.Symbol("s", real=True), more.get("roll"), more.get("title", "")
        track = read_track(points, z, kind=kind, closed=closed, smoothing=smoothing, roll=roll)
        banking = read_banking(space_roll(s) if track.banked else roll, more.get("heartline", 0), "sampled")
        if banking is not None and not track.in_space:
            raise DeclarationError("sampled: roll: is for tracks in space; give rows of x, y and z")
        named = dict(zip("xyz", (head(s) for head in SPACE), strict=True))
        at = named if track.in_space else {"x": chart_x(s), "z": chart_z(s)}
        forms = cls(kind="sampled", **at, parameter=s, title=title, definition=track, banking=banking)
        return declare(forms, None, more.get("parameters"), ())

    @classmethod
    @checked("Curve.piecewise")
    def piecewise(
        cls,
        pieces: "Iterable[Piece | Curve]",
        *,
        start: Sequence[Source] | None = None,
        heading: Source | Sequence[Source] | None = None,
        closed: bool = False,
        **more: Unpack[SpaceOptions],
    ) -> "Curve":
        """Declare a rail of pieces joined end to start, in arc length from its start.

        Parameters
        ----------
        pieces
            `line`, `arc` and `clothoid`, which are placed at the end of the piece before, and curves with formulas and
            a bounded domain, whose place and tangent must match there (within 1e-9 of the rail's length and 1e-9 rad).
            A `transition` or a space curve among them makes a rail in space, on which arcs and clothoids turn upwards
            where they turn left in a plane.
        start, heading
            Where the first piece begins, and the angle of its tangent from the x axis; (0, 0) and 0 if not given. In
            space x, y and z, and the angles of the tangent from the x axis as seen from above and from the level, then
            how far the frame leans to the left; those left out are 0. A curve that comes first has its own.
        closed
            Whether the rail ends where it began, in the same direction.
        roll
            In space, how the track is banked, so that states tell what a rider feels: "pieces", as the frame leans that
            the pieces turn and roll; or what `Curve.space` takes, with formulas in the arc length s.
        heartline, parameters
            As of `Curve.space`.
        title
            One line for people.

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

        _refuse_others(more, "Curve.piecewise", ("pieces", "start", "heading", "closed"))
        s, roll = sp.Symbol("s", real=True), more.get("roll")
        of_pieces = isinstance(roll, str) and roll == OF_PIECES
        banking = read_banking(space_roll(s) if of_pieces else roll, more.get("heartline", 0), "piecewise")
        forms = banking.forms if banking else ()
        rail, defaults, positive = declare_rail(
            pieces, start=start, heading=heading, closed=closed, parameters=more.get("parameters"), forms=forms
        )
        if banking is not None and not rail.in_space:
            raise DeclarationError("piecewise: roll: is for rails in space; give start=(x, y, z)")
        at_x, at_y, at_z = (head(s) for head in SPACE) if rail.in_space else (chart_x(s), sp.S.Zero, chart_z(s))
        return cls(
            kind="piecewise",
            x=at_x,
            y=at_y,
            z=at_z,
            parameter=s,
            defaults=defaults,
            title=more.get("title", ""),
            positive=positive,
            definition=replace(rail, banked=of_pieces),
            banking=banking,
        )


def _refuse_others(given: Mapping[str, Any], called: str, known: tuple[str, ...]) -> None:
    """Refuse arguments that are not among the known ones, nor among `SpaceOptions`."""
    if strangers := given.keys() - SpaceOptions.__annotations__.keys():
        raise ArgumentError(unknown_argument(called, min(strangers), (*known, *SpaceOptions.__annotations__)))
