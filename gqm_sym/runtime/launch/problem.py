"""One launch of one module: compiled functions bound to their parameters, and the problem in extended precision."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from gqm_sym.runtime.charts.double_double.making import TruePieces
from gqm_sym.runtime.charts.double_double.panel_rates import (
    CURVE_BEGIN,
    CURVE_END,
    LAUNCH_PLACE,
    PLACE,
    TURNING_POINT,
    ChartRates,
)
from gqm_sym.runtime.charts.double_double.passage import LaunchOnChart
from gqm_sym.runtime.charts.exact_normals import ChartTrack
from gqm_sym.runtime.double_double.recording import BoundTape
from gqm_sym.runtime.double_double.tapes import bind as bind_tape
from gqm_sym.runtime.double_double.tapes import record, record_by_coordinates
from gqm_sym.runtime.interface import ExactFormulas, ExactPotential
from gqm_sym.runtime.launch.domain import Domain
from gqm_sym.runtime.launch.formulas import Formulas, ParameterValues, true_pieces_of
from gqm_sym.runtime.launch.functions import BoundFunctions
from gqm_sym.runtime.launch.request import Launch
from gqm_sym.runtime.launch.rounded import RoundedProblem
from gqm_sym.runtime.multiprecision.exact_panels import is_launch_place, turns_of
from gqm_sym.runtime.multiprecision.exact_problem import NOWHERE, ExactProblem
from gqm_sym.runtime.multiprecision.exact_tracks import FormulaTrack


def bind(formulas: Formulas, p: ParameterValues, launch: Launch) -> BoundFunctions:
    """Return the compiled functions bound to parameter values, with one launch's problem in extended precision."""
    bound = bind_all(formulas, p)
    exact = exact_problem(formulas, p, launch)
    return bound if exact is None else BoundFunctions(bound.addresses, bound.p, exact, *bound[3:])


def bind_all(formulas: Formulas, p: ParameterValues) -> BoundFunctions:
    """Return the bound functions that all launches with these parameters share."""
    if p.functions is None:
        addresses, losses = formulas.functions.addresses(), formulas.dissipation
        dissipation = None if losses is None else losses.addresses(has_radius=bool(formulas.rolling_radius))
        mass = float(p.values[list(formulas.parameters).index("m")])
        p.functions = BoundFunctions(addresses, p.values, dissipation=dissipation, mass=mass)
        if formulas.chart is not None:
            chart = formulas.charted(p)
            block = np.concatenate([p.values, chart.block])
            shape = (chart.breaks, chart.corners, chart.period, chart.bends)
            pieces = chart.block, chart.inner_edges
            p.functions = BoundFunctions(addresses, block, None, *shape, dissipation, *pieces, mass)
    bound: BoundFunctions = p.functions
    return bound


@dataclass(slots=True)
class Problem:
    """One launch of one module, in doubles and in extended precision.

    Attributes
    ----------
    formulas : Formulas
        The module's record.
    launch : Launch
        The launch of the motion.
    p : ParameterValues
        The exact values of the run-time parameters.
    domain : Domain
        The range of the curve parameter.
    bound : BoundFunctions, optional
        The compiled functions bound to these values; by default they are bound when they are first needed.
    """

    formulas: Formulas
    launch: Launch
    p: ParameterValues
    domain: Domain
    bound: BoundFunctions | None = None

    @property
    def functions(self) -> BoundFunctions:
        """The compiled functions bound to these values, with the launch in extended precision where there is such."""
        if self.bound is None:
            self.bound = bind(self.formulas, self.p, self.launch)
        return self.bound

    @property
    def low(self) -> float:
        """The lower end of the parameter's range."""
        return self.domain.low

    @property
    def high(self) -> float:
        """The upper end of the parameter's range."""
        return self.domain.high

    @property
    def period(self) -> float:
        """The period of the parameter on a closed curve, 0 otherwise."""
        return self.domain.period

    @property
    def exact(self) -> ExactProblem:
        """The problem in extended precision; it exists only for curves that are known exactly."""
        exact = self.functions.exact
        assert exact is not None
        return exact

    @property
    def tape(self) -> BoundTape | None:
        """The exact formulas for double-double arithmetic, or the potential for a charted curve; None if they are too
        long.
        """
        return tape_of(self.formulas, self.p)

    @property
    def true_pieces(self) -> TruePieces | None:
        """A charted curve in double-double arithmetic; None if the curve is known in doubles only."""
        return pieces_of(self.formulas, self.p)

    @property
    def arc_origin(self) -> float:
        """Arc length at launch in m: 0, or on a charted curve the distance from its start point."""
        return self.lam0 if self.formulas.chart is not None else 0.0

    @property
    def deciding_problem(self) -> ExactProblem | RoundedProblem:
        """The problem that makes the decisions that doubles cannot make: by extended precision, or else by rounding
        margins.
        """
        exact = self.functions.exact
        if exact is not None:
            return exact
        domain = (0.0, self.period) if self.period else (self.low, self.high)
        return RoundedProblem(self.functions, self.lam0, self.w0, domain)

    @property
    def lam0(self) -> float:
        """The launch place, rounded to a double."""
        return self.launch.lam0.value

    @property
    def w0(self) -> float:
        """V**2 at launch."""
        return self.launch.v0.value**2


def tape_of(formulas: "Formulas", p: "ParameterValues") -> BoundTape | None:
    """Return the exact formulas for double-double arithmetic, or the potential for a charted curve; None if they are
    too long.
    """
    if p.tape is None:
        exact, domain, found = formulas.exact, formulas.domain_of, None
        if isinstance(exact, ExactFormulas) and domain is not None:
            found = record(exact, domain, len(p))
        elif isinstance(exact, ExactPotential):
            dimension = 2 if formulas.path_in_space is None else 3
            found = record_by_coordinates(exact.effective_potential, len(p), dimension)
        p.tape = bind_tape(found, p) or False
    return p.tape or None


def pieces_of(formulas: "Formulas", p: "ParameterValues") -> TruePieces | None:
    """Return a charted curve in double-double arithmetic; None if the curve is known in doubles only."""
    maker = formulas.chart
    if maker is None or not isinstance(formulas.exact, ExactPotential):
        return None
    if p.true_pieces is None:
        p.true_pieces = true_pieces_of(maker, p, formulas.charted(p)) or False
    return p.true_pieces or None


def launch_on_chart(formulas: "Formulas", p: "ParameterValues", launch: "Launch") -> LaunchOnChart | None:
    """Return a launch along a charted curve in double-double arithmetic; None if that does not suffice, and for
    formulas.
    """
    pieces, tape = pieces_of(formulas, p), tape_of(formulas, p)
    if pieces is None or tape is None:
        return None
    return LaunchOnChart(pieces, tape, launch.lam0, launch.v0, launch.point, formulas.offset(p))


def _rates_along(
    formulas: "Formulas", p: "ParameterValues", launch: "Launch", kind: int, ends: tuple[float, float]
) -> ChartRates | None:
    """Return the integrands of a segment along a charted curve (`ExactProblem.along_chart`)."""
    launched = launch_on_chart(formulas, p, launch)
    if launched is None:
        return None
    chart, whats = formulas.charted(p), [PLACE, PLACE]
    for i, is_turn in enumerate(turns_of(kind)):
        if is_launch_place(ends[i], is_turn, launch.lam0, launch.v0):
            whats[i] = LAUNCH_PLACE
        elif is_turn:
            whats[i] = TURNING_POINT
        elif not chart.period and ends[i] in (chart.edges[0], chart.edges[-1]):
            whats[i] = CURVE_BEGIN if ends[i] == chart.edges[0] else CURVE_END
    rates = ChartRates(launched, kind, ends, (whats[0], whats[1]))
    return rates if rates.is_known else None


def exact_problem(formulas: "Formulas", p: "ParameterValues", launch: "Launch") -> ExactProblem | None:
    """Return the problem of one launch in extended precision; None if the curve is known in doubles only."""
    exact, maker = formulas.exact, formulas.chart
    if isinstance(exact, ExactFormulas) and formulas.domain_of is not None:
        track = partial(FormulaTrack, exact, formulas.domain_of, launch.lam0)
        return ExactProblem(track, NOWHERE, p, launch.lam0, launch.v0, partial(tape_of, formulas, p))
    if isinstance(exact, ExactPotential) and maker is not None:
        chart = formulas.charted(p)
        if maker.is_exact(chart):
            given = formulas.radius(p), (launch.lam0, launch.point)
            along = partial(ChartTrack, maker, chart, exact.effective_potential, *given)
            rates = partial(_rates_along, formulas, p, launch)
            return ExactProblem(along, chart.edges, p, launch.lam0, launch.v0, lambda: None, rates)
    return None
