"""Points of a track from a CSV or GPX file beside the YAML."""

import re
import warnings
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from gqm_sym.declare import Curve
from gqm_sym.errors import DeclarationError, InputError, NoisyPointsWarning
from gqm_sym.literals.units import check_unit
from gqm_sym.parameters import exact_value, in_si
from gqm_sym.specfile.fields import (
    ABSENT,
    Centre,
    Expression,
    Flag,
    Line,
    ScatterText,
    Section,
    UnitText,
    split_value,
    wrapped,
)
from gqm_sym.specfile.survey import surveyed

_ROW = re.compile(r"row (\d+)")


class Scatter(Section):
    """The standard deviation of measured points, in metres or in the unit that is given with it, or auto."""

    value: ScatterText = Field(
        description="standard deviation of each coordinate; auto: it is found by cross-validation",
        examples=["0.01", "auto"],
    )
    unit: UnitText = Field(default="", description="its unit of length", examples=["mm", "cm"])

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Describe the short form too: the value alone."""
        return {"anyOf": [{"type": ["string", "number"]}, handler.resolve_ref_schema(handler(core_schema))]}


class Points(Section):
    """A track through the points of a CSV file (columns x, z or x, y, z) or a GPX file. The path alone is enough."""

    file: Line = Field(
        description="path of the file, in the folder of the curve file or below it", examples=["track.csv"]
    )
    kind: Literal["spline", "linear"] = Field(
        default="spline", description="spline: a quintic spline; linear: straight lines between the points"
    )
    closed: Flag = Field(
        default=False, description="whether the track is closed; it also is if its last point equals its first"
    )
    smoothing: Annotated[Scatter, BeforeValidator(split_value)] = Field(
        default=ABSENT,
        description="standard deviation of measured points, or auto; without it the track passes through the points",
        examples=["auto", {"value": 8, "unit": "mm"}],
    )
    roll: Expression | Centre | None = Field(
        default=ABSENT,
        description="in space: roll angle as a function of s, 'coordinated' (no lateral force), or [coordinated, "
        "speed]; by default the column roll of the file",
        examples=["coordinated"],
    )
    heartline: Expression | None = Field(default=ABSENT, description="height of the riders' line above the track")


POINTS: TypeAlias = Annotated[Points, wrapped("file", str)]


def declare_track(given: dict[str, Any], folder: Path) -> Curve:
    """Declare the track whose points are in a file.

    Parameters
    ----------
    given
        ``file``, and the other keys of the section that are given.
    folder
        The folder of the YAML file; the points are in it, or in a folder below it.

    Raises
    ------
    DeclarationError
        If there is no such file, or it is not a table of points; the message names file and row, which is the line of
        the file.
    """
    name = given.pop("file")
    found = surveyed(name, folder)
    if found.roll is not None:
        given.setdefault("roll", found.roll)
    if "smoothing" in given:
        given["smoothing"] = _deviation(**given["smoothing"])
    try:
        with warnings.catch_warnings(record=True) as noted:
            curve = Curve.sampled(found.rows, **given)
    except DeclarationError as error:
        what = str(error).removeprefix("sampled: ")
        if what.startswith("smoothing: "):
            raise DeclarationError(what) from None
        raise DeclarationError(
            f"{name!r}, {_ROW.sub(lambda m: f'row {int(m[1]) + found.first_line - 1}', what)}"
        ) from None
    for one in noted:
        warnings.warn(f"{name!r}, {str(one.message).removeprefix('sampled: ')}", NoisyPointsWarning, stacklevel=2)
    return curve


def _deviation(value: str, unit: str = "") -> float | str:
    """Return the standard deviation for smoothing in metres."""
    try:
        if unit:
            check_unit(unit, "m")
    except InputError as error:
        raise DeclarationError(f"smoothing: unit: {error}") from None
    if value == "auto":
        if unit:
            raise DeclarationError("smoothing: unit: auto has none; leave it out, or give a number")
        return value
    return float(exact_value(in_si(value, unit)))
