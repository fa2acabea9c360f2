"""The derivatives of F for an implicit curve F(x, z) = 0, its tangent and curvature (paper, eq. 36; ERRATA A9)."""

from dataclasses import dataclass

import sympy as sp

from gqm_sym.declare import Curve
from gqm_sym.declare.implicit import Level, X, Z
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.errors import DeclarationError


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelSet:
    """F and the functions that follow from it, in terms of x, z and run-time parameters.

    Attributes
    ----------
    level
        The declaration.
    value, slope_x, slope_z
        F and its gradient.
    bend_xx, bend_xz, bend_zz
        Its second derivatives.
    along, across
        The unit tangent: (-F_z, F_x)/|grad F|, or the opposite.
    kappa
        The signed curvature for this tangent.
    """

    level: Level
    value: sp.Expr
    slope_x: sp.Expr
    slope_z: sp.Expr
    bend_xx: sp.Expr
    bend_xz: sp.Expr
    bend_zz: sp.Expr
    along: sp.Expr
    across: sp.Expr
    kappa: sp.Expr

    @property
    def rows(self) -> tuple[sp.Expr, ...]:
        """The functions by which the runtime traces the curve: F, F_x, F_z, F_xx, F_xz and F_zz."""
        return (self.value, self.slope_x, self.slope_z, self.bend_xx, self.bend_xz, self.bend_zz)

    def closed_forms(self) -> tuple[tuple[str, sp.Expr], ...]:
        """Return the forms as they are printed."""
        return (
            ("F", self.value),
            ("dF/dx", self.slope_x),
            ("dF/dz", self.slope_z),
            ("d2F/dx2", self.bend_xx),
            ("d2F/dxdz", self.bend_xz),
            ("d2F/dz2", self.bend_zz),
        )

    @property
    def note(self) -> str:
        """A remark on the rows of the chart, which follow from these forms."""
        x, z = self.level.start
        sign = "" if self.level.tangent > 0 else "-"
        return (
            f"On F = 0 arc length is 0 at ({x}, {z}) and grows along {sign}(-F_z, F_x)/|grad F|; "
            f"kappa = {sign}(F_xx*F_z**2 - 2*F_xz*F_x*F_z + F_zz*F_x**2)/|grad F|**3."
        )


def level_set(curve: Curve) -> LevelSet | None:
    """Derive gradient, Hessian, tangent and curvature of an implicit curve; None for any other.

    Raises
    ------
    DeclarationError
        If F does not change with x or z.
    """
    level = curve.definition
    if not isinstance(level, Level):
        return None
    f = level.value
    fx, fz = differentiate(f, X), differentiate(f, Z)
    if fx.is_zero and fz.is_zero:
        raise DeclarationError(f"implicit: F: {f} changes neither with x nor with z; the curve is where F(x, z) = 0")
    fxx, fxz, fzz = differentiate(fx, X), differentiate(fx, Z), differentiate(fz, Z)
    size = sp.sqrt(fx**2 + fz**2)
    return LevelSet(
        level=level,
        value=f,
        slope_x=fx,
        slope_z=fz,
        bend_xx=fxx,
        bend_xz=fxz,
        bend_zz=fzz,
        along=-level.tangent * fz / size,
        across=level.tangent * fx / size,
        kappa=level.tangent * (fxx * fz**2 - 2 * fxz * fx * fz + fzz * fx**2) / size**3,
    )
