"""Accuracy and time of this package and its alternatives, measured in one process; run by ``make bench``.

All errors are differences from references of 40 digits. The run fails if the error of one of our rows exceeds its
limit, whatever the times. Writes ``docs/benchmarks.md``.
"""

import argparse
import platform
import sys
import warnings
from pathlib import Path

from calls import profile
from gradients import gradients
from half_periods import half_periods
from legs import legs
from load_maps import load_maps
from many_launches import many_launches
from measure import Result, measured, readable
from peers import PEERS, presence
from sampling import sampling
from scipy.integrate import IntegrationWarning
from stages import second_process

PAGE = Path(__file__).parent.parent / "docs" / "benchmarks.md"


def page(results: list[Result], start: tuple[float, float]) -> str:
    """Write the results as a page of Markdown."""
    lines = [
        "# Benchmarks",
        "",
        "`make bench` writes this page. Each error is the largest of some hundred cases, compared with closed forms of",
        "40 digits. The last column is the time relative to that of the first row with the same work. Times are",
        "medians of at most fifteen calls, and of one call where it takes long, on",
        f"{platform.machine()} with Python {platform.python_version()}; only their ratios are meaningful.",
        "",
        "| work | method | time | error | time relative to ours |",
        "|---|---|---|---|---|",
    ]
    ours: dict[str, float] = {}
    for result in results:
        row = result.row
        ratio = result.seconds / ours.setdefault(row.work, result.seconds)
        wrong = f"{result.error:.2g} {row.unit}".rstrip() + (f" **exceeds {row.line:g}**" if result.missed else "")
        lines.append(f"| {row.work} | {row.who} | {readable(result.seconds)} | {wrong} | {ratio:.3g} |")
    lines += [
        "",
        f"Start of a second process: `import numba` takes {start[0]:.2f} s, and from there to a solved pendulum",
    ]
    lines += [f"{start[1]:.2f} s.", ""]
    lines += [f"- {peer}: {presence(peer)}" for peer in PEERS]
    lines += ["", "## Where the time goes", "", "The shortest of many runs from Python, on one core.", "", *profile()]
    lines += [
        "",
        "## How the cost grows",
        "",
        "![Cost against time, legs, launches and length of formulas](figures/scale.svg)",
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Measure all rows, write the page, and fail if the error of one of our rows exceeds its limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=PAGE)
    output = parser.parse_args().output
    warnings.simplefilter("ignore", IntegrationWarning)  # the errors show what QUADPACK warns about
    results = []
    for row in [*half_periods(), *sampling(), *legs(), *load_maps(), *many_launches(), *gradients()]:
        results.append(measured(row))
        print(f"{row.work:<45} {row.who:<60} {readable(results[-1].seconds):>9} {results[-1].error:9.2g}", flush=True)
    output.write_text(page(results, second_process()), encoding="utf-8")
    missed = [result.row for result in results if result.missed]
    for row in missed:
        print(f"{row.work}, {row.who}: the error exceeds its limit, {row.line:g} {row.unit}", file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
