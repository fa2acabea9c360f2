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
        waiting = list(begin)
        while waiting:
            name = waiting.pop()
            # The name of a room stands for all files in it.
            for here in {name} & self._digests.keys() or {n for n in self._digests if n.startswith(f"{name}.")}:
                if here not in found:
                    found.add(here)
                    waiting += self._imports[here]
        return found

    def _joined(self, names: Iterable[str]) -> str:
        return hashlib.sha256("\n".join(f"{name} {self._digests[name]}" for name in sorted(names)).encode()).hexdigest()


def _module_name(path: Path) -> str:
    return ".".join(path.with_suffix("").parts)
