"""Points of a track from a CSV file beside the YAML: bounded, and never from anywhere else."""

import os
import re
import stat
from pathlib import Path, PurePath
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field

from gqm_sym.declare import Curve
from gqm_sym.errors import DeclarationError, InputError
from gqm_sym.specfile.fields import Flag, Line, Section, wrapped

SIZE_LIMIT = 1 << 25
ROW_LIMIT = 500_000
LINE_LIMIT = 200

_HEADER = ("x", "z")
_BETWEEN = re.compile(r"\s*[,;\t]\s*|\s+")
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
    rows, header = _read_rows(name, _read_text(name, folder))
    try:
        return Curve.sampled(rows, **given)
    except DeclarationError as error:
        what = str(error).removeprefix("sampled: ")
        raise DeclarationError(f"{name!r}, {_ROW.sub(lambda m: f'row {int(m[1]) + header}', what)}") from None


def _read_text(name: str, folder: Path) -> str:
    """The text of a file inside the folder."""
    pure = PurePath(name)
    if pure.is_absolute() or ".." in pure.parts or "\\" in name or ":" in name or "\0" in name:
        raise InputError(f"{name!r}: must be a path from the YAML file's folder on, inside it, without '..'")
    try:
        path = (folder / name).resolve(strict=True)
        if not path.is_relative_to(folder.resolve()):
            raise InputError(f"{name!r}: leads out of the YAML file's folder by a link; put the file itself there")
        # Not to wait for a pipe, and to read what was looked at.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0))
        with os.fdopen(descriptor, "rb") as file:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise InputError(f"{name!r}: is no plain file; give a CSV file with columns x, z")
            data = file.read(SIZE_LIMIT + 1)
    except FileNotFoundError:
        raise InputError(f"{name!r}: there is no such file beside the YAML file; check its path") from None
    except (OSError, ValueError, RuntimeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError(f"{name!r}: cannot be read ({reason}); give a CSV file with columns x, z") from None
    if len(data) > SIZE_LIMIT:
        raise InputError(f"{name!r}: is larger than {SIZE_LIMIT >> 20} MiB; give fewer points")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = data.count(b"\n", 0, error.start) + 1
        raise InputError(f"{name!r}, row {row}: is not UTF-8 text; save it as UTF-8") from None


def _read_rows(name: str, text: str) -> tuple[list[list[str]], int]:
    """The fields of each line, and how many lines stand before them."""
    text = text.rstrip()
    if (total := text.count("\n") + 1) > ROW_LIMIT:  # before they are parted, which takes much more memory
        raise InputError(f"{name!r}: has {total} rows; {ROW_LIMIT} is the most")
    lines, rows = text.split("\n"), []
    for count, line in enumerate(lines, start=1):
        if len(line) > LINE_LIMIT:
            raise InputError(f"{name!r}, row {count}: is longer than {LINE_LIMIT} characters; give two numbers a line")
        rows.append(_BETWEEN.split(line.strip()))
    header = 1 if rows[0] and rows[0][0][:1].isalpha() else 0
    if header and tuple(field.lower() for field in rows[0]) != _HEADER:
        raise InputError(f"{name!r}, row 1: the columns must be x, z, got {lines[0].strip()!r:.60}")
    return rows[header:], header
