"""The functions for sweeps: those of a conservative model in which each place has its own launch and parameters."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from sympy import Add, Expr, Function, Mul, Rational, S, Symbol, cos, cosh, exp, expand, sin, sinh, tan
from sympy.core.function import AppliedUndef

from gqm_sym.derivation.algebra.angles import of_sum
from gqm_sym.derivation.algebra.bottom_up import from_the_leaves_up
from gqm_sym.derivation.algebra.difference import Differences
from gqm_sym.derivation.algebra.rewrite import in_single_waves
from gqm_sym.emission.context import Lowering
from gqm_sym.emission.ir import FunctionIR
from gqm_sym.emission.sharing import hoist
from gqm_sym.emission.subscripts import at
from gqm_sym.emission.time_integrand import axis_orbits_batch

_CIRCULAR = frozenset({"divdiff2_cos", "divdiff2_sin"})
_CIRCULAR_FIRST = frozenset({"divdiff1_cos", "divdiff1_sin"})
_HYPERBOLIC = frozenset({"divdiff2_cosh", "divdiff2_exp", "divdiff2_sinh", "divdiff2_tanh"})
"""Divided differences that are split into factors of the orbit and factors of the place (MATHS, section 3). The latter
are NaN for points too far apart, and a sweep then computes the orbit in another way.
"""


_NARROW_FIRST = {"divdiff1_sinh": cosh, "divdiff1_cosh": sinh, "divdiff1_exp": exp}
"""First differences that are these functions of the mean of both arguments, times sinh(h/2)/(h/2)."""


@dataclass(frozen=True)
class _Middle:
    """The argument of a function at one end x of an orbit, at a place y and at the other end w.

    It is measured from the middle m of both ends: y = m + v and w = m + h.
    """

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
        """Return the second differences of cos and sin over -h, v, h, which are those of cos and sinc in the square of
        the argument.
        """
        return Function("divdiff1_cos_in_square")(*self.gaps), self.v * Function("divdiff1_sinc_in_square")(*self.gaps)

    def second(self, name: str) -> Expr:
        even, odd = self.parts
        return self._turned(sin if name == "divdiff2_sin" else cos, even, odd)

    def first(self, name: str, *, from_low: bool) -> Expr:
        """Return the first difference of sin or cos over the place and one end, by that over both ends and the second
        one: f[x,y] = f[x,w] - (w - y)*f[x,y,w].
        """
        return self.over_ends(name) + (-self.gaps[1] if from_low else self.gaps[0]) * self.second(f"divdiff2_{name}")

    def over_ends(self, name: str) -> Expr:
        """Return the first difference of sin or cos over both ends."""
        return (cos(self.m) if name == "sin" else -sin(self.m)) * Function("sinc_near")((self.w - self.x) / 2)

    def hyperbolic_second(self, name: str, y: Expr) -> Expr:
        """Return the second difference of sinh, cosh, exp or tanh.

        As tanh[x,y] = sinhc(h)/(cosh x cosh y), that of tanh has factors of both ends, of the gaps and of the place.
        """
        if name == "divdiff2_tanh":
            odd = Function("mean_sech")(self.x, self.w) * Function("difference_of_sinhc")(*self.gaps)
            even = (
                Function("difference_of_sech")(self.x, self.w, self.w - self.x)
                / 2
                * Function("sum_of_sinhc")(*self.gaps)
            )
            return (odd + even) / cosh(y)
        even = Function("divdiff1_cosh_in_square")(*self.gaps)
        odd = self.v * Function("divdiff1_sinhc_in_square")(*self.gaps)
        if name == "divdiff2_exp":
            return exp(self.m) * (even + odd)
        across, along = (sinh, cosh) if name == "divdiff2_sinh" else (cosh, sinh)
        return across(self.m) * even + along(self.m) * odd

    def value(self, head: type[Expr]) -> Expr:
        """Return the sine or cosine of y, from cos v = cos h + (v**2 - h**2) * even and the same for the sine."""
        even, odd = self.parts
        h, product = (self.w - self.x) / 2, self.gaps[0] * self.gaps[1]
        cosine, sine = cos(h) - product * even, self.v * Function("sinc_near")(h) - product * odd
        return self._turned(head, cosine, sine)

    def _turned(self, head: type[Expr], even: Expr, odd: Expr) -> Expr:
        """Rotate by m: return the result for sin(m + v) or cos(m + v), given the results for cos v and sin v."""
        return sin(self.m) * even + cos(self.m) * odd if head is sin else cos(self.m) * even - sin(self.m) * odd


def _with_constant_factors(
    forms: Sequence[Expr], place: Symbol, ends: tuple[Symbol, Symbol], gaps: tuple[Symbol, Symbol]
) -> list[Expr]:
    """Write sines, cosines and second differences in terms of factors most of which are constant along an orbit."""
    known, narrow = set[tuple[Expr, Expr]](), set[Expr]()
    # The orbits of the second differences, by the arguments of the first differences over the place and one end.
    with_end: dict[tuple[Expr, ...], tuple[_Middle, bool]] = {}
    whole: dict[tuple[Expr, Expr], _Middle] = {}  # by those over both ends

    def second(t: Expr) -> Expr:
        x, y, w, *both = t.args
        known.add((both[0], both[1]))
        middle = _Middle(x, w, (both[0], both[1]))
        with_end[x, y, both[0]], with_end[y, w, both[1]] = (middle, True), (middle, False)
        whole[x, w] = middle
        return middle.second(t.func.__name__)

    def first(t: Expr) -> Expr:
        name = t.func.__name__.removeprefix("divdiff1_")
        if t.args in with_end:
            middle, from_low = with_end[t.args]
            return middle.first(name, from_low=from_low)
        x, w, gap = t.args
        return whole[x, w].over_ends(name) if (x, w) in whole and expand(gap - (w - x)) == 0 else t

    def hyperbolic_second(t: Expr) -> Expr:
        x, y, w, *both = t.args
        if t.func.__name__ != "divdiff2_tanh":
            narrow.update(both)
        return _Middle(x, w, (both[0], both[1])).hyperbolic_second(t.func.__name__, y)

    def narrow_first(t: Expr) -> Expr:
        head = _NARROW_FIRST[t.func.__name__]
        return head((t.args[0] + t.args[1]) / 2) * Function("sinhc_near")(t.args[2] / 2)

    def value(t: Expr) -> Expr:
        argument = t.args[0]
        rate = argument.diff(place)
        scaled = tuple(expand(rate * gap) for gap in gaps)
        if rate.has(place) or scaled not in known:
            return t
        x, w = (argument.xreplace({place: end}) for end in ends)
        return _Middle(x, w, scaled).value(t.func)

    forms = [f.replace(lambda t: isinstance(t, AppliedUndef) and t.func.__name__ in _CIRCULAR, second) for f in forms]
    forms = [
        f.replace(lambda t: isinstance(t, AppliedUndef) and t.func.__name__ in _CIRCULAR_FIRST, first) for f in forms
    ]
    forms = [
        f.replace(lambda t: isinstance(t, AppliedUndef) and t.func.__name__ in _HYPERBOLIC, hyperbolic_second)
        for f in forms
    ]
    forms = [
        f.replace(
            lambda t: isinstance(t, AppliedUndef) and t.func.__name__ in _NARROW_FIRST and t.args[2] in narrow,
            narrow_first,
        )
        for f in forms
    ]
    return [f.replace(lambda t: isinstance(t, (sin, cos)) and t.has(place), value) for f in forms]


def _from_start(form: Expr, start: Symbol, place: Symbol, gap: Symbol) -> Expr:
    """Write sines and cosines of a place, and their first differences over it and a start, by the start and the gap,
    whose sum is not rounded.
    """
    names = {"divdiff1_sin", "divdiff1_cos"}
    form = form.replace(
        lambda t: isinstance(t, AppliedUndef) and t.func.__name__ in names,
        lambda t: of_sum(t, (start,), (start, gap)),
    )
    return form.replace(
        lambda t: isinstance(t, sin | cos) and t.has(place), lambda t: of_sum(t, (place,), (start, S.Zero, gap))
    )


def _without_tangents(form: Expr) -> Expr:
    """Write tangents as ratios, because that of the library keeps loops from filling vector registers."""
    return form.replace(tan, lambda angle: sin(angle) / cos(angle))


def _term_by_term(form: Expr) -> Expr:
    """Divide a sum by a power of a number term by term, if this takes that power from one of the terms.

    The root that remains of it, which is most of ds of a rolling body, then has one rounding instead of five.
    """
    sums = [factor for factor in form.args if factor.is_Add]
    if not form.is_Mul or len(sums) != 1:
        return form
    total, others = sums[0], form / sums[0]
    divisors = {power.base for power in others.args if power.is_Pow and power.exp.is_negative}
    roots = {part for term in total.args for part in Mul.make_args(term) if part.is_Pow and part.exp.is_Rational}
    if not any(root.base in divisors and root.exp.q == 2 for root in roots):
        return form
    return Add(*(term * others for term in total.args))


def _from_middle(value: Expr, ends: tuple[Symbol, Symbol], sums: tuple[Symbol, Symbol, Symbol]) -> Expr:
    """Write the sine or cosine of a multiple of one end, or of the mean of both, by that mean as two numbers and half
    the distance, because all nodes of an orbit have the rounding of an end in common.
    """
    if not isinstance(value, sin | cos):
        return value
    (a, b), (middle, rest, half) = ends, sums
    if not value.has(b):
        return of_sum(value, (a,), (middle, rest, -half))
    return (
        of_sum(value, (b,), (middle, rest, half)) if not value.has(a) else of_sum(value, ends, (middle, rest, S.Zero))
    )


def _at_middle(value: Expr, ends: tuple[Symbol, Symbol], middle: Symbol, rest: Symbol) -> Expr:
    """Write sinh, cosh or exp of a multiple of the mean of both ends by the mean as two numbers, because all nodes of
    an orbit have its rounding in common.
    """
    if not isinstance(value, sinh | cosh | exp):
        return value
    a, b = ends
    rate = value.args[0].diff(a)
    if rate != value.args[0].diff(b) or rate.has(a, b):
        return value
    argument = value.args[0].xreplace({a: middle, b: middle})
    moved = value.func(argument)
    return moved + 2 * rate * rest * {sinh: cosh, cosh: sinh, exp: exp}[value.func](argument)


def _of_one_gap(
    forms: Iterable[Expr], low: Symbol, high: Symbol, half: Symbol, unrounded: Sequence[Expr] = ()
) -> tuple[Expr, ...]:
    """Write multiples of the difference of two numbers as multiples of one symbol, which is half that difference.

    A difference of two multiples has the roundings of both, and at the ends of an orbit far from zero these are much
    more than that of its width. Multiples by ``unrounded`` stay as they are.
    """

    def of_half(form: Expr) -> Expr:
        if not form.is_Add or len(form.args) != 2 or form.has(AppliedUndef) or not form.has(low):
            return form
        rate = form.diff(high)
        if rate in unrounded or rate.has(low, high) or expand(form - rate * (high - low)) != 0:
            return form
        return 2 * rate * half

    return from_the_leaves_up(forms, of_half)


def potential_divdiff1_batch(lowering: Lowering) -> FunctionIR:
    """Return the function for first divided differences of the effective potential, ds and the potential's slopes."""
    model, names, place = lowering.model, lowering.names, lowering.measured
    a, d = names.symbol("a"), names.symbol("d")
    starts, places, offsets = (names(name) for name in ("starts", "places", "offsets"))
    potential = in_single_waves(lowering.from_origin(model.effective_potential), place)
    differences = Differences(place, (a, place), {(0, 1): d})
    here, offset = (place, at(places)), (d, at(offsets))
    return lowering.function(
        "potential_divdiff1_batch",
        (starts, places, offsets),
        f"U[a, {place}], ds/d{place} and dU/d{place}{lowering.meaning}.",
        inside=[(a, at(starts) - model.origin), *([offset, (place, a + d)] if model.origin else [here, offset])],
        outputs=tuple(
            _from_start(_without_tangents(form), a, place, d)
            for form in (
                differences.first(potential, 0, 1),
                _term_by_term(lowering.from_origin(model.ds)),
                lowering.from_origin(model.effective_potential_slope),
            )
        ),
        batch=True,
    )


def potential_divdiff2_batch(lowering: Lowering) -> tuple[FunctionIR, ...]:
    """Return the functions for second divided differences of the effective potential and ds, and for the terms that are
    constant along an orbit.
    """
    model, names, place = lowering.model, lowering.names, lowering.measured
    a, b, da, db = (names.symbol(s) for s in ("a", "b", "da", "db"))
    lows, highs, left, right = (names(name) for name in ("lows", "highs", "left", "right"))
    differences = Differences(place, (a, place, b), {(0, 1): da, (1, 2): db, (0, 2): b - a})
    potential = in_single_waves(lowering.from_origin(model.effective_potential), place)
    ds = _term_by_term(lowering.from_origin(model.ds))
    forms = _with_constant_factors((differences.second(potential), ds), place, (a, b), (da, db))
    outputs, held = hoist(forms, {place, da, db})
    middle, rest, half = (names.symbol(name) for name in ("middle", "rest", "half"))
    middles, rests, halves = (names(name) for name in ("middles", "rests", "halves"))
    ends = [(a, at(lows)), (b, at(highs))]
    if model.origin:  # of ends far from zero, only their mean and distance are exact
        ends = [(half, at(halves)), (a, middle - half + rest), (b, middle + half + rest)]
    from_middle = names.symbol("from_middle")
    in_halves = (Rational(1, 2), Rational(-1, 2))
    outputs = [
        form.replace(
            lambda t: isinstance(t, (sin, cos)) and t.has(place),
            lambda t: of_sum(t, (place,), (middle, rest, (da - db) / 2)),
        )
        for form in _of_one_gap(outputs, db, da, from_middle, in_halves)
    ]
    held = [(symbol, _from_middle(value, (a, b), (middle, rest, half))) for symbol, value in held]
    held = [(symbol, _at_middle(value, (a, b), middle, rest)) for symbol, value in held]
    held = list(zip((s for s, _ in held), _of_one_gap((v for _, v in held), a, b, half), strict=True))
    held += [(symbol, symbol) for symbol in (middle, rest) if any(form.has(symbol) for form in outputs)]
    held += [(symbol, symbol) for symbol in (a, b) if model.origin]
    behind = len(lowering.order)
    second = lowering.function(
        "potential_divdiff2_batch",
        (lows, highs, left, right),
        f"U[a, {place}, b] and ds/d{place}; NaN where the points lie too far apart for the closed form"
        f"{lowering.meaning}.",
        inside=[
            *((symbol, at(names("p"), behind + row)) for row, (symbol, _) in enumerate(held)),
            *([] if model.origin else ends),
            *((symbol, at(array)) for symbol, array in ((da, left), (db, right))),
            (from_middle, (da - db) / 2),
            (place, Function("place_from_ends")(a, b, da, db)),
        ],
        outputs=tuple(outputs),
        batch=True,
        rows_behind=len(held),
    )
    if not held:
        return (second,)
    orbit = lowering.function(
        "orbit_invariants_batch",
        (lows, highs, middles, rests, halves),
        "Terms that are constant along an orbit; ``potential_divdiff2_batch`` reads them after the parameters"
        f"{lowering.meaning}.",
        inside=[
            (middle, at(middles) - model.origin),
            (rest, at(rests)),
            *([] if model.origin else [(half, at(halves))]),
            *ends,
        ],
        outputs=tuple(value for _, value in held),
        batch=True,
    )
    return second, orbit


def bounds_batch(lowering: Lowering) -> FunctionIR:
    """Return the function for enclosures over many intervals."""
    once, n = lowering.bounds(), lowering.names("n")
    lo, hi, p, out = once.arguments
    return replace(
        once,
        name="bounds_batch",
        signature="BOUNDS_BATCH",
        arguments=(n, *once.arguments),
        doc=once.doc.replace(", by interval arithmetic", ""),
        views=((lo, n), (hi, n), (p, f"({len(lowering.order)}, {n})"), (out, f"(4, {n})")),
        batch=True,
    )


def batch_functions(lowering: Lowering) -> tuple[FunctionIR, ...]:
    """Return all functions of a batch except the bounds; none for a model whose motions are solved one by one."""
    model = lowering.model
    if model.dissipation is not None or model.curve.charted:
        return ()
    return potential_divdiff1_batch(lowering), *potential_divdiff2_batch(lowering), *axis_orbits_batch(lowering)
