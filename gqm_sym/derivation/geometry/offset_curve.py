"""The path of a rolling body's centre, beside the track that it rolls on."""

from dataclasses import replace

import sympy as sp

from gqm_sym.derivation.algebra.rewrite import tidy
from gqm_sym.derivation.geometry.geometry import Geometry


def offset_curve(x: sp.Expr, z: sp.Expr, shape: Geometry, radius: sp.Expr) -> tuple[sp.Expr, sp.Expr, Geometry]:
    """Return the curve at a distance to the left of another, in the same parameter (MATHS, section 2).

    Its tangent is that of the track, and its arc length element is ``1 - kappa*radius`` times that of the track; where
    this is not positive, the body does not fit.
    """
    if not radius:
        return x, z, shape
    share = 1 - shape.kappa * radius
    if not share.has(sp.exp, sp.sinh, sp.cosh):  # powers of these overflow in a common denominator
        share = sp.together(share)
    centre = replace(
        shape,
        size=tidy(shape.size * share),
        ds=tidy(shape.ds * share),
        kappa=tidy(shape.kappa / share),
    )
    return tidy(x - radius * shape.dzds), tidy(z + radius * shape.dxds), centre
