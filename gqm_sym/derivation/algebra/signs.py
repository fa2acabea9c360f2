"""Signs of expressions on the domain of a curve, as far as their structure and the ends of the domain prove them."""

from collections.abc import Iterable

import sympy as sp

_ALWAYS_POSITIVE = (sp.exp, sp.cosh)
_NEVER_NEGATIVE = (sp.Abs,)

# The largest angle that is considered: no practical curve reaches further within half a wave, and SymPy would need more
# digits for larger angles.
MAX_ANGLE = 10**6
_ODD = (sp.sinh, sp.tanh, sp.asinh, sp.atan, sp.asin, sp.atanh)


class Signs:
    """The signs of expressions inside the domain.

    If a closed form would contain the absolute value of a run-time parameter, the parameter is taken to be positive
    unless its default contradicts that; ``assumed`` lists these parameters.

    Parameters
    ----------
    parameter, domain
        The curve's parameter and its range.
    positive
        Parameters that are declared to be positive.
    may_be_positive
        Parameters whose defaults are positive, or that have none.
    """

    def __init__(
        self,
        *,
        parameter: sp.Symbol,
        domain: tuple[sp.Expr | None, sp.Expr | None],
        positive: Iterable[str],
        may_be_positive: Iterable[str],
    ) -> None:
        self.parameter = parameter
        self.domain = domain
        self._positive = dict.fromkeys(positive)
        self._candidates = frozenset(may_be_positive)

    @property
    def positive(self) -> tuple[str, ...]:
        """Parameters that are declared or taken to be positive, in that order."""
        return tuple(self._positive)

    def assume(self, expression: sp.Expr) -> None:
        """Take parameters as positive if their defaults allow it and the expression then has a sign.

        This applies to a single parameter and to sums such as ``R + r``.
        """
        names = [symbol.name for symbol in expression.free_symbols]
        if not self._candidates.issuperset(names):
            return
        terms = sp.Add.make_args(expression)
        if all(part.is_Symbol or part.is_positive for term in terms for part in sp.Mul.make_args(term)):
            for name in sorted(names):
                self._positive.setdefault(name)

    def sign(self, expression: sp.Expr) -> int | None:
        """Return 1 if the expression is nowhere negative, -1 if it is nowhere positive, and None otherwise."""
        if expression.is_number:
            return None if not expression.is_real else (1 if expression >= 0 else -1)
        if isinstance(expression, sp.Symbol):
            if expression == self.parameter:
                return self._sign_of_range(*self.domain)
            return 1 if expression.name in self._positive else None
        if isinstance(expression, sp.Add):
            signs = {self.sign(term) for term in expression.args}
            return signs.pop() if len(signs) == 1 else self._sign_of_line(expression)
        if isinstance(expression, sp.Mul):
            return self._sign_of_product(expression)
        if isinstance(expression, sp.Pow):
            return self._sign_of_power(expression)
        if isinstance(expression, (*_ALWAYS_POSITIVE, *_NEVER_NEGATIVE)):
            return 1
        if isinstance(expression, _ODD):
            return self.sign(expression.args[0])
        if isinstance(expression, sp.sin | sp.cos):
            return self._sign_of_wave(expression)
        return None

    def nonzero(self, expression: sp.Expr) -> bool:
        """Return whether the structure of the expression proves that it vanishes nowhere."""
        if expression.is_number:
            return bool(expression != 0)
        if isinstance(expression, sp.Symbol):
            return expression.name in self._positive
        if isinstance(expression, _ALWAYS_POSITIVE):
            return True
        if isinstance(expression, sp.Pow | sp.Mul):
            return all(self.nonzero(factor) for factor in expression.args)
        if isinstance(expression, sp.Add):
            return self.sign(expression) is not None and any(self.nonzero(term) for term in expression.args)
        return False

    def _sign_of_product(self, expression: sp.Mul) -> int | None:
        result = 1
        for factor in expression.args:
            sign = self.sign(factor)
            if sign is None:
                return None
            result *= sign
        return result

    def _sign_of_power(self, expression: sp.Pow) -> int | None:
        base, exponent = expression.args
        if not isinstance(exponent, sp.Integer):
            # A power is real only where the base is not negative (also for odd roots, of which SymPy takes the real
            # branch for positive bases only).
            return 1
        return 1 if exponent % 2 == 0 else self.sign(base)

    def _sign_of_line(self, expression: sp.Add) -> int | None:
        """Return the sign of a linear function of the parameter whose coefficients are numbers."""
        slope = expression.coeff(self.parameter)
        remainder = sp.expand(expression - slope * self.parameter)
        if not (slope.is_Rational and remainder.is_number and slope):
            return None
        return self._sign_of_range(*self._image(slope, remainder))

    def _image(self, slope: sp.Rational, offset: sp.Expr) -> tuple[sp.Expr | None, sp.Expr | None]:
        low, high = (None if end is None else slope * end + offset for end in self.domain)
        return (low, high) if slope > 0 else (high, low)

    def _sign_of_range(self, low: sp.Expr | None, high: sp.Expr | None) -> int | None:
        if low is not None and self.sign(low) == 1:
            return 1
        # For an end at zero `sign` returns 1; if that is the upper end, the range is below zero.
        if high is not None and (high == 0 or self.sign(high) == -1):
            return -1
        return None

    def _sign_of_wave(self, expression: sp.Expr) -> int | None:
        """Return the sign of a sine or cosine whose argument stays within half a wave."""
        angle = expression.args[0]
        slope = angle.coeff(self.parameter)
        remainder = angle - slope * self.parameter
        if not (slope.is_Rational and slope and remainder.is_number):
            return None
        low, high = self._image(slope, remainder)
        if low is None or high is None or not (low.is_number and high.is_number):
            return None
        if not (abs(low) < MAX_ANGLE and abs(high) < MAX_ANGLE):
            return None
        if isinstance(expression, sp.cos):
            low, high = low + sp.pi / 2, high + sp.pi / 2
        half_wave = sp.floor(low / sp.pi)
        if not high <= (half_wave + 1) * sp.pi:
            return None
        return 1 if half_wave % 2 == 0 else -1
