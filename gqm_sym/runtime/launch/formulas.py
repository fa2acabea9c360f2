"""The record of one generated module: its functions, formulas and run-time parameters, and the range of its curve."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gqm_sym.arguments import not_given
from gqm_sym.budgets import budget
from gqm_sym.errors import ParameterError, renamed
from gqm_sym.literals.namespaces import ARRAYS, FLOATS
from gqm_sym.literals.numbers import Number, read_number
from gqm_sym.runtime.arithmetic.doubledouble import ZERO, Pair
from gqm_sym.runtime.charts.chart import Chart, ChartMaker
from gqm_sym.runtime.compiled.emitted import Emitted
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.interface import (
    BatchFunctions,
    CompiledFunctions,
    DissipativeFunctions,
    ExactChartLaw,
    ExactFormulas,
    ExactLaw,
    ExactPotential,
    SeparatedTerms,
)
from gqm_sym.runtime.launch.domain import Domain, DomainNumbers

# Bits to which sines and cosines of parameters such as pi/2 must vanish to count as zero.
EXACT_BITS = 640


class ParameterValues(tuple[Number, ...]):
    """Exact values of the run-time parameters, and the data that follow from them alone and serve all launches.

    Attributes
    ----------
    values : array
        The values as doubles, followed by the sines, cosines and tangents of parameters alone.
    domain : Domain or None
        The range of the curve parameter, once it has been asked for.
    functions : launch.functions.BoundFunctions or None
        The compiled functions bound to these values, once they have been asked for.
    tape : double_double.recording.BoundTape or None
        The exact formulas as a tape, once it has been asked for; False if there is none.
    true_pieces : charts.double_double.making.TruePieces or None
        A charted curve in double-double arithmetic, once it has been asked for; False if the curve is known in doubles
        only.
    columns : tuple of lists of arrays or None
        The columns of sweeps with these values (`sweep.columns`), once one has been asked for.
    conditions : dict
        What all legs with losses share (`legs.conditions.Conditions`), by contact, their law
        (`legs.variations.law.FormulaLaw`) as "law", and "equilibria" near launches of sweeps (`sweep.small_swings`),
        once they have been asked for. Of a train it has the curve of its means (`gradients.charts.means`) as "means",
        and of that the changes (`gradients.charts.trains`) as "changes".
    """

    values: Array
    domain: Domain | None = None
    functions: Any = None
    tape: Any = None
    true_pieces: Any = None
    columns: Any = None
    conditions: dict[str, Any]


def shape_of(maker: ChartMaker, values: tuple[Any, ...], other: Any) -> tuple[Any, ...]:
    """Return the values of the run-time parameters that shape a curve, with one fixed value in place of all others."""
    shaping = maker.shaped_by
    return values if shaping is None else tuple(v if k in shaping else other for k, v in enumerate(values))


def chart_with(maker: ChartMaker, values: tuple[float, ...]) -> Chart:
    """Return the chart of a curve, which is made once for the same values of the run-time parameters that shape it."""
    return _chart_with(maker, shape_of(maker, values, 1.0))


@lru_cache(maxsize=8)
def _chart_with(maker: ChartMaker, values: tuple[float, ...]) -> Chart:
    with budget("chart", 60.0, "give fewer points, or shorter and simpler pieces"):
        return maker.chart(values)


def true_pieces_of(maker: ChartMaker, p: tuple[Number, ...], chart: Chart) -> Any:
    """Return the curve behind a chart in double-double arithmetic, or None; it is made once for each shape."""
    return _true_pieces_of(maker, shape_of(maker, tuple(p), read_number(1, where="p")), chart)


@lru_cache(maxsize=4)
def _true_pieces_of(maker: ChartMaker, p: tuple[Number, ...], chart: Chart) -> Any:
    return maker.true_pieces(p, chart)


@dataclass(frozen=True, slots=True, kw_only=True)
class Formulas:
    """The compiled functions and exact formulas of one generated module.

    Attributes
    ----------
    name, parameter : str
        The module's name, and the name of the curve parameter.
    parameters : dict
        The run-time parameters and their defaults; None for one that must be given.
    positive : tuple of str
        The parameters for which the closed forms assume a positive value.
    at_least : tuple of (str, str)
        Parameters, each with its lower limit: a number, or the name of another parameter.
    rolling_radius : str
        The name of the parameter that is the radius of a rolling body, if the path of its centre was derived from the
        track; empty otherwise.
    static_friction_limit : (str, str), optional
        For a rolling body whose static friction is known, the names of its inertia factor beta and of its coefficient
        mu_static.
    functions : CompiledFunctions
        The functions that serve one motion.
    domain_of : callable or None
        ``f(op, p)`` gives both ends of the parameter's range and its period, with None for each that does not exist. It
        is None for a charted curve, whose chart has its own range.
    axes_of : callable or None
        ``f(op, p)`` gives one place about which V**2 and ds are even, and the distance to the next, with None for each
        that does not exist.
    monotone : bool
        Whether it is proved that V**2 is monotone between two neighbouring axes and that ds vanishes nowhere.
    exact : ExactFormulas, ExactPotential, ExactLaw, ExactChartLaw or None
        The formulas over a namespace of operations; for a charted curve only those of the forces.
    chart : ChartMaker or None
        The maker of the chart of a curve that has no formulas.
    dissipation : DissipativeFunctions or None
        The additional functions of a dissipative model; None for a conservative one.
    load_map : Emitted or None
        The function that fills a load map in one pass; None if there is none.
    batch : BatchFunctions or None
        The functions that serve many orbits at once; None if motions are solved one by one.
    source, text : str
        The path of the module's file, and its text when it was imported, by which a motion is restored in another
        process.
    effective_potential, bounds : Emitted or None
        Functions for the equilibria of a dissipative model; a conservative one has them in ``functions``.
    units : mapping of str to str
        SI units of the curve's parameter and of the run-time parameters, as far as they are known; "1" for plain
        numbers and angles.
    inertia : callable or None
        ``f(op, p)`` gives 1 + beta of a rolling body; None if it is 1.
    trigonometric : callable or None
        ``f(op, p)`` gives sines, cosines and tangents of parameters alone, which compiled functions read after the
        parameters; None if there are none.
    separated : SeparatedTerms or None
        Potential and load along a charted curve as sums of products; None if they cannot be separated.
    path_in_space : Emitted or None
        The function that fills the third coordinate of a space curve and the contact force as a vector.
    signed : bool
        Whether the contact force has a sign. It has none on a space curve that lies in no vertical plane.
    sided : bool
        Whether the sign of the contact force shows on which side of the track the body is. On a banked space curve this
        is the sign of the force's component along the upward direction of riders.
    directed : bool
        Whether the contact force depends on the sign of ds/dt, as it does on a space curve in a rotating frame.
    rider_loads : Emitted or None
        The function that fills the loads on a rider of a banked track.
    """

    name: str
    parameter: str
    parameters: Mapping[str, float | int | str | None]
    positive: tuple[str, ...]
    functions: CompiledFunctions
    domain_of: Callable[..., Any] | None = None
    axes_of: Callable[..., Any] | None = None
    monotone: bool = False
    exact: ExactFormulas | ExactLaw | ExactPotential | ExactChartLaw | None = None
    chart: ChartMaker | None = None
    dissipation: DissipativeFunctions | None = None
    load_map: Emitted | None = None
    batch: BatchFunctions | None = None
    at_least: tuple[tuple[str, str], ...] = ()
    rolling_radius: str = ""
    static_friction_limit: tuple[str, str] | None = None
    source: str = ""
    effective_potential: Emitted | None = None
    bounds: Emitted | None = None
    inertia: Callable[..., Any] | None = None
    trigonometric: Callable[..., Any] | None = None
    separated: SeparatedTerms | None = None
    path_in_space: Emitted | None = None
    signed: bool = True
    sided: bool = True
    directed: bool = False
    rider_loads: Emitted | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    text: str = field(init=False, repr=False, compare=False)
    _read: Callable[..., "ParameterValues"] = field(init=False, repr=False, compare=False)

    if not TYPE_CHECKING:
        __getattr__ = renamed(
            {
                **{"body": "rolling_radius", "each": "batch"},
                **{"grip": "static_friction_limit", "loads": "load_map"},
            },
            "a compiled model",
        )

    def __post_init__(self) -> None:
        # Most launches have the parameters of an earlier launch. The integer 1 and the float 1.0 are kept apart,
        # because their texts differ.
        object.__setattr__(self, "_read", lru_cache(maxsize=16, typed=True)(self._numbers))
        file = Path(self.source)
        object.__setattr__(self, "text", file.read_text(encoding="utf-8") if file.is_file() else "")

    def numbers(self, values: tuple[Any, ...]) -> "ParameterValues":
        """Check the run-time parameters and return them as exact numbers.

        Parameters
        ----------
        values : tuple
            A value for each parameter, in the order of ``parameters``; None for one that has no default.

        Raises
        ------
        ParameterError
            If a value is missing, not a number, not positive where it must be, or below its lower limit.
        """
        try:
            return self._read(*values)
        except TypeError:  # a value that cannot be hashed, such as an array
            return self._numbers(*values)

    def _numbers(self, *values: Any) -> "ParameterValues":
        out = []
        for name, value in zip(self.parameters, values, strict=True):
            if value is None:
                raise ParameterError(not_given(name))
            number = read_number(value, where=name, unit=self.units.get(name))
            if (name in self.positive or name == "m") and not number.value > 0.0:
                raise ParameterError(
                    f"{name}: must be positive, got {number.text}; the closed forms hold for {name} > 0"
                )
            out.append(number)
        self._check_lower_limits(dict(zip(self.parameters, out, strict=True)))
        p = ParameterValues(out)
        p.values = np.array([*(number.value for number in out), *self.trigonometric_values(out)])
        p.conditions = {}
        return p

    @property
    def inertia_row(self) -> int:
        """The index of the run-time parameter beta if the inertia is 1 + beta, else -1."""
        if self.inertia is None:
            return -1
        numbers = range(len(self.parameters))
        found = [k for k in numbers if self.inertia(FLOATS, [float(j == k) for j in numbers]) == 2.0]
        return found[0] if len(found) == 1 else -1

    def trigonometric_over(self, operations: Any, p: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return the sines, cosines and tangents of the run-time parameters, over a namespace of operations."""
        values = () if self.trigonometric is None else self.trigonometric(operations, p)
        return values if isinstance(values, tuple) else (values,)

    def separated_factors(self, p: Sequence[Array]) -> list[Array]:
        """Return the factors of the parts of potential and load (`interface.SeparatedTerms`), for arrays of parameters.

        Each factor is the same however many are computed together, although elementary functions of NumPy may differ in
        their last bits between single numbers and arrays, and between arrays with and without gaps.
        """
        assert self.separated is not None
        with np.errstate(all="ignore"):
            found = self.separated.factors(ARRAYS, tuple(np.atleast_1d(np.ascontiguousarray(column)) for column in p))
        return [np.asarray(factor, dtype=np.float64) for factor in found]

    def trigonometric_values(self, numbers: Sequence[Number]) -> tuple[float, ...]:
        """Return the sines, cosines and tangents of the run-time parameters as doubles, which are exact for multiples
        of pi.

        A value that is zero to `EXACT_BITS` bits counts as zero.
        """
        if self.trigonometric is None:
            return ()
        if all(number.fraction is not None for number in numbers):
            return tuple(map(float, self.trigonometric_over(FLOATS, tuple(number.value for number in numbers))))
        from mpmath import MPContext

        context = MPContext()
        context.prec = EXACT_BITS + 64
        values = self.trigonometric_over(context, tuple(number.at(context) for number in numbers))
        return tuple(0.0 if abs(value) < context.mpf(2) ** -EXACT_BITS else float(value) for value in values)

    def _check_lower_limits(self, values: dict[str, Number]) -> None:
        """Refuse a parameter below its lower limit."""
        for name, limit in self.at_least:
            bound = values.get(limit) or read_number(limit, where=limit)
            if values[name].value < bound.value:
                what = f"{limit} = {bound.text}" if limit in values else limit
                raise ParameterError(f"{name}: must be at least {what}, got {values[name].text}")

    def charted(self, p: ParameterValues) -> Chart:
        """Return the chart of a charted curve."""
        assert self.chart is not None
        return chart_with(self.chart, tuple(p.values.tolist()))

    def offset(self, p: Sequence[Number]) -> Pair:
        """Return the distance of the body's path to the left of the curve, as two doubles: the radius of a rolling
        body, else 0.
        """
        radius = self.radius(p)
        return ZERO if radius is None else (radius.value, radius.low)

    def radius(self, p: Sequence[Number]) -> Number | None:
        """Return the radius of a rolling body; None if the curve itself is the path."""
        return dict(zip(self.parameters, p, strict=True)).get(self.rolling_radius)

    def domain(self, p: ParameterValues) -> Domain:
        """Return the range of the curve parameter."""
        if p.domain is None:
            p.domain = self._domain(p)
        return p.domain

    def _domain(self, p: ParameterValues) -> Domain:
        if self.chart is not None:
            chart = self.charted(p)
            return Domain(DomainNumbers(*chart.range), chart.ends)
        values = tuple(number.value for number in p)
        low, high, period = self.ends(FLOATS, values)
        axis, step = self.axes(FLOATS, values) if self.monotone else (None, None)
        return Domain(
            DomainNumbers(
                low=-math.inf if low is None else float(low),
                high=math.inf if high is None else float(high),
                period=float(period or 0.0),
                axis=math.nan if axis is None else float(axis),
                axis_step=float(step or 0.0),
            )
        )

    def ends(self, op: Any, values: tuple[Any, ...]) -> tuple[Any, Any, Any]:
        """Return both ends of the parameter's range and its period, with None for each that does not exist.

        A closed curve has no ends.
        """
        assert self.domain_of is not None
        low, high, period = self.domain_of(op, values)
        return (low, high, None) if period is None else (None, None, period)

    def axes(self, op: Any, values: tuple[Any, ...]) -> tuple[Any, Any]:
        """Return one place of symmetry and the distance to the next, with None for each that does not exist."""
        return (None, None) if self.axes_of is None else self.axes_of(op, values)
