"""The force law as data: the terms of one linear equation for W = V**2, which are added term by term.

With v the sign of ds/dt, F the applied force per unit mass, n0 = -F.n and N/m = kappa*W + n0 (section 2 of the notes
on the mathematics)::

    inertia * dW/ds = 2*(F.t - v*resistance - v*drag*W - v*friction*|N|/m + extra)
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import sympy as sp

from gqm_sym.arguments import checked, instance
from gqm_sym.dimensions import (
    ACCELERATION,
    LENGTH,
    NUMBER,
    SPEED_SQUARED,
    Dimension,
    Formulas,
    dimension,
    found_dimensions,
    unit_of,
)
from gqm_sym.dimensions import COMMON as COMMON_DIMENSIONS
from gqm_sym.errors import DeclarationError, renamed
from gqm_sym.expressions import read_expression
from gqm_sym.parameters import (
    COMMON,
    COORDINATES,
    Given,
    Measured,
    Value,
    check_measured,
    in_words,
    names_in_order,
    read_argument,
    read_parameters,
    refuse_out_of_range,
)

X = sp.Symbol("x", real=True)
Z = sp.Symbol("z", real=True)
"""The coordinates of the plane, as used in potentials."""
Y = sp.Symbol("ŷ", real=True)
"""The third coordinate, on space curves; in the plane it is 0, and a parameter may be called y there."""
W = sp.Symbol("W", real=True)
"""V**2, in laws that are not linear in it."""
DIRECTION = sp.Symbol("direction", real=True)
"""The sign of ds/dt."""
CONTACT_SIGN = sp.Symbol("contact_sign", real=True)
"""The sign of the contact force."""
MASS = sp.Symbol("m", real=True)
KAPPA = sp.Symbol("κ", real=True)
"""Signed curvature in a resistance. No parameter has this name, because parameters have ASCII names."""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Kernel:
    """A force law; ``first + second`` is the law with both forces (MATHS, section 2).

    Attributes
    ----------
    potential
        The potential energy per unit mass in m²/s², as a function of the coordinates ``x`` and ``z``, on space curves
        also of ``y``; the applied force is minus its gradient.
    inertia
        The factor of the acceleration: 1 for sliding, ``1 + beta`` for rolling.
    resistance
        The force per unit mass against the motion that does not depend on speed, in m/s², proportional to the curvature
        `KAPPA` or to its absolute value.
    drag
        The coefficient of V**2 in the force per unit mass against the motion, in 1/m.
    friction, static_friction
        The coefficients of sliding and of static friction.
    tangential_law
        The acceleration of `Kernel.law` in m/s², in the curve's parameter, the coordinates, `W` and `DIRECTION`.
    spin
        The angular velocity in rad/s of a frame that rotates about the z axis, whose Coriolis force acts sideways.
    radius
        The radius in m of a rolling body, whose centre is to the left of increasing λ (to the right if negative).
    static_friction_limit
        The names of the parameters beta and mu_static of a rolling body; None if its static friction is not given.
    train_length, cars
        The length in m of a train, whose mass is spread evenly along the track, and the number of its equal cars; 0
        for a body.
    terms
        The name and a description of every force in the sum.
    defaults
        The run-time parameters in order, each with its default or None.
    positive
        Names of parameters that must be positive.
    at_least
        Parameters with their lower bounds, each a number or another parameter.
    """

    terms: tuple[tuple[str, str], ...]
    potential: sp.Expr = field(default=sp.S.Zero)
    inertia: sp.Expr = field(default=sp.S.One)
    resistance: sp.Expr = field(default=sp.S.Zero)
    drag: sp.Expr = field(default=sp.S.Zero)
    friction: sp.Expr = field(default=sp.S.Zero)
    static_friction: sp.Expr = field(default=sp.S.Zero)
    tangential_law: sp.Expr = field(default=sp.S.Zero)
    spin: sp.Expr = field(default=sp.S.Zero)
    radius: sp.Expr = field(default=sp.S.Zero)
    train_length: sp.Expr = field(default=sp.S.Zero)
    cars: int = 0
    static_friction_limit: tuple[str, str] | None = None
    defaults: tuple[tuple[str, Value | None], ...] = ()
    positive: tuple[str, ...] = ()
    at_least: tuple[tuple[str, str], ...] = ()

    if not TYPE_CHECKING:
        __getattr__ = renamed({"extra": "tangential_law", "grip": "static_friction_limit"}, "a kernel")

    def __post_init__(self) -> None:
        refuse_out_of_range(dict(self.defaults), self.positive, self.at_least, where="kernel")
        if any(isinstance(value, Measured) for _, value in self.defaults):
            check_measured(dict(self.defaults), units_of(self), where="kernel", final=False)

    @classmethod
    @checked("Kernel.law")
    def law(
        cls,
        A: str | sp.Expr,
        *,
        parameters: Mapping[str, Given | None] | Iterable[str] | None = None,
    ) -> "Kernel":
        """Return a force law by its tangential acceleration.

        Parameters
        ----------
        A
            The acceleration in m/s² along increasing λ, as a function of the curve's parameter, the coordinates ``x``
            and ``z``, ``W`` = V**2 and ``direction`` = sgn(ds/dt); its other symbols are run-time parameters. It
            does not contribute to the contact force.
        parameters
            Defaults of these parameters in SI units, or their names in order.

        Returns
        -------
        Kernel

        Raises
        ------
        ExpressionError
            If the text is not an arithmetic expression.

        Examples
        --------
        >>> Kernel.law("-k*direction*sqrt(W)", parameters={"k": "0.3"}).defaults
        (('k', '0.3'),)
        """
        written = read_expression(A, where="law: A")
        known = (W.name, DIRECTION.name, "lam", *COORDINATES)
        found = tuple(name for name in names_in_order(written) if name not in known)
        return cls(
            terms=(("law", f"tangential acceleration {written}"),),
            tangential_law=written,
            defaults=read_parameters(parameters, found=found, where="law"),
        )

    def __repr__(self) -> str:
        return f"<{str(self).splitlines()[0]}: {', '.join(name for name, _ in self.terms)}>"

    def __str__(self) -> str:
        """Describe the law in a few lines: every force, and the units of its parameters."""
        loss = "conservative" if self.conservative else "dissipative"
        lines = [f"Force law, {loss}", *(f"  {name}: {text}" for name, text in self.terms)]
        return "\n".join([*lines, f"  parameters: {in_words(dict(self.defaults), units_of(self))}"])

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the run-time parameters, in order."""
        return tuple(name for name, _ in self.defaults)

    @property
    def conservative(self) -> bool:
        """Whether V**2 depends on the place alone."""
        return not any((self.resistance, self.drag, self.friction, self.tangential_law))

    def along(self, parameter: sp.Symbol, *, in_space: bool = False) -> "Kernel":
        """Return the law on a curve with this parameter, which a tangential law may contain.

        Parameters
        ----------
        parameter
            The name of the curve's parameter.
        in_space
            Whether the curve has three coordinates: then ``y`` is a coordinate too.

        Returns
        -------
        Kernel

        Raises
        ------
        DeclarationError
            If a parameter of the law with a default is called ``y`` on a space curve.
        """
        own = {parameter.name} if parameter in self.tangential_law.free_symbols else set()
        law = self
        if in_space and "y" in self.parameters:
            if dict(self.defaults)["y"] is not None:
                raise DeclarationError("kernel: 'y' is a coordinate on a space curve; give the parameter another name")
            own.add("y")
            third = {sp.Symbol("y", real=True): Y}
            forms = {name: getattr(self, name).xreplace(third) for name in ("potential", "tangential_law")}
            law = replace(self, **forms)
        return replace(law, defaults=tuple(pair for pair in self.defaults if pair[0] not in own)) if own else self

    def __add__(self, other: "Kernel") -> "Kernel":
        instance(other, Kernel, where="kernel: +", what="two kernels, as in Gravity() + CoulombFriction()")
        _refuse_clashes(self, other)
        known = dict(self.defaults)
        return Kernel(
            terms=self.terms + other.terms,
            potential=self.potential + other.potential,
            # If one kernel has 1 + beta and another has 1, the terms beyond 1 add up.
            inertia=self.inertia + other.inertia - 1,
            resistance=self.resistance + other.resistance,
            drag=self.drag + other.drag,
            friction=self.friction + other.friction,
            static_friction=self.static_friction + other.static_friction,
            tangential_law=self.tangential_law + other.tangential_law,
            spin=self.spin + other.spin,
            radius=self.radius + other.radius,
            train_length=self.train_length + other.train_length,
            cars=self.cars + other.cars,
            static_friction_limit=self.static_friction_limit or other.static_friction_limit,
            defaults=(*self.defaults, *(pair for pair in other.defaults if pair[0] not in known)),
            positive=tuple(dict.fromkeys(self.positive + other.positive)),
            at_least=tuple(dict.fromkeys(self.at_least + other.at_least)),
        )

    def __radd__(self, other: object) -> "Kernel":
        # Python's sum() begins with 0.
        if isinstance(other, int) and other == 0:
            return self
        return instance(other, Kernel, where="kernel: +", what="two kernels, as in Gravity() + CoulombFriction()")


def _refuse_clashes(first: Kernel, second: Kernel) -> None:
    names = {name for name, _ in first.terms}
    for name, _ in second.terms:
        if name in names and name in _AT_MOST_ONCE:
            raise DeclarationError(f"kernel: {name} is given twice; give it once")
        if {name, *names} >= _EXCLUSIVE and name in _EXCLUSIVE:
            raise DeclarationError(
                "kernel: rolling and coulomb exclude each other: a body that rolls without slipping does not slide; "
                "leave one of them out (rolling has mu_static, the friction that it needs)"
            )
    values = dict(first.defaults)
    for name, value in second.defaults:
        if name not in values:
            continue
        if name not in COMMON or value != values[name]:
            raise DeclarationError(
                f"kernel: the name {name!r} means one thing in "
                f"{' + '.join(term for term, _ in first.terms)} and another in "
                f"{' + '.join(term for term, _ in second.terms)}; give one of them another name, "
                f'as in {name}="{name}2"'
            )


# These forces act on a body as a whole, so that a second one is a mistake and not a sum.
_AT_MOST_ONCE = frozenset({"gravity", "rolling", "coulomb", "rotating_frame", "train"})
_EXCLUSIVE = frozenset({"rolling", "coulomb"})


# The dimensions of the parameters of the kernels, by their usual names.
UNITS = {
    "g": "m/s**2",
    "Omega": "rad/s",
    "k": "m**3/s**2",
    "beta": "1",
    "radius": "m",
    "length": "m",
    "mu": "1",
    "mu_static": "1",
    "b": "kg/m",
    "c": "kg/s",
    "gamma": "N/m",
    "ell_c": "m",
}


def kernel_formulas(kernel: Kernel) -> Formulas:
    """Return the formulas of a force law with their dimensions.

    Those of a resistance are omitted, because the printed form of surface tension takes its numbers in SI units.
    """
    fields = (
        (kernel.potential, SPEED_SQUARED),
        (kernel.tangential_law, ACCELERATION),
        (kernel.drag, dimension(metre=-1)),
    )
    numbers = ((kernel.friction, NUMBER), (kernel.static_friction, NUMBER), (kernel.inertia - 1, NUMBER))
    others = ((kernel.spin, dimension(second=-1)), (kernel.radius, LENGTH), (kernel.train_length, LENGTH))
    variables: dict[str, Dimension | None] = {symbol.name: LENGTH for symbol in (X, Y, Z)}
    variables[W.name] = SPEED_SQUARED
    return Formulas([*fields, *numbers, *others], {**variables, DIRECTION.name: NUMBER})


def units_of(kernel: Kernel) -> dict[str, str]:
    """Return the SI units of a force law's parameters, as far as its formulas and their roles determine them."""
    found = found_dimensions(kernel_formulas(kernel), COMMON_DIMENSIONS)
    return {**units_by_role(kernel), **{name: unit for name in found if (unit := unit_of(found[name]))}}


def units_by_role(kernel: Kernel) -> dict[str, str]:
    """Return the units of parameters that formulas alone do not determine, if they have their usual names."""
    droplet = any(name == "surface_tension" for name, _ in kernel.terms)
    return {name: UNITS[name] for name in ("gamma", "ell_c") if droplet and name in kernel.parameters}


def parameter(given: Given | None, name: str, *, where: str) -> tuple[sp.Symbol, tuple[str, Value | None]]:
    """Read a kernel's argument: another name for its parameter, a value for it, or nothing.

    The function returns the symbol for the law, and the pair of name and default.
    """
    called, default = read_argument(given, name, where=where)
    return sp.Symbol(called, real=True), (called, default)
