"""The equation of motion along a curve from its definitions alone, in mpmath: slow, obvious, and not the code's own.

Newton's law along the tangent, per unit mass (paper, eq. 20 with the corrections of its errata)::

    inertia * dV/dt = F.t - v*R - v*c*V**2 - v*mu*|N|/m,    N/m = kappa*V**2 - F.n
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

from mpmath import mp, mpf

Number = Callable[[mpf], mpf]
DIGITS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Textbook:
    """A curve by its coordinates, and the forces on a body that moves along it.

    ``push`` gives (F_x, F_z) at (x, z), per unit mass. ``resistance`` is a function of the curvature, ``law`` of λ, x,
    z, W and v. ``spin`` is the angular velocity about the z axis; its centrifugal force belongs into ``push``.
    """

    x: Number
    z: Number
    push: Callable[[mpf, mpf], tuple[mpf, mpf]] = lambda _x, _z: (mpf(0), -mpf("9.81"))
    resistance: Number = lambda _: mpf(0)
    drag: mpf = field(default_factory=lambda: mpf(0))
    mu: mpf = field(default_factory=lambda: mpf(0))
    mu_static: mpf = field(default_factory=lambda: mpf(0))
    spin: mpf = field(default_factory=lambda: mpf(0))
    inertia: mpf = field(default_factory=lambda: mpf(1))
    law: Callable[..., mpf] = lambda *_: mpf(0)

    def shape(self, lam: mpf) -> tuple[mpf, mpf, mpf, mpf]:
        """Return σ, both components of the tangent, and the curvature."""
        return _shape(self.x, self.z, lam, mp.prec)

    def forces(self, lam: mpf) -> tuple[mpf, mpf]:
        """Return F·t, and n₀ = -F·n with n a quarter turn to the left of t."""
        _, tx, tz, _ = self.shape(lam)
        fx, fz = self.push(self.x(lam), self.z(lam))
        return fx * tx + fz * tz, fx * tz - fz * tx

    def acceleration(self, lam: mpf, w: mpf, v: int, nu: int | None = None, *, held: bool = False) -> mpf:
        """Return A of a body at speed √w in direction v; ``nu`` stands for the sign of N if it is given."""
        _, tx, _, kappa = self.shape(lam)
        push, load = self.forces(lam)
        normal = kappa * w + load
        pressed = mp.hypot(normal, 2 * self.spin * mp.sqrt(w) * tx) if nu is None else nu * normal
        braking = self.resistance(kappa) + self.drag * w + (self.mu_static if held else self.mu) * pressed
        return (push - v * braking + self.law(lam, self.x(lam), self.z(lam), w, v)) / self.inertia

    def rate(self, lam: mpf, w: mpf, v: int, nu: int | None = None) -> mpf:
        """Return dW/dλ."""
        return 2 * self.shape(lam)[0] * self.acceleration(lam, w, v, nu)

    def centre(self, radius: mpf) -> "Textbook":
        """Return the curve of the centre of a body of this radius, to the left of the curve."""

        def across(lam: mpf) -> tuple[mpf, mpf]:
            _, tx, tz, _ = self.shape(lam)
            return -tz, tx

        return replace(
            self,
            x=lambda lam: self.x(lam) + radius * across(lam)[0],
            z=lambda lam: self.z(lam) + radius * across(lam)[1],
        )


@lru_cache(maxsize=4096)
def _shape(x: Number, z: Number, lam: mpf, _precision: int) -> tuple[mpf, mpf, mpf, mpf]:
    """Return `shape`, cached, because all terms of an equation need it, and quadratures for either sign at the same
    places.
    """
    dx, dz = mp.diff(x, lam), mp.diff(z, lam)
    ddx, ddz = mp.diff(x, lam, 2), mp.diff(z, lam, 2)
    ds = mp.hypot(dx, dz)
    return ds, dx / ds, dz / ds, (dx * ddz - dz * ddx) / ds**3
