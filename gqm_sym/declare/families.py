"""The curves of the paper's Table 3 by name: a table, and one call for each of its rows.

``families.ellipse(a=2, b="b_e")`` declares an ellipse whose semi-axis a is 2 unless another value
is given at run time, and whose b is called ``b_e``. A new family is a row here and one in
``tests/support/problems.py``.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import sympy as sp

from gqm_sym.arguments import checked, flag, nearest, short, unknown_argument
from gqm_sym.declare.curve import Curve, Source, check_parameter_name
from gqm_sym.errors import ArgumentError, DeclarationError
from gqm_sym.expressions import read_expression
from gqm_sym.parameters import Given, Parameters, Value, read_argument


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """A row of the table.

    Attributes
    ----------
    arguments
        The run-time parameters by their usual names; all but those in ``signed`` are lengths.
    signed
        Arguments that may be negative.
    x, z, r
        Texts of the coordinates, or of the radius of a polar curve.
    domain, period
        Texts, empty where there is none.
    """

    name: str
    title: str
    parameter: str
    arguments: tuple[str, ...]
    signed: tuple[str, ...] = ()
    x: str = ""
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
        parameter
            Another name for the curve's parameter.
        domain
            Another range of the parameter than the family's own.
        inverted
            Turn the curve upside down: z becomes -z.
        arguments
            For each argument of the family another name or a value.
        """
        where = f"families.{self.name}"
        if unnamed:
            named = ", ".join(f"{n}={short(v)}" for n, v in zip(self.arguments, unnamed, strict=False))
            raise ArgumentError(f"{where}: takes arguments by name only; write {where}({named})")
        for given in arguments:
            if given not in self.arguments:
                names_here = (*self.arguments, "parameter", "domain", "inverted")
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

        def read(text: str) -> sp.Expr:
            return read_expression(text, where=where).xreplace(renamed)

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
    """Declare the graph ``z = phi(x)``; the same as `Curve.graph`, by the paper's name."""
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
    """Declare the curve ``F(x, z) = 0``; the same as `Curve.implicit`, by the paper's name."""
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
