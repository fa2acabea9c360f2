"""The parts of a sweep on disk. Each is complete or absent, so that an interrupted run continues from them."""

import io
import json
import shutil
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gqm_sym.building import write_bytes, write_text
from gqm_sym.errors import InputError
from gqm_sym.runtime.sweep.result import Sweep
from gqm_sym.studies.plan import Plan

_PLAN = "plan.json"


class Store:
    """The folder ``FILE.parts`` beside the file to which the results will be written.

    Parameters
    ----------
    target
        The file for the results.
    plan
        The plan that is computed.

    Raises
    ------
    InputError
        If the folder contains parts of another plan.
    """

    def __init__(self, target: Path, plan: Plan) -> None:
        self.folder = self.folder_of(target)
        self._plan = plan
        if self.folder.exists() and self._digest() != plan.digest:
            raise InputError(
                f"{self.folder}: holds parts of another sweep, or of one with another version; "
                "give another name to write to, or --force to begin anew"
            )
        if not self.folder.exists():
            self.folder.mkdir(parents=True)
            write_text(json.dumps({"digest": plan.digest}), self.folder / _PLAN)

    @staticmethod
    def folder_of(target: Path) -> Path:
        """Return the folder of the parts of a file."""
        return target.with_name(f"{target.name}.parts")

    def length(self, number: int) -> int:
        """Return the number of points of a part."""
        extent = self._plan.extent(number)
        return int(extent.stop - extent.start)

    def _digest(self) -> str:
        try:
            return str(json.loads((self.folder / _PLAN).read_text(encoding="utf-8"))["digest"])
        except (OSError, ValueError, KeyError, TypeError):
            return ""

    def _path(self, number: int) -> Path:
        return self.folder / f"{number:06}.npz"

    def put(self, number: int, swept: Mapping[str, Sweep]) -> None:
        """Store a part: the values, the status and the route of each quantity."""
        stream = io.BytesIO()
        arrays = {f"{name} {field}": getattr(one, field) for name, one in swept.items() for field in one._fields}
        np.savez(stream, allow_pickle=False, **arrays)
        write_bytes(stream.getvalue(), self._path(number))

    def get(self, number: int) -> dict[str, Sweep] | None:
        """Return a stored part; None if it is absent or damaged."""
        try:
            with self._path(number).open("rb") as file, np.load(file, allow_pickle=False) as found:
                swept = {
                    name: Sweep(*(found[f"{name} {field}"] for field in Sweep._fields))
                    for name in self._plan.quantities
                }
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None
        complete = all(len(array) == self.length(number) for one in swept.values() for array in one)
        return swept if complete else None

    def missing(self) -> list[int]:
        """Return the parts that are not stored."""
        return [number for number in range(self._plan.parts) if self.get(number) is None]

    def joined(self) -> dict[str, Sweep]:
        """Return all parts together, in the plan's shape."""
        parts = [self.get(number) or {} for number in range(self._plan.parts)]
        shape, out = self._plan.shape, {}
        for name in self._plan.quantities:
            fields = (np.concatenate(pieces) for pieces in zip(*(part[name] for part in parts), strict=True))
            out[name] = Sweep(*(field.reshape(shape + field.shape[1:]) for field in fields))
        return out

    def remove(self) -> None:
        """Remove all parts."""
        shutil.rmtree(self.folder, ignore_errors=True)
