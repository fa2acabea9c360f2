"""From a model's closed forms to functions as straight-line code."""

from sympy import Expr, Function, Symbol

from gqm_sym.derivation import Model
from gqm_sym.derivation.algebra.difference import Differences
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.emission.charts import chart_maker
from gqm_sym.emission.context import Lowering
from gqm_sym.emission.dissipative import drive, hold
from gqm_sym.emission.each import bounds_each, each
from gqm_sym.emission.ir import ExactIR, FunctionIR, ModuleIR
from gqm_sym.emission.loads import loads
from gqm_sym.emission.printer import check_emittable
from gqm_sym.emission.subscripts import at
from gqm_sym.kernels.base import CONTACT_SIGN, DIRECTION, W
from gqm_sym.sympy_charts import chart_x, chart_z

FLAGS = ("friction", "kinked", "linear")
"""What a module says of a force law that is not conservative."""


def lower(model: Model, *, name: str, forms: tuple[tuple[str, Expr], ...]) -> ModuleIR:
    """All functions of the module for ``model``."""
    _check(model)
    lowering = _ModelLowering(model)
    loss = model.dissipation
    if loss is None:
        functions: tuple[FunctionIR, ...] = (*loads(lowering), lowering.climb(), lowering.rise(), lowering.bend())
        many = each(lowering)
    else:
        functions, many = (drive(lowering, loss), hold(lowering, loss)), ()
    exact = lowering.exact() if loss is None else ()
    return ModuleIR(
        name=name,
        title=model.title,
        parameter=model.parameter.name,
        defaults=model.defaults,
        positive=model.positive,
        at_least=model.at_least,
        forms=forms,
        notes=model.notes,
        functions=(lowering.frame(), *functions, *many),
        bounds=lowering.bounds() if loss is None else None,
        bounds_each=bounds_each(lowering) if many else None,
        exact=exact if model.curve.charted else (*exact, lowering.domain(), *lowering.axes()),
        monotone=model.symmetry is not None and model.symmetry.monotone and model.cusp is None,
        dissipation=() if loss is None else tuple((flag, getattr(loss, flag)) for flag in FLAGS),
        body=str(model.force.radius) if model.force.radius else "",
        grip=model.force.grip,
        chart=chart_maker(lowering),
    )


def _check(model: Model) -> None:
    """Refuse a model with a form that has no text."""
    names = {model.parameter.name, *model.parameters}
    low, high = model.domain
    forms = {
        **{"x": model.x, "z": model.z, "ds": model.ds, "kappa": model.kappa, "reaction": model.reaction},
        **{"domain, low": low, "domain, high": high, "period": model.period},
    }
    loss = model.dissipation
    if loss is None:
        forms |= {"climb": model.climb, "climb_slope": model.climb_slope}
    else:
        names |= {DIRECTION.name, CONTACT_SIGN.name, W.name}
        laws = {"P": loss.drive, "Q": loss.decay, "A at rest": loss.holds[0], "A at rest, backwards": loss.holds[1]}
        forms |= {label: loss.along(form) for label, form in laws.items()}
    for label, form in forms.items():
        if form is not None:
            check_emittable(form, names, where=label)


class _ModelLowering(Lowering):
    """The functions that every conservative or dissipative module has."""

    def frame(self) -> FunctionIR:
        """Position, metric, curvature and contact force, given the speed squared."""
        model, v2 = self.model, self.names.symbol("v2")
        force = Symbol("m", real=True) * (model.kappa * v2 + model.reaction)
        places, speeds = self.names("places"), self.names("speeds")
        return self.function(
            "frame",
            "FRAME",
            (places, speeds),
            "x, z, ds/d{0}, signed curvature and contact force, given V**2 (paper, eq. 15).",
            views=((places, self.names("n")), (speeds, self.names("n"))),
            inside=[(self.place, at(places)), (v2, at(speeds))],
            outputs=(model.x, model.z, model.ds, model.kappa, force),
        )

    def climb(self) -> FunctionIR:
        """The climb and its slope."""
        places = self.names("places")
        return self.function(
            "climb",
            "CLIMB",
            (places,),
            "What V**2 loses in climbing to {0}, up to a constant, and its derivative (paper, eq. 13).",
            views=((places, self.names("n")),),
            inside=[(self.place, at(places))],
            outputs=(self.model.climb, self.model.climb_slope),
        )

    def rise(self) -> FunctionIR:
        """First divided difference of the climb, from one place."""
        a, d = self.names.symbol("a"), self.names.symbol("d")
        places, offsets = self.names("places"), self.names("offsets")
        differences = Differences(self.place, (a, self.place), {(0, 1): d})
        return self.function(
            "rise",
            "RISE",
            (a.name, places, offsets),
            "climb[a, {0}] = (climb({0}) - climb(a))/({0} - a) without cancellation, and ds/d{0}.",
            views=((places, self.names("n")), (offsets, self.names("n"))),
            inside=[(self.place, at(places)), (d, at(offsets))],
            outputs=(differences.first(self.model.climb, 0, 1), self.model.ds),
        )

    def bend(self) -> FunctionIR:
        """Second divided difference of the climb, over two ends and a place between."""
        a, b, da, db = (self.names.symbol(s) for s in ("a", "b", "da", "db"))
        left, right = self.names("left"), self.names("right")
        differences = Differences(self.place, (a, self.place, b), {(0, 1): da, (1, 2): db, (0, 2): b - a})
        return self.function(
            "bend",
            "BEND",
            (a.name, b.name, left, right),
            "climb[a, {0}, b] = V**2/(({0} - a)*(b - {0})) between turning points, without cancellation, and ds/d{0}.",
            views=((left, self.names("n")), (right, self.names("n"))),
            inside=[
                (da, at(left)),
                (db, at(right)),
                (self.place, Function("nearest")(a, b, da, db)),
            ],
            outputs=(differences.second(self.model.climb), self.model.ds),
        )

    def exact(self) -> tuple[ExactIR, ...]:
        """The formulas that extended precision needs; of a charted curve the forces' alone, by coordinates."""
        model = self.model
        if model.curve.charted:
            return self.exact_climb()
        named: tuple[tuple[str, str, tuple[Expr, ...]], ...] = (
            ("x", "Horizontal coordinate.", (model.x,)),
            ("z", "Height.", (model.z,)),
            ("ds", f"ds/d{self.place}.", (model.ds,)),
            ("kappa", "Signed curvature.", (model.kappa,)),
            ("reaction", "Contact force per unit mass of a body at rest.", (model.reaction,)),
            ("climb", "What V**2 loses in climbing, up to a constant.", (model.climb,)),
            ("climb_slope", f"Its derivative by {self.place}.", (model.climb_slope,)),
        )
        return tuple(self.exact_function(*entry, (self.place,)) for entry in named)

    def exact_climb(self) -> tuple[ExactIR, ...]:
        """The climb and its gradient by coordinates; nothing where it depends on more than those."""
        x, z = self.names.symbol("x"), self.names.symbol("z")
        climb = self.model.climb.xreplace({chart_x(self.place): x, chart_z(self.place): z})
        if self.place in climb.free_symbols or self.model.ds != 1:
            return ()
        outputs = (climb, differentiate(climb, x), differentiate(climb, z))
        doc = "What V**2 loses in climbing, up to a constant, and its derivatives by x and z."
        return (self.exact_function("climb", doc, outputs, (x, z)),)

    def domain(self) -> ExactIR:
        """The range of the curve's parameter."""
        curve = self.model.curve
        doc = "Both ends of the domain, and the period; None where there is none."
        return self.constants("exact_domain", doc, (*curve.domain, curve.period))

    def axes(self) -> tuple[ExactIR, ...]:
        """Places of symmetry, where there are any."""
        symmetry = self.model.symmetry
        if symmetry is None:
            return ()
        doc = "A place about which V**2 and ds are even, and the distance to the next; None where there is none."
        return (self.constants("exact_axes", doc, (symmetry.place, symmetry.step)),)
