"""A force law along a curve: potential, static normal load and tangential acceleration."""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.normal_form import shortest
from gqm_sym.derivation.algebra.rewrite import combine_absolute_values, magnitude, multiplied_out, tidy, without_waves
from gqm_sym.derivation.geometry.geometry import Geometry, Heading, cross
from gqm_sym.kernels.base import DIRECTION, Kernel, X, Y, Z

Place = tuple[sp.Expr, sp.Expr, sp.Expr]


@dataclass(frozen=True, slots=True, kw_only=True)
class Forces:
    """The applied forces along a curve, per unit mass.

    Attributes
    ----------
    potential
        Φ(λ).
    effective_potential
        U = Φ/inertia; W + 2U is constant if no energy is lost.
    effective_potential_slope
        dU/dλ.
    push
        F·t.
    static_normal_load
        n₀ = -F·n, the contact force per unit mass at rest; N/m = κ W + n₀. For a curve in no vertical plane its length.
    pressure
        σ n₀, without absolute values.
    loads
        For a curve in no vertical plane, the components of t × (-F); t × N/m = W t × dt/ds - t × F.
    coriolis
        For such a curve in a rotating frame, the components of the vector that is added to t × N/m for each unit of
        ds/dt.
    """

    potential: sp.Expr
    effective_potential: sp.Expr
    effective_potential_slope: sp.Expr
    push: sp.Expr
    static_normal_load: sp.Expr
    pressure: sp.Expr
    loads: tuple[sp.Expr, ...] = ()
    coriolis: tuple[sp.Expr, ...] = ()


def potential_gradient(place: Place, kernel: Kernel) -> tuple[sp.Expr, ...]:
    """Return the derivatives of the potential with respect to x, y and z along a curve, and the potential itself."""
    # The force is found before the coordinates are inserted, because the curve's own symbols may be called x or z.
    axes = (X, Y, Z)
    written = (*(differentiate(kernel.potential, axis) for axis in axes), kernel.potential)
    return tuple(form.xreplace(dict(zip(axes, place, strict=True))) for form in written)


def turned_force(
    curvature_binormal: Sequence[sp.Expr],
    loads: Sequence[sp.Expr],
    coriolis: Sequence[sp.Expr],
    w: sp.Expr,
    direction: sp.Expr = DIRECTION,
) -> tuple[sp.Expr, ...]:
    """Return the vector t × N/m at V² = w, which has the length of N/m; ``direction`` is the sign of ds/dt."""
    fixed = (turn * w + load for turn, load in zip(curvature_binormal, loads, strict=True))
    return tuple(
        part + direction * sp.sqrt(w) * aside for part, aside in zip(fixed, coriolis or (0, 0, 0), strict=True)
    )


def is_planar(heading: Heading, place: Place, kernel: Kernel) -> bool:
    """Return whether it is proved that no force acts across a vertical plane, so that the contact force lies in the
    plane.

    The Coriolis force does act across it: `Forces` omits it from the contact force of a planar curve, but not from that
    of a space curve.
    """
    cosine, sine = heading
    pull_x, pull_y, *_ = potential_gradient(place, kernel)
    return bool(sp.expand(without_waves(cosine * pull_y - sine * pull_x)) == 0)


def forces(place: Place, kernel: Kernel, shape: Geometry, lam: sp.Symbol) -> Forces:
    """Insert the coordinates x, y and z of a curve, as functions of its parameter, into the force law."""
    written = potential_gradient(place, kernel)
    forms = [without_waves(form) for form in written]
    pull_x, pull_y, pull_z, potential = forms
    if shape.heading is None:
        return _in_space((pull_x, pull_y, pull_z), potential, kernel, shape)
    cosine, sine = shape.heading
    pull_x = cosine * pull_x + sine * pull_y
    # (F_x, F_z) is rotated into the frame of the tangent before the length of the tangent is introduced, so that a
    # common root stays one factor.
    push = tidy(pull_x * shape.along + pull_z * shape.across)
    load = tidy(pull_z * shape.along - pull_x * shape.across)
    if forms != list(written):
        # Along a curve about the centre of a force most of its components cancel.
        push, load = (multiplied_out(form) for form in (push, load))
        if shape.cusp is None:
            push = shortest([push, tidy(differentiate(potential, lam) / shape.size)])
    return Forces(
        potential=potential,
        effective_potential=tidy(potential / kernel.inertia),
        effective_potential_slope=push * shape.size / kernel.inertia,
        push=combine_absolute_values(-push * shape.per_length),
        static_normal_load=combine_absolute_values(load * shape.per_length),
        pressure=load * shape.size,
    )


def _in_space(pull: Place, potential: sp.Expr, kernel: Kernel, shape: Geometry) -> Forces:
    """Return the forces along a curve in no vertical plane."""
    tangent = (shape.along, shape.sideways, shape.across)
    push = tidy(sp.Add(*(part * rate for part, rate in zip(pull, tangent, strict=True))))
    crossed = [tidy(part) for part in cross(tangent, pull)]
    load = tidy(sp.sqrt(without_waves(sp.Add(*(part**2 for part in crossed)))))
    return Forces(
        potential=potential,
        effective_potential=tidy(potential / kernel.inertia),
        effective_potential_slope=push * shape.size / kernel.inertia,
        push=combine_absolute_values(-push * shape.per_length),
        static_normal_load=load * magnitude(shape.per_length),
        pressure=load * magnitude(shape.size),
        loads=tuple(combine_absolute_values(part * shape.per_length) for part in crossed),
        coriolis=_coriolis(kernel.spin, shape) if kernel.spin else (),
    )


def _coriolis(spin: sp.Expr, shape: Geometry) -> Place:
    """Return the components of 2 Ω t × (ẑ × t)."""
    across, along, up = shape.tangent
    return -2 * spin * up * across, -2 * spin * up * along, 2 * spin * (across**2 + along**2)
