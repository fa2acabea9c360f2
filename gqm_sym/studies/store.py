"""Finished parts of a sweep on disk, each complete or absent, from which an interrupted run continues."""

import io
import json
import shutil
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gqm_sym.building import write_bytes, write_text
from gqm_sym.errors import InputError
from gqm_sym.runtime.sweep.sweep import Sweep
from gqm_sym.studies.plan import Plan

_PLAN = "plan.json"
_FIELDS = ("values", "status")


class Store:
    """The folder ``FILE.parts`` beside the file of results.

    Parameters
    ----------
    target : Path
        The file of results.
    plan : Plan
        What is computed.

    Raises
    ------
    InputError
        If the folder holds parts of another plan.
    """

    def __init__(self, target: Path, plan: Plan) -> None:
        self.folder = self.folder_of(target)
        self._plan = plan
        if self.folder.exists() and self._digest() != plan.digest:
            raise InputError(
                f"{self.folder}: holds parts of another sweep, or of another version of gqm_sym; "
                "write to a file of another name, or start again with force=True (--force)"
            )
        if not self.folder.exists():
            self.folder.mkdir(parents=True)
            write_text(json.dumps({"digest": plan.digest}), self.folder / _PLAN)

    @staticmethod
    def folder_of(target: Path) -> Path:
        """Return the folder of parts that belongs to a file of results."""
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
        """Store a part: the values and the status of each quantity."""
        stream = io.BytesIO()
        arrays = {f"{name} {field}": one[k] for name, one in swept.items() for k, field in enumerate(_FIELDS)}
        np.savez(stream, allow_pickle=False, **arrays)
        write_bytes(stream.getvalue(), self._path(number))

    def get(self, number: int) -> dict[str, Sweep] | None:
        """Return a stored part, or None if it is missing or damaged."""
        try:
            with self._path(number).open("rb") as file, np.load(file, allow_pickle=False) as found:
                swept = {
                    name: Sweep(*(found[f"{name} {field}"] for field in _FIELDS)) for name in self._plan.quantities
                }
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None
        complete = all(len(array) == self.length(number) for one in swept.values() for array in one[:2])
        return swept if complete else None

    def missing(self) -> list[int]:
        """Return the numbers of the parts that are not stored."""
        return [number for number in range(self._plan.parts) if self.get(number) is None]

    def results(self) -> dict[str, Sweep]:
        """Return the results of all parts together, in the shape of the plan."""
        parts = [self.get(number) or {} for number in range(self._plan.parts)]
        shape, out = self._plan.shape, {}
        for name in self._plan.quantities:
            values, status = (np.concatenate([part[name][k] for part in parts]) for k in (0, 1))
            out[name] = Sweep(values.reshape(shape + values.shape[1:]), status.reshape(shape))
        return out

    def remove(self) -> None:
        """Remove all parts."""
        shutil.rmtree(self.folder, ignore_errors=True)
