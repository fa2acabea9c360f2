"""The record of one generated module: its functions, formulas and run-time parameters, and the range of its curve."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.budgets import budget
from gqm_sym.errors import ParameterError, renamed
from gqm_sym.literals.namespaces import FLOATS
from gqm_sym.literals.numbers import Number, read_number
from gqm_sym.runtime.charts.chart import Chart, ChartMaker
from gqm_sym.runtime.compiled.jit import Later
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import Addresses, BatchFunctions, Dissipation, ExactFormulas, ExactPotential
from gqm_sym.runtime.launch.domain import Domain


class ParameterValues(tuple[Number, ...]):
    """Run-time parameters, and what follows from them alone: the same for every launch with them."""

    values: Array
    domain: Domain | None = None
    functions: Any = None  # `launch.problem.BoundFunctions` of all launches with these parameters


@lru_cache(maxsize=8)
def _chart(maker: ChartMaker, values: tuple[float, ...]) -> Chart:
    """A curve's chart, made once for the same values of the run-time parameters."""
    with budget("chart", 60.0, "give fewer points, or shorter and simpler pieces"):
        return maker.chart(values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Formulas:
    """The compiled functions and exact formulas of one generated module.

    Attributes
    ----------
    name, parameter : str
        Its name, and the name of the curve's parameter.
    parameters : dict
        Run-time parameters and their defaults, None where one must be given.
    positive : tuple of str
        Parameters for which the closed forms assume a positive value.
    at_least : tuple of (str, str)
        Parameters with what they must not fall below: a number, or another parameter.
    rolling_radius : str
        The radius of a rolling body whose centre's path was derived from its track; empty for any other.
    static_friction_limit : tuple of str, optional
        Of a rolling body whose static friction is known: its inertia beta and its coefficient mu_static.
    domain_of
        ``f(op, p)``: both ends of the parameter's range and its period, None where there is none. A chart has its own.
    axes_of
        ``f(op, p)``: a place about which V**2 and ds are even, and the distance to the next; None where there is none.
    monotone
        Whether V**2 is proved to rise or fall all the way between two such places, and ds to vanish nowhere.
    exact
        The formulas over a namespace of operations, of a charted curve those of the forces; None where there are none.
    chart
        What makes the chart of a curve that has no formulas.
    dissipation
        What a dissipative model adds; None for a conservative one.
    load_map
        The function that fills a load map in one call; None where there is no such function.
    batch
        The functions that serve many orbits at once; None where motions are solved one by one.
    """

    name: str
    parameter: str
    parameters: Mapping[str, float | int | str | None]
    positive: tuple[str, ...]
    addresses: Addresses
    domain_of: Callable[..., Any] | None = None
    axes_of: Callable[..., Any] | None = None
    monotone: bool = False
    exact: ExactFormulas | ExactPotential | None = None
    chart: ChartMaker | None = None
    dissipation: Dissipation | None = None
    load_map: Later | None = None
    batch: BatchFunctions | None = None
    at_least: tuple[tuple[str, str], ...] = ()
    rolling_radius: str = ""
    static_friction_limit: tuple[str, str] | None = None
    _read: Callable[..., "ParameterValues"] = field(init=False, repr=False, compare=False)

    if not TYPE_CHECKING:
        __getattr__ = renamed(body="rolling_radius", each="batch", grip="static_friction_limit", loads="load_map")

    def __post_init__(self) -> None:
        # Most launches come with the parameters of one before; 1 and 1.0 are told apart, for their texts differ.
        object.__setattr__(self, "_read", lru_cache(maxsize=16, typed=True)(self._numbers))

    def numbers(self, given: tuple[Any, ...]) -> "ParameterValues":
        """The run-time parameters as exact numbers, checked."""
        try:
            return self._read(*given)
        except TypeError:  # what cannot be hashed
            return self._numbers(*given)

    def _numbers(self, *given: Any) -> "ParameterValues":
        out = []
        for name, value in zip(self.parameters, given, strict=True):
            if value is None:
                raise ParameterError(f"{name}: has no default and was not given; pass {name}=...")
            number = read_number(value, where=name)
            if (name in self.positive or name == "m") and not number.value > 0.0:
                raise ParameterError(
                    f"{name}: must be positive, got {number.text}; the closed forms hold for {name} > 0"
                )
            out.append(number)
        self._check_least(dict(zip(self.parameters, out, strict=True)))
        p = ParameterValues(out)
        p.values = np.array([number.value for number in out])
        return p

    def _check_least(self, values: dict[str, Number]) -> None:
        """Refuse a parameter below what it must not fall below."""
        for name, least in self.at_least:
            bound = values.get(least) or read_number(least, where=least)
            if values[name].value < bound.value:
                what = f"{least} = {bound.text}" if least in values else least
                raise ParameterError(f"{name}: must be at least {what}, got {values[name].text}")

    def charted(self, p: ParameterValues) -> Chart:
        """The chart of a charted curve."""
        assert self.chart is not None
        return _chart(self.chart, tuple(p.values.tolist()))

    def domain(self, p: ParameterValues) -> Domain:
        """The range of the curve's parameter."""
        if p.domain is None:
            p.domain = self._domain(p)
        return p.domain

    def _domain(self, p: ParameterValues) -> Domain:
        if self.chart is not None:
            chart = self.charted(p)
            if chart.period:
                return Domain(-math.inf, math.inf, chart.period)
            return Domain(chart.low, chart.high, 0.0, chart.ends)
        values = tuple(number.value for number in p)
        low, high, period = self.ends(FLOATS, values)
        axis, step = self.axes(FLOATS, values) if self.monotone else (None, None)
        ends = (-math.inf if low is None else float(low), math.inf if high is None else float(high))
        return Domain(
            *ends, float(period or 0.0), axis=math.nan if axis is None else float(axis), axis_step=float(step or 0.0)
        )

    def ends(self, op: Any, values: tuple[Any, ...]) -> tuple[Any, Any, Any]:
        """Both ends of the parameter's range and its period, None where there is none: on a closed curve no ends."""
        assert self.domain_of is not None
        low, high, period = self.domain_of(op, values)
        return (low, high, None) if period is None else (None, None, period)

    def axes(self, op: Any, values: tuple[Any, ...]) -> tuple[Any, Any]:
        """A place of symmetry and the distance to the next, None where there is none."""
        return (None, None) if self.axes_of is None else self.axes_of(op, values)
