"""A check that a curve is real somewhere: ``asin(2 + x**2)``, for example, is an expression that is never a real
height.
"""

from collections.abc import Iterable, Mapping

import sympy as sp

from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import is_real_at
from gqm_sym.parameters import Value, exact_value

# The places that are tried on a range without ends, and the shares of a range with ends. Curves may be as small as
# molecules or as large as orbits, so that other orders of magnitude follow.
_POWERS = tuple(sp.Integer(10) ** (sign * power) for power in (3, 6, 9, 12) for sign in (-1, 1))
_PLACES = (
    *(sp.Rational(n, 10) for n in (3, -7, 11, -23, 29, 1, -1, 57, -90)),
    *(sp.Rational(n, 10) * scale for scale in _POWERS for n in (3, -7)),
)
_SHARES = tuple(sp.Rational(n, 97) for n in (5, 17, 29, 41, 53, 67, 79, 91))


def check_somewhere_real(
    forms: Iterable[tuple[str, sp.Expr]],
    parameter: sp.Symbol,
    domain: tuple[sp.Expr | None, sp.Expr | None],
    defaults: Mapping[str, Value | None],
) -> None:
    """Refuse forms that are complex or infinite wherever they are tried.

    Raises
    ------
    DeclarationError
        If a form is never real; the message names it. A form that is real somewhere is accepted: where it is not, the
        motion ends. A form whose parameters have no defaults is accepted too: ``sqrt(1 - e_0**2)`` is real for the
        values for which it is meant.
    """
    values = {sp.Symbol(name, real=True): exact_value(value) for name, value in defaults.items() if value is not None}
    unset = {sp.Symbol(name, real=True) for name, value in defaults.items() if value is None}
    if any(end is not None and end.free_symbols & unset for end in domain):
        return
    low, high = (None if end is None else end.xreplace(values) for end in domain)
    places = tried_places((low, high))
    for label, form in forms:
        if form.free_symbols & unset:
            continue
        if all(is_real_at(form, {**values, parameter: place}) is False for place in places):
            raise DeclarationError(
                f"{label}: {form} is not a real number at any place tried with the default parameters; "
                "declare a curve and a potential that are real, or a domain on which they are"
            )


def tried_places(domain: tuple[sp.Expr | None, sp.Expr | None]) -> list[sp.Expr]:
    """Return places of a range at which to try a form."""
    low, high = domain
    if low is not None and high is not None:
        return [low + (high - low) * share for share in _SHARES]
    if low is not None or high is not None:
        return [high - abs(p) if low is None else low + abs(p) for p in _PLACES]
    return list(_PLACES)
