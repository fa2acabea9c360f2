"""What a sweep calls: the conservative functions again, each place with a launch and parameters of its own."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from sympy import Expr, Function, Symbol, cos, expand, sin
from sympy.core.function import AppliedUndef

from gqm_sym.derivation.algebra.difference import Differences
from gqm_sym.emission.ir import FunctionIR
from gqm_sym.emission.sharing import hoist
from gqm_sym.emission.subscripts import at
from gqm_sym.emission.swing import swing_each

if TYPE_CHECKING:
    from gqm_sym.emission.context import Lowering

NEAR = frozenset({"cosh2", "sinh2"})
"""Differences that have a closed form for near points, without the rest: NaN tells a sweep to go another way."""

WAVES = frozenset({"cos2", "sin2"})
"""Differences that are taken apart into what belongs to the orbit and what to the place (MATHS, section 3)."""


def _near(form: Expr) -> Expr:
    return form.replace(
        lambda t: isinstance(t, AppliedUndef) and t.func.__name__ in NEAR,
        lambda t: Function(f"near_{t.func.__name__}")(*t.args),
    )


@dataclass(frozen=True)
class _Middle:
    """A wave's argument x, y, w at both ends of an orbit and between, seen from the middle m: y = m + v, w - m = h."""

    x: Expr
    w: Expr
    gaps: tuple[Expr, Expr]

    @property
    def m(self) -> Expr:
        return (self.x + self.w) / 2

    @property
    def v(self) -> Expr:
        return (self.gaps[0] - self.gaps[1]) / 2

    @property
    def parts(self) -> tuple[Expr, Expr]:
        """Second differences of cos and sin over -h, v, h: ``near_even`` and v times ``near_odd``."""
        return Function("near_even")(*self.gaps), self.v * Function("near_odd")(*self.gaps)

    def second(self, name: str) -> Expr:
        even, odd = self.parts
        return self._turned(sin if name == "sin2" else cos, even, odd)

    def value(self, head: type[Expr]) -> Expr:
        """The sine or cosine of y, by that of v: cos v = cos h + (v**2 - h**2) * even, and so for the sine."""
        even, odd = self.parts
        h, product = (self.w - self.x) / 2, self.gaps[0] * self.gaps[1]
        cosine, sine = cos(h) - product * even, self.v * Function("near_sinc")(h) - product * odd
        return self._turned(head, cosine, sine)

    def _turned(self, head: type[Expr], even: Expr, odd: Expr) -> Expr:
        """What belongs to sin(m + v) or cos(m + v), from what belongs to cos v and sin v."""
        return sin(self.m) * even + cos(self.m) * odd if head is sin else cos(self.m) * even - sin(self.m) * odd


def _apart(
    forms: Sequence[Expr], place: Symbol, ends: tuple[Symbol, Symbol], gaps: tuple[Symbol, Symbol]
) -> list[Expr]:
    """Waves, and their second differences, by parts of which most belong to the orbit."""
    known = set[tuple[Expr, Expr]]()

    def second(t: Expr) -> Expr:
        x, _y, w, *both = t.args
        known.add((both[0], both[1]))
        return _Middle(x, w, (both[0], both[1])).second(t.func.__name__)

    def value(t: Expr) -> Expr:
        argument = t.args[0]
        rate = argument.diff(place)
        scaled = tuple(expand(rate * gap) for gap in gaps)
        if rate.has(place) or scaled not in known:
            return t
        x, w = (argument.xreplace({place: end}) for end in ends)
        return _Middle(x, w, scaled).value(t.func)

    forms = [f.replace(lambda t: isinstance(t, AppliedUndef) and t.func.__name__ in WAVES, second) for f in forms]
    return [f.replace(lambda t: isinstance(t, (sin, cos)) and t.has(place), value) for f in forms]


def rise_each(lowering: "Lowering") -> FunctionIR:
    """First divided differences of climbs, ds and slopes of climbs."""
    model, names, place = lowering.model, lowering.names, lowering.place
    a, d = names.symbol("a"), names.symbol("d")
    starts, places, offsets = (names(name) for name in ("starts", "places", "offsets"))
    differences = Differences(place, (a, place), {(0, 1): d})
    return lowering.function(
        "rise_each",
        "RISE_EACH",
        (starts, places, offsets),
        "climb[a, {0}], ds/d{0} and the climb's derivative, each for a launch of its own.",
        views=tuple((name, names("n")) for name in (starts, places, offsets)),
        inside=[(a, at(starts)), (place, at(places)), (d, at(offsets))],
        outputs=(differences.first(model.climb, 0, 1), model.ds, model.climb_slope),
        each=True,
    )


def bend_each(lowering: "Lowering") -> tuple[FunctionIR, ...]:
    """Second divided differences of climbs, and ds; with what is the same all along an orbit, if anything is."""
    model, names, place = lowering.model, lowering.names, lowering.place
    a, b, da, db = (names.symbol(s) for s in ("a", "b", "da", "db"))
    lows, highs, left, right = (names(name) for name in ("lows", "highs", "left", "right"))
    differences = Differences(place, (a, place, b), {(0, 1): da, (1, 2): db, (0, 2): b - a})
    forms = _apart((_near(differences.second(model.climb)), model.ds), place, (a, b), (da, db))
    outputs, held = hoist(forms, {place, da, db})
    ends = [(a, at(lows)), (b, at(highs))]
    behind = len(lowering.order)
    bend = lowering.function(
        "bend_each",
        "BEND_EACH",
        (lows, highs, left, right),
        "climb[a, {0}, b] and ds/d{0}, each for an orbit of its own; NaN where the closed form ends.",
        views=tuple((name, names("n")) for name in (lows, highs, left, right)),
        inside=[
            *((symbol, at(names("p"), behind + row)) for row, (symbol, _) in enumerate(held)),
            *ends,
            *((symbol, at(array)) for symbol, array in ((da, left), (db, right))),
            (place, Function("nearest")(a, b, da, db)),
        ],
        outputs=tuple(outputs),
        each=True,
        held=len(held),
    )
    if not held:
        return (bend,)
    orbit = lowering.function(
        "orbit_each",
        "ORBIT_EACH",
        (lows, highs),
        "What is the same all along an orbit: ``bend_each`` finds it behind the run-time parameters.",
        views=tuple((name, names("n")) for name in (lows, highs)),
        inside=ends,
        outputs=tuple(value for _, value in held),
        each=True,
    )
    return bend, orbit


def bounds_each(lowering: "Lowering") -> FunctionIR:
    """Enclosures over many intervals."""
    once, n = lowering.bounds(), lowering.names("n")
    lo, hi, p, out = once.arguments
    return replace(
        once,
        name="bounds_each",
        signature="BOUNDS_EACH",
        arguments=(n, *once.arguments),
        doc=once.doc.replace("Bounds", "Bounds over many intervals").rstrip(".") + ", each for parameters of its own.",
        views=((lo, n), (hi, n), (p, f"({len(lowering.order)}, {n})"), (out, f"(4, {n})")),
        each=True,
    )


def each(lowering: "Lowering") -> tuple[FunctionIR, ...]:
    """All of them; none for a model whose motions are solved one by one."""
    model = lowering.model
    if model.dissipation is not None or model.curve.charted or model.force.radius:
        return ()
    return rise_each(lowering), *bend_each(lowering), *swing_each(lowering)
