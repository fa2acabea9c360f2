"""From a model's closed forms to functions as straight-line code."""

from collections.abc import Iterable, Sequence

import sympy
from sympy import Expr, Function, Rational, Symbol

from gqm_sym.derivation import Model
from gqm_sym.derivation.difference import Differences
from gqm_sym.emission.ir import Assignment, ExactIR, FunctionIR, ModuleIR
from gqm_sym.emission.printer import check_emittable


class Names:
    """Names of our own inside emitted functions: a user's name never begins with an underscore, so ours may."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = frozenset(taken)

    def __call__(self, name: str) -> str:
        """``name``, or ``_name`` where the user has that one."""
        return f"_{name}" if name in self._taken else name

    def symbol(self, name: str) -> Symbol:
        """The same as a symbol."""
        return Symbol(self(name), real=True)


def lower(model: Model, *, name: str, forms: tuple[tuple[str, Expr], ...]) -> ModuleIR:
    """All functions of the module for ``model``."""
    _check(model)
    lowering = _Lowering(model)
    return ModuleIR(
        name=name,
        title=model.title,
        parameter=model.parameter.name,
        defaults=model.defaults,
        positive=model.positive,
        forms=forms,
        notes=model.notes,
        functions=(lowering.frame(), lowering.climb(), lowering.rise(), lowering.bend()),
        bounds=lowering.bounds(),
        exact=lowering.exact(),
    )


def _check(model: Model) -> None:
    """Refuse a model with a form that has no text."""
    names = {model.parameter.name, *model.parameters}
    low, high = model.domain
    forms = {
        **{"x": model.x, "z": model.z, "ds": model.ds, "kappa": model.kappa, "reaction": model.reaction},
        **{"climb": model.climb, "climb_slope": model.climb_slope},
        **{"domain, low": low, "domain, high": high, "period": model.period},
    }
    for label, form in forms.items():
        if form is not None:
            check_emittable(form, names, where=label)


class _Lowering:
    """The functions of one model, sharing its names."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.place = model.parameter
        self.order = {name: i for i, (name, _) in enumerate(model.defaults)}
        self.names = Names([self.place.name, *self.order])

    def frame(self) -> FunctionIR:
        """Position, metric, curvature and contact force, given the speed squared."""
        model, v2 = self.model, self.names.symbol("v2")
        force = Symbol("m", real=True) * (model.kappa * v2 + model.reaction)
        places, speeds = self.names("places"), self.names("speeds")
        return self._function(
            "frame",
            "FRAME",
            (places, speeds),
            "x, z, ds/d{0}, signed curvature and contact force, given V**2 (paper, eq. 15).",
            views=((places, self.names("n")), (speeds, self.names("n"))),
            inside=[(self.place, _at(places)), (v2, _at(speeds))],
            outputs=(model.x, model.z, model.ds, model.kappa, force),
        )

    def climb(self) -> FunctionIR:
        """The climb and its slope."""
        places = self.names("places")
        return self._function(
            "climb",
            "CLIMB",
            (places,),
            "What V**2 loses in climbing to {0}, up to a constant, and its derivative (paper, eq. 13).",
            views=((places, self.names("n")),),
            inside=[(self.place, _at(places))],
            outputs=(self.model.climb, self.model.climb_slope),
        )

    def rise(self) -> FunctionIR:
        """First divided difference of the climb, from one place."""
        a, d = self.names.symbol("a"), self.names.symbol("d")
        places, offsets = self.names("places"), self.names("offsets")
        differences = Differences(self.place, (a, self.place), {(0, 1): d})
        return self._function(
            "rise",
            "RISE",
            (a.name, places, offsets),
            "climb[a, {0}] = (climb({0}) - climb(a))/({0} - a) without cancellation, and ds/d{0}.",
            views=((places, self.names("n")), (offsets, self.names("n"))),
            inside=[(self.place, _at(places)), (d, _at(offsets))],
            outputs=(differences.first(self.model.climb, 0, 1), self.model.ds),
        )

    def bend(self) -> FunctionIR:
        """Second divided difference of the climb, over two ends and a place between."""
        a, b, da, db = (self.names.symbol(s) for s in ("a", "b", "da", "db"))
        left, right = self.names("left"), self.names("right")
        differences = Differences(self.place, (a, self.place, b), {(0, 1): da, (1, 2): db, (0, 2): b - a})
        return self._function(
            "bend",
            "BEND",
            (a.name, b.name, left, right),
            "climb[a, {0}, b] = V**2/(({0} - a)*(b - {0})) between turning points, without cancellation, and ds/d{0}.",
            views=((left, self.names("n")), (right, self.names("n"))),
            inside=[
                (da, _at(left)),
                (db, _at(right)),
                (self.place, Function("nearest")(a, b, da, db)),
            ],
            outputs=(differences.second(self.model.climb), self.model.ds),
        )

    def bounds(self) -> FunctionIR:
        """Interval enclosures of the climb's slope and of ds."""
        outputs = (self.model.climb_slope, self.model.ds)
        replaced, reduced = sympy.cse(outputs, symbols=sympy.numbered_symbols("_t", real=True), order="canonical")
        lo, hi = self.names("lo"), self.names("hi")
        return FunctionIR(
            name="bounds",
            signature="BOUNDS",
            arguments=(lo, hi, self.names("p"), self.names("out")),
            doc=f"Bounds of the climb's slope and of ds/d{self.place} for {lo} <= {self.place} <= {hi}.",
            views=(),
            parameters=self._used(outputs),
            before=(),
            inside=tuple(Assignment(name=s.name, value=v) for s, v in replaced),
            outputs=tuple(reduced),
        )

    def exact(self) -> tuple[ExactIR, ...]:
        """The formulas that extended precision needs."""
        model = self.model
        named: tuple[tuple[str, str, tuple[Expr, ...]], ...] = (
            ("x", "Horizontal coordinate.", (model.x,)),
            ("z", "Height.", (model.z,)),
            ("ds", f"ds/d{self.place}.", (model.ds,)),
            ("kappa", "Signed curvature.", (model.kappa,)),
            ("reaction", "Contact force per unit mass of a body at rest.", (model.reaction,)),
            ("climb", "What V**2 loses in climbing, up to a constant.", (model.climb,)),
            ("climb_slope", f"Its derivative by {self.place}.", (model.climb_slope,)),
        )
        ends = (*model.curve.domain, model.curve.period)
        domain = ExactIR(
            name="exact_domain",
            doc="Both ends of the domain, and the period; None where there is none.",
            parameters=self._used(e for e in ends if e is not None),
            inside=(),
            outputs=ends,
        )
        return (*(self._exact(*entry) for entry in named), domain)

    def _exact(self, name: str, doc: str, outputs: tuple[Expr, ...]) -> ExactIR:
        replaced, reduced = sympy.cse(outputs, symbols=sympy.numbered_symbols("_t", real=True), order="canonical")
        return ExactIR(
            name=f"exact_{name}",
            doc=doc,
            parameters=self._used(outputs),
            inside=tuple(Assignment(name=s.name, value=v) for s, v in replaced),
            outputs=tuple(reduced),
        )

    def _function(
        self,
        name: str,
        signature: str,
        arguments: tuple[str, ...],
        doc: str,
        *,
        views: tuple[tuple[str, str], ...],
        inside: list[tuple[Symbol, Expr]],
        outputs: tuple[Expr, ...],
    ) -> FunctionIR:
        """Share common subexpressions, and move what does not depend on the place in front of the loop."""
        used = self._used([*outputs, *(value for _, value in inside)])
        moving = {symbol for symbol, _ in inside}
        prepared, fixed = _hoist([_half_powers(e) for e in outputs], moving)
        everything = [value for _, value in fixed] + prepared
        replaced, reduced = sympy.cse(everything, symbols=sympy.numbered_symbols("_t", real=True), order="canonical")
        before: list[Assignment] = []
        loop = [Assignment(name=s.name, value=v) for s, v in inside]
        for symbol, value in replaced:
            if value.free_symbols & moving:
                moving.add(symbol)
                loop.append(Assignment(name=symbol.name, value=value))
            else:
                before.append(Assignment(name=symbol.name, value=value))
        before += [Assignment(name=s.name, value=v) for (s, _), v in zip(fixed, reduced, strict=False)]
        needed = set().union(*(a.value.free_symbols for a in [*loop, *before]), *(e.free_symbols for e in reduced))
        kept = [a for a in loop if any(a.name == s.name for s in needed)]
        p, out = self.names("p"), self.names("out")
        return FunctionIR(
            name=name,
            signature=signature,
            arguments=(self.names("n"), *arguments, p, out),
            doc=doc.format(self.place.name),
            views=(
                *views,
                (p, str(len(self.order))),
                (out, f"({len(outputs)}, {self.names('n')})"),
            ),
            parameters=used,
            before=_sorted(before),
            inside=tuple(kept),
            outputs=tuple(reduced[len(fixed) :]),
        )

    def _used(self, expressions: Iterable[Expr]) -> tuple[tuple[str, int], ...]:
        free = {s.name for e in expressions for s in e.free_symbols}
        return tuple((name, i) for name, i in self.order.items() if name in free)


def _sorted(assignments: list[Assignment]) -> tuple[Assignment, ...]:
    """Assignments in an order in which each name is given before it is used."""
    waiting, out = {a.name: a for a in assignments}, []
    while waiting:
        ready = [a for a in waiting.values() if not any(s.name in waiting for s in a.value.free_symbols)]
        for a in ready:
            out.append(waiting.pop(a.name))
    return tuple(out)


def _at(array: str) -> Expr:
    """The element of an array that the loop stands at."""
    return Function("at")(Symbol(array, real=True))


def _half_powers(e: Expr) -> Expr:
    """Powers of whole and a half as powers of a root: a root costs a tenth of a general power."""

    def replace(power: Expr) -> Expr:
        return Function("sqrt")(power.base) ** power.exp.p

    return e.replace(
        lambda t: t.is_Pow and isinstance(t.exp, Rational) and t.exp.q == 2 and abs(t.exp.p) > 1,
        replace,
    )


def _hoist(outputs: Sequence[Expr], moving: set[Symbol]) -> tuple[list[Expr], list[tuple[Symbol, Expr]]]:
    """Give calls that do not depend on the place a name of their own, so that the loop need not repeat them."""
    calls = {
        call
        for e in outputs
        for call in e.atoms(sympy.Function, sympy.Pow)
        if not call.free_symbols & moving
        and call.free_symbols
        and not (call.is_Pow and isinstance(call.exp, sympy.Integer))
    }
    outermost = [c for c in sympy.ordered(calls) if not any(c != o and o.has(c) for o in calls)]
    named = [(Symbol(f"_c{i}", real=True), call) for i, call in enumerate(outermost)]
    replacement = {call: symbol for symbol, call in named}
    return [e.xreplace(replacement) for e in outputs], named
