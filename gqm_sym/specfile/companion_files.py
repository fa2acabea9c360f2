"""Files that a YAML file names, which are limited in size and must be inside its folder."""

import os
import re
import stat
from pathlib import Path, PurePath

from gqm_sym.errors import InputError

SIZE_LIMIT = 1 << 25
ROW_LIMIT = 500_000
LINE_LIMIT = 200

_BETWEEN = re.compile(r"\s*[,;\t]\s*|\s+")


def companion_path(name: str, folder: Path, *, wanted: str) -> Path:
    """Return the path of a file in a folder or in one of its subfolders.

    Parameters
    ----------
    name
        The path in the YAML file, relative to its folder.
    folder
        The folder of the YAML file.
    wanted
        A description of the required file, for messages.

    Raises
    ------
    InputError
        If the path leads anywhere else, or there is no such file.
    """
    pure = PurePath(name)
    if pure.is_absolute() or ".." in pure.parts or "\\" in name or ":" in name or "\0" in name:
        raise InputError(f"{name!r}: must be a path inside the YAML file's folder, without '..'")
    try:
        path = (folder / name).resolve(strict=True)
    except FileNotFoundError:
        raise InputError(f"{name!r}: there is no such file in this folder; check its path") from None
    except (OSError, ValueError, RuntimeError) as error:
        raise _unreadable(name, error, wanted) from None
    if not path.is_relative_to(folder.resolve()):
        raise InputError(f"{name!r}: leads out of the YAML file's folder by a link; put the file itself there")
    if not path.is_file():
        raise InputError(f"{name!r}: is not a plain file; give {wanted}")
    return path


def read_companion(name: str, folder: Path, *, wanted: str) -> str:
    """Return the text of a plain file in a folder, at most 32 MiB in UTF-8. The parameters are those of
    `companion_path`.
    """
    path = companion_path(name, folder, wanted=wanted)
    try:
        # The file is opened before it is examined, without waiting for a pipe, so that the examined file is read.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0))
        with os.fdopen(descriptor, "rb") as file:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise InputError(f"{name!r}: is not a plain file; give {wanted}")
            data = file.read(SIZE_LIMIT + 1)
    except OSError as error:
        raise _unreadable(name, error, wanted) from None
    if len(data) > SIZE_LIMIT:
        raise InputError(f"{name!r}: is larger than {SIZE_LIMIT >> 20} MiB; give fewer rows")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = data.count(b"\n", 0, error.start) + 1
        raise InputError(f"{name!r}, row {row}: is not UTF-8 text; save it as UTF-8") from None


def read_rows(name: str, text: str) -> tuple[list[str], list[list[str]]]:
    """Return the fields of the first line of a table if they are names, else none, and the fields of each line of
    values.
    """
    text = text.rstrip()
    if (total := text.count("\n") + 1) > ROW_LIMIT:  # before the fields are separated, which takes much more memory
        raise InputError(f"{name!r}: has {total} rows; {ROW_LIMIT} is the most")
    lines = text.split("\n")
    rows = []
    for count, line in enumerate(lines, start=1):
        if len(line) > LINE_LIMIT:
            raise InputError(f"{name!r}, row {count}: is longer than {LINE_LIMIT} characters; give few numbers a line")
        if ";" in line and "," in line:
            raise InputError(f"{name!r}, row {count}: has commas and semicolons; write decimals with a point, as 0.5")
        rows.append(_BETWEEN.split(line.strip()))
    named = rows[0][0][:1].isalpha()
    return (rows[0], rows[1:]) if named else ([], rows)


def _unreadable(name: str, error: Exception, wanted: str) -> InputError:
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return InputError(f"{name!r}: cannot be read ({reason}); give {wanted}")
