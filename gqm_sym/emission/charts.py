"""The part of a module that makes the chart of its curve, for each kind of curve without formulas."""

from collections.abc import Callable
from dataclasses import replace

from sympy import Add, Expr, Function, S, Symbol

from gqm_sym.declare import Curve
from gqm_sym.declare.implicit import X, Z
from gqm_sym.declare.piecewise import Rail
from gqm_sym.declare.polynomials import PolynomialPieces
from gqm_sym.declare.sampled import Track
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.forces.train import PotentialParts, loads_along, potential_parts, rates_along
from gqm_sym.derivation.geometry.geometry import cross, geometry
from gqm_sym.emission.context import Lowering
from gqm_sym.emission.dissipative import CORIOLIS_VECTOR, planar_point, point_in_space
from gqm_sym.emission.ir import ChartIR, ExactIR, FunctionIR
from gqm_sym.emission.printer import check_emittable
from gqm_sym.kernels import base
from gqm_sym.sympy_charts import AXES, LOAD_IN_PLANE, LOADS_IN_SPACE, MEAN_PARTS, SPACE_ROWS


def _shaped_by(*formulas: ExactIR | FunctionIR) -> str:
    """Return the argument of a chart's maker that lists the indices of the run-time parameters on which the curve
    depends.
    """
    return f"shaped_by={tuple(sorted({place for formula in formulas for _, place in formula.parameters}))!r}"


def _implicit(lowering: Lowering) -> ChartIR:
    """Return the part for an implicit curve: F and its derivatives, the start point, and the ends in arc length."""
    model = lowering.model
    found = model.level_set
    assert found is not None
    for row in found.rows:
        check_emittable(row, {X.name, Z.name, *lowering.order}, where="implicit: F")
    across, up = (lowering.names(name) for name in ("xs", "zs"))
    field = lowering.function(
        "field",
        (across, up),
        "F, F_x, F_z, F_xx, F_xz and F_zz: the curve is F(x, z) = 0 (paper, eq. 36).",
        inside=[(place, Function("at")(Symbol(array, real=True))) for place, array in ((X, across), (Z, up))],
        outputs=found.rows,
    )
    exact = [lowering.constants("exact_start", "Coordinates of the start point.", found.level.start)]
    doc = "F, F_x and F_z."
    exact.append(lowering.exact_function("level", doc, (found.value, found.slope_x, found.slope_z), (X, Z)))
    arguments = ["field=field.address", "start=exact_start", f"tangent={found.level.tangent}", "level=exact_level"]
    if model.domain != (None, None):
        doc = "Both ends in arc length; None for an open end."
        exact.append(lowering.constants("exact_domain", doc, model.domain))
        arguments.append("domain=exact_domain")
    arguments.append(_shaped_by(field, *exact))
    return ChartIR(
        statement=f"Traced({', '.join(arguments)})",
        imports=("FIELD", "Traced"),
        functions=(field,),
        exact=tuple(exact),
    )


def _sampled(lowering: Lowering) -> ChartIR:
    """Return the part for a sampled curve: its points, as text."""
    track = lowering.model.curve.definition
    assert isinstance(track, Track)
    space = (", in_space=True" if track.in_space else "") + (", banked=True" if track.banked else "")
    return ChartIR(
        statement=f"Sampled(POINTS, kind={track.kind!r}, closed={track.closed}{space})",
        imports=("Sampled",),
        data=(("POINTS", track.points),),
    )


def _polynomial(lowering: Lowering) -> ChartIR:
    """Return the part for a curve of polynomials: their coefficients, as text."""
    made = lowering.model.curve.definition
    assert isinstance(made, PolynomialPieces)
    return ChartIR(
        statement=f"Polynomials(PIECES, origin={made.origin}, breaks={made.breaks!r})",
        imports=("Polynomials",),
        data=(("PIECES", made.pieces),),
    )


def _rail(lowering: Lowering) -> ChartIR:
    """Return the part for a piecewise curve: the numbers of each piece, and a function for each piece that is a curve
    with formulas.
    """
    rail = lowering.model.curve.definition
    assert isinstance(rail, Rail)
    curves = [piece.curve for piece in rail.pieces if isinstance(piece.curve, Curve)]
    maker, segment = ("SpaceRail", _segment_in_space) if rail.in_space else ("Rail", _segment)
    functions = tuple(segment(lowering, curve, f"segment_{count}") for count, curve in enumerate(curves, start=1))
    known = zip(curves, functions, strict=True)
    formulas = tuple(_exact_segment(lowering, curve, f.name, in_space=rail.in_space) for curve, f in known)
    given = (*(rail.start or ()), *(number for piece in rail.pieces for number in piece.numbers))
    doc = "The start of the rail, then the numbers of each piece."
    numbers = lowering.exact_function("rail", doc, given)
    arguments = [
        f"numbers={numbers.name}",
        f"placed={rail.start is not None}",
        f"pieces={tuple(piece.kind for piece in rail.pieces)!r}",
    ]
    if functions:
        arguments.append(f"segments=({', '.join(f'{function.name}.address' for function in functions)},)")
    if formulas:
        arguments.append(f"formulas=({', '.join(formula.name for formula in formulas)},)")
    if rail.closed:
        arguments.append("closed=True")
    if rail.banked:
        arguments.append("banked=True")
    arguments.append(_shaped_by(numbers, *formulas, *functions))
    return ChartIR(
        statement=f"{maker}(\n    " + ",\n    ".join(arguments) + ",\n)",
        imports=(maker, *(["SEGMENT"] if functions else [])),
        functions=functions,
        exact=(numbers, *formulas),
    )


def _segment(lowering: Lowering, curve: Curve, name: str) -> FunctionIR:
    """Return the function for position, metric and curvature of a piece that is a curve with formulas, in its own
    parameter.
    """
    shape = geometry(curve, may_be_positive=())
    rows = (curve.x, curve.z, shape.ds, shape.dxds, shape.dzds, shape.kappa)
    what = f"x, z, ds/d{curve.parameter}, dx/ds, dz/ds and curvature"
    return _function_of_segment(lowering, curve, name, what, rows)


def _segment_in_space(lowering: Lowering, curve: Curve, name: str) -> FunctionIR:
    """Return the same function for a piece of a rail in space, with the derivatives of its coordinates with respect to
    arc length.
    """
    shape = geometry(replace(curve, kind="space"), may_be_positive=(), heading=None)
    tangent = (shape.dxds, shape.dyds, shape.dzds)
    bends = cross(shape.curvature_binormal, tangent)
    changes = (differentiate(bend, curve.parameter) / shape.ds for bend in bends)
    rows = (curve.x, curve.y, curve.z, shape.ds, *tangent, *bends, *changes)
    what = f"x, y, z, ds/d{curve.parameter} and the first three derivatives of the coordinates by arc length"
    return _function_of_segment(lowering, curve, name, what, rows)


def _function_of_segment(lowering: Lowering, curve: Curve, name: str, what: str, rows: tuple[Expr, ...]) -> FunctionIR:
    place, places = lowering.place, lowering.names("places")
    outputs = tuple(row.xreplace({curve.parameter: place}) for row in rows)
    for row in outputs:
        check_emittable(row, {place.name, *lowering.order}, where=f"piecewise: {curve.kind}")
    function = lowering.function(
        name,
        (places,),
        f"{what} of a piece by its own parameter (paper, eqs. 6, 8).",
        inside=[(place, Function("at")(Symbol(places, real=True)))],
        outputs=outputs,
    )
    return replace(function, signature="SEGMENT")


def _exact_segment(lowering: Lowering, curve: Curve, name: str, *, in_space: bool) -> ExactIR:
    """Return the function for the coordinates of such a piece and their derivatives, over a namespace of operations."""
    place, named = curve.parameter, "x, y, z" if in_space else "x, z"
    rows = (curve.x, curve.y, curve.z) if in_space else (curve.x, curve.z)
    rows = (*rows, *(differentiate(row, place) for row in rows))
    outputs = tuple(row.xreplace({place: lowering.place}) for row in rows)
    doc = f"{named} and their derivatives with respect to its own parameter."
    return lowering.exact_function(name, doc, outputs, (lowering.place,))


MAKERS: dict[str, Callable[[Lowering], ChartIR]] = {
    "implicit": _implicit,
    "piecewise": _rail,
    "polynomial": _polynomial,
    "sampled": _sampled,
}
"""The functions that describe the chart, by the kind of the curve."""


def chart_maker(lowering: Lowering) -> ChartIR | None:
    """Return the part of a module that makes a model's chart; None for a curve with formulas."""
    curve = lowering.model.curve
    if not curve.charted:
        return None
    along = ("along_z", "along_x", "along_y") if curve.in_space else ("chart",)
    names = (*along, *(("along_roll",) if getattr(curve.definition, "banked", False) else ()))
    made = replace(MAKERS[curve.kind](lowering), names=names)
    return _of_train(lowering, made) if lowering.model.force.cars else made


def potential_by_coordinates(lowering: Lowering, potential: Expr, name: str = "") -> tuple[ExactIR, ...]:
    """Return the functions of `interface.ExactPotential`: an effective potential in terms of coordinates with its
    gradient, and in a rotating frame the vector of the Coriolis force.

    Parameters
    ----------
    lowering
        The module.
    potential
        The potential, in ``lowering.coordinates``.
    name
        What stands before their names.
    """
    places, coriolis = lowering.coordinates, lowering.model.coriolis
    outputs = (potential, *(differentiate(potential, coordinate) for coordinate in places))
    named = "x, y and z" if lowering.model.curve.in_space else "x and z"
    doc = f"U, so that V**2 + 2*U is constant, and its derivatives with respect to {named} (paper, eq. 13)."
    if name:
        doc = f"U of a body at one place, and its derivatives with respect to {named} (paper, eq. 13)."
    found = lowering.exact_function(f"{name}effective_potential", doc, outputs, places)
    if not coriolis:
        return (found,)
    tangent = {SPACE_ROWS[axis][1](lowering.place): lowering.names.symbol(f"d{axis}ds") for axis in AXES}
    aside = tuple(form.xreplace(tangent) for form in coriolis)
    return found, lowering.exact_function(f"{name}coriolis", CORIOLIS_VECTOR, aside, tuple(tangent.values()))


def _of_train(lowering: Lowering, track: ChartIR) -> ChartIR:
    """Return the part that makes the chart of a train's track, from that of the track."""
    train = lowering.model.force
    whole = potential_parts(train.potential)
    numbers = lowering.constants(
        "exact_train",
        "Length of the train, acceleration of gravity, coefficient of friction, and rate of the rotating frame"
        + (", then the factors of the other parts of the potential." if whole.parts else "."),
        (train.train_length, whole.gravity, train.friction, train.spin, *whole.factors),
    )
    arguments = [track.statement, f"cars={train.cars}", f"numbers={numbers.name}"]
    arguments.append(f"length={lowering.order[train.train_length.name]}")
    parts: tuple[ExactIR, ...] = ()
    if whole.parts:
        parts = (_parts_along_track(lowering, whole),)
        held = tuple(place for _, place in parts[0].parameters)
        arguments += [f"parts={parts[0].name}", f"held={held!r}"]
    if train.friction:
        arguments.append("friction=True")
    body = _potential_of_body(lowering) if lowering.model.dissipation is None else ()
    if body:
        arguments.append(f"body=ExactPotential({', '.join(part.name for part in body)})")
    loads = LOADS_IN_SPACE if lowering.model.curve.in_space else LOAD_IN_PLANE
    return replace(
        track,
        statement=f"TrackOfTrain({', '.join(arguments)})",
        imports=(*track.imports, "TrackOfTrain", *(["ExactPotential"] if body else [])),
        means=("along_h", *(f"along_{heads[0].axis}" for _, heads in zip(whole.parts, MEAN_PARTS, strict=False))),
        loads=loads if whole.parts and train.friction else (),
        exact=(*track.exact, numbers, *parts, *body),
    )


def _potential_of_body(lowering: Lowering) -> tuple[ExactIR, ...]:
    """Return the functions of `potential_by_coordinates` for a body at one place of the track of a train."""
    train = lowering.model.force
    names = lowering.coordinates
    place = names if lowering.model.curve.in_space else (names[0], S.Zero, names[1])
    potential = train.potential.xreplace(dict(zip((base.X, base.Y, base.Z), place, strict=True)))
    return potential_by_coordinates(lowering, potential / lowering.model.inertia, "body_")


def _parts_along_track(lowering: Lowering, whole: PotentialParts) -> ExactIR:
    """Return the function for parts of a potential with two derivatives each by arc length, and with friction for the
    load across the track under them (`loads_along`).
    """
    if lowering.model.curve.in_space:
        names, _ = point_in_space(lowering)
        place, tangent, bend = names[:3], names[3:6], names[6:9]
    else:
        names = x, z, dxds, dzds, kappa = planar_point(lowering)[0]
        place, tangent, bend = (x, S.Zero, z), (dxds, S.Zero, dzds), (-kappa * dzds, S.Zero, kappa * dxds)
    outputs = tuple(form for part in whole.parts for form in rates_along(part, place, tangent, bend))
    doc = "The other parts of the potential, each with its first two derivatives by arc length."
    if lowering.model.force.friction:
        others = Add(*(factor * part for factor, part in zip(whole.factors, whole.parts, strict=True)))
        outputs += loads_along(others, place, tangent, bend, in_space=lowering.model.curve.in_space)
        doc += (
            " Then their sum, a component of its gradient across the track, and the rate of that, for each component."
        )
    return lowering.exact_function("parts_along_track", doc, outputs, names)
