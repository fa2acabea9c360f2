"""The sources of compiled code: the files of the runtime whose code it may contain.

A compiled function contains code of the functions that it calls, which are in its own file or in files that it imports,
directly or through others. So after an edit of one file, the functions of all files that import it are compiled again,
and no others.
"""

import hashlib
import re
from collections.abc import Iterable
from pathlib import Path

# An import anywhere in a file: of names from another file, or of files from a room or from the runtime. Other matches
# do no harm. A pattern that begins with plain text is found eight times as fast.
_IMPORT = re.compile(rb"gqm_sym\.runtime(?:\.([\w.]+)| import (\w+))")

RUNTIME = "gqm_sym.runtime"
FOLDER = Path(__file__).parent.parent

# The files whose functions the functions of generated modules call.
CALLED_BY_MODULES = (
    "arithmetic",
    "charts.differences",
    "charts.evaluate",
    "charts.train_load",
    "compiled",
    "interface",
)


class Stamps:
    """Digests of the files of the runtime.

    Parameters
    ----------
    folder : Path
        The folder of the runtime.
    """

    def __init__(self, folder: Path = FOLDER) -> None:
        files = sorted((_module_name(file.relative_to(folder)), file.read_bytes()) for file in folder.rglob("*.py"))
        # Times of change do not count: those of an installed wheel are all the same.
        self._digests = {name: hashlib.sha256(text).hexdigest() for name, text in files}
        self._imports = {name: {(a or b).decode() for a, b in _IMPORT.findall(text)} for name, text in files}
        self._meant: dict[str, set[str]] = {}
        self._known: dict[str, str] = {}
        self.of_all = self._joined(self._digests)

    def of(self, module: str) -> str:
        """Return the digest of all files that the code of a module's functions may come from.

        Parameters
        ----------
        module : str
            The name of a module of the runtime; any other name stands for a generated module.
        """
        begin = module.removeprefix(f"{RUNTIME}.")
        if begin not in self._known:
            self._known[begin] = self._joined(self.files((begin,) if begin in self._digests else CALLED_BY_MODULES))
        return self._known[begin]

    def files(self, begin: tuple[str, ...]) -> set[str]:
        """Return the given files and all files that they import, directly or through others."""
        found: set[str] = set()
        waiting = set(begin)
        while waiting:
            new = set().union(*map(self._files_of, waiting)) - found
            found |= new
            waiting = set().union(*(self._imports[name] for name in new))
        return found

    def _files_of(self, name: str) -> set[str]:
        """Return the file of a name, or all files in the room of that name."""
        if name not in self._meant:
            inside = (file for file in self._digests if file.startswith(f"{name}."))
            self._meant[name] = {name} if name in self._digests else set(inside)
        return self._meant[name]

    def _joined(self, names: Iterable[str]) -> str:
        return hashlib.sha256("\n".join(f"{name} {self._digests[name]}" for name in sorted(names)).encode()).hexdigest()


def _module_name(path: Path) -> str:
    return ".".join(path.with_suffix("").parts)
