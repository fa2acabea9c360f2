"""Feed mutated curve files and expressions to their readers for a while: ``fuzz.py [SECONDS] [SEED]``.

Every input must be read, or refused by a GQMError, within a second of processor time and 200 MB. What breaks that is
written to ``fuzz-failures/``. Inputs that reach code which none before reached join the corpus, so that the run goes
deeper as it goes on.
"""

import random
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT)]

from confined import OutOfTime, confined  # noqa: E402

from gqm_sym.errors import GQMError  # noqa: E402
from gqm_sym.expressions import read_expression  # noqa: E402
from gqm_sym.literals.grammar import CONSTANTS, FUNCTIONS  # noqa: E402
from gqm_sym.specfile import read_spec  # noqa: E402

PACKAGE = str(ROOT / "gqm_sym")
FAILURES = Path("fuzz-failures")
PIECES = [
    *(name + "(" for name in FUNCTIONS),
    *CONSTANTS,
    *("x", "h", "0", "1", "9", "1/2", "1e9", "1e-300", "0.1", "**", "**-", "+", "-", "*", "/", "(", ")", ")**9", " "),
    *(
        ": ",
        "\n",
        "\n  ",
        "- ",
        "{",
        "}",
        "[",
        "]",
        ", ",
        "'",
        '"',
        "&a ",
        "*a",
        "!!x ",
        "|\n",
        ">\n",
        "? ",
        "#",
        "---\n",
    ),
    *("null", "~", "true", ".nan", "\t", "\\u0041", "\ufeff", "\u202e", "\u0445", "\0", "<<: ", "%YAML 1.1\n"),
    *("name", "curve", "graph", "polar", "kernel", "parameters", "launch", "lam0", "domain", "value", "family"),
]
SEEDS = [
    *("h*x**2 + sin(x/3)", "sqrt(x**2 + h)", "-pi/2 + 6/5", "cbrt(2)*exp(-x)/(1 + x)", "abs(asin(1/3) - x)**(3/2)"),
    *("log(2 + cos(h*x))**-2", "acosh(2)*tanh(x)", "1e-3*cot(x)", "2**3**2"),
]


class Coverage:
    """Lines of the package that no input reached before; free of charge once a line was seen."""

    def __init__(self) -> None:
        self.seen: set[tuple[Any, int]] = set()
        self.new = 0

    def __call__(self, frame: Any, event: str, _: Any) -> "Coverage | None":
        """Note a line, as ``sys.settrace`` asks for it."""
        code = frame.f_code
        if event == "call":
            return self if code.co_filename.startswith(PACKAGE) else None
        place = (code, frame.f_lineno)
        if place not in self.seen:
            self.seen.add(place)
            self.new += 1
        return self


def mutated(text: str, others: list[str], draw: random.Random) -> str:
    """Some pieces cut out, put in, doubled, or taken from another text."""
    for _ in range(draw.choice((1, 1, 2, 3, 8))):
        start = draw.randint(0, len(text))
        stop = min(len(text), start + draw.choice((0, 0, 1, 2, 5, 20, 200)))
        kind = draw.randrange(5)
        if kind == 0:
            new = draw.choice(PIECES)
        elif kind == 1:
            other = draw.choice(others)
            begin = draw.randint(0, len(other))
            new = other[begin : begin + draw.choice((1, 5, 50))]
        elif kind == 2:
            new = text[start:stop] * draw.choice((0, 2, 2, 20))
        elif kind == 3:
            new = chr(draw.choice((draw.randrange(128), draw.randrange(0xD800), draw.randrange(0xE000, 0x110000))))
        else:
            new = draw.choice(PIECES) * draw.choice((1, 2, 30))
        text = text[:start] + new + text[stop:]
    return text[:80_000]


def outcome(read: Callable[[], object]) -> str:
    """Return a description of what went wrong with one input; empty if nothing did."""
    try:
        with confined():
            read()
    except GQMError:
        return ""
    except OutOfTime:
        return "time"
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        return type(error).__name__
    return ""


def main(seconds: float, seed: int) -> int:
    """Run, print the counts, and return 1 if anything failed."""
    draw, coverage = random.Random(seed), Coverage()
    files = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "curves").glob("*.yaml"))]
    corpora = [files, list(SEEDS)]
    count, failures, worst = [0, 0], 0, 0.0
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.yaml"
        while time.monotonic() < start + seconds:
            kind = draw.randrange(2)
            corpus = corpora[kind]
            text = mutated(draw.choice(corpus), corpora[draw.randrange(2)], draw)
            if kind == 0:
                path.write_bytes(text.encode("utf-8", "surrogatepass"))
            # Lines are counted for one input in 32: counting takes much more time than reading.
            counted, coverage.new = count[kind] % 32 == 0, 0
            read = partial(read_spec, path) if kind == 0 else partial(read_expression, text, where="t")
            before = time.thread_time()
            if counted:
                sys.settrace(coverage)
            found = outcome(read)
            sys.settrace(None)
            if not counted:
                worst = max(worst, time.thread_time() - before)
            count[kind] += 1
            if coverage.new and len(text) < 4000:
                corpus.append(text)
            # Counting lines slows an input down: without it, it may be in time.
            if found == "time" and counted:
                found = outcome(read)
            if found:
                failures += 1
                FAILURES.mkdir(exist_ok=True)
                name = f"{seed}-{sum(count)}-{found}{'.yaml' if kind == 0 else '.txt'}"
                (FAILURES / name).write_bytes(text.encode("utf-8", "surrogatepass"))
                print(f"{found}: {FAILURES / name}", flush=True)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    print(
        f"{count[0]} files and {count[1]} expressions in {time.monotonic() - start:.0f} s: {failures} failures; "
        f"slowest {worst:.2f} s, {memory} MB at most, {len(coverage.seen)} lines reached, "
        f"corpus {len(corpora[0])} + {len(corpora[1])}"
    )
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 600.0, int(sys.argv[2]) if len(sys.argv) > 2 else 0))
