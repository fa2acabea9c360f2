"""Curvature and contact force of a space curve, in the form that is evaluated.

The closed forms of a model are expanded, which is short to read for many curves. Where they are long they contain sines
of many angles, whose terms cancel. The definition

    N/m = W K + F - t (t·F),   K = dt/ds = (r'' - t (t·r''))/σ²,

with the derivatives of the declared coordinates, has the sines of the coordinates alone, and in it hardly anything
cancels. F is the force that holds the body at rest.
"""

from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import sympy
from sympy import Add, Expr, Function, Symbol, cos, sin

from gqm_sym.derivation import Model
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.algebra.rewrite import without_waves
from gqm_sym.derivation.forces.forces import potential_gradient
from gqm_sym.derivation.geometry.geometry import cross
from gqm_sym.emission.sharing import straight_line
from gqm_sym.kernels.base import DIRECTION, MASS

# What a sine costs in multiplications, and the reduction of its argument, which the cosine of that argument shares.
COST_OF_WAVE, COST_OF_ANGLE = 12, 12

# What quotients and roots cost, and other functions.
COST_OF_QUOTIENT, COST_OF_FUNCTION = 8, 30

# The closed forms are evaluated where they cost less than this part of the definition.
MUCH_SHORTER = 0.75

Vector = tuple[Expr, ...]


class Contact(NamedTuple):
    """What contact means at a place of a curve.

    Attributes
    ----------
    kappa
        The curvature.
    size
        N, or its length for a curve in no vertical plane.
    vector
        The components of N along x, y and z.
    """

    kappa: Expr
    size: Expr
    vector: Vector

    @property
    def forms(self) -> Vector:
        """All forms in one row."""
        return (self.kappa, self.size, *self.vector)

    def replaced(self, known: dict[Symbol, Expr]) -> "Contact":
        """Return the same forms with expressions in place of symbols."""
        kappa, size, *vector = (form.xreplace(known) for form in self.forms)
        return Contact(kappa, size, tuple(vector))


def contact_at(model: Model, v2: Expr) -> Contact:
    """Return curvature and contact force for a given value of V², in the cheaper and more accurate form.

    The direction of motion, on which the force in a rotating frame depends, is a symbol in it.
    """
    known = Contact(model.kappa, model.normal_force_at(v2), model.normal_force_vector_at(v2))
    if not model.loads or model.common_factor.has(model.parameter):
        return known
    whole = _by_definition(model, v2)
    mixed = whole._replace(kappa=model.kappa)
    costs = [(_cost(form.forms), form) for form in (whole, mixed)]
    cost, best = min(costs, key=lambda pair: pair[0])
    return known if _cost(known.forms) < MUCH_SHORTER * cost else best


def turned_parts(model: Model) -> tuple[Vector, Vector]:
    """Return the components of t × dt/dλ and of -t × F for a curve in no vertical plane, in the cheapest form."""
    bends, loads = tuple(model.ds * part for part in model.curvature_binormal), model.loads
    if not loads or model.common_factor.has(model.parameter):
        return bends, loads
    first, second = _derivatives(model)
    whole_bends = tuple(part / model.ds**2 for part in cross(first, second))
    whole_loads = tuple(part / model.ds for part in cross(first, _held(model)))
    choices = product((bends, whole_bends), (loads, whole_loads))
    return min(choices, key=lambda pair: _cost((*pair[0], *pair[1], model.ds)))


def _held(model: Model) -> Vector:
    """Return the force that holds the body at rest, per unit mass."""
    return tuple(without_waves(pull) for pull in potential_gradient((model.x, model.y, model.z), model.force)[:3])


def _derivatives(model: Model) -> tuple[list[Expr], list[Expr]]:
    """Return the first and second derivatives of the coordinates x, y and z."""
    first = [differentiate(form, model.parameter) for form in (model.x, model.y, model.z)]
    return first, [differentiate(form, model.parameter) for form in first]


def _by_definition(model: Model, v2: Expr) -> Contact:
    """Return curvature and contact force by the derivatives of the coordinates."""
    first, second = _derivatives(model)
    square = model.ds**2
    bends = _across(first, second, square)
    parts = [v2 * bend / square + part for bend, part in zip(bends, _across(first, _held(model), square), strict=True)]
    if model.coriolis:
        rate = 2 * model.force.spin * DIRECTION * sympy.sqrt(v2) / model.ds
        parts[0], parts[1] = parts[0] - rate * first[1], parts[1] + rate * first[0]
    return Contact(_length(bends) / square, MASS * _length(parts), tuple(MASS * part for part in parts))


def _across(tangent: list[Expr], vector: Iterable[Expr], square: Expr) -> list[Expr]:
    """Return the part of a vector across the tangent, given the tangent's square."""
    vector = list(vector)
    along = Add(*(one * other for one, other in zip(tangent, vector, strict=True))) / square
    return [part - rate * along for part, rate in zip(vector, tangent, strict=True)]


def _length(vector: Iterable[Expr]) -> Expr:
    return sympy.sqrt(Add(*(part**2 for part in vector)))


def _cost(outputs: Vector) -> int:
    """Return about how many multiplications expressions take when common parts are computed once."""
    before, inside, results = straight_line(outputs, [])
    forms = [*(a.value for a in (*before, *inside)), *results]
    waves = {wave for form in forms for wave in form.atoms(sin, cos)}
    total = COST_OF_WAVE * len(waves) + COST_OF_ANGLE * len({wave.args[0] for wave in waves})
    for node in (node for form in forms for node in sympy.preorder_traversal(form)):
        if node.is_Add or node.is_Mul:
            total += len(node.args) - 1
        elif node.is_Pow:
            total += int(node.exp) - 1 if node.exp.is_Integer and node.exp > 0 else COST_OF_QUOTIENT
        elif isinstance(node, Function) and not isinstance(node, sin | cos):
            total += COST_OF_FUNCTION
    return total
