"""A force law that is not conservative, along a curve: dW/dλ = P - Q W, and the forces that hold a body at rest.

The law is first written in terms of the geometric quantities that it depends on, its *pieces* (σ, κ, dΘ/dλ, F·t, n₀ and
dx/ds), to which every force adds its terms; then the pieces are replaced by their closed forms. Emitted code computes
the pieces separately. At a cusp κ is infinite and σ zero; P and Q contain dΘ/dλ = σ κ, which is finite there.
"""

from dataclasses import dataclass

import sympy as sp

from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.signs import Signs
from gqm_sym.kernels.base import CONTACT_SIGN, DIRECTION, KAPPA, Kernel, W

# These names contain a mark that no text of a user can have.
SIGMA, TURN, PUSH, LOAD, TILT = (sp.Symbol(name, real=True) for name in ("σ", "dΘ/dλ", "F·t", "n₀", "dx/ds"))
TURNS = tuple(sp.Symbol(f"(t × dt/dλ)_{axis}", real=True) for axis in "xyz")
LOADS = tuple(sp.Symbol(f"-(t × F)_{axis}", real=True) for axis in "xyz")
UPRIGHT = tuple(sp.Symbol(name, real=True) for name in ("n₀·u", "κ·u", "2 Ω (ẑ × t)·u"))
CORIOLIS = tuple(sp.Symbol(f"2 Ω (t × (ẑ × t))_{axis}", real=True) for axis in "xyz")


@dataclass(frozen=True, slots=True, kw_only=True)
class Dissipation:
    """A force law along a curve, in terms of the sign v of ds/dt, the sign ν of the contact force, and W if the law is
    not linear.

    Attributes
    ----------
    pieces
        The symbols of the curve's quantities in the forms below, with their closed forms in λ.
    drive, decay
        P and Q in terms of the pieces; for a law that is not linear in W, its linearisation at W, where P - Q W is the
        law itself.
    acceleration
        The tangential acceleration A in terms of the pieces; dW/ds = 2 A.
    holds
        A of a body at rest that is about to move forwards or backwards, under static friction, in terms of the pieces.
    contact
        The contact force per unit mass in terms of the pieces: its value at rest, and the factor of W. For a curve in
        no vertical plane it has no sign, and if the law is not linear in W the first is the whole force; on a banked
        curve both are components along the upward direction of riders, and in a rotating frame the first is the whole
        component.
    squared_contact
        On a curve in no vertical plane, for one body: the coefficients of 1, W and W² in (N/m)², and the factor of
        -v |N|/m in dW/dλ, all in terms of the pieces. Apart from friction the law is linear in W. Empty for other laws.
    friction, kinked, linear
        Whether the law depends on the contact force, has a kink where κ changes sign, and is linear in W.
    """

    pieces: tuple[tuple[sp.Symbol, sp.Expr], ...]
    drive: sp.Expr
    decay: sp.Expr
    acceleration: sp.Expr
    holds: tuple[sp.Expr, sp.Expr]
    contact: tuple[sp.Expr, ...]
    squared_contact: tuple[sp.Expr, ...]
    friction: bool
    kinked: bool
    linear: bool

    def along(self, form: sp.Expr) -> sp.Expr:
        """Return a form in the pieces as a form in λ."""
        return form.xreplace(dict(self.pieces))


def dissipation(
    kernel: Kernel,
    pieces: dict[sp.Symbol, sp.Expr],
    coordinates: dict[sp.Symbol, sp.Expr],
    signs: Signs,
    mean_car_load: sp.Expr | None = None,
) -> Dissipation:
    """Put a curve into a force law that is not conservative.

    Parameters
    ----------
    kernel
        The force law.
    pieces
        Closed forms of SIGMA, KAPPA, TURN, PUSH, LOAD and TILT; on a curve in no vertical plane also of TURNS and
        LOADS, of CORIOLIS in a rotating frame, and of UPRIGHT if its riders have an upward direction.
    coordinates
        The coordinates along the curve, for a user's own law that contains them.
    signs
        The signs of expressions on the curve.
    mean_car_load
        The mean of |N|/m over the cars of a train, in λ and W; None for one body.
    """
    v, nu = DIRECTION, CONTACT_SIGN
    # The curvature of a curve in no vertical plane has no sign.
    resistance = _without_absolute_values(kernel.resistance, 1 if TURNS[0] in pieces else signs.sign(pieces[KAPPA]))
    extra = kernel.tangential_law.xreplace(coordinates)
    sliding, other, contact = v * nu * kernel.friction, extra, (LOAD, KAPPA)
    rubbing = sp.S.Zero
    if kernel.friction and mean_car_load is not None:
        contact, rubbing, sliding = (mean_car_load, sp.S.Zero), v * kernel.friction * SIGMA * mean_car_load, sp.S.Zero
    elif kernel.friction and TURNS[0] in pieces:
        # This is σ |N|/m, in which nothing is infinite at a cusp.
        vectors = zip(TURNS, LOADS, CORIOLIS if kernel.spin else (0, 0, 0), strict=True)
        parts = (turn * W + SIGMA * (load + v * sp.sqrt(W) * aside) for turn, load, aside in vectors)
        force = sp.sqrt(sp.Add(*(part**2 for part in parts)))
        contact, rubbing, sliding = (force / SIGMA, sp.S.Zero), v * kernel.friction * force, sp.S.Zero
    elif kernel.spin:
        # The contact force has a component out of the plane, so friction is not linear in W.
        sideways = 2 * kernel.spin * TILT
        other -= v * kernel.friction * sp.sqrt((LOAD + KAPPA * W) ** 2 + sideways**2 * W)
        sliding = sp.S.Zero
    if UPRIGHT[0] in pieces:
        still, turn, aside = UPRIGHT
        contact = (still + turn * W + v * sp.sqrt(W) * aside, sp.S.Zero) if kernel.spin else (still, turn)
    slope = differentiate(other, W)
    linear = W not in sp.expand(slope).free_symbols
    squared = _squared_contact(kernel) if linear and mean_car_load is None and TURNS[0] in pieces else ()
    # A contact force that is not linear in W is evaluated at the W of each step, as the law is.
    linear = linear and not rubbing and not (kernel.spin and UPRIGHT[0] in pieces)
    if linear:
        slope = sp.expand(slope)
    constant_part = sp.expand(other - slope * W) if linear else other - slope * W
    load = sp.Abs(LOAD) if mean_car_load is None else mean_car_load.xreplace({W: sp.S.Zero, v: sp.S.One})
    resisting, rubbing_slope = v * resistance.xreplace({KAPPA: TURN}), differentiate(rubbing, W)
    return Dissipation(
        pieces=tuple(pieces.items()),
        drive=2
        * (SIGMA * (PUSH - sliding * LOAD + constant_part) - resisting - (rubbing - rubbing_slope * W))
        / kernel.inertia,
        decay=2 * (SIGMA * (v * kernel.drag - slope) + sliding * TURN + rubbing_slope) / kernel.inertia,
        acceleration=(
            PUSH - v * resistance - v * kernel.drag * W - sliding * (LOAD + KAPPA * W) + other - rubbing / SIGMA
        )
        / kernel.inertia,
        holds=(
            _static_balance(kernel, resistance, extra, load, 1),
            _static_balance(kernel, resistance, extra, load, -1),
        ),
        contact=contact,
        squared_contact=squared,
        friction=bool(kernel.friction),
        kinked=bool(resistance.atoms(sp.Abs)),
        linear=linear,
    )


def _squared_contact(kernel: Kernel) -> tuple[sp.Expr, ...]:
    """Return the forms of `Dissipation.squared_contact`; nothing in a rotating frame, where N contains sqrt(W)."""
    if kernel.spin:
        return ()
    at_rest = sp.Add(*(load**2 for load in LOADS))
    mixed = sp.Add(*(2 * turn * load for turn, load in zip(TURNS, LOADS, strict=True))) / SIGMA
    turning = sp.Add(*(turn**2 for turn in TURNS)) / SIGMA**2
    return at_rest, mixed, turning, 2 * kernel.friction * SIGMA / kernel.inertia


def _static_balance(kernel: Kernel, resistance: sp.Expr, extra: sp.Expr, load: sp.Expr, direction: int) -> sp.Expr:
    against = resistance + kernel.static_friction * load
    return (
        PUSH - direction * against + extra.xreplace({DIRECTION: sp.Integer(direction), W: sp.S.Zero})
    ) / kernel.inertia


def _without_absolute_values(resistance: sp.Expr, sign: int | None) -> sp.Expr:
    """Replace |κ| by κ or -κ if the sign of κ is known, on a curve that bends in one direction only."""
    return resistance if sign is None else resistance.xreplace({sp.Abs(KAPPA): sign * KAPPA})
