"""The curves of the paper's Table 3, and space curves, by name: a table with one call for each row.

``families.ellipse(a=2, b="b_e")`` declares an ellipse whose semi-axis a is 2 unless another value is given at run time,
and whose semi-axis b is called ``b_e``. A new family takes a row here and one in ``tests/support/problems.py``.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import sympy as sp

from gqm_sym.arguments import checked, flag, nearest, short, unknown_argument
from gqm_sym.declare.curve import Curve
from gqm_sym.declare.declaration import Source, check_parameter_name
from gqm_sym.errors import ArgumentError, DeclarationError
from gqm_sym.expressions import read_expression
from gqm_sym.parameters import Given, Parameters, Value, read_argument


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """A row of the table.

    Attributes
    ----------
    arguments
        The run-time parameters by their usual names; all except those in ``signed`` are lengths.
    signed
        Arguments that may be negative.
    whole
        Whole numbers that shape the curve, each with its default.
    x, y, z, r
        Texts of the coordinates, or of the radius of a polar curve; only space curves have y.
    domain, period
        Texts, empty if there is none.
    """

    name: str
    title: str
    parameter: str
    arguments: tuple[str, ...]
    signed: tuple[str, ...] = ()
    whole: tuple[tuple[str, int], ...] = ()
    x: str = ""
    y: str = ""
    z: str = ""
    r: str = ""
    domain: tuple[str, str] | None = None
    period: str = ""
    note: str = ""

    def __call__(
        self,
        *unnamed: object,
        parameter: str | None = None,
        domain: Iterable[Source | None] | None = None,
        inverted: bool = False,
        **arguments: Given | None,
    ) -> Curve:
        """Declare a curve of this family.

        Parameters
        ----------
        unnamed
            Positional arguments, which are refused.
        parameter
            Another name for the curve's parameter.
        domain
            The two ends of the range of the parameter, if they differ from those of the family.
        inverted
            Whether to turn the curve upside down: z becomes -z.
        arguments
            For each argument of the family a value in SI units or another name; for a whole number its value.

        Returns
        -------
        Curve

        Raises
        ------
        ArgumentError
            If an argument is positional or unknown.
        DeclarationError
            If a name has two meanings, or a value is not allowed.
        """
        where = f"families.{self.name}"
        if unnamed:
            named = ", ".join(f"{n}={short(v)}" for n, v in zip(self.argument_names, unnamed, strict=False))
            raise ArgumentError(f"{where}: takes arguments by name only; write {where}({named})")
        for given in arguments:
            if given not in self.argument_names:
                names_here = (*self.argument_names, "parameter", "domain", "inverted")
                raise ArgumentError(unknown_argument(where, given, names_here))
        flag(inverted, where=f"{where}: inverted")
        called = self.parameter if parameter is None else check_parameter_name(parameter, where)
        names: dict[str, Value | None] = {}
        renamed = {_symbol(self.parameter): _symbol(called)}
        positive: list[str] = []
        for argument in self.arguments:
            name, value = read_argument(arguments.get(argument), argument, where=where)
            if name in names or name == called:
                raise DeclarationError(
                    f"{where}: the name {name!r} means two things; "
                    f'give one of them another name, as in {argument}="{argument}_2"'
                )
            names[name] = value
            renamed[_symbol(argument)] = _symbol(name)
            if argument not in self.signed:
                positive.append(name)

        whole = {_symbol(name): _whole(arguments.get(name), value, f"{where}: {name}") for name, value in self.whole}

        def read(text: str) -> sp.Expr:
            return read_expression(text, where=where).xreplace({**renamed, **whole})

        ends = domain
        if ends is None and self.domain is not None:
            ends = tuple(read(end) for end in self.domain)
        title = f"{self.title}, upside down" if inverted else self.title
        period = read(self.period) if self.period else None
        sign = -1 if inverted else 1
        if self.r and not inverted:
            return Curve.polar(
                read(self.r),
                parameter=called,
                domain=ends,
                period=period,
                parameters=names,
                title=title,
                positive=positive,
            )
        x, z = self.x, self.z
        if self.r:
            x = f"({self.r})*cos({self.parameter})"
            z = f"({self.r})*sin({self.parameter})"
        if x == self.parameter:
            return Curve.graph(
                sign * read(z),
                parameter=called,
                domain=ends,
                parameters=names,
                title=title,
                positive=positive,
            )
        if self.y:
            in_space = Curve.space(
                x=read(x),
                y=read(self.y),
                z=sign * read(z),
                parameter=called,
                domain=ends,
                period=period,
                parameters=names,
                title=title,
            )
            return replace(in_space, positive=tuple(positive))
        return Curve.parametric(
            x=read(x),
            z=sign * read(z),
            parameter=called,
            domain=ends,
            period=period,
            parameters=names,
            title=title,
            positive=positive,
        )

    @property
    def argument_names(self) -> tuple[str, ...]:
        """The names of the run-time parameters and of the whole numbers."""
        return (*self.arguments, *dict(self.whole))


def _whole(given: object, value: int, where: str) -> sp.Expr:
    """Read a whole number from 1 to `MAX_WHOLE`, which may be written as text."""
    number = value if given is None else read_expression(given, where=where)
    if not (number == int(number) if isinstance(number, int) else number.is_Integer) or not 1 <= number <= MAX_WHOLE:
        raise DeclarationError(f"{where}: must be a whole number from 1 to {MAX_WHOLE}, got {short(given)}")
    return sp.Integer(number)


# The largest whole number that shapes a curve; with more windings a derivation takes minutes.
MAX_WHOLE = 12


def _symbol(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)


FAMILIES: dict[str, Family] = {
    row.name: row
    for row in (
        Family(
            name="circle",
            title="Circle of radius L, angle from the downward vertical",
            parameter="theta",
            arguments=("L",),
            x="L*sin(theta)",
            z="-L*cos(theta)",
            period="2*pi",
            note="the pendulum; z = 0 at the centre",
        ),
        Family(
            name="ellipse",
            title="Ellipse with semi-axes a and b, eccentric angle",
            parameter="theta",
            arguments=("a", "b"),
            x="a*cos(theta)",
            z="b*sin(theta)",
            period="2*pi",
            note="z = 0 at the centre",
        ),
        Family(
            name="parabola",
            title="Parabola z = a*x**2",
            parameter="x",
            arguments=("a",),
            signed=("a",),
            x="x",
            z="a*x**2",
            note="a may be negative: then it is a hill",
        ),
        Family(
            name="log_spiral",
            title="Logarithmic spiral r = r0*exp(b*theta)",
            parameter="theta",
            arguments=("r0", "b"),
            signed=("b",),
            r="r0*exp(b*theta)",
            note="the pole is never reached",
        ),
        Family(
            name="catenary",
            title="Catenary z = c*cosh(x/c)",
            parameter="x",
            arguments=("c",),
            x="x",
            z="c*cosh(x/c)",
            note="z = c at the lowest point",
        ),
        Family(
            name="cycloid",
            title="Cycloid of a wheel of radius R",
            parameter="theta",
            arguments=("R",),
            x="R*(theta - sin(theta))",
            z="R*(1 - cos(theta))",
            domain=("0", "2*pi"),
            note="an arch between two cusps; inverted=True hangs it as the tautochrone",
        ),
        Family(
            name="helix",
            title="Helix of radius R that rises by c for each radian",
            parameter="theta",
            arguments=("R", "c"),
            signed=("c",),
            x="R*cos(theta)",
            y="R*sin(theta)",
            z="c*theta",
            note="a space curve; theta grows counter-clockwise as seen from above",
        ),
        Family(
            name="conical_helix",
            title="Conical helix that widens by a and rises by c for each radian",
            parameter="theta",
            arguments=("a", "c"),
            signed=("c",),
            x="a*theta*cos(theta)",
            y="a*theta*sin(theta)",
            z="c*theta",
            note="a space curve on a cone whose tip is at the origin",
        ),
        Family(
            name="torus_knot",
            title="Torus knot on a ring of radius R and a tube of radius r",
            parameter="theta",
            arguments=("R", "r"),
            whole=(("p", 2), ("q", 3)),
            x="(R + r*cos(q*theta))*cos(p*theta)",
            y="(R + r*cos(q*theta))*sin(p*theta)",
            z="r*sin(q*theta)",
            note="a space curve, p times round the z axis and q times round the tube; R > r",
        ),
        Family(
            name="viviani",
            title="Viviani's curve on a sphere of radius 2*a",
            parameter="theta",
            arguments=("a",),
            x="a*(1 + cos(theta))",
            y="a*sin(theta)",
            z="2*a*sin(theta/2)",
            note="a space curve where a sphere about the origin meets an upright cylinder of half its radius",
        ),
    )
}


@checked("families.cartesian_graph")
def cartesian_graph(
    phi: Source,
    *,
    parameter: str = "x",
    domain: Iterable[Source | None] | None = None,
    parameters: Parameters | None = None,
) -> Curve:
    """Declare the graph ``z = phi(x)``: `Curve.graph` under the name of the paper's Table 3.

    Parameters
    ----------
    phi
        The height in m, as text or a SymPy expression.
    parameter, domain, parameters
        As in `Curve.graph`, whose errors are raised too.

    Returns
    -------
    Curve
    """
    return Curve.graph(phi, parameter=parameter, domain=domain, parameters=parameters)


@checked("families.implicit")
def implicit(
    F: Source,
    *,
    start: Iterable[Source],
    tangent: int = 1,
    parameter: str = "s",
    domain: Iterable[Source | None] | None = None,
    parameters: Parameters | None = None,
) -> Curve:
    """Declare the curve ``F(x, z) = 0``: `Curve.implicit` under the name of the paper's Table 3.

    Parameters
    ----------
    F, start, tangent, parameter, domain, parameters
        As in `Curve.implicit`, whose errors are raised too.

    Returns
    -------
    Curve
    """
    return Curve.implicit(F, start=start, tangent=tangent, parameter=parameter, domain=domain, parameters=parameters)


def names() -> tuple[str, ...]:
    """Return the names of all families."""
    return ("cartesian_graph", *FAMILIES, "implicit")


def __getattr__(name: str) -> Callable[..., Curve]:
    try:
        return FAMILIES[name]
    except KeyError:
        near = nearest(name, names())
        hint = f"did you mean {near}? " if near else ""
        raise AttributeError(f"there is no family {name!r}; {hint}known are {', '.join(names())}") from None


def __dir__() -> list[str]:
    return sorted({*globals(), *FAMILIES})
