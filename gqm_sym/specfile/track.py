"""Points of a track from a CSV file beside the YAML."""

import re
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field

from gqm_sym.declare import Curve
from gqm_sym.errors import DeclarationError, InputError
from gqm_sym.specfile.beside import read_beside, read_rows
from gqm_sym.specfile.fields import Flag, Line, Section, wrapped

_COLUMNS = ["x", "z"]
_ROW = re.compile(r"row (\d+)")


class Points(Section):
    """A track through the points of a CSV file with columns x, z; its path alone will do."""

    file: Line = Field(description="path from this file's folder on, inside it", examples=["track.csv"])
    kind: Literal["spline", "linear"] = Field(default="spline", description="a quintic spline, or stitched planes")
    closed: Flag = Field(default=False, description="whether the track closes; else if its last point is its first")


POINTS: TypeAlias = Annotated[Points, wrapped("file", str)]


def declare_track(given: dict[str, Any], folder: Path) -> Curve:
    """Declare the track whose points are in a file.

    Parameters
    ----------
    given
        ``file``, and where they are given ``kind`` and ``closed``.
    folder
        Of the YAML file; the points are in it, or in a folder inside.

    Raises
    ------
    DeclarationError
        If there is no such file, or it is anything but a table of points; the message names file and row, which is
        the line of the file.
    """
    name = given.pop("file")
    header, rows = read_rows(name, read_beside(name, folder, wanted="a CSV file with columns x, z"))
    if header and [field.lower() for field in header] != _COLUMNS:
        raise InputError(f"{name!r}, row 1: the columns must be x, z, got {','.join(header)!r:.60}")
    try:
        return Curve.sampled(rows, **given)
    except DeclarationError as error:
        what = str(error).removeprefix("sampled: ")
        raise DeclarationError(f"{name!r}, {_ROW.sub(lambda m: f'row {int(m[1]) + bool(header)}', what)}") from None
