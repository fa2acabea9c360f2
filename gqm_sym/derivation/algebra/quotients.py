"""Divided differences of quotients of polynomials of low degrees, without terms that cancel.

The rules for products and powers give f[x, y, w] of such a quotient f = N/D as a sum of terms of which only the factors
D(x)*D(y)*D(w) of their divisors are left in the end; the rest cancels, and digits with it. Multiplied by that divisor,
f[x, y, w] is a polynomial in x + y + w, x*y + x*w + y*w and x*y*w, whose coefficients follow from those of N and D.
"""

from dataclasses import dataclass

import sympy
from sympy import Expr, S, Symbol

# The highest degrees of N and D.
MAX_ABOVE, MAX_BELOW = 3, 2

_VARIABLE = sympy.Dummy("x", real=True)


@dataclass(frozen=True, slots=True)
class Quotient:
    """A quotient of polynomials.

    Attributes
    ----------
    above
        The coefficients of the powers 0 to 3 in N.
    below
        The coefficients of the powers 0 to 2 in D.
    divisor
        D as it is written, as a function of `_VARIABLE`.
    """

    above: tuple[Expr, ...]
    below: tuple[Expr, ...]
    divisor: Expr

    def _over(self, *places: Expr) -> Expr:
        """Return one over the product of D at places."""
        return sympy.Mul(*(1 / self.divisor.xreplace({_VARIABLE: place}) for place in places))

    def first(self, x: Expr, y: Expr, h: Expr) -> Expr:
        """Return f[x, y]."""
        (n0, n1, n2, n3), (d0, d1, d2) = self.above, self.below
        total, product = x + y, x * y
        numerator = (
            (n1 * d0 - n0 * d1)
            + (n2 * d0 - n0 * d2) * total
            + (n2 * d1 - n1 * d2) * product
            + n3 * (d0 * (x**2 + product + y**2) + d1 * product * total + d2 * product**2)
        )
        return numerator * self._over(x, y)

    def second(self, x: Expr, y: Expr, w: Expr, h1: Expr, h2: Expr) -> Expr:
        """Return f[x, y, w]."""
        (n0, n1, n2, n3), (d0, d1, d2) = self.above, self.below
        discriminant = d1**2 - d0 * d2
        numerator = (
            (n0 * discriminant - n1 * d0 * d1 + n2 * d0**2)
            + (n0 * d1 * d2 - n1 * d0 * d2 + n3 * d0**2) * (x + y + w)
            + (n0 * d2**2 - n2 * d0 * d2 + n3 * d0 * d1) * (x * y + x * w + y * w)
            + (n1 * d2**2 - n2 * d1 * d2 + n3 * discriminant) * x * y * w
        )
        return numerator * self._over(x, y, w)


def quotient_of(u: Expr, parameter: Symbol) -> tuple[Quotient, Expr] | None:
    """Return a product or power as a quotient, and the expression of which it is one.

    None if it has a factor that is constant, or if it is no such quotient by one sum.
    """
    factors = sympy.Mul.make_args(u)
    divisors = [f for f in factors if f.is_Pow and f.exp == -1 and f.base.is_Add]
    if len(divisors) != 1 or not all(f.has(parameter) for f in factors):
        return None
    below, above = divisors[0].base, sympy.Mul(*(f for f in factors if f is not divisors[0]))
    inner = _inner(below, parameter)
    if len(inner) != 1:
        return None
    (place,) = inner
    coefficients = [
        _coefficients(form.xreplace({place: _VARIABLE}), parameter, degree)
        for form, degree in ((above, MAX_ABOVE), (below, MAX_BELOW))
    ]
    if not all(coefficients):
        return None
    return Quotient(coefficients[0], coefficients[1], below.xreplace({place: _VARIABLE})), place


def _coefficients(form: Expr, parameter: Symbol, degree: int) -> tuple[Expr, ...]:
    """Return the coefficients of a polynomial up to a degree; none if it is no such polynomial."""
    if form.has(parameter) or not form.is_polynomial(_VARIABLE):
        return ()
    found = sympy.Poly(form, _VARIABLE).all_coeffs()[::-1]
    return (*found, *[S.Zero] * (degree + 1 - len(found))) if len(found) <= degree + 1 else ()


def _inner(form: Expr, parameter: Symbol) -> set[Expr]:
    """Return the expressions of which a form is a polynomial, as it is written."""
    if not form.has(parameter):
        return set()
    if form.is_Add or form.is_Mul:
        return set().union(*(_inner(part, parameter) for part in form.args))
    return {form.base if form.is_Pow and form.exp.is_Integer and form.exp > 0 else form}
