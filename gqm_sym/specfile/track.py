"""Points of a track from a CSV file beside the YAML."""

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
from gqm_sym.specfile.beside import read_beside, read_rows
from gqm_sym.specfile.fields import ABSENT, Flag, Line, ScatterText, Section, UnitText, split_value, wrapped

_COLUMNS = (["x", "z"], ["x", "y", "z"])
_ROW = re.compile(r"row (\d+)")


class Scatter(Section):
    """How far measured points scatter: their standard deviation in metres or in the unit that it names, or auto."""

    value: ScatterText = Field(
        description="the standard deviation of each coordinate; auto: found by cross-validation",
        examples=["0.01", "auto"],
    )
    unit: UnitText = Field(default="", description="of length", examples=["mm", "cm"])

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Describe the short form too: the value alone."""
        return {"anyOf": [{"type": ["string", "number"]}, handler.resolve_ref_schema(handler(core_schema))]}


class Points(Section):
    """A track through the points of a CSV file with columns x, z, or x, y, z; its path alone will do."""

    file: Line = Field(description="path from this file's folder on, inside it", examples=["track.csv"])
    kind: Literal["spline", "linear"] = Field(default="spline", description="a quintic spline, or stitched planes")
    closed: Flag = Field(default=False, description="whether the track closes; else if its last point is its first")
    smoothing: Annotated[Scatter, BeforeValidator(split_value)] = Field(
        default=ABSENT,
        description="for measured points: their standard deviation, or auto; else the track goes through them",
        examples=["auto", {"value": 8, "unit": "mm"}],
    )


POINTS: TypeAlias = Annotated[Points, wrapped("file", str)]


def declare_track(given: dict[str, Any], folder: Path) -> Curve:
    """Declare the track whose points are in a file.

    Parameters
    ----------
    given
        ``file``, and where they are given ``kind``, ``closed`` and ``smoothing``.
    folder
        Of the YAML file; the points are in it, or in a folder inside.

    Raises
    ------
    DeclarationError
        If there is no such file, or it is anything but a table of points; the message names file and row, which is
        the line of the file.
    """
    name = given.pop("file")
    header, rows = read_rows(name, read_beside(name, folder, wanted="a CSV file with columns x, z, or x, y, z"))
    if header and [field.lower() for field in header] not in _COLUMNS:
        raise InputError(f"{name!r}, row 1: the columns must be x, z, or x, y, z, got {','.join(header)!r:.60}")
    if "smoothing" in given:
        given["smoothing"] = _deviation(**given["smoothing"])
    try:
        with warnings.catch_warnings(record=True) as noted:
            curve = Curve.sampled(rows, **given)
    except DeclarationError as error:
        what = str(error).removeprefix("sampled: ")
        if what.startswith("smoothing: "):
            raise DeclarationError(what) from None
        raise DeclarationError(f"{name!r}, {_ROW.sub(lambda m: f'row {int(m[1]) + bool(header)}', what)}") from None
    for one in noted:
        warnings.warn(f"{name!r}, {str(one.message).removeprefix('sampled: ')}", NoisyPointsWarning, stacklevel=2)
    return curve


def _deviation(value: str, unit: str = "") -> float | str:
    """What was written as smoothing, in metres."""
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
