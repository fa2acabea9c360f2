"""Which tests run at every change, and which only in the extended run (``make test-all``).

A test is marked ``extended`` if it takes more than about half a second of processor time and what it claims is also
claimed by a test that runs at every change: for another curve, force or size. A test with many cases that all pass
through the same code is marked ``sample``: at every change some of its cases run.

``sample(3)`` keeps three cases, spread evenly from the first to the last. ``sample(each=("curve", "force"))`` keeps the
first case with each value of each of these arguments. Tables of cases therefore begin and end with what is hardest.
Tests of Hypothesis say by `examples` how many examples they draw in the extended run, and draw a quarter of them
otherwise, or a number that they say.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any

from hypothesis import settings

# The number of examples in the extended run of a test that does not say it (the default of Hypothesis), and in the
# other one; by their ratio the numbers of all tests are less there.
EXTENDED_EXAMPLES, USUAL_EXAMPLES = 100, 25

# Notebooks that show on one more example what others and the tests of the same calls show too. They take most of the
# time of all notebooks.
EXTENDED_NOTEBOOKS = (
    "absorber",
    "coaster",
    "damping",
    "descent",
    "design",
    "example1",
    "example2",
    "families",
    "kepler",
    "kernels",
    "own_curve",
    "period_law",
    "rail",
)


def examples(count: int, otherwise: int | None = None) -> settings:
    """Return the settings of a test of Hypothesis that draws so many examples in the extended run, and so many, or a
    quarter, otherwise.
    """
    share = settings().max_examples / EXTENDED_EXAMPLES
    drawn = otherwise if otherwise and share < 1 else round(count * share)
    return settings(max_examples=max(2, drawn))


def spread(length: int, count: int) -> set[int]:
    """Return so many indices of a sequence of some length, spread evenly, with the first and the last one."""
    if count == 1:
        return {0}
    return {round(k * (length - 1) / (count - 1)) for k in range(count)}


def first_of_each(rows: Sequence[Sequence[Any]]) -> set[int]:
    """Return the indices of the rows that have a value in a column which no row before has there."""
    seen: set[tuple[int, int]] = set()
    kept = set()
    for index, row in enumerate(rows):
        values = {(column, id(value)) for column, value in enumerate(row)}
        if not values <= seen:
            kept.add(index)
            seen |= values
    return kept


def usual(items: Iterable[Any]) -> list[Any]:
    """Return those of pytest's items that run at every change, in their order."""
    families: dict[tuple[Any, str], list[Any]] = defaultdict(list)
    left_out: set[Any] = set()
    for item in items:
        if item.path.suffix == ".ipynb":
            if item.path.stem in EXTENDED_NOTEBOOKS:
                left_out.add(item)
        elif item.get_closest_marker("extended"):
            left_out.add(item)
        elif item.get_closest_marker("sample"):
            families[item.path, item.originalname].append(item)
    for family in families.values():
        mark = family[0].get_closest_marker("sample")
        if mark.args:
            kept = spread(len(family), *mark.args)
        else:
            names = mark.kwargs["each"]
            kept = first_of_each([[item.callspec.params[name] for name in names] for item in family])
        left_out |= {item for index, item in enumerate(family) if index not in kept}
    return [item for item in items if item not in left_out]
