"""Divided differences of x*cot(x), whose poles at 0 cancel, without these poles.

The rule for products writes the second difference as a sum of terms with the pole of the cotangent, of which little is
left beside 0. With y and w beside x, S(x, y) = (sinc(x + y) - sinc(y - x))/(4*x*y) and g(x) = x/sin(x), f(x) = x*cot(x)
has ``f[x,y] = 2*(x + y)*S(x, y)*g(x)*g(y)``, from which the second difference follows by the rule for products.
"""

from dataclasses import dataclass

from sympy import Expr, Function, Mul, Symbol, cos, expand_mul, sin


@dataclass(frozen=True, slots=True)
class Cotangent:
    """A multiple of x*cot(x).

    Attributes
    ----------
    factor : Expr
        Of which number it is the multiple.
    """

    factor: Expr

    def first(self, x: Expr, y: Expr, h: Expr) -> Expr:
        """Return f[x, y]."""
        return 2 * self.factor * (x + y) * _difference_of_sinc(x, y, h) * _over_sine(x) * _over_sine(y)

    def second(self, x: Expr, y: Expr, w: Expr, h1: Expr, h2: Expr) -> Expr:
        """Return f[x, y, w].

        The difference over both ends of g is small beside 0, and its rounding counts little.
        """
        bent = Function("divdiff1_difference_of_sinc")(x, y, w, h1, h2)
        ends = (sin(x) - x * Function("divdiff1_sin")(x, w, w - x)) / (sin(x) * sin(w))
        straight = _difference_of_sinc(y, w, h2) * _over_sine(w)
        curved = bent * _over_sine(w) + _difference_of_sinc(x, y, h1) * ends
        return 2 * self.factor * _over_sine(y) * (straight + (x + y) * curved)


def _difference_of_sinc(x: Expr, y: Expr, h: Expr) -> Expr:
    return Function("difference_of_sinc")(x, y, h)


def _over_sine(x: Expr) -> Expr:
    return x / sin(x)


def cotangent_of(u: Expr, parameter: Symbol) -> tuple[Cotangent, Expr] | None:
    """Return the parameter times the cotangent of a multiple of it as such a function of that multiple, and the latter;
    None if it is no such product.
    """
    angles = [f.base.args[0] for f in Mul.make_args(u) if f.is_Pow and f.exp == -1 and isinstance(f.base, sin)]
    if len(angles) != 1:
        return None
    rate = angles[0] / parameter
    if rate.has(parameter) or u != parameter * cos(angles[0]) / sin(angles[0]):
        return None
    return Cotangent(1 / rate), angles[0]


def with_cotangents(u: Expr, parameter: Symbol) -> Expr:
    """Multiply out a product of the parameter and a sum if one of its terms then is a multiple of `cotangent_of`'s."""
    if not u.is_Mul or parameter not in u.args or not any(factor.is_Add for factor in u.args):
        return u
    product = expand_mul(u)
    moving = (term.as_independent(parameter, as_Add=False)[1] for term in product.args)
    return product if product.is_Add and any(cotangent_of(term, parameter) for term in moving) else u
