"""The whole chain on one page: a model is written to a file, and the file is imported as a module.

=========  ==========================  ==============
stage      takes                       returns
=========  ==========================  ==============
derive     `Curve`, `Kernel`           `Model`
emit       `Model`, name               text
write      text, path                  a file
load       a file                      a module
=========  ==========================  ==============
"""

import contextlib
import difflib
import importlib.util
import os
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

from gqm_sym.arguments import checked, instance, short, unknown_argument
from gqm_sym.declare import Curve
from gqm_sym.declare.outline import SAMPLES, outline, values_of
from gqm_sym.derivation import Model, derive
from gqm_sym.emission import body_digests, emit
from gqm_sym.errors import ArgumentError, HandEditedError, InputError
from gqm_sym.expressions import check_module_name
from gqm_sym.kernels import Gravity
from gqm_sym.literals.numbers import read_number
from gqm_sym.loading import load, load_text

__all__ = ["build", "difference", "load", "transient", "write_bytes", "write_module", "write_text"]

FOLDER = "generated"


@checked("build")
def build(model: Model, *, name: str, folder: str | os.PathLike[str] = FOLDER, force: bool = False) -> ModuleType:
    """Write ``folder/name.py`` for a model and import it.

    Parameters
    ----------
    model : Model
        The model that `derive` returned.
    name : str
        The module's name, a Python identifier that no installed module has.
    folder : path
        The folder to write to; it is created if it does not exist.
    force : bool
        Whether to overwrite a file that was edited by hand.

    Returns
    -------
    module
        The generated module, with ``PARAMETERS``, ``pass1``, ``solve`` and ``sweep``.

    Raises
    ------
    HandEditedError
        If the existing file was not written by gqm_sym, or was edited since.
    InputError
        If the path is that of a folder or a device, or the name is not allowed.
    EmissionError
        If the model has an expression that no module can hold.
    """
    check_module_name(name, where="build: name")
    try:
        path = Path(folder) / f"{name}.py"
    except TypeError:
        raise ArgumentError(f"build: folder: must be a path, got {short(folder)}") from None
    instance(model, Model, where="build: model", what="a model, as derive(curve, kernel) returns one")
    write_module(emit(model, name=name), path, force=force)
    return load(path, name)


def transient(model: Model) -> ModuleType:
    """Import the module of a model without leaving a file; it is compiled once in each process."""
    return load_text("", emit(model, name="model"), "model")


def draw_curve(curve: Curve, lam: Any, axes: Any, parameters: dict[str, Any]) -> Any:
    """Draw a curve; the public method is `Curve.plot`."""
    from gqm_sym.figures.curves import drawn

    for name in parameters.keys() - set(curve.parameters):
        raise ArgumentError(unknown_argument("Curve.plot", name, ("lam", "axes", *curve.parameters)))
    if not curve.charted:
        return drawn(outline(curve, lam, parameters), curve.title, axes)
    values_of(curve, parameters)
    model = transient(derive(curve, Gravity())).MODEL
    chart = model.charted(model.numbers(tuple({**model.parameters, **parameters}.values())))
    low, high = (chart.low, chart.high) if lam is None else (read_number(end, where="lam").value for end in lam)
    points = chart.coordinates([low + (high - low) * k / SAMPLES for k in range(SAMPLES + 1)])
    return drawn(points, curve.title, axes)


def write_module(text: str, path: str | os.PathLike[str], *, force: bool = False) -> bool:
    """Write the text of a generated module to a file, completely or not at all.

    Parameters
    ----------
    text : str
        The text that `emit` returned.
    path : path
        The file; missing folders are created.
    force : bool
        Whether to overwrite a file that was edited by hand.

    Returns
    -------
    bool
        Whether the file changed.

    Raises
    ------
    HandEditedError
        If the existing file was not written by gqm_sym, or was edited since.
    InputError
        If the path is that of a folder or a device.
    """
    target = Path(path)
    if target.exists():
        if not target.is_file() and not target.is_symlink():
            raise InputError(f"{target}: is a folder or a device; give the path of a file")
        present = _read(target)
        if present == text:
            return False
        digests = body_digests(present)
        if not force and (digests is None or digests[0] != digests[1]):
            raise HandEditedError(
                f"{target}: was not written by gqm-gen, or was edited since; "
                "move it away, or overwrite it with force=True (--force)"
            )
    write_text(text, target)
    with contextlib.suppress(OSError, NotImplementedError):
        Path(importlib.util.cache_from_source(str(target))).unlink(missing_ok=True)
    return True


def write_text(text: str, path: str | os.PathLike[str]) -> None:
    """Write a text file in UTF-8, completely or not at all."""
    write_bytes(text.encode("utf-8"), path)


def write_bytes(data: bytes, path: str | os.PathLike[str]) -> None:
    """Write a file completely or not at all: a temporary file beside it is written first and then takes its place."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".tmp", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        Path(temporary).chmod(0o666 & ~_umask())
        Path(temporary).replace(target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def difference(text: str, path: str | os.PathLike[str]) -> str:
    """Return the unified diff from the file on disk to ``text``; it is empty if they agree."""
    target = Path(path)
    present = _read(target)
    lines = difflib.unified_diff(
        present.splitlines(keepends=True),
        text.splitlines(keepends=True),
        f"{target} (on disk)",
        f"{target} (generated)",
    )
    return "".join(lines)


def _read(path: Path) -> str:
    """Return the text of a file, or an empty text if it is not a plain file, because a device may have no end."""
    if not path.is_file():
        return ""
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return ""


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
