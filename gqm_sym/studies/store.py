"""Parts of a sweep on disk: each whole or not there, so that a run that was cut off goes on from them."""

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


class Store:
    """The folder ``FILE.parts`` beside the file that the results will be in.

    Parameters
    ----------
    target
        That file.
    plan
        What is computed.

    Raises
    ------
    InputError
        If parts of another plan are there.
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
        """Where the parts of a file lie."""
        return target.with_name(f"{target.name}.parts")

    def length(self, number: int) -> int:
        """How many points a part has."""
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
        """Store a part: values and reasons of each quantity."""
        stream = io.BytesIO()
        arrays = {f"{name} {field}": getattr(one, field) for name, one in swept.items() for field in one._fields}
        np.savez(stream, allow_pickle=False, **arrays)
        write_bytes(stream.getvalue(), self._path(number))

    def get(self, number: int) -> dict[str, Sweep] | None:
        """A stored part; None where there is none, or a damaged one."""
        try:
            with self._path(number).open("rb") as file, np.load(file, allow_pickle=False) as found:
                swept = {
                    name: Sweep(*(found[f"{name} {field}"] for field in Sweep._fields))
                    for name in self._plan.quantities
                }
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None
        whole = all(len(array) == self.length(number) for one in swept.values() for array in one)
        return swept if whole else None

    def missing(self) -> list[int]:
        """The parts that are not stored."""
        return [number for number in range(self._plan.parts) if self.get(number) is None]

    def whole(self) -> dict[str, Sweep]:
        """All parts together, in the plan's shape."""
        parts = [self.get(number) or {} for number in range(self._plan.parts)]
        shape, out = self._plan.shape, {}
        for name in self._plan.quantities:
            values, reasons = (np.concatenate([part[name][k] for part in parts]) for k in (0, 1))
            out[name] = Sweep(values.reshape(shape + values.shape[1:]), reasons.reshape(shape))
        return out

    def remove(self) -> None:
        """Remove all parts."""
        shutil.rmtree(self.folder, ignore_errors=True)
