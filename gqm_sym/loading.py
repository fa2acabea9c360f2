"""Import of generated modules from their files."""

import atexit
import importlib.util
import os
import tempfile
from functools import cache, lru_cache
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType

from gqm_sym.errors import InputError


class _Source(SourceFileLoader):
    """A loader that always reads the source, because Python distinguishes cached versions by size and whole seconds
    only.
    """

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        code: CodeType = self.source_to_code(self.get_data(path), path)
        return code


def load(path: str | os.PathLike[str], name: str) -> ModuleType:
    """Import a generated module from its file, even if it has been imported before."""
    location = Path(path).resolve()
    spec = importlib.util.spec_from_file_location(name, location, loader=_Source(name, str(location)))
    if spec is None or spec.loader is None or not location.is_file():
        raise InputError(f"{path}: is not a generated module; run gqm-gen to write it")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def _folder() -> str:
    """Return a folder for modules that have no file of their own; it is deleted when the process ends.

    numba stores compiled code only for functions whose file exists when they are compiled, and without a place for it
    they would be compiled at their first call.
    """
    folder = tempfile.TemporaryDirectory(prefix="gqm-")
    atexit.register(folder.cleanup)
    return folder.name


@lru_cache(maxsize=16)
def load_text(source: str, text: str, name: str) -> ModuleType:
    """Import a generated module from its text, in another process or on another machine.

    The file is used if it has the same text here, because compiled code is stored beside it.

    Parameters
    ----------
    source, text, name
        The path of the module's file where it was written, its text, and its name.
    """
    path = Path(source)
    if path.is_file() and path.read_text(encoding="utf-8", errors="replace") == text:
        return load(path, name)
    path = Path(tempfile.mkdtemp(dir=_folder())) / f"{name}.py"
    path.write_text(text, encoding="utf-8")
    return load(path, name)
