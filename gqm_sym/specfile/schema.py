"""The shape of a curve file: one small pydantic model for each mapping in it.

They check structure and single values, and ``gqm schema`` prints them. Conditions on several values at once (an
undefined symbol, a launch outside the domain) are checked in ``reader``. A kind of curve, a family or a kernel is one
entry of a table, from which its model is made.
"""

from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    create_model,
)
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import CoreSchema

from gqm_sym.declare import Curve
from gqm_sym.declare.families import FAMILIES, cartesian_graph, implicit
from gqm_sym.kernels import KERNELS, KernelRow
from gqm_sym.specfile.fields import (
    ABSENT,
    Centre,
    Count,
    CurveParameter,
    Direction,
    Ends,
    Expression,
    Flag,
    Line,
    Name,
    Number,
    ParameterName,
    Place,
    Section,
    SpaceCentre,
    Tangent,
    UnitText,
    split_value,
)
from gqm_sym.specfile.rails import RailSchema
from gqm_sym.specfile.track import POINTS, Points, Scatter, declare_track

_DOMAIN = Field(
    default=None,
    description="ends of the parameter's range; null for an open end",
    examples=[["-pi", "pi"], [0, None]],
)
_PERIOD = Field(default=None, description="parameter period of a closed curve", examples=["2*pi"])


class Graph(Section):
    """The graph z = z(x)."""

    z: Expression = Field(description="height", examples=["x**3", "h*(x**4 - 2*x**2)"])
    parameter: CurveParameter = Field(default="x", description="the curve's parameter")
    domain: Ends | None = _DOMAIN


class Parametric(Section):
    """The coordinates x and z as functions of a parameter."""

    x: Expression = Field(description="horizontal coordinate", examples=["L*cos(theta)"])
    z: Expression = Field(description="height", examples=["L*sin(theta)"])
    parameter: CurveParameter = Field(description="the curve's parameter", examples=["theta"])
    period: Expression | None = _PERIOD
    domain: Ends | None = _DOMAIN


class Space(Section):
    """The coordinates x, y and z as functions of a parameter; z is up."""

    x: Expression = Field(description="horizontal coordinate", examples=["R*cos(theta)"])
    y: Expression = Field(description="the other horizontal coordinate", examples=["R*sin(theta)"])
    z: Expression = Field(description="height", examples=["c*theta"])
    parameter: CurveParameter = Field(description="the curve's parameter", examples=["theta"])
    period: Expression | None = _PERIOD
    domain: Ends | None = _DOMAIN
    roll: Expression | Centre | None = Field(
        default=ABSENT,
        description="roll angle; 'coordinated', without lateral force; or [coordinated, speed of no lateral force]",
        examples=["coordinated"],
    )
    heartline: Expression | None = Field(default=ABSENT, description="height of the riders' line above the track")


class Polar(Section):
    """The radius r as a function of the angle theta from the positive x axis."""

    r: Expression = Field(description="radius; may be negative", examples=["r0*exp(b*theta)"])
    parameter: CurveParameter = Field(default="theta", description="the curve's parameter")
    period: Expression | None = _PERIOD
    domain: Ends | None = _DOMAIN


_LEVEL: dict[str, Any] = {
    "F": (Expression, Field(description="a function of x and z that is 0 on the curve", examples=["x**4 + z**4 - 1"])),
    "start": (Centre, Field(description="x and z of the point where arc length is 0", examples=[[1, 0]])),
    "tangent": (Tangent, Field(default=1, description="1: arc length increases along (-F_z, F_x); -1: against it")),
}
_LEVEL_SUMMARY = "The curve F(x, z) = 0; its parameter is the arc length from a start point."
Implicit: type[Section] = create_model(
    "Implicit",
    __base__=Section,
    __doc__=_LEVEL_SUMMARY,
    **_LEVEL,
    parameter=(CurveParameter, Field(default="s", description="name of the curve's parameter, which is arc length")),
    domain=(Ends | None, _DOMAIN),
)


def _family_model(name: str, doc: str, own: dict[str, Any]) -> type[Section]:
    fields: dict[str, Any] = {
        "name": (Literal[name], Field(description="the family")),
        **own,
        "parameter": (CurveParameter | None, Field(default=None, description="another name for the curve's parameter")),
        "domain": (Ends | None, _DOMAIN),
    }
    return create_model(f"Family_{name}", __base__=Section, __doc__=doc, **fields)


def _name_or_value(argument: str) -> tuple[Any, Any]:
    what = f"value of the parameter {argument}, or another name for it"
    return (Expression, Field(default=None, description=what))


def _whole_number(name: str, value: int) -> tuple[Any, Any]:
    return (Expression, Field(default=None, description=f"the whole number {name}; by default {value}"))


FAMILY_MODELS: dict[str, type[Section]] = {
    "cartesian_graph": _family_model(
        "cartesian_graph",
        "The graph z = phi(x).",
        {"phi": (Expression, Field(description="height, as in a graph", examples=["x**3"]))},
    ),
    **{
        row.name: _family_model(
            row.name,
            row.title,
            {
                **{argument: _name_or_value(argument) for argument in row.arguments},
                **{name: _whole_number(name, value) for name, value in row.whole},
                "inverted": (
                    Flag,
                    Field(default=False, description="whether the curve is turned upside down (-z for z)"),
                ),
            },
        )
        for row in FAMILIES.values()
    },
    "implicit": _family_model("implicit", _LEVEL_SUMMARY, _LEVEL),
}


class CurveRow(NamedTuple):
    """The schema of a kind of curve, and its declaration from a file."""

    model: Any
    declare: Callable[..., Curve]
    summary: str
    reads_files: bool = False  # if true, the folder of the YAML file is needed for the declaration


def _declare_graph(given: dict[str, Any]) -> Curve:
    return Curve.graph(given.pop("z"), **given)


def _declare_polar(given: dict[str, Any]) -> Curve:
    return Curve.polar(given.pop("r"), **given)


def _declare_implicit(given: dict[str, Any]) -> Curve:
    return Curve.implicit(given.pop("F"), **given)


def _declare_family(given: dict[str, Any]) -> Curve:
    declare: dict[str, Callable[..., Curve]] = {**FAMILIES, "cartesian_graph": cartesian_graph, "implicit": implicit}
    return declare[given.pop("name")](**given)


_FAMILY: Any = Annotated[reduce(or_, FAMILY_MODELS.values()), Field(discriminator="name")]


EXPLICIT: dict[str, CurveRow] = {
    "graph": CurveRow(Graph, _declare_graph, "the graph z = z(x)"),
    "parametric": CurveRow(Parametric, lambda given: Curve.parametric(**given), "x and z as functions of a parameter"),
    "polar": CurveRow(Polar, _declare_polar, "the radius r = r(theta)"),
    "family": CurveRow(_FAMILY, _declare_family, "a curve of a known family"),
}
EXPLICIT["space"] = CurveRow(Space, lambda given: Curve.space(**given), "x, y and z as functions of a parameter")
RAILS = RailSchema.over({key: (row.model, row.declare, row.summary) for key, row in EXPLICIT.items()})
CURVES: dict[str, CurveRow] = {
    **EXPLICIT,
    "implicit": CurveRow(Implicit, _declare_implicit, "the curve F(x, z) = 0"),
    "points": CurveRow(POINTS, declare_track, "a track through the points of a file", reads_files=True),
    "pieces": CurveRow(RAILS.rail, RAILS.declare, "a rail of lines, arcs, clothoids and curves"),
}

# Arguments of kernels that are not a name or a value.
_KERNEL_ARGUMENTS: dict[str, tuple[Any, Any]] = {
    "U": (
        Expression,
        Field(description="the potential energy; on space curves also a function of y"),
    ),
    "A": (
        Expression,
        Field(
            description="the acceleration; other symbols are run-time parameters",
            examples=["-direction*k*W"],
        ),
    ),
    "cars": (Count, Field(default=1, description="number of cars, which are equal")),
    "mass": (Number, Field(default=None, description="mass of the whole train; by default that of the parameter m")),
    "form": (
        Literal["resistance", "printed"],
        Field(default="resistance", description="printed: gamma*ell_c*kappa/m, as in the paper"),
    ),
    "centre": (
        SpaceCentre,
        Field(default=None, description="coordinates x and z, or x, y and z, of the centre; by default the origin"),
    ),
}


def _kernel_model(row: KernelRow) -> type[Section]:
    fields: dict[str, Any] = {
        argument: _KERNEL_ARGUMENTS.get(argument, _name_or_value(argument)) for argument in row.arguments
    }
    return create_model(f"Kernel_{row.name}", __base__=Section, __doc__=row.summary, **fields)


def _sections(rows: dict[str, tuple[Any, str]]) -> dict[str, Any]:
    return {key: (model, Field(default=ABSENT, description=summary)) for key, (model, summary) in rows.items()}


class _OneEntry(Section):
    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})


CurveSection: type[Section] = create_model(
    "CurveSection",
    __base__=_OneEntry,
    __doc__="The curve, in exactly one of these ways.",
    **_sections({key: (row.model, row.summary) for key, row in CURVES.items()}),
)
KERNEL_MODELS = {key: _kernel_model(row) for key, row in KERNELS.items()}
KernelSection: type[Section] = create_model(
    "KernelSection",
    __base__=Section,
    __doc__="The forces, one entry for each. Gravity acts only if it is listed.",
    **_sections({key: (model, KERNELS[key].summary) for key, model in KERNEL_MODELS.items()}),
)


def _read_if_given(value: object) -> object:
    return None if value is None else split_value(value)


class Quantity(Section):
    """A number in SI units, or in the unit that is given with it."""

    value: Number = Field(description="the number, exactly as written", examples=["9.81", "2/5", "pi/2"])
    unit: UnitText = Field(
        default="", description="its unit; the number is converted to SI", examples=["m", "cm", "km/h", "deg"]
    )

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Describe the short form too: the value alone."""
        long = handler.resolve_ref_schema(handler(core_schema))
        nullable = "null" in str(long["properties"]["value"])
        short = {"type": ["string", "number", *(["null"] if nullable else [])]}
        return {"anyOf": [short, long]}


class Parameter(Quantity):
    """A run-time parameter with its default, its unit and a description."""

    value: Number | None = Field(  # type: ignore[assignment]
        description="the default, exactly as written; null if it must be given at run time",
        examples=["9.81", "2/5", "pi/2"],
    )
    description: Line = Field(default="", description="one line of text for readers")


class Launch(Section):
    """Place, speed and direction at the start of the motion. Only a curve in arc length may be launched at a point."""

    lam0: Annotated[Quantity, BeforeValidator(split_value)] = Field(
        default=ABSENT, description="the curve's parameter at launch", examples=["-pi/2 + 6/5"]
    )
    point: Place = Field(default=ABSENT, description="x and z at launch, in place of lam0", examples=[[1, 0]])
    v0: Annotated[Quantity, BeforeValidator(split_value)] = Field(
        default="0", validate_default=True, description="speed, never negative", examples=["6.2088"]
    )
    direction: Direction = Field(default=1, description="the sign of ds/dt at launch")
    t_max: Annotated[Quantity | None, BeforeValidator(_read_if_given)] = Field(
        default=None, description="time up to which the motion is followed, s"
    )
    contact: Literal["bilateral", "above", "below"] = Field(
        default="bilateral",
        description="side of the track on which the body runs. above: to the left of increasing parameter, where "
        "it can lift off; below: to the right; bilateral: the track holds it on both sides",
    )


class CurveFile(Section):
    """A curve, the forces on a body that moves along it, and a launch."""

    name: Name = Field(description="name of the generated module, a Python identifier", examples=["pendulum"])
    title: Line = Field(default="", description="one line of text for readers")
    curve: CurveSection = Field(
        description="the curve, in exactly one way", examples=[{"graph": {"z": "x**3", "parameter": "x"}}]
    )
    kernel: KernelSection = Field(description="the forces", examples=[{"gravity": {}}])
    parameters: dict[ParameterName, Annotated[Parameter, BeforeValidator(split_value)]] = Field(
        default_factory=dict,
        description="every free symbol, with a number, {value, unit, description} or null",
    )
    launch: Launch = Field(default=ABSENT, description="the start of the motion; needed to solve")


def model_at(path: tuple[str, ...]) -> Any:
    """Return the model of the mapping at a place of the file; None if there is none there."""
    match path:
        case ():
            return CurveFile
        case ("curve",):
            return CurveSection
        case ("curve", "family", name):
            return FAMILY_MODELS.get(name)
        case ("curve", "pieces", "pieces", _, "family", name):
            return FAMILY_MODELS.get(name)
        case ("curve", "pieces", *steps):
            return RAILS.model_at(steps)
        case ("curve", "points"):
            return Points
        case ("curve", "points", "smoothing"):
            return Scatter
        case ("curve", kind) if kind in CURVES and kind != "family":
            return CURVES[kind].model
        case ("kernel",):
            return KernelSection
        case ("kernel", key):
            return KERNEL_MODELS.get(key)
        case ("parameters", _):
            return Parameter
        case ("launch",):
            return Launch
        case ("launch", _):
            return Quantity
    return None


class _Draft07(GenerateJsonSchema):
    """A schema for editors: draft 7, without the titles that pydantic makes from names."""

    schema_dialect = "http://json-schema.org/draft-07/schema#"

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def json_schema(model: type[Section] = CurveFile) -> dict[str, Any]:
    """Return the JSON Schema (draft 7) of a curve file, or of another file."""
    schema = model.model_json_schema(ref_template="#/definitions/{model}", schema_generator=_Draft07)
    schema["definitions"] = schema.pop("$defs", {})
    return {"$schema": _Draft07.schema_dialect, **_without_null_defaults(schema)}


def _without_null_defaults(schema: Any) -> Any:
    # "default: null" only says that a key may be left out, which "required" says already.
    if isinstance(schema, dict):
        return {
            key: _without_null_defaults(value)
            for key, value in schema.items()
            if not (key == "default" and value is None)
        }
    return [_without_null_defaults(item) for item in schema] if isinstance(schema, list) else schema
