"""The one place where an error becomes a line of text and an exit code."""

import os
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gqm_sym.errors import GQMError, InputError, NoisyPointsWarning, SpecFileError

DONE = 0
DIFFERENT = 1  # --check found a file that differs from what would be written
WRONG_INPUT = 2
FAILED = 3
INTERRUPTED = 130
BROKEN_PIPE = 141  # what a shell reports for a program that SIGPIPE ended


def guarded(program: str, work: Callable[[], int]) -> int:
    """Run a command, and turn any error into one clear message and an exit code.

    Parameters
    ----------
    program
        The name of the command, for messages.
    work
        The whole command, including the reading of its arguments. It returns the exit code.
    """
    for stream in (sys.stdout, sys.stderr):
        # A title with characters that the terminal cannot show must not make the command fail.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    try:
        with _warnings_as_lines(program):
            code = work()
        sys.stdout.flush()
        return code
    except SystemExit as stop:  # argparse: 0 after --help, 2 after a usage error
        return stop.code if isinstance(stop.code, int) else WRONG_INPUT
    except KeyboardInterrupt:
        return _end(f"{program}: interrupted", INTERRUPTED)
    except BrokenPipeError:
        # The interpreter flushes once more at exit, which must not fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except GQMError as error:
        return _end(message_of(error, program), code_of(error))
    except OSError as error:
        what = f"{error.filename}: " if error.filename else ""
        return _end(f"{program}: {what}{error.strerror or error}", WRONG_INPUT)
    except (RecursionError, MemoryError) as error:
        what = "nested too deeply" if isinstance(error, RecursionError) else "too large"
        return _end(f"{program}: an expression is {what}; write it in a simpler form", FAILED)
    except Exception as error:  # a defect of this package: the place of the error is printed instead of a traceback
        frame = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(frame.filename).name}:{frame.lineno}"
        what = f"{type(error).__name__}: {error}".replace("\n", " ")
        return _end(f"{program}: internal error ({where}): {what}; please report it, with the input", FAILED)


@contextmanager
def _warnings_as_lines(program: str) -> Iterator[None]:
    """Print warnings of this package as one line, without their place in the package, which helps nobody."""
    with warnings.catch_warnings():
        shown = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *where: Any, **rest: Any) -> None:
            if issubclass(category, NoisyPointsWarning):
                print(f"{program}: warning: {message}", file=sys.stderr)
            else:
                shown(message, category, *where, **rest)

        warnings.showwarning = show
        yield


def code_of(error: GQMError) -> int:
    """Return the exit code for an error."""
    return WRONG_INPUT if isinstance(error, InputError) else FAILED


def message_of(error: GQMError, source: str) -> str:
    """Return the text that is printed for an error. It begins with ``source`` unless the error names its own file."""
    return str(error) if isinstance(error, SpecFileError) else f"{source}: {error}"


class Failures:
    """Errors in several files: each is printed as it occurs, and the work on the other files continues."""

    def __init__(self) -> None:
        self._codes: list[int] = []

    def __bool__(self) -> bool:
        return bool(self._codes)

    @property
    def code(self) -> int:
        """The exit code: wrong input takes precedence over a failure; 0 if there was neither."""
        return min(self._codes, default=DONE)

    @contextmanager
    def recording(self, source: str) -> Iterator[None]:
        """Record and print an error that ends the block; ``source`` is the file that it concerns."""
        try:
            yield
        except GQMError as error:
            self._codes.append(_end(message_of(error, source), code_of(error)))


def _end(message: str, code: int) -> int:
    print(message, file=sys.stderr)
    return code
