"""The generators of the ring in which expressions become polynomials.

Sines and cosines of commensurate angles share one *pair* of a common base angle, hyperbolic ones
likewise; exponentials of commensurate exponents share one generator; roots of one order and base
share one; every other function and every symbol is a generator of its own.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import sympy as sp

from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.expressions import common_measure

MAX_GENERATORS = 14
CIRCULAR, HYPERBOLIC, EXPONENTIAL = "circular", "hyperbolic", "exponential"
_KINDS: dict[type[sp.Basic], str] = {
    **dict.fromkeys((sp.sin, sp.cos, sp.tan), CIRCULAR),
    **dict.fromkeys((sp.sinh, sp.cosh, sp.tanh), HYPERBOLIC),
    sp.exp: EXPONENTIAL,
}
Angle = tuple[str, sp.Basic]
"""The kind of a function, and its argument without the rational factor."""


class OverBudget(Exception):
    """An expression is too large for exact algebra within the budget."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Sine and cosine of one base angle, given by their indices among the generators.

    ``sign`` is that of s² in the relation: s² + c² = 1, or c² - s² = 1 for hyperbolic ones.
    """

    angle: sp.Expr
    sine: int
    cosine: int
    sign: int

    def degree(self, monomial: tuple[int, ...]) -> int:
        """Return the total degree of a monomial in both."""
        return monomial[self.sine] + monomial[self.cosine]


@dataclass(frozen=True, slots=True, kw_only=True)
class Generators:
    """All generators in order.

    Attributes
    ----------
    names
        The expressions that the generators stand for.
    pairs
        The pairs of sine and cosine, by angle.
    exponentials
        The indices of the exponentials, by exponent.
    steps
        The rational factor of each base angle.
    """

    names: tuple[sp.Expr, ...]
    pairs: dict[Angle, Pair]
    exponentials: dict[Angle, int]
    steps: dict[Angle, sp.Rational]


def collect(expressions: Iterable[sp.Expr], variable: sp.Symbol, halved: frozenset[Angle]) -> Generators:
    """Find the generators of some expressions and of all their derivatives.

    Parameters
    ----------
    expressions
        The expressions that must be representable.
    variable
        The variable of derivatives.
    halved
        Angles whose base is to be half of that which the expressions need.
    """
    atoms: dict[sp.Basic, None] = {variable: None}
    angles: dict[Angle, set[sp.Rational]] = {}
    pending = list(reversed(tuple(expressions)))
    seen: set[sp.Basic] = set()
    while pending:
        node = pending.pop()
        if node in seen or isinstance(node, sp.Rational):
            continue
        seen.add(node)
        if isinstance(node, sp.Add | sp.Mul) or is_integer_power(node):
            pending.extend(reversed(node.args))
            continue
        if node.func in _KINDS:
            factor, angle = angle_of(node)
            angles.setdefault(angle, set()).add(factor)
        else:
            node = root_of(node)
            atoms.setdefault(node)
            if isinstance(node, sp.Pow | sp.Abs):
                # Even powers of roots and absolute values are multiplied out.
                pending.append(node.args[0])
        if len(atoms) + 2 * len(angles) > MAX_GENERATORS:
            raise OverBudget(f"more than {MAX_GENERATORS} different functions and symbols")
        if variable in node.free_symbols and node != variable:
            pending.append(slope(node, variable))
    return _number(atoms, angles, halved)


def _number(atoms: Iterable[sp.Basic], angles: dict[Angle, set[sp.Rational]], halved: frozenset[Angle]) -> Generators:
    names: list[sp.Expr] = list(atoms)
    pairs: dict[Angle, Pair] = {}
    exponentials: dict[Angle, int] = {}
    steps: dict[Angle, sp.Rational] = {}
    for angle, factors in angles.items():
        kind, bare = angle
        step = common_measure([abs(factor) for factor in factors])
        if kind == EXPONENTIAL and all(factor < 0 for factor in factors):
            # exp(-u) stays so: its reciprocal may overflow where exp(-u) is only small.
            step = -step
        if angle in halved:
            step = step / 2
        steps[angle] = step
        if kind == EXPONENTIAL:
            exponentials[angle] = len(names)
            names.append(sp.exp(step * bare))
            continue
        place = len(names)
        sign = 1 if kind == CIRCULAR else -1
        pairs[angle] = Pair(angle=step * bare, sine=place, cosine=place + 1, sign=sign)
        names += waves(step * bare, sign)
    return Generators(names=tuple(names), pairs=pairs, exponentials=exponentials, steps=steps)


def waves(angle: sp.Expr, sign: int) -> tuple[sp.Expr, sp.Expr]:
    """Return sine and cosine, hyperbolic for sign -1."""
    if sign > 0:
        return sp.sin(angle), sp.cos(angle)
    return sp.sinh(angle), sp.cosh(angle)


def kind_of(node: sp.Basic) -> str:
    """Return the kind of a function of an angle or exponent, "" for anything else."""
    return _KINDS.get(node.func, "")


def is_integer_power(node: sp.Basic) -> bool:
    """Return whether a node is a power that polynomials may contain."""
    return isinstance(node, sp.Pow) and isinstance(node.exp, sp.Integer)


def is_real_power(node: sp.Basic) -> bool:
    """Return whether a node is a power whose exponent is not a rational number."""
    return isinstance(node, sp.Pow) and not isinstance(node.exp, sp.Rational)


def angle_of(node: sp.Basic) -> tuple[sp.Rational, Angle]:
    """Return the rational factor and the rest of an argument; commensurate arguments share the rest."""
    factor, remainder = node.args[0].primitive()
    inner, remainder = remainder.as_coeff_Mul()
    factor *= inner
    if remainder.could_extract_minus_sign():
        factor, remainder = -factor, -remainder
    return factor, (_KINDS[node.func], remainder)


def root_of(node: sp.Basic) -> sp.Basic:
    """Return the generator of which ``node`` is an integer power."""
    if isinstance(node, sp.Pow) and isinstance(node.exp, sp.Rational):
        return sp.Pow(node.base, sp.Rational(1, node.exp.q))
    return node


def slope(node: sp.Basic, variable: sp.Symbol) -> sp.Expr:
    """Return the expression that determines the derivative of a generator in terms of the generators.

    For angles and exponents that is the derivative of the argument, for u**p the logarithmic
    derivative (which needs no further power of u), for the q-th root y = u**(1/q) it is
    u'/(q*y**(q - 1)), for other functions the derivative itself.
    """
    if node.func in _KINDS:
        return differentiate(node.args[0], variable)
    if is_real_power(node):
        base, exponent = node.args
        logarithmic = exponent * differentiate(base, variable) / base
        if variable in exponent.free_symbols:
            logarithmic += sp.log(base) * differentiate(exponent, variable)
        return logarithmic
    if isinstance(node, sp.Pow):
        order = node.exp.q
        return differentiate(node.base, variable) / (order * node ** (order - 1))
    return differentiate(node, variable)
