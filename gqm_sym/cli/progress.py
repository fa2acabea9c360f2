"""A progress bar for long computations."""

import sys
from typing import TextIO

BAR_WIDTH = 30


class Bar:
    """A progress bar on a terminal, redrawn in place. Nothing is drawn if the stream is not a terminal.

    Parameters
    ----------
    stream
        The stream to draw on; by default standard error.
    things
        The name of the things that are counted.
    """

    def __init__(self, stream: TextIO | None = None, things: str = "points") -> None:
        self._stream, self._things = stream or sys.stderr, things
        self._visible = self._stream.isatty()

    def __call__(self, done: int, size: int) -> None:
        """Draw the bar for ``done`` things out of ``size``."""
        if self._visible:
            filled = BAR_WIDTH * done // size
            bar = "#" * filled + "." * (BAR_WIDTH - filled)
            self._stream.write(f"\r[{bar}] {100 * done // size:3d}%  {done} of {size} {self._things}")
            self._stream.flush()

    def close(self) -> None:
        """End the line, so that the bar stays visible."""
        if self._visible:
            self._stream.write("\n")
            self._stream.flush()
