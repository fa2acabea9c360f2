"""Derivatives of a half period that follow from its homogeneity.

If run-time parameters, places and speeds may be multiplied by powers of a factor so that the half period tau is
multiplied by a power of it too, then Euler's theorem gives a derivative from others. With the exponents ``e`` and the
exponent 1 of the parameter q,

    q dtau/dq = e_time tau - e_place lam0 dtau/dlam0 - e_speed v0 dtau/dv0 - sum e_r r dtau/dr.

At the same phase angle this holds for the time per phase angle too, so nothing cancels in it that does not cancel
there. The exponents are proved by the formulas: terms of a sum have the same exponent, and arguments of transcendental
functions have the exponent 0.
"""

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from gqm_sym.runtime.double_double import interpreter
from gqm_sym.runtime.double_double.recording import Recorder, TapeNumber
from gqm_sym.runtime.gradients.adjoints import gradient
from gqm_sym.runtime.gradients.programs import Source

Exponents = tuple[Fraction, ...]
"""The exponent of an entry of a tape as a linear form: the coefficients of those of the parameters and of the place."""

HALF = Fraction(1, 2)


class Scaling(NamedTuple):
    """How a half period is homogeneous of degree 1 in a parameter, together with other variables.

    Attributes
    ----------
    time, place, speed : Fraction
        The exponents of the half period, of places and of speeds.
    others : tuple of (int, Fraction)
        Other parameters with their exponents.
    """

    time: Fraction
    place: Fraction
    speed: Fraction
    others: tuple[tuple[int, Fraction], ...] = ()


class Plan(NamedTuple):
    """How derivatives with respect to parameters and launch are found.

    Attributes
    ----------
    wanted : tuple of int
        The variables of differentiation: a parameter's number, or that after the last one for the launch place and the
        next for the launch speed.
    scalings : tuple
        For each of them the scaling from which its derivative follows; None if the formulas are differentiated.
    tangents : tuple of int
        The parameters by which the formulas are differentiated.
    has_launch : bool
        Whether they are also differentiated by the energy, or by the place of a launch from rest.
    """

    wanted: tuple[int, ...]
    scalings: tuple[Scaling | None, ...]
    tangents: tuple[int, ...]
    has_launch: bool

    def moves(self, launch: int) -> tuple[int, ...]:
        """The variables by which the formulas are differentiated, with ``launch`` for the launch."""
        return (*((launch,) if self.has_launch else ()), *self.tangents)


class DirectRows(NamedTuple):
    """Derivatives that are multiples of the half period.

    Attributes
    ----------
    scaled : tuple of (int, int, Fraction)
        Positions among the wanted variables, the parameters, and the exponents of the half period.
    zeros : tuple of int
        Positions of variables on which the half period does not depend, to first order.
    others : tuple of int
        Positions of all other variables.
    """

    scaled: tuple[tuple[int, int, Fraction], ...]
    zeros: tuple[int, ...]
    others: tuple[int, ...]


@lru_cache(maxsize=256)
def plan_of(source: Source, wanted: tuple[int, ...], *, at_rest: bool, is_scaled: bool) -> tuple[DirectRows, Plan]:
    """Return which derivatives of a half period are multiples of it, and how the others are found.

    Parameters
    ----------
    source : Source
        The formulas.
    wanted : tuple of int
        The variables of differentiation.
    at_rest : bool
        Whether launches are from rest. Derivatives by the launch speed are then zero.
    is_scaled : bool
        Whether derivatives may follow from others. A parameter that is zero permits no division by it.
    """
    n = source.parameters
    found = scalings(source, wanted) if is_scaled else {}
    scaled, zeros, others = list[tuple[int, int, Fraction]](), list[int](), list[int]()
    for position, k in enumerate(wanted):
        scaling = found.get(k)
        if scaling is not None and not scaling.others and not scaling.place and (at_rest or not scaling.speed):
            scaled.append((position, k, scaling.time))
        else:
            (zeros if (at_rest and k == n + 1) or k in constants(source) else others).append(position)
    left = tuple(wanted[position] for position in others)
    by = [found.get(k) for k in left]
    has_launch = any(s is None and k >= n for k, s in zip(left, by, strict=True)) or any(
        s is not None and (s.place != 0 or (s.speed != 0 and not at_rest)) for s in by
    )
    tangents = {k for k, s in zip(left, by, strict=True) if s is None and k < n}
    tangents |= {other for s in by if s is not None for other, _ in s.others}
    plan = Plan(left, tuple(by), tuple(sorted(tangents)), has_launch)
    return DirectRows(tuple(scaled), tuple(zeros), tuple(others)), plan


@lru_cache(maxsize=64)
def constants(source: Source) -> frozenset[int]:
    """Return the parameters that add only a constant to the effective potential, and on which ds does not depend."""
    op = Recorder(source.parameters)
    potential = op.number(source.formulas.effective_potential(op, op.place, op.values))
    ds = op.number(source.formulas.ds(op, op.place, op.values))

    def adds_a_constant(p: TapeNumber) -> bool:
        change = gradient(op, potential, [p])[0]
        by_place = change if change.known is not None else gradient(op, change, [op.place])[0]
        return (change.known is not None or by_place.known == 0) and gradient(op, ds, [p])[0].known == 0

    return frozenset(k for k, p in enumerate(op.values[: source.parameters]) if adds_a_constant(p))


Terms = list[tuple[TapeNumber, int]]
"""A derivative as a sum of products: factors that do not depend on the place, each with the position of the rate that
it is of."""


def terms_of(
    op: Recorder,
    source: Source,
    plan: Plan,
    launch: tuple[TapeNumber, TapeNumber],
    slope: TapeNumber | None = None,
) -> list[Terms]:
    """Return the derivatives that a plan wants as sums.

    The rates are the half period, or the time per phase angle, and then its derivatives with respect to the launch and
    the parameters (`Plan.moves`).

    Parameters
    ----------
    op : Recorder
        The tape, whose first inputs are the run-time parameters.
    source : Source
        The formulas.
    plan : Plan
        The plan.
    launch : pair of TapeNumber
        The launch place and the launch speed; the latter is the number 0 for launches from rest whose first derivative
        is that with respect to the place, instead of the energy.
    slope : TapeNumber, optional
        The slope of the potential at the launch place, if it is on the tape.
    """
    n, p, (lam0, v0) = source.parameters, op.values, launch
    position = {k: 1 + j for j, k in enumerate(plan.moves(n))}
    factor = {k: op.number(1) for k in position}
    if plan.has_launch and v0.known is None:
        if slope is None:
            slope = gradient(op, source.formulas.effective_potential(op, lam0, p[:n]), [lam0])[0]
        position[n + 1] = position[n]
        factor[n], factor[n + 1] = slope, v0
    found = []
    for k, scaling in zip(plan.wanted, plan.scalings, strict=True):
        if scaling is None:
            found.append([(factor[k], position[k])])
            continue
        terms = [(op.number(scaling.time), 0)] if scaling.time else []
        parts = [(scaling.place, lam0, n), (scaling.speed, v0, n + 1)]
        for exponent, value, which in [*parts, *((e, p[other], other) for other, e in scaling.others)]:
            if exponent != 0 and value.known != 0:
                terms.append((-exponent * (value * factor[which]), position[which]))
        found.append([(number / p[k], which) for number, which in terms])
    return found


def combined(op: Recorder, terms: Sequence[Terms], rates: Sequence[TapeNumber]) -> list[TapeNumber]:
    """Record sums of products (`terms_of`)."""
    return [sum((number * rates[which] for number, which in some), op.number(0)) for some in terms]


@lru_cache(maxsize=256)
def scalings(source: Source, wanted: tuple[int, ...]) -> dict[int, Scaling]:
    """Return the scalings of a half period from which derivatives with respect to wanted parameters follow."""
    n = source.parameters
    op = Recorder(n)
    potential = op.register(source.formulas.effective_potential(op, op.place, op.values))
    ds = op.register(source.formulas.ds(op, op.place, op.values))
    exponents, conditions = _exponents(op, n)
    found, chosen = dict[int, Scaling](), list[int]()
    for k in wanted:
        if k >= n:
            continue
        solution = None
        for unknowns in ((), (n,), (n, *chosen)):
            solution = solution or _solution(conditions, k, unknowns)
        if solution is None:
            chosen.append(k)
            continue
        u, length = (sum(c * solution.get(i, 0) for i, c in enumerate(exponents[e])) for e in (potential, ds))
        place = solution.get(n, Fraction(0))
        others = tuple((other, solution[other]) for other in chosen if solution.get(other))
        found[k] = Scaling(length + place - u * HALF, place, u * HALF, others)
    return found


def _exponents(op: Recorder, n: int) -> tuple[list[Exponents], list[Exponents]]:
    """Return the exponents of all entries of a tape, and linear forms that have to be zero."""
    none = (Fraction(0),) * (n + 1)
    found, conditions = list[Exponents](), list[Exponents]()

    def joined(a: Exponents, b: Exponents, factor: Fraction | int) -> Exponents:
        return tuple(x + factor * y for x, y in zip(a, b, strict=True))

    for code, *operands in op.entries:
        if isinstance(code, str):  # the registers of parameters come first, then that of the place
            is_input = code in ("parameter", "place")
            found.append(tuple(Fraction(int(i == len(found))) for i in range(n + 1)) if is_input else none)
            continue
        of = [found[k] for k in operands]
        if code in (interpreter.ADD, interpreter.SUBTRACT):
            terms = [found[k] for k in operands if op.exact.get(k) != 0]
            conditions += [joined(terms[0], term, -1) for term in terms[1:]]
            found.append((terms or of)[0])
        elif code in (interpreter.MULTIPLY, interpreter.DIVIDE):
            found.append(joined(of[0], of[1], 1 if code == interpreter.MULTIPLY else -1))
        elif code == interpreter.SQUARE_ROOT:
            found.append(joined(none, of[0], HALF))
        elif code == interpreter.ABSOLUTE:
            found.append(of[0])
        else:
            conditions.append(of[0])
            found.append(none)
    return found, list(dict.fromkeys(condition for condition in conditions if any(condition)))


def _solution(conditions: Sequence[Exponents], given: int, unknowns: Sequence[int]) -> dict[int, Fraction] | None:
    """Return exponents that fulfil all conditions: 1 of the variable ``given``, and those of the ``unknowns``; None if
    there are none.
    """
    rows = [[*(condition[k] for k in unknowns), -condition[given]] for condition in conditions]
    solved = list[tuple[int, list[Fraction]]]()
    for row in rows:
        for column, other in solved:
            factor = row[column]
            row[:] = [x - factor * y for x, y in zip(row, other, strict=True)]
        pivot = next((k for k, x in enumerate(row[:-1]) if x != 0), None)
        if pivot is None:
            if row[-1] != 0:
                return None
            continue
        row[:] = [x / row[pivot] for x in row]
        for _, other in solved:
            factor = other[pivot]
            other[:] = [x - factor * y for x, y in zip(other, row, strict=True)]
        solved.append((pivot, row))
    return {given: Fraction(1)} | {unknowns[column]: row[-1] for column, row in solved}
