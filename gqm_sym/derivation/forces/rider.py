"""The loads on a rider of a banked track, in closed form.

With t × N/m = T the contact force has the component T·(t × u) along any unit vector u across the track. Riders sit
upright along u = u₀ cos ψ + l₀ sin ψ, where l₀ is horizontal and points to the left, u₀ = t × l₀, and ψ is the roll
angle. In a vertical plane u₀ is the normal, so that it is also defined where the tangent is vertical. On a track
without lateral force, u is parallel to N at the speed of the motion or at a declared speed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from gqm_sym.declare.banking import Banking
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.forces.forces import Forces, Place, turned_force
from gqm_sym.derivation.geometry.centre_in_space import frame_of, upward
from gqm_sym.derivation.geometry.geometry import Geometry, cross
from gqm_sym.kernels.base import DIRECTION, W

STANDARD_GRAVITY = sp.Rational(980665, 100000)
"""The unit of loads, in m/s²."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rider:
    """Closed forms in λ, W = V² and the signs of ds/dt and of N.

    Attributes
    ----------
    loads
        The loads on a rider along the rider's upward direction, to the left and forwards, in units of 9.80665 m/s².
    onsets
        The rates of change of the loads, per second.
    roll
        Cosine and sine of the roll angle, each times a positive number.
    up
        The rider's upward direction.
    level
        The square of the tangent's horizontal component, if the roll angle is measured from the horizontal; else 1.
    """

    loads: Place
    onsets: Place
    roll: tuple[sp.Expr, sp.Expr]
    up: Place
    level: sp.Expr

    @property
    def forms(self) -> tuple[sp.Expr, ...]:
        """All closed forms."""
        return (*self.loads, *self.onsets, *self.roll, *self.up, self.level)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Seat:
    """The force on a rider per unit mass, upwards and to the left, and the rider's upward direction."""

    vertical: sp.Expr
    lateral: sp.Expr
    roll: tuple[sp.Expr, sp.Expr]
    up: Place
    level: sp.Expr = sp.S.One


def rider(banking: Banking, shape: Geometry, law: Forces, acceleration: sp.Expr, lam: sp.Symbol) -> Rider:
    """Derive the loads on a rider.

    Parameters
    ----------
    banking
        The banking of the track.
    shape, law
        The curve and the applied forces along it.
    acceleration
        A in terms of λ and W; dW/ds = 2 A.
    lam
        The curve's parameter.
    """
    seat = _in_plane(banking, shape, law) if shape.heading is not None else _in_space(banking, shape, law, lam)
    # The longitudinal load contains all forces except that of the potential.
    felt = (seat.vertical, seat.lateral, acceleration - law.push)
    vertical, lateral, ahead = (load / STANDARD_GRAVITY for load in felt)

    def onset(load: sp.Expr) -> sp.Expr:
        change = differentiate(load, lam) / shape.ds + 2 * acceleration * differentiate(load, W)
        return DIRECTION * sp.sqrt(W) * change

    return Rider(
        loads=(vertical, lateral, ahead),
        onsets=(onset(vertical), onset(lateral), onset(ahead)),
        roll=seat.roll,
        up=seat.up,
        level=seat.level,
    )


def upright_force(banking: Banking, shape: Geometry, law: Forces, lam: sp.Symbol) -> tuple[sp.Expr, ...]:
    """Return n₀ and κ for which κ W + n₀ is the component of N/m along the rider's upward direction; in a rotating
    frame a third number, which is added to it for each unit of ds/dt.

    There are none in a vertical plane, where N has a sign, and if that direction depends on the motion.
    """
    if shape.heading is not None or not has_upward_direction(banking):
        return ()
    upright = _in_space(banking, shape, law, lam).vertical
    load = upright.xreplace({W: sp.S.Zero})
    if not law.coriolis:
        return load, differentiate(upright, W)
    return (
        load,
        differentiate(upright.xreplace({DIRECTION: sp.S.Zero}), W),
        differentiate(upright, DIRECTION).xreplace({W: sp.S.One}),
    )


def has_upward_direction(banking: Banking | None) -> bool:
    """Return whether the upward direction of riders is that of the track, whatever the motion."""
    return banking is not None and not (banking.angle is None and banking.speed is None and not banking.up)


def _in_plane(banking: Banking, shape: Geometry, law: Forces) -> _Seat:
    """Return the force on a rider in a vertical plane, where the contact force is along the normal and has no lateral
    component.
    """
    force, (upright, tilted) = shape.kappa * W + law.static_normal_load, _roll(banking, shape)
    return _Seat(vertical=force * upright, lateral=-force * tilted, roll=(upright, tilted), up=_upward(banking, shape))


def _in_space(banking: Banking, shape: Geometry, law: Forces, lam: sp.Symbol) -> _Seat:
    if banking.up:
        return _along_derived_curve(banking, shape, law, lam)
    tangent = shape.tangent
    across, along, _ = tangent
    turned = _turned(shape, law, W)
    if banking.angle is None:
        loaded = turned if banking.speed is None else _turned(shape, law, banking.speed**2, forwards=sp.S.One)
        size = sp.sqrt(sp.Add(*(part**2 for part in loaded)))
        up_x, up_y, up_z = (part / size for part in cross(loaded, tangent))
        roll = (loaded[0] * along - loaded[1] * across, loaded[2])
        if banking.speed is None:
            return _Seat(vertical=size, lateral=sp.S.Zero, roll=roll, up=(up_x, up_y, up_z))
        vertical, lateral = _dot(turned, loaded) / size, -_dot(cross(turned, tangent), loaded) / size
        return _Seat(vertical=vertical, lateral=lateral, roll=roll, up=(up_x, up_y, up_z))
    level = across**2 + along**2
    width = sp.sqrt(level)
    upwards, sideways = (turned[0] * along - turned[1] * across) / width, turned[2] / width
    upright, tilted = _roll(banking, shape)
    return _Seat(
        vertical=upwards * upright + sideways * tilted,
        lateral=sideways * upright - upwards * tilted,
        roll=(upright, tilted),
        up=_upward(banking, shape),
        level=level,
    )


def _along_derived_curve(banking: Banking, shape: Geometry, law: Forces, lam: sp.Symbol) -> _Seat:
    """Return the force on a rider whose upward direction u is known, with K·u = -t·du/ds and K·l = dt/ds·(u × t)."""
    tangent, up = shape.tangent, banking.up
    first, left = [shape.ds * part for part in tangent], cross(up, tangent)
    second = [differentiate(part, lam) for part in first]
    fixed = [
        load + DIRECTION * sp.sqrt(W) * aside for load, aside in zip(law.loads, law.coriolis or (0, 0, 0), strict=True)
    ]
    bend = -_dot(first, [differentiate(part, lam) for part in up])
    return _Seat(
        vertical=W * bend / shape.ds**2 - _dot(fixed, left),
        lateral=W * _dot(second, cross(up, first)) / shape.ds**3 + _dot(fixed, up),
        roll=_roll(banking, shape),
        up=_upward(banking, shape),
        level=tangent[0] ** 2 + tangent[1] ** 2,
    )


def _roll(banking: Banking, shape: Geometry) -> tuple[sp.Expr, sp.Expr]:
    """Return cosine and sine of the roll angle."""
    if banking.up:
        left, above = frame_of(shape)
        # What is upwards across the tangent has a vertical component that decides how much.
        return banking.up[2] / above[2], _dot(banking.up, left)
    angle = sp.S.Zero if banking.angle is None else banking.angle
    return sp.cos(angle), sp.sin(angle)


def _upward(banking: Banking, shape: Geometry) -> Place:
    """Return the upward direction of riders."""
    if banking.up:
        up_x, up_y, up_z = banking.up
        return up_x, up_y, up_z
    return upward(shape, sp.S.Zero if banking.angle is None else banking.angle)


def _turned(shape: Geometry, law: Forces, w: sp.Expr, forwards: sp.Expr = DIRECTION) -> Place:
    """Return the vector t × N/m at V² = w, for a motion forwards (1) or backwards (-1)."""
    along_x, along_y, along_z = turned_force(shape.curvature_binormal, law.loads, law.coriolis, w, forwards)
    return along_x, along_y, along_z


def _dot(one: Sequence[sp.Expr], other: Sequence[sp.Expr]) -> sp.Expr:
    return sp.Add(*(a * b for a, b in zip(one, other, strict=True)))
