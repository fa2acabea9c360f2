"""How far long work has come, drawn where a person looks."""

import sys
from typing import TextIO

_WIDTH = 30


class Bar:
    """A bar on a terminal, redrawn in place; nothing where the stream is none."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr
        self._shown = self._stream.isatty()

    def __call__(self, done: int, size: int) -> None:
        """Draw it."""
        if self._shown:
            filled = _WIDTH * done // size
            bar = "#" * filled + "." * (_WIDTH - filled)
            self._stream.write(f"\r[{bar}] {100 * done // size:3d}%  {done} of {size} points")
            self._stream.flush()

    def close(self) -> None:
        """Leave it, on a line of its own."""
        if self._shown:
            self._stream.write("\n")
            self._stream.flush()
