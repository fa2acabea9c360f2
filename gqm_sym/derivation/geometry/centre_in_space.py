"""The path of a rolling body's centre above a banked track in space."""

from dataclasses import replace

import sympy as sp

from gqm_sym.declare import Curve
from gqm_sym.declare.banking import Banking
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.rewrite import tidy
from gqm_sym.derivation.geometry.geometry import Geometry, Heading, geometry, vertical_plane
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import read_expression
from gqm_sym.parameters import Value

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]


def frame_of(shape: Geometry) -> tuple[Vector, Vector]:
    """Return the directions from which the roll angle is measured, horizontally to the left and upwards across the
    curve; in a vertical plane the latter is the normal.
    """
    if shape.heading is not None:
        cosine, sine = shape.heading
        along_x, along_y, along_z = shape.normal
        return (-sine, cosine, sp.S.Zero), (along_x, along_y, along_z)
    across, along, up = shape.tangent
    width = sp.sqrt(across**2 + along**2)
    return (-along / width, across / width, sp.S.Zero), (-up * across / width, -up * along / width, width)


def upward(shape: Geometry, angle: sp.Expr) -> Vector:
    """Return the upward direction at a roll angle."""
    left, above = frame_of(shape)
    cosine, sine = sp.cos(angle), sp.sin(angle)
    along_x, along_y, along_z = (one * cosine + side * sine for one, side in zip(above, left, strict=True))
    return along_x, along_y, along_z


def centre_in_space(curve: Curve, radius: sp.Expr, default: Value | None, may_be_positive: tuple[str, ...]) -> Curve:
    """Return the path of the centre of a body that rolls on a banked track, on the side to which its upward direction
    points.

    The direction from the track to the centre is across both curves. It is the upward direction of the new curve, whose
    height over the track is the radius.

    Parameters
    ----------
    curve
        The declared curve, which may itself be a heartline over the track.
    radius, default
        The radius of the body, and its value if it has one.
    may_be_positive
        Parameters that may be taken as positive.

    Raises
    ------
    DeclarationError
        If no roll is declared, or if it depends on the motion; and of a curve without formulas, unless the declared
        curve is the path of the centre.
    """
    banking = curve.banking
    if banking is None:
        raise DeclarationError(
            "derive: rolling: radius: on which side of a track in space the body rolls is not known; declare roll= as "
            "an angle (0 is upright)"
        )
    height = radius - banking.heartline
    if height == 0:
        return curve
    if curve.charted and default is not None and banking.heartline == read_expression(str(default), where="radius"):
        return replace(curve, banking=replace(banking, heartline=radius))
    if curve.charted:
        raise DeclarationError(
            "derive: rolling: radius: the path of the centre is derived along curves with formulas; here declare that "
            "path, with the radius as heartline="
        )
    if banking.angle is None:
        raise DeclarationError(
            "derive: rolling: radius: the place of the body's centre needs a roll that does not depend on forces; "
            "declare roll= as an angle"
        )
    heading = vertical_plane(curve)
    up = _upward_of(curve, banking.angle, heading, may_be_positive)
    place = (tidy(axis + height * part) for axis, part in zip((curve.x, curve.y, curve.z), up, strict=True))
    # In a vertical plane the tangent is that of the track, and an angle that does not change remains the same.
    is_same = heading is not None and curve.parameter not in banking.angle.free_symbols
    banked = Banking(angle=banking.angle if is_same else None, speed=None, heartline=radius, up=() if is_same else up)
    return replace(curve, **dict(zip("xyz", place, strict=True)), banking=banked)


def _upward_of(curve: Curve, angle: sp.Expr, heading: Heading | None, may_be_positive: tuple[str, ...]) -> Vector:
    """Return the upward direction of a curve with formulas at a roll angle.

    The lengths of dr/dλ and of its horizontal part are simplified each by themselves.
    """
    shape = geometry(curve, may_be_positive=may_be_positive, heading=heading)
    if heading is not None:
        return upward(shape, angle)
    lam = curve.parameter
    plan = replace(curve, kind="parametric", y=sp.S.Zero, z=curve.y, banking=None)
    width, size = geometry(plan, may_be_positive=may_be_positive).ds, shape.ds
    across, along, rise = (differentiate(axis, lam) for axis in (curve.x, curve.y, curve.z))
    cosine, sine = sp.cos(angle), sp.sin(angle)
    along_x = tidy(-rise * across / (size * width)) * cosine - tidy(along / width) * sine
    along_y = tidy(-rise * along / (size * width)) * cosine + tidy(across / width) * sine
    return along_x, along_y, tidy(width / size) * cosine
