"""The forces along the track of a train: its potential energy is the mean of that of a body over the length of the
train.

The potential is a sum of products of a factor, which depends on run-time parameters alone, and a part, which depends on
the coordinates. The mean of the height, and that of each other part, are known as functions of the place of the train's
middle in arc length.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import sympy as sp

from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.separate import separate
from gqm_sym.derivation.forces.forces import Forces, Place
from gqm_sym.errors import DeclarationError
from gqm_sym.kernels.base import DIRECTION, Kernel, W, X, Y, Z
from gqm_sym.sympy_charts import MEAN_HEIGHT, MEAN_PARTS, SpaceFunction, train_load, train_load_in_plane


@dataclass(frozen=True, slots=True)
class PotentialParts:
    """The potential of a body as a sum.

    Attributes
    ----------
    gravity
        The factor of the height.
    factors, parts
        The factors of the other parts, and these parts as functions of the coordinates.
    constant
        What does not depend on the place.
    """

    gravity: sp.Expr
    factors: tuple[sp.Expr, ...]
    parts: tuple[sp.Expr, ...]
    constant: sp.Expr

    @property
    def means(self) -> tuple[tuple[sp.Expr, tuple[type[SpaceFunction], ...]], ...]:
        """Each factor with the functions for the mean of its part and for the derivatives of that."""
        height = ((self.gravity, MEAN_HEIGHT),) if self.gravity else ()
        return (*height, *zip(self.factors, MEAN_PARTS, strict=False))


def potential_parts(potential: sp.Expr) -> PotentialParts:
    """Return a potential as a sum; parts of which there are no charts left are added up in the last one."""
    held: set[sp.Symbol] = set()
    while True:
        before = set(held)
        found = separate(potential, (X, Y, Z), held)
        if held == before:
            break
    constant, gravity = (found.pop(part, sp.S.Zero) for part in (sp.S.One, Z))
    pairs = [(factor, part) for part, factor in found.items()]
    most = len(MEAN_PARTS)
    if len(pairs) > most:
        remainder = sp.Add(*(factor * part for factor, part in pairs[most - 1 :]))
        pairs[most - 1 :] = [(sp.S.One, remainder)]
    return PotentialParts(gravity, tuple(factor for factor, _ in pairs), tuple(part for _, part in pairs), constant)


def rates_along(part: sp.Expr, place: Place, tangent: Sequence[sp.Expr], bend: Sequence[sp.Expr]) -> Place:
    """Return a function of the coordinates at a place of a curve, and its first two derivatives by arc length.

    Parameters
    ----------
    part
        The function, in the coordinates of potentials.
    place, tangent, bend
        The coordinates of the place, and their first two derivatives with respect to arc length.
    """
    axes, at = (X, Y, Z), dict(zip((X, Y, Z), place, strict=True))
    slopes = [differentiate(part, axis) for axis in axes]
    first = sp.Add(*(slope * rate for slope, rate in zip(slopes, tangent, strict=True)))
    second = sp.Add(*(slope * change for slope, change in zip(slopes, bend, strict=True)))
    second += sp.Add(
        *(
            differentiate(slope, axis) * rate * other
            for slope, rate in zip(slopes, tangent, strict=True)
            for axis, other in zip(axes, tangent, strict=True)
        )
    )
    value, along, curved = (form.xreplace(at) for form in (part, first, second))
    return value, along, curved


def of_train(law: Forces, kernel: Kernel, lam: sp.Symbol) -> Forces:
    """Return the forces along the track of a train, whose potential is a mean.

    The contact force remains that of a body at the middle of the train, and so do `Forces.loads`.

    Raises
    ------
    DeclarationError
        If there is no potential.
    """
    whole = potential_parts(kernel.potential)
    if not whole.means:
        raise DeclarationError("derive: train: no potential acts on it; add Gravity() or another potential")
    potential = whole.constant + sp.Add(*(factor * heads[0](lam) for factor, heads in whole.means))
    slope = sp.Add(*(factor * heads[1](lam) for factor, heads in whole.means))
    return replace(
        law,
        potential=potential,
        effective_potential=potential / kernel.inertia,
        effective_potential_slope=slope / kernel.inertia,
        push=-slope,
    )


def load_of_cars(kernel: Kernel, lam: sp.Symbol, *, in_space: bool) -> sp.Expr:
    """Return the mean of |N|/m over the cars of a train, to which friction is proportional."""
    whole = potential_parts(kernel.potential)
    head, cars = train_load if in_space else train_load_in_plane, sp.Integer(kernel.cars)
    turning, others = 2 * kernel.spin * DIRECTION, sp.Integer(bool(whole.parts))
    return head(lam, W, kernel.train_length, cars, whole.gravity, turning, others)


def loads_along(
    potential: sp.Expr, place: Place, tangent: Sequence[sp.Expr], bend: Sequence[sp.Expr], *, in_space: bool
) -> tuple[sp.Expr, ...]:
    """Return the static load per unit mass on a body across a track, the components of the gradient of a potential
    that are normal to the track: along x, y and z, or along the normal of a planar track.

    Parameters
    ----------
    potential, place, tangent, bend
        As in `rates_along`.
    in_space
        Whether the track is a curve in space.

    Returns
    -------
    tuple
        The potential, the component and its derivative by arc length, for each component.
    """
    slopes = [differentiate(potential, axis) for axis in (X, Y, Z)]
    rows = [rates_along(slope, place, tangent, bend)[:2] for slope in slopes]
    gradient, change = ([row[k] for row in rows] for k in (0, 1))
    value, along, _ = rates_along(potential, place, tangent, bend)
    bent = sp.Add(*(a * b for a, b in zip(gradient, bend, strict=True)))
    turned = sp.Add(*(a * b for a, b in zip(change, tangent, strict=True))) + bent
    found: list[sp.Expr] = []
    if not in_space:
        dxds, _, dzds = tangent
        curvature = dxds * bend[2] - dzds * bend[0]
        load = gradient[2] * dxds - gradient[0] * dzds
        return value, load, change[2] * dxds - change[0] * dzds - curvature * along
    for axis in range(3):
        load = gradient[axis] - along * tangent[axis]
        found += [value, load, change[axis] - turned * tangent[axis] - along * bend[axis]]
    return tuple(found)


def notes_of_train(kernel: Kernel) -> tuple[str, ...]:
    """Return what the symbols in the forms of a train mean that are not those of a body."""
    coordinates = {X: sp.Symbol("x"), Y: sp.Symbol("y"), Z: sp.Symbol("z")}
    whole = potential_parts(kernel.potential)
    return tuple(
        f"{heads[0].axis} is the mean of {part.xreplace(coordinates)} over the length of the train"
        for part, heads in zip(whole.parts, MEAN_PARTS, strict=False)
    )
