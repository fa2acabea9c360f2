"""Places about which a well and its curve are even, so that orbits around them are their own mirror images."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

import sympy as sp

# Longer forms are not examined, and only forms with at most so many operations are expanded to find their symmetry.
MAX_LENGTH, MAX_OPERATIONS = 1000, 200
_WAVES = (sp.sin, sp.cos)

# The distance from a place of symmetry at which is asked whether it lies in a well.
NEXT_TO_AXIS = sp.Rational(1, 1024)


@dataclass(frozen=True, slots=True)
class Symmetry:
    """Places about which an effective potential and σ² are even functions of the distance.

    Attributes
    ----------
    place
        One such place about which σ is even.
    step
        The distance from each place to the next, None for a single one; two places of symmetry imply one at every
        multiple of their distance.
    monotone
        Whether the potential is proved to be monotone between two neighbouring places, on a path on which σ is nowhere
        negative.
    """

    place: sp.Expr
    step: sp.Expr | None
    monotone: bool


def symmetry(
    potential: sp.Expr,
    slope: sp.Expr,
    ds: sp.Expr,
    lam: sp.Symbol,
    domain: tuple[sp.Expr | None, sp.Expr | None] = (None, None),
    cusp: sp.Expr | None = None,
    values: Mapping[sp.Symbol, sp.Expr] | None = None,
) -> Symmetry | None:
    """Return the places about which the effective potential and ds**2 are even; None if ds is even about none of them.

    The candidates are zeros of the arguments of all functions, steps of a quarter turn from those of sines and cosines,
    0, and the centre that follows from the two highest powers of a polynomial. `Symmetry.place` is one about which ds
    is even, inside the domain if possible, and there one at the bottom of a well if possible, because swings are about
    it; that is decided for the ``values`` of the parameters. The others may be cusps, which no body passes: ds is odd
    about them, or the factor ``cusp`` of ds vanishes there. A cusp elsewhere needs no attention: the slope of the
    potential vanishes at every cusp, and it vanishes nowhere on the way from a place of symmetry to a turning point.
    """
    forms = (potential, ds)
    if any(_is_longer(form, MAX_LENGTH) for form in forms):
        return None
    candidates = dict.fromkeys(_candidates(forms, lam))
    found = [place for place in candidates if all(_is_even(form, lam, place) for form in (potential, ds**2))]
    passable = [p for p in found if _is_even(ds, lam, p) and (cusp is None or cusp.xreplace({lam: p}) != 0)]
    if not passable:
        return None
    chosen = dict(values or {})
    rises = {p: bool(slope.xreplace({lam: p + NEXT_TO_AXIS}).xreplace(chosen).evalf().is_positive) for p in passable}
    known = min(passable, key=lambda place: (not _is_inside(place, domain), not rises[place]))
    step = min((abs(place - known) for place in found if place != known), key=_size, default=None)
    monotone = len(passable) == len(found) and _vanishes_only_at(slope, lam, known, step)
    return Symmetry(known, step, monotone)


def _is_inside(place: sp.Expr, domain: tuple[sp.Expr | None, sp.Expr | None]) -> bool:
    low, high = domain
    return (low is None or bool((place - low).is_positive)) and (high is None or bool((high - place).is_positive))


def _is_longer(form: sp.Expr, length: int) -> bool:
    """Return whether a form has more than ``length`` parts when it is expanded, without visiting all of them."""
    return next(islice(sp.preorder_traversal(form), length, None), None) is not None


def _size(step: sp.Expr) -> sp.Expr:
    return step if step.is_number else sp.oo


def _candidates(forms: Iterable[sp.Expr], lam: sp.Symbol) -> Iterator[sp.Expr]:
    functions = {function for form in forms for function in form.atoms(sp.Function) if function.has(lam)}
    for function in sorted(functions, key=sp.default_sort_key):
        rate = function.args[0].diff(lam)
        if rate and not rate.has(lam):
            zero = -function.args[0].xreplace({lam: sp.S.Zero}) / rate
            quarters = (-1, 0, 1, 2) if isinstance(function, _WAVES) else (0,)
            yield from (zero + k * sp.pi / (2 * rate) for k in quarters)
    yield sp.S.Zero
    for form in forms:
        polynomial = form.as_poly(lam)
        if polynomial is not None and polynomial.degree() > 1:
            highest, second = (polynomial.nth(polynomial.degree() - k) for k in (0, 1))
            yield sp.cancel(-second / (polynomial.degree() * highest))


def _is_even(form: sp.Expr, lam: sp.Symbol, place: sp.Expr) -> bool:
    mirrored = form.xreplace({lam: 2 * place - lam})
    return mirrored == form or bool(form.count_ops() <= MAX_OPERATIONS and sp.expand(mirrored - form) == 0)


def is_half_turn(step: sp.Expr | None, rate: sp.Expr) -> bool:
    """Return whether a step is half a period of a sine of this rate."""
    return step is not None and sp.simplify(step * abs(rate) - sp.pi) == 0


def _vanishes_only_at(slope: sp.Expr, lam: sp.Symbol, place: sp.Expr, step: sp.Expr | None) -> bool:
    """Return whether a slope vanishes at places of symmetry and nowhere else, as a sine, a power or a hyperbolic sine
    does.
    """
    shape = slope.as_independent(lam, as_Add=False)[1]
    if shape.xreplace({lam: place}) != 0:
        return False
    if isinstance(shape, _WAVES):
        rate = shape.args[0].diff(lam)
        return not rate.has(lam) and is_half_turn(step, rate)
    if isinstance(shape, sp.sinh):
        return not shape.args[0].diff(lam).has(lam)
    return bool(shape.as_base_exp()[0] == lam and shape.as_base_exp()[1].is_positive)
