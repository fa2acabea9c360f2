"""The plan of a sweep: quantities, and varying and fixed arguments, point by point."""

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

# The number of points of a part, which take about a second: if compiled loops compute most points, and if each point is
# solved separately.
POINTS_IN_LOOPS, POINTS_SOLVED = 2**15, 2**7


@dataclass(frozen=True, kw_only=True, eq=False)
class Axis:
    """An argument that varies: its name, its values in SI units, and their unit."""

    name: str
    values: Array
    unit: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """The plan of a sweep; the same plan gives the same numbers.

    Attributes
    ----------
    title
        One line of text for readers.
    quantities
        Names of quantities, as for ``module.sweep``.
    axes
        The arguments that vary, with their values.
    grid
        Whether the points are all combinations of the axes; otherwise the axes are columns of a table.
    fixed
        Arguments that are the same at all points, with numbers as exact texts.
    units
        SI units of all names, as far as they are known.
    name, module
        The name and the text of the generated module.
    origin
        The files from which the plan was read, with their texts.
    part
        The number of points that are computed and stored together.
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
        """The shape of the results."""
        return tuple(axis.values.size for axis in self.axes) if self.grid else (self.axes[0].values.size,)

    @property
    def size(self) -> int:
        """The number of points."""
        return prod(self.shape)

    @property
    def parts(self) -> int:
        """The number of parts in which the points are computed."""
        return -(-self.size // self.part)

    def extent(self, number: int) -> slice:
        """Return the slice of the points in a part.

        Parameters
        ----------
        number
            The number of the part, from 0.
        """
        return slice(number * self.part, min((number + 1) * self.part, self.size))

    def arguments(self, number: int) -> dict[str, Any]:
        """Return the arguments of ``module.sweep`` for a part: fixed ones as text, and varying ones as arrays.

        Parameters
        ----------
        number
            The number of the part, from 0.
        """
        extent = self.extent(number)
        return self._at(np.arange(extent.start, extent.stop))

    def point(self, index: int) -> dict[str, Any]:
        """Return the arguments of ``module.solve`` for one point.

        Parameters
        ----------
        index
            The number of the point, from 0, in C order.
        """
        given = self._at(np.array([index]))
        return given | {axis.name: float(given[axis.name][0]) for axis in self.axes}

    def _at(self, points: NDArray[np.int64]) -> dict[str, Any]:
        at = np.unravel_index(points, self.shape) if self.grid else (points,) * len(self.axes)
        return {**self.fixed, **{axis.name: axis.values[k] for axis, k in zip(self.axes, at, strict=True)}}

    @cached_property
    def digest(self) -> str:
        """Return a digest that differs for plans whose numbers may differ; it includes the module and the runtime."""
        values = [[axis.name, hashlib.sha256(axis.values.tobytes()).hexdigest()] for axis in self.axes]
        facts = [STAMP, self.module, self.quantities, values, self.grid, sorted(self.fixed.items()), self.part]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def evenly(start: str, stop: str, count: int) -> Array:
    """Return the doubles nearest to evenly spaced exact numbers, including both ends."""
    first, last = (_fraction(text) for text in (start, stop))
    step = (last - first) / (count - 1)
    whole = lcm(first.denominator, step.denominator)
    at, by = int(first * whole), int(step * whole)
    # A quotient of integers is rounded once, however long they are.
    return np.fromiter(((at + by * k) / whole for k in range(count)), dtype=np.float64, count=count)


def in_doubles(cells: Iterable[str], unit: Unit) -> Array:
    """Return the doubles in SI units nearest to decimal numbers given in a unit."""
    if unit.is_si:
        return np.array([float(cell) for cell in cells])
    scale = unit.factor * _fraction("pi") ** unit.turns
    return np.array([float(Fraction(cell) * scale) for cell in cells])


def _fraction(text: str) -> Fraction:
    number = read_number(text, where="a value")
    # An irrational number is represented by its first 32 digits.
    return Fraction(number.value) + Fraction(number.low) if number.fraction is None else number.fraction
