"""V² along a motion: W(λ) = U(λ) + (v0² - U(lam0)) e^(-q), with q = ∫ Q dλ and U any solution of W' + Q W = P.

If Q = 0, U is an antiderivative of P; otherwise it is searched for among elementary functions (`particular_solution`).
If none is found, W is written as a quadrature, and if the law is not linear in W, as an unknown function.
"""

from dataclasses import dataclass
from itertools import pairwise, product

import sympy as sp

from gqm_sym.declare import Curve
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.rewrite import tidy
from gqm_sym.derivation.forces.dissipation import LOAD, PUSH, SIGMA, TURN, Dissipation
from gqm_sym.derivation.forces.forces import Forces
from gqm_sym.derivation.forces.particular_solution import particular_solution
from gqm_sym.derivation.geometry.geometry import Geometry
from gqm_sym.derivation.reality import tried_places
from gqm_sym.expressions import is_real_at
from gqm_sym.kernels.base import CONTACT_SIGN, DIRECTION, Kernel, W

LAM0 = sp.Symbol("lam0", real=True)
V0 = sp.Symbol("v0", real=True)
CLOSED, QUADRATURE, EQUATION = "closed", "quadrature", "equation"
_TEXTS = {
    CLOSED: "closed form",
    QUADRATURE: "spectral antiderivative, no elementary form found",
    EQUATION: "solved in space, for dV**2/ds = 2*A is not linear in it",
}

# The number of digits with which the derivative of a closed form is compared with P - Q W, and the largest difference
# as a share of their size.
_DIGITS = 40
_SHARE = sp.Rational(1, 10**25)


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedField:
    """W = V² as a function of λ, ``lam0`` and ``v0``.

    Attributes
    ----------
    squared
        W.
    form
        ``closed``, ``quadrature`` (W contains an Integral) or ``equation`` (W is an unknown function).
    gain
        dW/d(v0²), if W is a closed form, which is linear in v0².
    """

    squared: sp.Expr
    form: str
    gain: sp.Expr | None = None

    @property
    def in_other_forms(self) -> sp.Expr:
        """Return W for use in other forms: W itself if it is closed, otherwise its symbol."""
        return self.squared if self.form == CLOSED else W

    @property
    def note(self) -> str:
        """The kind of the form, and the meaning of the signs in it."""
        meanings = {DIRECTION: "the sign of ds/dt", CONTACT_SIGN: "the sign of N"}
        found = [f"{s.name} is {text}" for s, text in meanings.items() if s in self.squared.free_symbols]
        jumps = ["atan2 is continued without its jumps by 2*pi"] if self.squared.has(sp.atan2) else []
        return "; ".join([f"V**2: {_TEXTS[self.form]}", *found, *jumps])


def conservative_speed(law: Forces, lam: sp.Symbol) -> SpeedField:
    """Return W for a motion without losses."""
    squared = V0**2 + tidy(2 * (law.effective_potential.xreplace({lam: LAM0}) - law.effective_potential))
    return SpeedField(squared=squared, form=CLOSED, gain=sp.S.One)


def dissipative_speed(
    kernel: Kernel,
    law: Forces,
    shape: Geometry,
    loss: Dissipation,
    curve: Curve,
) -> SpeedField:
    """Return W for a motion along one leg, in closed form if one is found."""
    lam = curve.parameter
    if not loss.linear:
        return SpeedField(squared=sp.Function(W.name, real=True)(lam), form=EQUATION)
    side = sp.Symbol("|κ|/κ", real=True)
    # The pieces of the law without the absolute values in σ, and their antiderivatives if these are known.
    table: dict[sp.Expr, tuple[sp.Expr, sp.Expr | None]] = {
        SIGMA * PUSH: (-kernel.inertia * law.effective_potential_slope, -kernel.inertia * law.effective_potential),
        SIGMA * LOAD: (law.pressure, None),
        TURN: (shape.turning_rate, shape.angle),
        sp.Abs(TURN): (side * shape.turning_rate, None if shape.angle is None else side * shape.angle),
    }
    drive, decay = (_Sum(form, table, shape.ds, lam) for form in (loss.drive, loss.decay))
    spent = decay.antiderivative()
    ground = drive.antiderivative() if not decay.rate else particular_solution(drive.rate, decay.rate, lam, _SIGNS)
    # κ has one sign on a leg, which ends where κ changes sign; it may begin where κ is zero.
    signed = {side: sp.Abs(shape.kappa) / shape.kappa if shape.kappa else sp.S.Zero}
    if spent is not None and ground is not None:
        start = {lam: LAM0}
        gain = sp.exp(-tidy(spent - spent.xreplace(start)))
        launch = ground.xreplace(start)
        squared = V0**2 + tidy(ground - launch) if gain == 1 else ground + (V0**2 - launch) * gain
        squared = squared.xreplace(signed)
        # A charted curve has no coordinates before it is traced; the only closed forms on it are those of Φ and Θ.
        if curve.charted or _agrees(squared, loss, lam, curve.domain):
            return SpeedField(squared=squared, form=CLOSED, gain=gain)
    return SpeedField(squared=_quadrature(drive.rate.xreplace(signed), decay.rate, spent, lam), form=QUADRATURE)


_SIGNS = (DIRECTION, CONTACT_SIGN)


class _Sum:
    """A form in terms of the pieces, as a sum over the curve's quantities in it."""

    def __init__(
        self,
        form: sp.Expr,
        table: dict[sp.Expr, tuple[sp.Expr, sp.Expr | None]],
        ds: sp.Expr,
        lam: sp.Symbol,
    ) -> None:
        remainder = sp.expand(form)
        self.lam = lam
        self.known, self.unknown = sp.S.Zero, sp.S.Zero
        known_rate = sp.S.Zero
        for piece, (rate, whole) in table.items():
            coefficient = remainder.coeff(piece)
            remainder -= sp.expand(coefficient * piece)
            if whole is None or lam in coefficient.free_symbols:
                self.unknown += coefficient * rate
            else:
                self.known += coefficient * whole
                known_rate += coefficient * rate
        self.unknown += sp.factor_terms(remainder).xreplace({SIGMA: ds})
        self.rate = tidy(known_rate + self.unknown)

    def antiderivative(self) -> sp.Expr | None:
        """Return an antiderivative with respect to λ, or None if no elementary one was found."""
        found = particular_solution(self.unknown, sp.S.Zero, self.lam, _SIGNS)
        return None if found is None else self.known + found


def _agrees(squared: sp.Expr, loss: Dissipation, lam: sp.Symbol, domain: tuple[sp.Expr | None, sp.Expr | None]) -> bool:
    """Return whether the derivative of a closed form agrees with the law, at a place of the curve and at values of all
    other symbols.
    """
    # Each term is evaluated separately, because no number of digits is enough for SymPy to evaluate a sum that is zero.
    terms = (differentiate(squared, lam), -loss.along(loss.drive), loss.along(loss.decay) * squared)
    named = [*terms, *(end for end in domain if end is not None)]
    free = sorted(set().union(*(form.free_symbols for form in named)) - {lam, LAM0, *_SIGNS}, key=str)
    values = {symbol: sp.Rational(7 + 2 * place, 11 + place) for place, symbol in enumerate(free)}
    low, high = (None if end is None else end.xreplace(values) for end in domain)
    tried = tried_places((low, high))
    for signs in product((sp.S.One, sp.S.NegativeOne), repeat=2):
        for here, there in pairwise(tried):
            at = {**values, **dict(zip(_SIGNS, signs, strict=True)), lam: here, LAM0: there}
            if not all(is_real_at(term, at) for term in terms):
                continue
            parts = [term.xreplace(at).evalf(_DIGITS) for term in terms]
            if abs(sum(parts)) > _SHARE * (1 + sum(abs(part) for part in parts)):
                return False
            break
        else:
            return False
    return True


def _quadrature(drive: sp.Expr, decay: sp.Expr, spent: sp.Expr | None, lam: sp.Symbol) -> sp.Expr:
    """Write W as an integral whose exponents do not grow along the motion."""
    between, inner = (sp.Symbol(f"{mark}{lam.name}", real=True) for mark in ("_", "__"))

    def loss(start: sp.Symbol) -> sp.Expr:
        if spent is None:
            return sp.Integral(decay.xreplace({lam: inner}), (inner, start, lam))
        return tidy(spent - spent.xreplace({lam: start}))

    total = V0**2 * sp.exp(-loss(LAM0))
    if not drive:
        return total
    return total + sp.Integral(sp.exp(-loss(between)) * drive.xreplace({lam: between}), (between, LAM0, lam))
