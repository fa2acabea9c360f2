"""A plan of a sweep: the quantities, the arguments that vary and those that are fixed, point by point."""

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
from gqm_sym.runtime.compiled.jit import STAMP
from gqm_sym.specfile.units import Unit

Array = NDArray[np.float64]

# Points per part, which is what is computed and stored at a time: where the vectorised path answers a point in about a
# microsecond, and where each point is solved on its own in about a millisecond.
VECTORISED_PART, SOLVED_PART = 2**15, 2**7


@dataclass(frozen=True, kw_only=True, eq=False)
class Axis:
    """One argument that varies: its name, its values in SI units, and their unit."""

    name: str
    values: Array
    unit: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """What a sweep computes. Made by `read_sweep`; the same plan gives the same numbers.

    Attributes
    ----------
    title : str
        One line of description.
    quantities : tuple of str
        The quantities to compute, as named by ``module.sweep``.
    axes : tuple of Axis
        The arguments that vary.
    grid : bool
        True if the points are all combinations of the axes, False if the axes are columns of a table.
    fixed : mapping
        Arguments that are the same at all points; numbers as exact text.
    units : mapping
        SI unit of each name, where it is known.
    name, module : str
        Name and text of the generated module.
    origin : mapping
        Text of each file that the plan was read from, by the kind of file.
    part : int
        Number of points that are computed and stored at a time.
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
        """Return the range of points of a part."""
        return slice(number * self.part, min((number + 1) * self.part, self.size))

    def arguments(self, number: int) -> dict[str, Any]:
        """Return the arguments of ``module.sweep`` for a part: fixed ones as text, varying ones as arrays."""
        extent = self.extent(number)
        return self._at(np.arange(extent.start, extent.stop))

    def point(self, index: int) -> dict[str, Any]:
        """Return the arguments of ``module.solve`` for one point, with the varying ones as floats."""
        given = self._at(np.array([index]))
        return given | {axis.name: float(given[axis.name][0]) for axis in self.axes}

    def _at(self, points: NDArray[np.int64]) -> dict[str, Any]:
        at = np.unravel_index(points, self.shape) if self.grid else (points,) * len(self.axes)
        return {**self.fixed, **{axis.name: axis.values[k] for axis, k in zip(self.axes, at, strict=True)}}

    @cached_property
    def digest(self) -> str:
        """A hash of everything that the numbers depend on, including the module and the version of the runtime."""
        values = [[axis.name, hashlib.sha256(axis.values.tobytes()).hexdigest()] for axis in self.axes]
        facts = [STAMP, self.module, self.quantities, values, self.grid, sorted(self.fixed.items()), self.part]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def evenly(start: str, stop: str, count: int) -> Array:
    """Return the doubles nearest to evenly spaced exact numbers, both ends included."""
    first, last = (_fraction(text) for text in (start, stop))
    step = (last - first) / (count - 1)
    denominator = lcm(first.denominator, step.denominator)
    start_numerator, step_numerator = int(first * denominator), int(step * denominator)
    # A quotient of integers is rounded only once, however long they are.
    return np.fromiter(
        ((start_numerator + step_numerator * k) / denominator for k in range(count)), dtype=np.float64, count=count
    )


def in_doubles(cells: Iterable[str], unit: Unit) -> Array:
    """Return decimal numbers that are given in a unit as the nearest doubles in SI."""
    if unit.is_si:
        return np.array([float(cell) for cell in cells])
    scale = unit.factor * _fraction("pi") ** unit.turns
    return np.array([float(Fraction(cell) * scale) for cell in cells])


def _fraction(text: str) -> Fraction:
    number = read_number(text, where="a value")
    # The first 32 digits stand for an irrational number.
    return Fraction(number.value) + Fraction(number.low) if number.fraction is None else number.fraction
