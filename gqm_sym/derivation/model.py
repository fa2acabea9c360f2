"""The model: every closed form of a motion on a curve under a force law, as one frozen value."""

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from gqm_sym.declare import Curve
from gqm_sym.derivation.forces import forces
from gqm_sym.derivation.geometry import geometry
from gqm_sym.derivation.reality import check_somewhere_real
from gqm_sym.derivation.rewrite import check_real, tidy, without_poles
from gqm_sym.errors import DeclarationError
from gqm_sym.kernels.base import Kernel
from gqm_sym.parameters import COMMON, COMMON_DEFAULTS, Given, Value, is_positive, read_value

LAM0 = sp.Symbol("lam0", real=True)
V0 = sp.Symbol("v0", real=True)
LAM1 = sp.Symbol("lam1", real=True)
LAM2 = sp.Symbol("lam2", real=True)
MASS = sp.Symbol("m", real=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """Closed forms in the parameter λ, the launch (``lam0``, ``v0``) and run-time parameters.

    Attributes
    ----------
    curve, force
        What it was derived from.
    title
        One line for people.
    parameter, lam0, v0, mass
        The symbols of λ, of the launch and of the mass.
    x, z
        Coordinates.
    ds, dxds, dzds
        σ = ds/dλ ≥ 0 and the components of the unit tangent.
    kappa
        Signed curvature, positive to the left of growing λ.
    turning_rate, turning_angle
        dΘ/dλ, and Θ from ``lam0`` to λ.
    cusp
        A smooth factor of σ that changes sign or vanishes at the cusps; None without cusps.
    potential, inertia
        Φ per unit mass along the curve, and 1 + β.
    climb, climb_slope
        2Φ/inertia, so that W + climb is constant along a motion, and its derivative by λ.
    reaction
        n₀ with N/m = κ W + n₀.
    speed_squared
        W = V².
    normal_force
        N, positive along the normal to the left of growing λ.
    kernel
        Tangential acceleration A, so that dW/ds = 2 A.
    time_integrand
        dt/dλ = σ/√W.
    regularised_integrand
        σ √((λ - λ₁)(λ₂ - λ)/W) between turning points ``lam1`` and ``lam2``: it stays finite.
    turning_point_equation, liftoff_equation
        W = 0 and N = 0.
    defaults
        Run-time parameters in order, each with its default or None; g and m come last.
    positive
        Parameters that were taken to be positive, which is checked at run time.
    notes
        What was left unsimplified, and why.
    """

    curve: Curve
    force: Kernel
    title: str
    parameter: sp.Symbol
    lam0: sp.Symbol
    v0: sp.Symbol
    mass: sp.Symbol
    x: sp.Expr
    z: sp.Expr
    ds: sp.Expr
    dxds: sp.Expr
    dzds: sp.Expr
    kappa: sp.Expr
    turning_rate: sp.Expr
    turning_angle: sp.Expr
    cusp: sp.Expr | None
    potential: sp.Expr
    inertia: sp.Expr
    climb: sp.Expr
    climb_slope: sp.Expr
    reaction: sp.Expr
    speed_squared: sp.Expr
    normal_force: sp.Expr
    kernel: sp.Expr
    time_integrand: sp.Expr
    regularised_integrand: sp.Expr
    turning_point_equation: sp.Eq
    liftoff_equation: sp.Eq
    defaults: tuple[tuple[str, Value | None], ...]
    positive: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the run-time parameters, in order."""
        return tuple(name for name, _ in self.defaults)

    @property
    def domain(self) -> tuple[sp.Expr | None, sp.Expr | None]:
        """Ends of the parameter's range; None where it is open."""
        return self.curve.domain

    @property
    def period(self) -> sp.Expr | None:
        """The parameter period of a closed curve."""
        return self.curve.period

    @property
    def kernel_acceleration(self) -> sp.Expr:
        """The tangential acceleration A; the same as ``kernel``."""
        return self.kernel

    def closed_forms(self) -> tuple[tuple[str, sp.Basic], ...]:
        """Return the forms for people, in the order to print them, each with its label."""
        lam = self.parameter.name
        return (
            ("x", self.x),
            ("z", self.z),
            (f"ds/d{lam}", self.ds),
            ("dx/ds", self.dxds),
            ("dz/ds", self.dzds),
            ("kappa", self.kappa),
            ("Theta", self.turning_angle),
            ("V**2", self.speed_squared),
            ("N", self.normal_force),
            ("A", self.kernel),
            (f"dt/d{lam}", self.time_integrand),
            ("turning points", self.turning_point_equation),
            ("liftoff", self.liftoff_equation),
        )

    def latex(self) -> str:
        """Return the closed forms as one aligned LaTeX block, without delimiters."""
        names = self._latex_names()
        lam = sp.latex(self.parameter, symbol_names=names)
        labels = {
            f"ds/d{self.parameter.name}": rf"\frac{{ds}}{{d{lam}}}",
            f"dt/d{self.parameter.name}": rf"\frac{{dt}}{{d{lam}}}",
            "dx/ds": r"\frac{dx}{ds}",
            "dz/ds": r"\frac{dz}{ds}",
            "kappa": r"\kappa",
            "Theta": r"\Theta",
            "V**2": "V^{2}",
            "turning points": "",
            "liftoff": "",
        }
        rows = []
        for label, form in self.closed_forms():
            left = labels.get(label, label)
            right = sp.latex(form, symbol_names=names)
            if isinstance(form, sp.Equality):
                left = sp.latex(form.lhs, symbol_names=names)
                right = rf"{sp.latex(form.rhs, symbol_names=names)} \qquad\text{{({label})}}"
            rows.append(f"{left} &= {right}")
        body = " \\\\\n".join(rows)
        return f"\\begin{{aligned}}\n{body}\n\\end{{aligned}}"

    def _latex_names(self) -> dict[sp.Symbol, str]:
        lam = sp.latex(self.parameter)
        # A parameter that carries an index already keeps it: λ_{1} becomes λ_{1,0}.
        indexed = f"{lam[:-1]},%d}}" if lam.endswith("}") and "_{" in lam else f"{lam}_{{%d}}"
        return {
            self.lam0: indexed % 0,
            LAM1: indexed % 1,
            LAM2: indexed % 2,
            self.v0: "V_{0}",
        }

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


def derive(
    curve: Curve,
    kernel: Kernel,
    *,
    parameters: Mapping[str, Given | None] | None = None,
    title: str | None = None,
) -> Model:
    """Derive every closed form of a motion on ``curve`` under ``kernel``.

    Parameters
    ----------
    curve, kernel
        The declarations.
    parameters
        Defaults that replace those of the declarations; None means: to be given at run time.
    title
        One line for people; that of the curve if nothing is said.

    Raises
    ------
    DeclarationError
        If a name means two things, a default belongs to no parameter, or a form is nowhere real.
    DerivationError
        If a closed form is not real and finite.
    """
    defaults = _join(curve, kernel, parameters or {})
    values = dict(defaults)
    shape = geometry(curve, may_be_positive=tuple(name for name in values if is_positive(values[name])))
    x, z = without_poles(curve.x), without_poles(curve.z)
    law = forces(x, z, kernel, shape)
    lam = curve.parameter
    start = {lam: LAM0}
    speed_squared = V0**2 + tidy(law.climb.xreplace(start) - law.climb)
    pressure = shape.kappa * speed_squared + law.reaction
    model = Model(
        curve=curve,
        force=kernel,
        title=curve.title if title is None else title,
        parameter=lam,
        lam0=LAM0,
        v0=V0,
        mass=MASS,
        x=x,
        z=z,
        ds=shape.ds,
        dxds=shape.dxds,
        dzds=shape.dzds,
        kappa=shape.kappa,
        turning_rate=shape.turning_rate,
        turning_angle=shape.angle - shape.angle.xreplace(start),
        cusp=shape.cusp,
        potential=law.potential,
        inertia=kernel.inertia,
        climb=law.climb,
        climb_slope=law.climb_slope,
        reaction=law.reaction,
        speed_squared=speed_squared,
        normal_force=MASS * pressure,
        kernel=law.acceleration,
        time_integrand=shape.ds / sp.sqrt(speed_squared),
        regularised_integrand=shape.ds * sp.sqrt((lam - LAM1) * (LAM2 - lam) / speed_squared),
        turning_point_equation=sp.Eq(speed_squared, 0, evaluate=False),
        liftoff_equation=sp.Eq(pressure, 0, evaluate=False),
        defaults=defaults,
        positive=shape.positive,
        notes=shape.notes,
    )
    for label, form in model.closed_forms():
        check_real(form, where=label)
    tried = (("x", x), ("z", z), (f"ds/d{lam.name}", shape.ds), ("potential", law.potential))
    check_somewhere_real(tried, lam, curve.domain, values)
    return model


def _join(curve: Curve, kernel: Kernel, given: Mapping[str, Given | None]) -> tuple[tuple[str, Value | None], ...]:
    """Join the parameters of curve and kernel, g and m last."""
    own, forced = dict(curve.defaults), dict(kernel.defaults)
    lam = curve.parameter.name
    if lam in forced:
        raise DeclarationError(
            f"derive: {lam!r} is the curve's parameter and a parameter of the kernel; give one of them another name"
        )
    for name in own.keys() & forced.keys():
        if name not in COMMON:
            raise DeclarationError(
                f"derive: the name {name!r} means one thing in the curve and another in the "
                f'kernel; give one of them another name, as in {name}="{name}2"'
            )
    if lam in COMMON:
        raise DeclarationError(
            f"derive: {lam!r} means {'gravity' if lam == 'g' else 'mass'} everywhere; "
            "give the curve's parameter another name"
        )
    values: dict[str, Value | None] = {**own, **forced}
    values.setdefault("m", COMMON_DEFAULTS["m"])
    order = [name for name in values if name not in COMMON]
    order += [name for name in COMMON if name in values]
    for name, value in given.items():
        if name not in values:
            raise DeclarationError(
                f"derive: parameters: {name!r} is no parameter of this curve and kernel; they have {', '.join(order)}"
            )
        values[name] = None if value is None else read_value(value, where=f"parameters: {name}")
    _refuse_negative(curve, kernel, values)
    return tuple((name, values[name]) for name in order)


def _refuse_negative(curve: Curve, kernel: Kernel, values: Mapping[str, Value | None]) -> None:
    for name in (*curve.positive, *kernel.positive, "m"):
        if not is_positive(values[name]):
            raise DeclarationError(f"derive: parameters: {name!r} must be positive, got {values[name]}")
