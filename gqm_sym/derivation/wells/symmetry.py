"""Places about which a well and its curve are even, so that orbits around them are their own mirror images."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import sympy as sp

# Longer forms are not examined, and only forms with at most so many operations are expanded to find their symmetry.
MAX_LENGTH, MAX_OPERATIONS = 1000, 200
_WAVES = (sp.sin, sp.cos)


@dataclass(frozen=True, slots=True)
class Symmetry:
    """Places about which an effective potential and σ are even functions of the distance.

    Attributes
    ----------
    place
        One such place.
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


def symmetry(potential: sp.Expr, slope: sp.Expr, ds: sp.Expr, lam: sp.Symbol) -> Symmetry | None:
    """Return the places about which the effective potential and ds are even; None if none was found.

    The candidates are zeros of the arguments of all functions, steps of a quarter turn from those of sines and cosines,
    0, and the centre that follows from the two highest powers of a polynomial.
    """
    forms = (potential, ds)
    if any(_is_longer(form, MAX_LENGTH) for form in forms):
        return None
    found = [place for place in dict.fromkeys(_candidates(forms, lam)) if all(_is_even(f, lam, place) for f in forms)]
    if not found:
        return None
    step = min((abs(place - found[0]) for place in found[1:]), key=_size, default=None)
    return Symmetry(found[0], step, _vanishes_only_at(slope, lam, found[0], step))


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
