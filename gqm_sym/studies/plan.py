"""What a sweep computes: quantities, what varies and what does not, point by point."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import lcm, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gqm_sym.literals.numbers import read_number
from gqm_sym.literals.units import Unit
from gqm_sym.runtime.compiled.jit import STAMP

Array = NDArray[np.float64]

# The number of points of a part, about a second of work: where compiled loops answer most points, and where each point
# is solved by itself.
POINTS_IN_LOOPS, POINTS_SOLVED = 2**15, 2**7


@dataclass(frozen=True, kw_only=True, eq=False)
class Axis:
    """One thing that varies: its name, its values in SI, and their unit."""

    name: str
    values: Array
    unit: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A sweep: the same plan gives the same numbers.

    Attributes
    ----------
    title
        One line for people.
    quantities
        As of ``module.sweep``.
    axes
        What varies.
    grid
        Whether all combinations of the axes are points; else they are columns of a table.
    fixed
        Arguments that are the same at all points; numbers as exact texts.
    units
        SI units of all names, as far as they are known.
    name, module
        The generated module: its name and its text.
    origin
        Files that the plan was read from: what each is, and its text.
    part
        Points that are computed, and stored, at a time.
    """

    title: str
    quantities: tuple[str, ...]
    axes: tuple[Axis, ...]
    grid: bool
    fixed: Mapping[str, str]
    units: Mapping[str, str]
    name: str
    module: str
    origin: Mapping[str, str]
    part: int

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the results."""
        return tuple(axis.values.size for axis in self.axes) if self.grid else (self.axes[0].values.size,)

    @property
    def size(self) -> int:
        """How many points there are."""
        return prod(self.shape)

    @property
    def parts(self) -> int:
        """In how many parts they are computed."""
        return -(-self.size // self.part)

    def extent(self, number: int) -> slice:
        """The points of a part."""
        return slice(number * self.part, min((number + 1) * self.part, self.size))

    def arguments(self, number: int) -> dict[str, Any]:
        """Arguments of ``module.sweep`` for a part: what is fixed as text, what varies as arrays."""
        extent = self.extent(number)
        return self._at(np.arange(extent.start, extent.stop))

    def point(self, index: int) -> dict[str, Any]:
        """The same for one point."""
        given = self._at(np.array([index]))
        return given | {axis.name: float(given[axis.name][0]) for axis in self.axes}

    def _at(self, points: NDArray[np.int64]) -> dict[str, Any]:
        at = np.unravel_index(points, self.shape) if self.grid else (points,) * len(self.axes)
        return {**self.fixed, **{axis.name: axis.values[k] for axis, k in zip(self.axes, at, strict=True)}}

    @cached_property
    def digest(self) -> str:
        """What tells plans apart whose numbers may differ: by the module and the runtime too."""
        values = [[axis.name, hashlib.sha256(axis.values.tobytes()).hexdigest()] for axis in self.axes]
        facts = [STAMP, self.module, self.quantities, values, self.grid, sorted(self.fixed.items()), self.part]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def evenly(start: str, stop: str, count: int) -> Array:
    """Doubles nearest to evenly spaced exact numbers, both ends included."""
    first, last = (_fraction(text) for text in (start, stop))
    step = (last - first) / (count - 1)
    whole = lcm(first.denominator, step.denominator)
    at, by = int(first * whole), int(step * whole)
    # A quotient of integers is rounded once, however long they are.
    return np.fromiter(((at + by * k) / whole for k in range(count)), dtype=np.float64, count=count)


def in_doubles(cells: Iterable[str], unit: Unit) -> Array:
    """Doubles nearest to decimal numbers given in a unit, in SI."""
    if unit.is_si:
        return np.array([float(cell) for cell in cells])
    scale = unit.factor * _fraction("pi") ** unit.turns
    return np.array([float(Fraction(cell) * scale) for cell in cells])


def _fraction(text: str) -> Fraction:
    number = read_number(text, where="a value")
    # An irrational number by its first 32 digits.
    return Fraction(number.value) + Fraction(number.low) if number.fraction is None else number.fraction
