"""The model: every closed form of a motion on a curve under a force law, as one frozen value."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import sympy as sp

from gqm_sym.declare import Curve
from gqm_sym.declare.measures import curve_formulas, parameter_dimension
from gqm_sym.derivation.forces.dissipation import Dissipation
from gqm_sym.derivation.forces.forces import Place, turned_force
from gqm_sym.derivation.forces.rider import Rider
from gqm_sym.derivation.geometry.geometry import cross
from gqm_sym.derivation.geometry.level_set import LevelSet
from gqm_sym.derivation.wells.symmetric_orbits import SymmetricOrbits
from gqm_sym.derivation.wells.symmetry import Symmetry
from gqm_sym.dimensions import COMMON, found_dimensions, unit_of
from gqm_sym.errors import renamed
from gqm_sym.expressions import read_expression
from gqm_sym.kernels.base import CONTACT_SIGN, DIRECTION, MASS, Kernel, W, kernel_formulas, units_by_role
from gqm_sym.parameters import Value, in_words

if TYPE_CHECKING:
    from gqm_sym.runtime.launch.equilibria import Equilibrium

# The largest number of characters of a closed form that a printed model shows.
MOST_SHOWN = 160
# Variables of integration, as text and as LaTeX.
_DASHES = (("_", "'"), ("__", "''"))


def _read_v2(given: Any) -> sp.Expr:
    """Return V² as an expression."""
    return given if isinstance(given, sp.Expr) else read_expression(given, where="v2")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Model:
    """Closed forms in the parameter λ, the launch (``lam0``, ``v0``) and run-time parameters.

    The geometry is that of MATHS, section 1. Forces and the contact force are in section 2 (paper, eq. 15), turning
    points in section 3, and the time in section 4 (paper, eq. 17).

    Attributes
    ----------
    curve, force
        The declarations from which the model was derived.
    title
        One line of text for readers.
    parameter, lam0, v0, mass
        The symbols of λ, of the place and the speed of launch, and of the mass.
    x, y, z
        Coordinates in m; y is 0 on planar curves.
    ds
        σ = ds/dλ ≥ 0, in m per unit of λ.
    dxds, dyds, dzds
        The components of the unit tangent.
    kappa
        The signed curvature in 1/m, positive to the left of increasing λ; its absolute value for a curve in no vertical
        plane.
    turning_rate, turning_angle
        dΘ/dλ, and Θ from ``lam0`` to λ in radians; ``|dt/dλ|`` and None for a curve in no vertical plane.
    cusp
        A smooth factor of σ that changes sign or vanishes at cusps; None without cusps.
    potential
        Φ, the potential energy per unit mass along the curve, in m²/s².
    inertia
        1 + β.
    effective_potential, effective_potential_slope
        U = Φ/inertia in m²/s², for which W + 2U is constant along a motion without losses, and dU/dλ.
    symmetry
        The places about which the effective potential and σ are even; None if none was found, or nothing repeats.
    symmetric_orbits
        The time of orbits about such a place as an integral without sines; None if there is no such form.
    static_normal_load
        n₀ in m/s², with N/m = κ W + n₀; its length for a curve in no vertical plane.
    normal
        The unit vector along which N is positive; empty for a curve in no vertical plane.
    curvature_binormal, loads
        The components of t × dt/ds and of -t × F for a curve in no vertical plane, with t × N/m =
        W·curvature_binormal + loads; otherwise empty.
    coriolis
        In a rotating frame the vector that ds/dt adds to that sum for such a curve, for each unit of ds/dt; otherwise
        empty.
    dissipation
        The terms of a force law that is not conservative; None for a conservative one.
    speed_squared
        W = V² in m²/s². In a dissipative model it holds on one leg, where ``direction`` is the sign of ds/dt and
        ``contact_sign`` that of N.
    speed_squared_form
        ``closed``, ``quadrature`` (W contains an Integral) or ``equation`` (W is an unknown function, because the law
        is not linear in W). If it is not closed, the forms below contain W as a symbol.
    normal_force
        N in N, positive along the normal to the left of increasing λ; ``|N|`` for a curve in no vertical plane.
    side_force
        The force in N out of the plane of a planar track that rotates; 0 for a track at rest, and in space.
    tangential_acceleration
        A in m/s², where dW/ds = 2 A; it contains ``W`` in a dissipative model.
    time_integrand
        dt/dλ = σ/√W, in s per unit of λ.
    regularised_integrand
        σ √((λ - λ₁)(λ₂ - λ)/W) between the turning points ``lam1`` and ``lam2``, which is finite.
    turning_point_equation, liftoff_equation
        W = 0 and N = 0; None for a contact force without a sign.
    liftoff_speed_squared
        v0² of the launch for which N = 0 at λ; None if W is not closed, or the curve is straight.
    defaults
        The run-time parameters in order, each with its default or None; g and m come last.
    positive
        Parameters that were assumed to be positive, which is checked at run time.
    at_least
        Parameters with their lower bounds, which are checked at run time.
    notes
        Remarks on forms that were not simplified, and on the form of V² in a dissipative model.
    level_set
        F of an implicit curve with its derivatives, tangent and curvature, as functions of x and z.
    sided
        Whether the sign of N, or of its component along the upward direction of riders on a banked space curve, shows
        on which side of the track a body is.
    upright
        n₀ and κ of that component, and in a rotating frame what it gains for each unit of ds/dt; empty for other curves
        (`derivation.forces.rider.upright_force`).
    rider
        The loads on a rider of a banked space curve; None for other curves.
    common_factor
        A factor of dx/dλ, dy/dλ and dz/dλ, whose zeros are the cusps.
    origin
        A number or run-time parameter c if the forms contain λ only as λ - c, apart from linear terms and the arguments
        of sines and cosines; otherwise 0.
    """

    curve: Curve
    force: Kernel
    title: str
    parameter: sp.Symbol
    lam0: sp.Symbol
    v0: sp.Symbol
    mass: sp.Symbol
    x: sp.Expr
    y: sp.Expr
    z: sp.Expr
    ds: sp.Expr
    dxds: sp.Expr
    dyds: sp.Expr
    dzds: sp.Expr
    kappa: sp.Expr
    turning_rate: sp.Expr
    turning_angle: sp.Expr | None
    cusp: sp.Expr | None
    potential: sp.Expr
    inertia: sp.Expr
    effective_potential: sp.Expr
    effective_potential_slope: sp.Expr
    symmetry: Symmetry | None
    symmetric_orbits: SymmetricOrbits | None
    static_normal_load: sp.Expr
    normal: tuple[sp.Expr, ...]
    curvature_binormal: tuple[sp.Expr, ...]
    loads: tuple[sp.Expr, ...]
    coriolis: tuple[sp.Expr, ...]
    dissipation: Dissipation | None
    speed_squared: sp.Expr
    speed_squared_form: str
    normal_force: sp.Expr
    side_force: sp.Expr
    tangential_acceleration: sp.Expr
    time_integrand: sp.Expr
    regularised_integrand: sp.Expr
    turning_point_equation: sp.Eq
    liftoff_equation: sp.Eq | None
    liftoff_speed_squared: sp.Expr | None
    defaults: tuple[tuple[str, Value | None], ...]
    positive: tuple[str, ...]
    at_least: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]
    level_set: LevelSet | None = None
    sided: bool = True
    upright: tuple[sp.Expr, ...] = ()
    rider: Rider | None = None
    common_factor: sp.Expr = sp.S.One
    origin: sp.Expr = sp.S.Zero

    if not TYPE_CHECKING:
        __getattr__ = renamed(
            {
                **{"climb": "2*effective_potential", "climb_slope": "2*effective_potential_slope"},
                **{"kernel": "tangential_acceleration", "reaction": "static_normal_load", "swing": "symmetric_orbits"},
                **{"bend": "curvature_binormal"},
            },
            "a model",
        )

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the run-time parameters, in order."""
        return tuple(name for name, _ in self.defaults)

    @property
    def domain(self) -> tuple[sp.Expr | None, sp.Expr | None]:
        """The two ends of the range of λ, each of which is None if it is open."""
        return self.curve.domain

    @property
    def period(self) -> sp.Expr | None:
        """The increase of λ in one lap of a closed curve; None on open curves."""
        return self.curve.period

    def normal_force_at(self, v2: sp.Expr) -> sp.Expr:
        """Return the contact force for a given value of V²: N, or ``|N|`` for a curve in no vertical plane.

        In a rotating frame in space it depends on ``direction``, the sign of ds/dt.

        Parameters
        ----------
        v2
            V² in m²/s², an expression.

        Returns
        -------
        sympy.Expr
            The contact force in N, ``m*(kappa*V**2 + n0)`` (paper, eq. 15, for any force; MATHS, section 2).
        """
        v2 = _read_v2(v2)
        if not self.loads:
            return MASS * (self.kappa * v2 + self.static_normal_load)
        return MASS * sp.sqrt(sp.Add(*(part**2 for part in self._turned_force(v2)))) / self.ds

    def normal_force_vector_at(self, v2: sp.Expr) -> Place:
        """Return the components of the contact force along x, y and z for a given value of V².

        Parameters
        ----------
        v2
            V² in m²/s², an expression.

        Returns
        -------
        tuple of sympy.Expr
            The three components in N.
        """
        v2 = _read_v2(v2)
        if self.loads:
            tangent = (self.ds * part for part in (self.dxds, self.dyds, self.dzds))
            along_x, along_y, along_z = cross(self._turned_force(v2), (*tangent,))
            scale = MASS / self.ds**2
            return scale * along_x, scale * along_y, scale * along_z
        force = self.normal_force_at(v2)
        along_x, along_y, along_z = (force * part for part in self.normal)
        return along_x, along_y, along_z

    def _turned_force(self, v2: sp.Expr) -> tuple[sp.Expr, ...]:
        """Return the vector ds/dλ t × N/m, in which the square root of ds/dλ often cancels."""
        binormal, loads, coriolis = (
            tuple(self.ds * part for part in parts) for parts in (self.curvature_binormal, self.loads, self.coriolis)
        )
        return turned_force(binormal, loads, coriolis, v2)

    @property
    def units(self) -> dict[str, str]:
        """SI units of the curve's parameter and of the run-time parameters, as far as the formulas determine them.

        Plain numbers and angles have the unit "1".
        """
        return units_of(self.curve, self.force)

    def closed_forms(self) -> tuple[tuple[str, sp.Basic], ...]:
        """Return the closed forms in the order in which they are printed, each with its label.

        In a dissipative model V² is written as the symbol W.
        """
        lam = self.parameter.name
        force, side, rate = self.normal_force, self.side_force, self.time_integrand
        turning, liftoff = self.turning_point_equation, self.liftoff_equation
        if self.dissipation is not None:
            force, rate = self.normal_force_at(W), self.ds / sp.sqrt(W)
            turning = sp.Eq(W, 0, evaluate=False)
            if liftoff is not None:
                liftoff = sp.Eq(self.kappa * W + self.static_normal_load, 0, evaluate=False)
            side = 0 if self.loads else 2 * self.mass * self.force.spin * DIRECTION * sp.sqrt(W) * self.dxds
        return (
            *(self.level_set.closed_forms() if self.level_set else ()),
            *self.curve.named(self.x, self.y, self.z),
            (f"ds/d{lam}", self.ds),
            *((f"d{name}/ds", form) for name, form in self.curve.named(self.dxds, self.dyds, self.dzds)),
            ("kappa", self.kappa),
            *((("Theta", self.turning_angle),) if self.turning_angle is not None else ()),
            ("V**2" if self.dissipation is None else "W = V**2", self.speed_squared),
            ("|N|" if self.loads else "N", force),
            *((("N_b", side),) if side else ()),
            ("A", self.tangential_acceleration),
            (f"dt/d{lam}", rate),
            ("turning points", turning),
            *((("liftoff", liftoff),) if liftoff is not None else ()),
        )

    def equilibria(self, *, between: Any = None, **parameters: Any) -> "tuple[Equilibrium, ...]":
        """Find the places at which a body at rest stays, their stability, and the frequency of small oscillations about
        them.

        Parameters
        ----------
        between
            The range of the curve parameter to search, a pair of numbers; by default the whole domain, or one period.
        parameters
            Run-time parameters, by name.

        Returns
        -------
        tuple of Equilibrium
            In ascending order, each with ``lam``, ``stable`` and ``frequency``: the angular frequency of small
            oscillations in rad/s. Friction, drag and resistance do not count.

        Raises
        ------
        InputError
            If a parameter is unknown or missing, or the range is not valid.
        SolutionError
            If the potential is constant, or there are too many equilibria to be listed.
        """
        from gqm_sym.building import transient

        found: tuple[Equilibrium, ...] = transient(self).equilibria(between=between, **parameters)
        return found

    def __repr__(self) -> str:
        return f"<{str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        """Describe the model in a few lines: its closed forms, and its parameters with their units."""
        said = {"kappa": " [1/m]", "V**2": " [m**2/s**2]", "W = V**2": " [m**2/s**2]", "A": " [m/s**2]"}
        said |= {"N": " [N]", "|N|": " [N]"}
        lines = [f"{self.title or 'Model'}: {self.curve.kind} curve, {', '.join(name for name, _ in self.force.terms)}"]
        for label, form in self.closed_forms():
            if label in said or label in ("x", "y", "z", f"ds/d{self.parameter.name}"):
                text = str(form)
                shown = text if len(text) <= MOST_SHOWN else text[: MOST_SHOWN - 3] + "..."
                lines.append(f"  {label}{said.get(label, '')} = {shown}")
        lines.append(f"  parameters: {in_words(dict(self.defaults), self.units)}")
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])

    def latex(self) -> str:
        """Return the closed forms as one aligned LaTeX block, without delimiters."""
        names = self._latex_names()
        lam = sp.latex(self.parameter, symbol_names=names)
        labels = {
            f"ds/d{self.parameter.name}": rf"\frac{{ds}}{{d{lam}}}",
            f"dt/d{self.parameter.name}": rf"\frac{{dt}}{{d{lam}}}",
            "dx/ds": r"\frac{dx}{ds}",
            "dy/ds": r"\frac{dy}{ds}",
            "dF/dx": r"\frac{\partial F}{\partial x}",
            "dF/dz": r"\frac{\partial F}{\partial z}",
            "d2F/dx2": r"\frac{\partial^{2} F}{\partial x^{2}}",
            "d2F/dxdz": r"\frac{\partial^{2} F}{\partial x \partial z}",
            "d2F/dz2": r"\frac{\partial^{2} F}{\partial z^{2}}",
            "dz/ds": r"\frac{dz}{ds}",
            "kappa": r"\kappa",
            "Theta": r"\Theta",
            "V**2": "V^{2}",
            "W = V**2": "W = V^{2}",
            "N_b": "N_{b}",
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
        # A parameter that already has an index keeps it: λ_{1} becomes λ_{1,0}.
        launch = f"{lam[:-1]},0}}" if lam.endswith("}") and "_{" in lam else f"{lam}_{{0}}"
        return {
            self.lam0: launch,
            self.v0: "V_{0}",
            DIRECTION: r"\left(\operatorname{sgn} V\right)",
            CONTACT_SIGN: r"\left(\operatorname{sgn} N\right)",
            **{sp.Symbol(f"{mark}{self.parameter.name}", real=True): f"{{{lam}{dash}}}" for mark, dash in _DASHES},
        }

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


def units_of(curve: Curve, kernel: Kernel) -> dict[str, str]:
    """Return the SI units of λ and of the run-time parameters, as far as the formulas determine them."""
    found = found_dimensions(curve_formulas(curve) + kernel_formulas(kernel), COMMON)
    units = {**units_by_role(kernel), **{name: unit for name in found if (unit := unit_of(found[name]))}}
    own = parameter_dimension(curve)
    names = dict.fromkeys((curve.parameter.name, *dict(curve.defaults), *dict(kernel.defaults), "g", "m"))
    known = units if own is None else {**units, curve.parameter.name: unit_of(own)}
    return {name: known[name] for name in names if name in known}
