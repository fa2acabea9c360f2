"""The schema of a sweep file, as `specfile.schema` is that of a curve file."""

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field, WithJsonSchema
from pydantic_core import PydanticCustomError

from gqm_sym.runtime.sweep.quantities import QUANTITIES
from gqm_sym.specfile.fields import ABSENT, Line, Number, Section, UnitText, split_value, wrapped
from gqm_sym.specfile.nodes import shown
from gqm_sym.specfile.schema import Quantity, json_schema

MOST_POINTS = 10**7


def _read_count(value: object) -> object:
    text = str(value)
    if not (text.isascii() and text.isdigit() and len(text) <= 9 and 2 <= int(text) <= MOST_POINTS):
        what = f"must be a whole number from 2 to {MOST_POINTS}, got {shown(text)}"
        raise PydanticCustomError("gqm", "{what}", {"what": what, "column": 0})
    return int(text)


_COUNT = {"type": "integer", "minimum": 2, "maximum": MOST_POINTS}
Count: TypeAlias = Annotated[int, BeforeValidator(_read_count), WithJsonSchema(_COUNT)]
Asked: TypeAlias = Literal[tuple(QUANTITIES)]  # type: ignore[valid-type]
Name: TypeAlias = str


class Axis(Section):
    """The values of one axis: evenly spaced from start to stop, both included, or a list. The list alone is enough."""

    start: Number = Field(default=ABSENT, description="the first value", examples=["0.1"])
    stop: Number = Field(default=ABSENT, description="the last value", examples=["3"])
    num: Count = Field(default=ABSENT, description="how many values", examples=[300])
    values: list[Number] = Field(
        default=ABSENT, description="the values themselves, in place of the keys above", examples=[[0.5, 1, 2]]
    )
    unit: UnitText = Field(
        default="", description="unit of these numbers, which are converted to SI", examples=["cm", "deg"]
    )


class Table(Section):
    """A CSV file whose first line names its columns. The path alone is enough."""

    file: Line = Field(
        description="path of the file, in the folder of this file or below it", examples=["launches.csv"]
    )
    units: dict[Name, UnitText] = Field(
        default_factory=dict, description="units of columns, which are converted to SI", examples=[{"L": "cm"}]
    )


class SweepFile(Section):
    """Quantities to compute for many launches along one curve."""

    title: Line = Field(default="", description="one line of text for readers")
    curve: Line = Field(
        description="path of the curve file, in the folder of this file or below it", examples=["pendulum.yaml"]
    )
    quantities: Annotated[list[Asked], Field(min_length=1)] = Field(
        description="the quantities to compute for each launch", examples=[["half_period", "v_max"]]
    )
    grid: dict[Name, Annotated[Axis, wrapped("values", list)]] = Field(
        default=ABSENT,
        description="all combinations of these values of lam0, v0, direction, lam (for time_at) and parameters",
        examples=[{"lam0": {"start": "0.1", "stop": "3", "num": 300}}],
    )
    table: Annotated[Table, wrapped("file", str)] = Field(
        default=ABSENT,
        description="launches and parameters, one launch in each row, in place of a grid",
        examples=["launches.csv"],
    )
    fixed: dict[Name, Annotated[Quantity, BeforeValidator(split_value)]] = Field(
        default_factory=dict,
        description="launch, t_max and parameters of all points that replace those of the curve file",
        examples=[{"v0": "1.5"}],
    )
    contact: Literal["bilateral", "above", "below"] = Field(
        default=ABSENT, description="side of the track on which the body runs, in place of that in the curve file"
    )


def model_at(path: tuple[str, ...]) -> Any:
    """Return the model of the mapping at a place of the file; None if there is none there."""
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
