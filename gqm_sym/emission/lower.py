"""Conversion of a model's closed forms to functions as straight-line code."""

from sympy import Expr, Function

from gqm_sym.derivation import Model
from gqm_sym.derivation.algebra.bottom_up import with_replaced
from gqm_sym.derivation.algebra.difference import Differences
from gqm_sym.emission.batches import batch_functions, bounds_batch
from gqm_sym.emission.charts import chart_maker, potential_by_coordinates
from gqm_sym.emission.context import FORWARDS, Lowering
from gqm_sym.emission.dissipative import (
    chart_law,
    contact_products,
    speed_equation,
    speed_slope,
    squared_contact,
    static_balance,
    upright_along_chart,
    upright_force,
)
from gqm_sym.emission.ir import ExactIR, FunctionIR, ModuleIR
from gqm_sym.emission.load_map import load_map
from gqm_sym.emission.printer import check_emittable
from gqm_sym.emission.separated import separated_terms
from gqm_sym.emission.subscripts import at
from gqm_sym.emission.time_integrand import exact_axis_orbits
from gqm_sym.kernels.base import CONTACT_SIGN, DIRECTION, MASS, W

FLAGS = ("friction", "kinked", "linear")
"""The parts of a module for a force law that is not conservative."""


def lower(model: Model, *, name: str, forms: tuple[tuple[str, Expr], ...]) -> ModuleIR:
    """Return all functions of the module for ``model``."""
    _check(model)
    lowering = _ModelLowering(model)
    loss = model.dissipation
    if loss is None:
        functions = lowering.potentials()
        batch = (*load_map(lowering), *batch_functions(lowering))
    else:
        energy = lowering.effective_potential()
        law = (speed_equation(lowering, loss), *squared_contact(lowering, loss), static_balance(lowering, loss))
        functions, batch = (*law, energy), ()
    of_axes = exact_axis_orbits(lowering) if loss is None and not model.curve.charted else ()
    exact = (*lowering.exact(), *of_axes, *lowering.inertia(), *lowering.trigonometric_values())
    return ModuleIR(
        name=name,
        title=model.title,
        parameter=model.parameter.name,
        defaults=model.defaults,
        positive=model.positive,
        at_least=model.at_least,
        forms=forms,
        notes=model.notes,
        functions=(
            lowering.path_and_contact_force(),
            *lowering.path_in_space(),
            *lowering.rider_loads(),
            *functions,
        ),
        in_space=model.curve.in_space,
        banked=model.rider is not None,
        signed=not model.loads,
        sided=model.sided,
        directed=bool(model.coriolis),
        bounds=lowering.bounds(),
        batch=batch,
        bounds_batch=bounds_batch(lowering) if any(function.batch for function in batch) else None,
        exact=exact if model.curve.charted else (*exact, lowering.domain(), *lowering.axes()),
        monotone=model.symmetry is not None and model.symmetry.monotone and model.cusp is None,
        dissipation=() if loss is None else tuple((flag, getattr(loss, flag)) for flag in FLAGS),
        rolling_radius=str(model.force.radius) if model.force.radius else "",
        static_friction_limit=model.force.static_friction_limit,
        units=tuple(model.units.items()),
        chart=chart_maker(lowering),
        separated=separated_terms(lowering),
    )


def _check(model: Model) -> None:
    """Refuse a model with a form that cannot be written as text."""
    names = {model.parameter.name, *model.parameters}
    low, high = model.domain
    forms = {
        **{"x": model.x, "y": model.y, "z": model.z, "ds": model.ds, "kappa": model.kappa},
        **{"static_normal_load": model.static_normal_load, "inertia": model.inertia},
        **{"effective_potential": model.effective_potential},
        **{"effective_potential_slope": model.effective_potential_slope},
        **{"domain, low": low, "domain, high": high, "period": model.period},
    }
    if model.curve.in_space:
        labels = (f"contact force, {axis}" for axis in "xyz")
        vector = (part.xreplace(FORWARDS) for part in model.normal_force_vector_at(MASS))
        forms |= dict(zip(labels, vector, strict=True))
    loss = model.dissipation
    if model.rider is not None:
        felt = {DIRECTION.name, CONTACT_SIGN.name, W.name} | names
        for form in model.rider.forms:
            check_emittable(form, felt, where="what a rider feels")
    if loss is not None:
        names |= {DIRECTION.name, CONTACT_SIGN.name, W.name}
        laws = {"P": loss.drive, "Q": loss.decay, "A at rest": loss.holds[0], "A at rest, backwards": loss.holds[1]}
        forms |= {label: loss.along(form) for label, form in laws.items()}
    for label, form in forms.items():
        if form is not None:
            check_emittable(form, names, where=label)


class _ModelLowering(Lowering):
    """The functions that every conservative or dissipative module has."""

    def path_and_contact_force(self) -> FunctionIR:
        """Return the function for position, metric, curvature and contact force, given the speed squared."""
        model, v2 = self.model, self.names.symbol("v2")
        lam, places, speeds = self.place, self.names("places"), self.names("speeds")
        form = "|N|" if model.loads else "N = m*(kappa*V**2 + n0)"
        contact = self.contact(v2)
        return self.function(
            "path_and_contact_force",
            (places, speeds),
            f"x, z, ds/d{lam}, curvature kappa, contact force {form}, given V**2 (paper, eqs. 8, 15).",
            inside=[(lam, at(places)), (v2, at(speeds))],
            outputs=self.accurate((model.x, model.z, model.ds, contact.kappa, contact.size)),
        )

    def path_in_space(self) -> tuple[FunctionIR, ...]:
        """Return the function for the third coordinate of a space curve and the contact force as a vector; nothing for
        a planar curve.
        """
        model, v2 = self.model, self.names.symbol("v2")
        places, speeds, v = self.names("places"), self.names("speeds"), self.names.symbol("v")
        if not model.curve.in_space:
            return ()
        function = self.function(
            "path_in_space",
            (places, speeds, v),
            "y, and the contact force along x, y and z, given V**2 and the sign v = sgn(ds/dt).",
            inside=[(self.place, at(places)), (v2, at(speeds))],
            outputs=self.accurate((model.y, *self.contact(v2, v).vector)),
        )
        return (function,)

    def rider_loads(self) -> tuple[FunctionIR, ...]:
        """Return the function for the loads on a rider of a banked track, and its coordinates; nothing for a track that
        is not banked.
        """
        felt, model = self.model.rider, self.model
        if felt is None or model.curve.banking is None:
            return ()
        places, speeds, w = self.names("places"), self.names("speeds"), self.names.symbol("w")
        v, nu = self.names.symbol("v"), self.names.symbol("nu")
        symbols = {DIRECTION: v, CONTACT_SIGN: nu, W: w}
        height = model.curve.banking.heartline
        track = (axis - height * up for axis, up in zip((model.x, model.y, model.z), felt.up, strict=True))
        rows = (*felt.loads, *felt.onsets, *felt.roll, *track, felt.level)
        function = self.function(
            "rider_loads",
            (places, speeds, v, nu),
            "Loads on a rider, their rates, and roll and place of the track; v = sgn(ds/dt), nu = sgn(N).",
            inside=[(self.place, at(places)), (w, at(speeds))],
            outputs=self.accurate(with_replaced(rows, symbols)),
        )
        return (function,)

    def potentials(self) -> tuple[FunctionIR, ...]:
        """Return the functions for the effective potential and its divided differences."""
        return self.effective_potential(), self.potential_divdiff1(), self.potential_divdiff2()

    def effective_potential(self) -> FunctionIR:
        """Return the function for the effective potential and its slope."""
        lam, places = self.place, self.names("places")
        return self.function(
            "effective_potential",
            (places,),
            f"U per unit mass, V**2 = v0**2 - 2*(U({lam}) - U(lam0)), and dU/d{lam} (paper, eq. 13).",
            inside=[(lam, at(places))],
            outputs=(self.model.effective_potential, self.model.effective_potential_slope),
        )

    def potential_divdiff1(self) -> FunctionIR:
        """Return the function for the first divided difference of the effective potential from one place."""
        model, lam, y = self.model, self.place, self.measured
        a, d, start = (self.names.symbol(s) for s in ("a", "d", "start"))
        places, offsets = self.names("places"), self.names("offsets")
        low, offset = a, (d, at(offsets))
        inside = [(y, at(places)), offset]
        if model.origin:
            low, inside = start, [offset, (start, a - model.origin), (y, start + d)]
        differences = Differences(y, (low, y), {(0, 1): d})
        return self.function(
            "potential_divdiff1",
            (a, places, offsets),
            f"U[a, {lam}] = (U({lam}) - U(a))/({lam} - a) without cancellation, and ds/d{lam} (MATHS, s. 3).",
            inside=inside,
            outputs=(
                differences.first(self.from_origin(model.effective_potential), 0, 1),
                self.from_origin(model.ds),
            ),
        )

    def potential_divdiff2(self) -> FunctionIR:
        """Return the function for the second divided difference of the effective potential over two ends and a place
        between them.
        """
        model, lam, y = self.model, self.place, self.measured
        a, b, da, db = (self.names.symbol(s) for s in ("a", "b", "da", "db"))
        left, right = self.names("left"), self.names("right")
        low, high, moved = a, b, []
        if model.origin:
            low, high = self.names.symbol("low"), self.names.symbol("high")
            moved = [(low, a - model.origin), (high, b - model.origin)]
        differences = Differences(y, (low, y, high), {(0, 1): da, (1, 2): db, (0, 2): b - a})
        return self.function(
            "potential_divdiff2",
            (a, b, left, right),
            f"U[a, {lam}, b] = V**2/(2*({lam} - a)*(b - {lam})) from turn a to turn b, and ds/d{lam} (MATHS, s. 3).",
            inside=[
                (da, at(left)),
                (db, at(right)),
                *moved,
                (y, Function("place_from_ends")(low, high, da, db)),
            ],
            outputs=(
                differences.second(self.from_origin(model.effective_potential)),
                self.from_origin(model.ds),
            ),
        )

    def exact(self) -> tuple[ExactIR, ...]:
        """Return the formulas for extended precision and gradients; for a charted curve the potential in terms of
        coordinates.
        """
        model, loss = self.model, self.model.dissipation
        if model.curve.charted:
            return self.exact_potential() if loss is None else chart_law(self, loss)
        bend, load = "Signed curvature", "n0 = N/m of a body at rest, so that N = m*(kappa*V**2 + n0)"
        if model.loads:
            bend, load = "Curvature", "|N|/m of a body at rest"
        named: tuple[tuple[str, str, tuple[Expr, ...]], ...] = (
            ("x", "Horizontal coordinate.", (model.x,)),
            ("z", "Height.", (model.z,)),
            ("ds", f"ds/d{self.place}.", (model.ds,)),
            ("kappa", f"{bend} (paper, eq. 8).", (model.kappa,)),
            ("static_normal_load", f"{load} (paper, eq. 15).", (model.static_normal_load,)),
        )
        path, space = ([self.exact_function(*entry, (self.place,)) for entry in of] for of in (named, self._space()))
        if loss is not None:
            return (*path, speed_slope(self, loss), *space, *upright_force(self))
        potentials = (
            ("effective_potential", "U, so that V**2 + 2*U is constant (paper, eq. 13).", model.effective_potential),
            ("effective_potential_slope", f"dU/d{self.place}.", model.effective_potential_slope),
        )
        energy = (self.exact_function(name, doc, (form,), (self.place,)) for name, doc, form in potentials)
        return (*path, *energy, *space, *upright_force(self))

    def _space(self) -> tuple[tuple[str, str, tuple[Expr, ...]], ...]:
        """Return the additional formulas of a space curve, each with its name and description."""
        model = self.model
        if not model.curve.in_space:
            return ()
        return (("y", "Second horizontal coordinate.", (model.y,)), *contact_products(model))

    def exact_potential(self) -> tuple[ExactIR, ...]:
        """Return the effective potential and its gradient in terms of coordinates; nothing if it depends on more than
        these.
        """
        potential = self.by_coordinates(self.model.effective_potential)
        if self.place in potential.free_symbols:
            return ()
        return (*potential_by_coordinates(self, potential), *upright_along_chart(self))

    def domain(self) -> ExactIR:
        """Return the formula for the range of the curve's parameter."""
        curve = self.model.curve
        doc = "Both ends of the domain and the period; None for an open end or without a period."
        return self.constants("exact_domain", doc, (*curve.domain, curve.period))

    def inertia(self) -> tuple[ExactIR, ...]:
        """Return the formula for the factor 1 + beta of the inertia of a rolling body; nothing if it is 1."""
        doc = "1 + beta, so that the kinetic energy is m*(1 + beta)*V**2/2, and the potential energy m*(1 + beta)*U."
        return () if self.model.inertia == 1 else (self.constants("exact_inertia", doc, (self.model.inertia,)),)

    def axes(self) -> tuple[ExactIR, ...]:
        """Return the formula for places of symmetry, if there are any."""
        symmetry = self.model.symmetry
        if symmetry is None:
            return ()
        doc = "A place about which V**2 and ds are even, and the distance to the next (None if there is no other)."
        return (self.constants("exact_axes", doc, (symmetry.place, symmetry.step)),)
