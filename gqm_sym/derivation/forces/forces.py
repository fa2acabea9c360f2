"""What a force law becomes along a curve: potential, static normal load and tangential acceleration."""

from dataclasses import dataclass

import sympy as sp

from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.normal_form import shortest
from gqm_sym.derivation.algebra.rewrite import absorb_bars, multiplied_out, tidy, without_waves
from gqm_sym.derivation.geometry.geometry import Geometry
from gqm_sym.kernels.base import Kernel, X, Z


@dataclass(frozen=True, slots=True, kw_only=True)
class Forces:
    """The applied forces along a curve, per unit mass.

    Attributes
    ----------
    potential
        Φ(λ).
    effective_potential
        U = Φ/inertia, so that W + 2U is constant where nothing is lost.
    effective_potential_slope
        dU/dλ.
    push
        F·t.
    static_normal_load
        n₀ = -F·n: what the track carries at rest; N/m = κ W + n₀.
    pressure
        σ n₀, in which no absolute values are left.
    """

    potential: sp.Expr
    effective_potential: sp.Expr
    effective_potential_slope: sp.Expr
    push: sp.Expr
    static_normal_load: sp.Expr
    pressure: sp.Expr


def forces(x: sp.Expr, z: sp.Expr, kernel: Kernel, shape: Geometry, lam: sp.Symbol) -> Forces:
    """Put the coordinates of a curve in its parameter into the force law."""
    along = {X: x, Z: z}
    # The force before the coordinates are put in: the curve's own symbols may be called x or z.
    written = [
        form.xreplace(along)
        for form in (differentiate(kernel.potential, X), differentiate(kernel.potential, Z), kernel.potential)
    ]
    pull_x, pull_z, potential = forms = [without_waves(form) for form in written]
    # (F_x, F_z) turned into the tangent's frame, before the length of the tangent comes in: a
    # common root stays one piece.
    push = tidy(pull_x * shape.along + pull_z * shape.across)
    load = tidy(pull_z * shape.along - pull_x * shape.across)
    if forms != written:
        # Along a curve about the centre of a force most of its components cancels.
        push, load = (multiplied_out(form) for form in (push, load))
        if shape.cusp is None:
            push = shortest([push, tidy(differentiate(potential, lam) / shape.size)])
    return Forces(
        potential=potential,
        effective_potential=tidy(potential / kernel.inertia),
        effective_potential_slope=push * shape.size / kernel.inertia,
        push=absorb_bars(-push * shape.per_length),
        static_normal_load=absorb_bars(load * shape.per_length),
        pressure=load * shape.size,
    )
