"""Figures of a model, not of one motion: its phase portrait, and the period against the amplitude."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gqm_sym.errors import InputError, ParameterError, SolutionError
from gqm_sym.figures.axes import finished, new_axes
from gqm_sym.literals.numbers import read_number
from gqm_sym.optional import require
from gqm_sym.runtime.compiled.types import Array
from gqm_sym.runtime.launch.domain import Domain
from gqm_sym.runtime.launch.request import LaunchRequest
from gqm_sym.runtime.model import CompiledModel
from gqm_sym.runtime.motion.extremes import grid_peaks

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Places across a portrait; an extremum is narrowed down by ZOOMS grids of as many.
PLACES = 1601
ZOOMS = 3
LEVELS = 9
ORBIT, SEPARATRIX, LAUNCHED = "#0072b2", "#d55e00", "#009e73"

# How far above the highest barrier a portrait reaches, and how far beyond a closed curve's period, as shares.
HEADROOM = 1.5
OVERLAP = 1.5

# Periods that agree so well are drawn as equal.
EQUAL = 1e-9

# A step of the energy that is no more than rounding, and how wide (as a share of all places) a flat summit may be.
LEVEL, FLAT = 1e-14, 0.05


class _Levels(NamedTuple):
    """V**2 lost in climbing to each place, up to a constant, with its extrema among the places."""

    lam: Array
    climb: Array
    bottoms: NDArray[np.intp]
    tops: NDArray[np.intp]


@require("plot")
def phase_portrait(
    module: ModuleType,
    lam: tuple[Any, Any] | None = None,
    *,
    levels: int = LEVELS,
    through: Iterable[tuple[Any, Any]] = (),
    axes: "Axes | None" = None,
    **parameters: Any,
) -> "Figure":
    """Draw the phase portrait of a conservative model: velocity ds/dt against place, one curve for each energy.

    Parameters
    ----------
    module : module
        A generated module.
    lam : pair of numbers, optional
        The range of the curve's parameter; the whole domain, or a period and a half round the lowest place of a closed
        curve, if not given.
    levels : int
        Number of energies, evenly spaced in the speed at the lowest place.
    through : pairs of numbers
        Launches ``(lam0, v)`` whose orbits are drawn as well; ``v`` is ds/dt, with its sign.
    axes : matplotlib Axes, optional
        Where to draw; a new figure if not given.
    parameters
        Run-time parameters of the module.

    Notes
    -----
    Separatrices are drawn through every unstable equilibrium within the range. Units are SI.
    """
    known = module.MODEL.parameters
    if unknown := parameters.keys() - known.keys():
        raise ParameterError(f"{min(unknown)}: is no parameter; there are {', '.join(known)}")
    if levels < 1:
        raise InputError(f"levels: must be at least 1, got {levels}")
    given = tuple({**known, **parameters}.values())
    return portrait_of(module.MODEL, given, lam, levels=levels, through=through, axes=axes)


def portrait_of(
    formulas: CompiledModel,
    given: tuple[Any, ...],
    lam: tuple[Any, Any] | None,
    *,
    levels: int = LEVELS,
    through: Iterable[tuple[Any, Any]],
    axes: "Axes | None",
) -> "Figure":
    """Draw the phase portrait of formulas whose parameters have these values; see `phase_portrait`."""
    if formulas.dissipation is not None:
        raise SolutionError("phase portrait: with friction or drag no energy is kept; plot motions instead")
    domain = formulas.domain(formulas.numbers(given))
    low, high = _range(formulas, domain, lam, given)
    field = _field(formulas, np.linspace(low, high, PLACES), given)
    axes = new_axes(axes)
    for w0 in _energies(field, levels):
        _draw(axes, field.lam, w0 - field.climb, color=ORBIT, linewidth=0.9)
    for top in field.tops:
        reach = _reach(field.climb, top)
        _draw(
            axes,
            field.lam[reach],
            field.climb[top] - field.climb[reach],
            color=SEPARATRIX,
            linewidth=2.0,
            label="separatrix",
        )
    for launch in through:
        place, speed = (read_number(number, where="through").value for number in launch)
        if domain.period and not low <= place <= high:
            place = low + (place - low) % domain.period
        _draw(axes, field.lam, np.interp(place, field.lam, field.climb) + speed**2 - field.climb, color=LAUNCHED)
        axes.plot(place, speed, ">", color=LAUNCHED, markeredgecolor="white", markersize=9, label="launch")
    for places, marker, label in (
        (field.bottoms, "o", "stable equilibrium"),
        (field.tops, "X", "unstable equilibrium"),
    ):
        if len(places):
            at = field.lam[places]
            axes.plot(at, 0 * at, marker, color="black", markeredgecolor="white", markersize=8, label=label, zorder=5)
    axes.set_xlim(low, high)
    return finished(axes, formulas.parameter, "velocity ds/dt (m/s)")


@require("plot")
def period_against_amplitude(
    module: ModuleType, places: Sequence[Any], *, axes: "Axes | None" = None, **parameters: Any
) -> "Figure":
    """Draw the period of the librations released from rest at places, against half their arc from turn to turn.

    Parameters
    ----------
    module : module
        A generated module.
    places : sequence of numbers
        Launch places in one well; those from which the motion is no libration are left out.
    axes : matplotlib Axes, optional
        Where to draw; a new figure if not given.
    parameters
        Run-time parameters of the module.
    """
    found = [motion for place in places if (motion := module.solve(place, **parameters)).kind == "libration"]
    if not found:
        raise SolutionError("period_against_amplitude: nothing librates from any of the places; release it in a well")
    arcs = [0.5 * abs(motion.state(motion.half_period).s - motion.state(0.0).s) for motion in found]
    order = np.argsort(arcs)
    amplitude, period = np.array(arcs)[order], np.array([motion.period for motion in found])[order]
    axes = new_axes(axes)
    axes.plot(amplitude, period, "o-", color=ORBIT, markersize=4)
    if np.ptp(period) <= EQUAL * period.max():
        axes.set_ylim(0.9 * period.mean(), 1.1 * period.mean())
    return finished(axes, "amplitude along the arc (m)", "period (s)")


def _range(
    formulas: CompiledModel, domain: Domain, lam: tuple[Any, Any] | None, given: tuple[Any, ...]
) -> tuple[float, float]:
    if lam is not None:
        low, high = (read_number(end, where="lam").value for end in lam)
        if not low < high:
            raise InputError(f"lam: must be a range (lo, hi) with lo < hi, got {lam!r}")
        return low, high
    if domain.period:
        # Of the lowest places the one next to 0.
        field = _field(formulas, np.linspace(-0.5 * domain.period, 0.5 * domain.period, PLACES), given)
        centre = float(field.lam[np.nanargmin(field.climb)])
        return centre - 0.5 * OVERLAP * domain.period, centre + 0.5 * OVERLAP * domain.period
    if not np.isfinite([domain.low, domain.high]).all():
        raise InputError("lam: the curve has no ends, so give the range (lo, hi) to draw")
    return domain.low, domain.high


def _field(formulas: CompiledModel, lam: Array, given: tuple[Any, ...]) -> _Levels:
    middle = float(lam[len(lam) // 2])

    def climb_at(places: Array) -> Array:
        climb: Array = -formulas.pass1(LaunchRequest(middle), given, places).v2
        return np.where(np.isfinite(climb), climb, np.nan)

    climb = climb_at(lam)
    if not np.isfinite(climb).any():
        raise SolutionError("phase portrait: the energy is finite nowhere in the range; give another lam")
    extremes = [(_narrowed(climb_at, lam[k - 1], lam[k + 1], sign), sign) for k, sign in _extremes(climb)]
    extra = np.array([place for place, _ in extremes])
    lam = np.union1d(lam, extra)
    at = {sign: np.searchsorted(lam, [place for place, its in extremes if its == sign]) for sign in (-1, 1)}
    return _Levels(lam, climb_at(lam), bottoms=at[-1], tops=at[1])


def _extremes(climb: Array) -> Iterator[tuple[int, int]]:
    """Places that are lowest (-1) or highest (+1) among those around; none on a level stretch."""
    steps = np.diff(climb)
    slopes = np.sign(np.where(np.abs(steps) <= LEVEL * np.nanmax(np.abs(climb)), 0.0, steps))
    for before, after in pairwise(np.flatnonzero(slopes)):
        turns = slopes[before] * slopes[after] < 0.0 and np.isfinite(slopes[before : after + 1]).all()
        if turns and after - before <= FLAT * len(climb):
            yield int(before + 1 + after) // 2, int(slopes[before])


def _narrowed(climb_at: Any, low: float, high: float, sign: int) -> float:
    """The middle of the interval that the finest grid leaves for an extremum; places without a value do not count."""

    def signed(places: Array) -> Array:
        heights: Array = sign * climb_at(places)
        return np.where(np.isnan(heights), -np.inf, heights)

    *_, peak = grid_peaks(signed, low, high, PLACES, ZOOMS)
    return 0.5 * (peak.low + peak.high)


def _energies(field: _Levels, levels: int) -> Array:
    lowest = np.nanmin(field.climb)
    highest = np.nanmax(field.climb)
    if len(field.tops):
        highest = lowest + HEADROOM * (np.max(field.climb[field.tops]) - lowest)
    return lowest + (highest - lowest) * (np.arange(1, levels + 1) / levels) ** 2


def _reach(climb: Array, top: int) -> slice:
    """The places that a body coming from rest at a top can get to, and one beyond at each end."""
    above = np.flatnonzero(~(climb <= climb[top]))
    first = above[above < top].max(initial=0)
    last = above[above > top].min(initial=len(climb))
    return slice(int(first), int(last) + 1)


def _draw(axes: "Axes", lam: Array, w: Array, **style: Any) -> None:
    """Draw both velocities where V**2 = w is not negative, each branch up to the turning points."""
    cuts = np.flatnonzero(np.diff(np.sign(w)) * np.isfinite(np.diff(w)))
    share = w[cuts] / (w[cuts] - w[cuts + 1])
    turns = lam[cuts] + share * (lam[cuts + 1] - lam[cuts])
    lam, w = np.insert(lam, cuts + 1, turns), np.insert(w, cuts + 1, 0.0)
    speed = np.sqrt(np.where(w >= 0.0, w, np.nan))
    (line,) = axes.plot(lam, speed, **style)
    axes.plot(lam, -speed, **{**style, "label": None, "color": line.get_color()})
