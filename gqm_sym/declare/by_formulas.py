"""Curves that are declared by formulas: graphs, both coordinates, a radius, and three coordinates in space."""

from collections.abc import Iterable, Mapping
from typing import Any, Self, TypedDict, Unpack

import sympy as sp

from gqm_sym.arguments import checked, unknown_argument
from gqm_sym.declare.banking import read_banking
from gqm_sym.declare.declaration import Declaration, Source, declare, parameter_symbol
from gqm_sym.errors import ArgumentError
from gqm_sym.expressions import read_expression
from gqm_sym.parameters import Parameters


class SpaceOptions(TypedDict, total=False):
    """Less common arguments of `Curve.space`, `Curve.sampled` and `Curve.piecewise`, which describe them."""

    roll: Any
    heartline: Source
    parameters: Parameters | None
    title: str


def refuse_others(given: Mapping[str, Any], called: str, known: tuple[str, ...]) -> None:
    """Refuse arguments that are not among the known ones, nor among `SpaceOptions`."""
    if strangers := given.keys() - SpaceOptions.__annotations__.keys():
        raise ArgumentError(unknown_argument(called, min(strangers), (*known, *SpaceOptions.__annotations__)))


class ByFormulas(Declaration):
    """The constructors of `Curve` that take formulas of the coordinates."""

    __slots__ = ()

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
    ) -> Self:
        """Declare the graph ``z = z(x)`` (paper, Table 3).

        Parameters
        ----------
        z
            The height in m, as text or a SymPy expression.
        parameter
            The name of the curve's parameter λ.
        domain
            The two ends of the range of λ: numbers or expressions in run-time parameters, or None for an open end.
        parameters
            Defaults of run-time parameters in SI units, or their names in order; None for a value that is given at run
            time. Every other symbol becomes a run-time parameter without a default.
        title
            One line of text for readers.
        positive
            Names of run-time parameters that must be positive.

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
        >>> from gqm_sym import Curve
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
    ) -> Self:
        """Declare a planar curve by both coordinates as functions of a parameter.

        Parameters
        ----------
        x, z
            The horizontal coordinate and the height in m, as text or SymPy expressions.
        period
            The increase of λ in one lap of a closed curve. Without it and without ``domain`` the curve is closed if its
            coordinates consist of sines and cosines of commensurate angles.
        parameter, domain, parameters, title, positive
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
        >>> from gqm_sym import Curve
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
    ) -> Self:
        """Declare a curve by its radius ``r(θ)``, where θ is measured from the positive x axis.

        Parameters
        ----------
        r
            The radius in m, as text or a SymPy expression; it may be negative.
        period
            The increase of λ in one lap of a closed curve. Without it and without ``domain`` the curve is closed if its
            coordinates consist of sines and cosines of commensurate angles.
        parameter, domain, parameters, title, positive
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
        """
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
    ) -> Self:
        """Declare a curve in space by its three coordinates; z is up.

        The contact force of a space curve is a vector, and ``normal_force`` is its length; on a curve in a vertical
        plane ``normal_force`` has the same sign as on planar curves.

        Parameters
        ----------
        x, y, z
            The coordinates in m, as text or SymPy expressions.
        parameter, domain, parameters, title
            As in `Curve.graph`.
        period
            The increase of λ in one lap of a closed curve. Without it and without ``domain`` the curve is closed if its
            coordinates consist of sines and cosines of commensurate angles.
        roll
            How the track is banked, so that states have the loads on a rider: a roll angle in radians, positive to the
            left; "coordinated", without lateral force at the speed of the motion; or ("coordinated", v), without
            lateral force at the speed v. The angle is measured from the horizontal, and is undefined where the tangent
            is vertical; on a curve in a vertical plane it is measured from the normal of that plane along which the
            contact force is positive. None, the default, is a track that is not banked.
        heartline
            The height in m of the declared curve, which riders follow, above the track; by default 0.

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
        >>> from gqm_sym import Curve
        >>> Curve.space(x="R*cos(u)", y="R*sin(u)", z="c*u", parameter="u").parameters
        ('R', 'c')
        """
        refuse_others(more, "Curve.space", ("x", "y", "z", "parameter", "period", "domain"))
        symbol, title = parameter_symbol(parameter, "space"), more.get("title", "")
        at = {name: read_expression(form, where=f"space: {name}") for name, form in (("x", x), ("y", y), ("z", z))}
        banking = read_banking(more.get("roll"), more.get("heartline", 0))
        forms = cls(kind="space", **at, parameter=symbol, title=title, banking=banking)
        return declare(forms, domain, more.get("parameters"), (), period)
