"""What the module of a charted curve holds besides its formulas: the maker of its chart, one for each kind of curve."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from sympy import Function, Symbol

from gqm_sym.declare import Curve
from gqm_sym.declare.implicit import X, Z
from gqm_sym.declare.piecewise import Rail
from gqm_sym.declare.sampled import Track
from gqm_sym.derivation.algebra.differentiate import differentiate
from gqm_sym.derivation.geometry.geometry import geometry
from gqm_sym.emission.ir import ChartIR, ExactIR, FunctionIR
from gqm_sym.emission.printer import check_emittable

if TYPE_CHECKING:
    from gqm_sym.emission.context import Lowering


def _implicit(lowering: "Lowering") -> ChartIR:
    """F and its derivatives at many points, the start point and the ends of arc length."""
    model = lowering.model
    found = model.level_set
    assert found is not None
    for row in found.rows:
        check_emittable(row, {X.name, Z.name, *lowering.order}, where="implicit: F")
    count, across, up = (lowering.names(name) for name in ("n", "xs", "zs"))
    field = lowering.function(
        "field",
        "FIELD",
        (across, up),
        "F and its derivatives: F, F_x, F_z, F_xx, F_xz and F_zz (paper, eq. 36).",
        views=((across, count), (up, count)),
        inside=[(place, Function("at")(Symbol(array, real=True))) for place, array in ((X, across), (Z, up))],
        outputs=found.rows,
    )
    exact = [lowering.constants("exact_start", "Coordinates of the start point.", found.level.start)]
    doc = "F, F_x and F_z."
    exact.append(lowering.exact_function("level", doc, (found.value, found.slope_x, found.slope_z), (X, Z)))
    arguments = ["field=field.address", "start=exact_start", f"tangent={found.level.tangent}", "level=exact_level"]
    if model.domain != (None, None):
        doc = "Both ends in arc length; None where there is none."
        exact.append(lowering.constants("exact_domain", doc, model.domain))
        arguments.append("domain=exact_domain")
    return ChartIR(
        statement=f"Traced({', '.join(arguments)})",
        imports=("FIELD", "Traced"),
        functions=(field,),
        exact=tuple(exact),
    )


def _sampled(lowering: "Lowering") -> ChartIR:
    """The points, as text."""
    track = lowering.model.curve.definition
    assert isinstance(track, Track)
    return ChartIR(
        statement=f"Sampled(POINTS, kind={track.kind!r}, closed={track.closed})",
        imports=("Sampled",),
        data=(("POINTS", track.points),),
    )


def _rail(lowering: "Lowering") -> ChartIR:
    """What each piece is given by, and a function for each curve among them."""
    rail = lowering.model.curve.definition
    assert isinstance(rail, Rail)
    curves = [piece.curve for piece in rail.pieces if isinstance(piece.curve, Curve)]
    functions = tuple(_segment(lowering, curve, f"segment_{count}") for count, curve in enumerate(curves, start=1))
    formulas = tuple(_exact_segment(lowering, curve, f.name) for curve, f in zip(curves, functions, strict=True))
    given = (*(rail.start or ()), *(number for piece in rail.pieces for number in piece.numbers))
    doc = "Where the rail starts, and what each of its pieces is given by."
    numbers = lowering.exact_function("rail", doc, given)
    arguments = [
        f"numbers={numbers.name}",
        f"placed={rail.start is not None}",
        f"pieces={tuple(piece.kind for piece in rail.pieces)!r}",
    ]
    if functions:
        arguments.append(f"segments=({', '.join(f'{function.name}.address' for function in functions)},)")
        arguments.append(f"formulas=({', '.join(formula.name for formula in formulas)},)")
    if rail.closed:
        arguments.append("closed=True")
    return ChartIR(
        statement="Rail(\n    " + ",\n    ".join(arguments) + ",\n)",
        imports=("Rail", *(["SEGMENT"] if functions else [])),
        functions=functions,
        exact=(numbers, *formulas),
    )


def _segment(lowering: "Lowering", curve: Curve, name: str) -> FunctionIR:
    """The shape of a curve that is a piece, in its own parameter."""
    shape = geometry(curve, may_be_positive=())
    place, places = lowering.place, lowering.names("places")
    rows = (curve.x, curve.z, shape.ds, shape.dxds, shape.dzds, shape.kappa)
    outputs = tuple(row.xreplace({curve.parameter: place}) for row in rows)
    for row in outputs:
        check_emittable(row, {place.name, *lowering.order}, where=f"piecewise: {curve.kind}")
    return lowering.function(
        name,
        "SEGMENT",
        (places,),
        f"x, z, length, unit tangent and signed curvature of a piece, by its own parameter {curve.parameter.name}.",
        views=((places, lowering.names("n")),),
        inside=[(place, Function("at")(Symbol(places, real=True)))],
        outputs=outputs,
    )


def _exact_segment(lowering: "Lowering", curve: Curve, name: str) -> ExactIR:
    """Its coordinates and their derivatives over a namespace of operations."""
    place = curve.parameter
    rows = (curve.x, curve.z, differentiate(curve.x, place), differentiate(curve.z, place))
    outputs = tuple(row.xreplace({place: lowering.place}) for row in rows)
    return lowering.exact_function(name, "x, z and their derivatives by its own parameter.", outputs, (lowering.place,))


MAKERS: dict[str, Callable[["Lowering"], ChartIR]] = {"implicit": _implicit, "piecewise": _rail, "sampled": _sampled}
"""By the curve's kind."""


def chart_maker(lowering: "Lowering") -> ChartIR | None:
    """The maker of a model's chart; None for a curve with formulas."""
    curve = lowering.model.curve
    return MAKERS[curve.kind](lowering) if curve.charted else None
