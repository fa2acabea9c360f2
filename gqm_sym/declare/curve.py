"""Curves, and the ways to declare one without formulas: by an equation, by points or by pieces."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

import sympy as sp

from gqm_sym.arguments import checked
from gqm_sym.declare.banking import OF_PIECES, read_banking
from gqm_sym.declare.by_formulas import ByFormulas, SpaceOptions, refuse_others
from gqm_sym.declare.declaration import Source, declare, parameter_symbol
from gqm_sym.declare.ends import read_ends
from gqm_sym.declare.measures import description
from gqm_sym.errors import DeclarationError
from gqm_sym.parameters import Parameters
from gqm_sym.sympy_charts import SPACE, chart_x, chart_z, space_roll

if TYPE_CHECKING:
    from gqm_sym.declare.piecewise import Piece
    from gqm_sym.smoothing import Smoothing


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Curve(ByFormulas):
    """A curve ``(x(λ), z(λ))`` or ``(x(λ), y(λ), z(λ))``, where z is up; one of the constructors makes it.

    Attributes
    ----------
    kind
        The form of declaration: ``graph``, ``parametric``, ``polar`` or ``space``; for curves without formulas
        ``implicit``, ``sampled``, ``piecewise`` or ``polynomial``.
    x
        The horizontal coordinate in m, as an expression in λ and the run-time parameters.
    y
        The other horizontal coordinate in m; 0 on planar curves.
    z
        The height in m.
    parameter
        The symbol of λ.
    domain
        The two ends of the range of λ, each an expression in run-time parameters, or None where it is open.
    period
        The increase of λ in one lap of a closed curve; None on open curves.
    defaults
        The run-time parameters in order, each with its default or None.
    title
        One line of text for readers.
    positive
        Names of run-time parameters that must be positive, which is checked when a module runs.
    radius
        The radius r(θ) of a polar curve in m, whose derivatives give shorter forms than those of x and z.
    definition
        The points, pieces or equation of a curve without formulas, whose coordinates are numbers.
    banking
        The banking of a space curve; None if none is declared.
    """

    def in_arc_length(self) -> "Curve":
        """Return the same curve with arc length as its parameter, measured from its start.

        Returns
        -------
        Curve

        Raises
        ------
        DeclarationError
            If the curve has no start or no end, or its roll angle is a formula in its own parameter.
        """
        if self.charted:
            return self
        closed = self.period is not None
        ends = (sp.S.Zero, self.period) if closed else self.domain
        if None in ends:
            raise DeclarationError(f"{self.kind} curve: has no end to measure arc length from; give it a domain")
        banking = self.banking
        if banking is not None and banking.angle is not None and self.parameter in banking.angle.free_symbols:
            raise DeclarationError(
                f"{self.kind} curve: roll: {banking.angle} is in {self.parameter}, and the track of a train has arc "
                "length for its parameter; declare roll='coordinated', ('coordinated', speed) or an angle that is the "
                "same everywhere, or give the track as points with roll angles"
            )
        whole = replace(self, domain=ends, period=None, banking=None)
        made = Curve.piecewise([whole], closed=closed, parameters=dict(self.defaults), title=self.title)
        return replace(made, banking=banking)

    def __repr__(self) -> str:
        return f"<{str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        """Describe the curve in a few lines: its form, its range and the units of its parameters."""
        return description(self)

    def plot(self, lam: Any = None, *, axes: Any = None, **parameters: Any) -> Any:
        """Draw the curve with Matplotlib, with its start and an arrow along increasing λ.

        Parameters
        ----------
        lam
            The two ends of the range of λ to draw. The default is the domain or one period; without these it is -1 to 1
            for a graph, and 0 to 2*pi for other curves.
        axes
            The Matplotlib axes to draw on; by default a new figure is made.
        parameters
            Values of run-time parameters by name, in SI units; the others have their defaults.

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
        """The changes that smoothing made to the points of a sampled track; None if it was not smoothed."""
        return getattr(self.definition, "smoothing", None)

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
        """Declare the curve ``F(x, z) = 0`` through a point; its parameter is the arc length in m from there.

        Parameters
        ----------
        F
            An expression in x, z and run-time parameters.
        start
            x and z in m of a point of the curve, where the arc length is 0: numbers or expressions in run-time
            parameters.
        tangent
            1: the arc length increases along ``(-F_z, F_x)/|grad F|`` (paper, eq. 36); -1: against it.
        parameter
            The name of the arc length.
        domain
            The two ends of the arc length, between which 0 lies. By default the curve is traced until it closes or
            reaches a singular point, where grad F = 0.
        parameters, title, positive
            As in `Curve.graph`.

        Returns
        -------
        Curve

        Raises
        ------
        DeclarationError
            If names, ends or period do not fit together, or the curve is a point.
        ExpressionError
            If a text is not an arithmetic expression.

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
        """Declare the track through points; its parameter is the arc length in m from the first of them.

        Parameters
        ----------
        points
            An (n, 2) array of x and z, or in space an (n, 3) array of x, y and z, in m; or rows of numbers or decimal
            text, which is exact; or a table with these columns, as a DataFrame or a mapping, in space also with the
            column roll; or, if ``z`` is given, the x of all points.
        z
            The heights of the points in m, if ``points`` are their x: ``Curve.sampled(x, z)``.
        kind
            "spline": the interpolating quintic spline. "linear": straight lines between the points (paper, eq. 1). At
            their corners the speed is kept. A body at rest on a corner stays if both lines rise from it or friction
            holds it; on a ridge from which it can slide down on either side it starts in the direction of launch. A
            moving body that only one side of a planar track holds (``contact="above"`` or ``"below"``) leaves it at a
            corner that bends away from the body, with the event "liftoff", and passes a corner that bends towards it.
        closed
            Whether the track is closed; by default it is if its last point equals its first.
        smoothing
            For measured points: their standard deviation in m, or "auto", to find it by cross-validation. The track is
            then the smoothing spline of degree 5, and the attribute ``smoothing`` of the curve describes the changes
            and the error of the curvature. By default the track passes through the points, so that their scatter
            appears in the loads, a hundred times as large.
        roll
            In space, how the track is banked, so that states have the loads on a rider: an array of the roll angle at
            each point in radians, which a spline interpolates too; or what `Curve.space` takes, with formulas in the
            arc length s.
        heartline, parameters, title
            As in `Curve.space`.

        Returns
        -------
        Curve

        Raises
        ------
        DeclarationError
            If a row is not a point, or points are too few, repeated, out of order or too far away.

        Warns
        -----
        NoisyPointsWarning
            If the curvature of the track changes its sign from point to point.

        Examples
        --------
        >>> from math import cos
        >>> ruler = [(x / 10, round(cos(x / 10), 2)) for x in range(60)]  # heights to the centimetre
        >>> track = Curve.sampled(ruler, smoothing=0.003)
        >>> round(track.smoothing.rms, 4)
        0.0021
        """
        from gqm_sym.declare.sampled import read_track

        refuse_others(more, "Curve.sampled", ("points", "z", "kind", "closed", "smoothing"))
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
        """Declare a rail of pieces, each joined to the end of the one before; its parameter is arc length in m.

        Parameters
        ----------
        pieces
            `line`, `arc` and `clothoid`, which are placed at the end of the piece before, and curves with formulas and
            a bounded domain, whose place and tangent must match there (within 1e-9 of the rail's length and 1e-9 rad).
            A `transition` or a space curve among them makes a rail in space, on which arcs and clothoids turn upwards
            where they turn left in a plane.
        start
            The coordinates of the start in m: x and z, in space x, y and z; by default the origin. A curve with
            formulas that comes first has its own.
        heading
            The angle of the tangent at the start from the x axis, in radians; by default 0. In space it has up to three
            angles: that from the x axis as seen from above, that above the horizontal, and the roll to the left.
        closed
            Whether the rail ends where it began, in the same direction.
        roll
            In space, how the track is banked, so that states have the loads on a rider: "pieces", by the roll of the
            rail's frame; or what `Curve.space` takes, with formulas in the arc length s.
        heartline, parameters, title
            As in `Curve.space`.

        Returns
        -------
        Curve

        Raises
        ------
        DeclarationError
            If a piece is of another type, or has no ends. Whatever depends on parameters is checked at run time.

        Examples
        --------
        >>> from gqm_sym.declare.piecewise import arc, line
        >>> Curve.piecewise([line(length=2), arc(radius="R", angle="pi/2")]).parameters
        ('R',)
        """
        from gqm_sym.declare.piecewise import declare_rail

        refuse_others(more, "Curve.piecewise", ("pieces", "start", "heading", "closed"))
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
