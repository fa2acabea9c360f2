"""The structure of a sweep file; `specfile.schema` describes that of a curve file."""

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field, WithJsonSchema
from pydantic_core import PydanticCustomError

from gqm_sym.runtime.sweep.sweep import QUANTITIES
from gqm_sym.specfile.fields import ABSENT, Line, Number, Section, UnitText, wrapped
from gqm_sym.specfile.nodes import shown
from gqm_sym.specfile.schema import Quantity, json_schema, read_default

MAX_POINTS = 10**7


def _read_count(value: object) -> object:
    text = str(value)
    if not (text.isascii() and text.isdigit() and len(text) <= 9 and 2 <= int(text) <= MAX_POINTS):
        what = f"must be a whole number from 2 to {MAX_POINTS}, got {shown(text)}"
        raise PydanticCustomError("gqm", "{what}", {"what": what, "column": 0})
    return int(text)


_COUNT = {"type": "integer", "minimum": 2, "maximum": MAX_POINTS}
Count: TypeAlias = Annotated[int, BeforeValidator(_read_count), WithJsonSchema(_COUNT)]
QuantityName: TypeAlias = Literal[tuple(QUANTITIES)]  # type: ignore[valid-type]
Name: TypeAlias = str


class Axis(Section):
    """The values of one argument: start, stop and num for evenly spaced values with both ends, or a list of values."""

    start: Number = Field(default=ABSENT, description="the first value", examples=["0.1"])
    stop: Number = Field(default=ABSENT, description="the last value", examples=["3"])
    num: Count = Field(default=ABSENT, description="number of values", examples=[300])
    values: list[Number] = Field(
        default=ABSENT, description="the values themselves, instead of start, stop and num", examples=[[0.5, 1, 2]]
    )
    unit: UnitText = Field(
        default="", description="unit of the values, which are converted to SI", examples=["cm", "deg"]
    )


class Table(Section):
    """A CSV file whose first line names its columns. The path alone may stand for the mapping."""

    file: Line = Field(
        description="path relative to the folder of this file, and inside that folder", examples=["launches.csv"]
    )
    units: dict[Name, UnitText] = Field(
        default_factory=dict, description="units of columns, converted to SI", examples=[{"L": "cm"}]
    )


class SweepFile(Section):
    """Quantities of the motions of many launches on one curve."""

    title: Line = Field(default="", description="one line of description")
    curve: Line = Field(
        description="the curve file: its path relative to the folder of this file, and inside that folder",
        examples=["pendulum.yaml"],
    )
    quantities: Annotated[list[QuantityName], Field(min_length=1)] = Field(
        description="the quantities to compute for each motion", examples=[["half_period", "v_max"]]
    )
    grid: dict[Name, Annotated[Axis, wrapped("values", list)]] = Field(
        default=ABSENT,
        description="values of lam0, v0, direction, lam (for time_at) and parameters; all combinations are computed",
        examples=[{"lam0": {"start": "0.1", "stop": "3", "num": 300}}],
    )
    table: Annotated[Table, wrapped("file", str)] = Field(
        default=ABSENT, description="instead of a grid: a table with one point per row", examples=["launches.csv"]
    )
    fixed: dict[Name, Annotated[Quantity, BeforeValidator(read_default)]] = Field(
        default_factory=dict,
        description="launch, t_max and parameters that are the same at all points and replace those of the curve file",
        examples=[{"v0": "1.5"}],
    )
    contact: Literal["bilateral", "above", "below"] = Field(
        default=ABSENT, description="the side of the track on which the body runs; replaces that of the curve file"
    )


def model_at(path: tuple[str, ...]) -> Any:
    """Return the model of the mapping at a path in the file, or None if there is no mapping."""
    match path:
        case ():
            return SweepFile
        case ("grid", _):
            return Axis
        case ("table",):
            return Table
        case ("fixed", _):
            return Quantity
    return None


def sweep_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 7) of a sweep file."""
    return json_schema(SweepFile)
