"""Figures of a model rather than of one motion: its phase portrait, and the period against the amplitude."""

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
from gqm_sym.runtime.motion.parts.peaks import grid_peaks

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# The number of grid points across a portrait. Each extremum is located by NESTED_GRIDS nested grids of as many points.
GRID_POINTS = 1601
NESTED_GRIDS = 3
ENERGY_LEVELS = 9
ORBIT_COLOUR, SEPARATRIX_COLOUR, LAUNCH_COLOUR = "#0072b2", "#d55e00", "#009e73"

# The highest energy drawn, as a multiple of the highest barrier, and the range drawn of a closed curve, in periods.
ENERGY_RANGE = 1.5
PERIODS_DRAWN = 1.5

# Periods with smaller relative differences than this are drawn as equal.
EQUAL_PERIODS = 1e-9

# The largest relative step of the potential that may be rounding, and the largest width of a flat extremum, as a
# fraction of the grid.
ROUNDING_STEP, MAX_FLAT_WIDTH = 1e-14, 0.05


class _PotentialGrid(NamedTuple):
    """Twice the effective potential (the loss of V**2, up to a constant) on a grid, with the indices of its extrema."""

    lam: Array
    potential: Array
    minima: NDArray[np.intp]
    maxima: NDArray[np.intp]


@require("plot")
def phase_portrait(
    module: ModuleType,
    lam: tuple[Any, Any] | None = None,
    *,
    levels: int = ENERGY_LEVELS,
    through: Iterable[tuple[Any, Any]] = (),
    axes: "Axes | None" = None,
    **parameters: Any,
) -> "Figure":
    """Draw the phase portrait of a conservative model: velocity against the curve parameter, one curve per energy.

    Parameters
    ----------
    module : module
        A generated module.
    lam : pair of numbers, optional
        The range of the curve parameter. Without it the whole domain is drawn, or one and a half periods of a closed
        curve, centred on the minimum of its potential.
    levels : int
        Number of energies, evenly spaced in the speed at the minimum of the potential.
    through : pairs of numbers
        Launches ``(lam0, v)`` whose orbits are drawn as well; ``v`` is ds/dt in m/s, with its sign.
    axes : matplotlib Axes, optional
        The axes to draw on; by default a new figure is made.
    parameters
        Run-time parameters of the module.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If ``levels`` or the range is not valid, or if a range is needed and was not given.
    ParameterError
        If a parameter is unknown or has no value.
    SolutionError
        If the model loses energy, or has no finite energy anywhere in the range.

    Notes
    -----
    A separatrix is drawn through every unstable equilibrium within the range. Units are SI.
    """
    known = module.MODEL.parameters
    if unknown := parameters.keys() - known.keys():
        raise ParameterError(
            f"{min(unknown)}: is not a parameter of this module; its parameters are {', '.join(known)}"
        )
    if levels < 1:
        raise InputError(f"levels: must be at least 1, got {levels}")
    given = tuple({**known, **parameters}.values())
    return portrait_of(module.MODEL, given, lam, levels=levels, through=through, axes=axes)


def portrait_of(
    formulas: CompiledModel,
    given: tuple[Any, ...],
    lam: tuple[Any, Any] | None,
    *,
    levels: int = ENERGY_LEVELS,
    through: Iterable[tuple[Any, Any]],
    axes: "Axes | None",
) -> "Figure":
    """Draw the phase portrait of a compiled model for given values of its parameters; see `phase_portrait`."""
    if formulas.dissipation is not None:
        raise SolutionError(
            "phase portrait: a model with friction or drag does not conserve energy; plot its motions instead"
        )
    domain = formulas.domain(formulas.numbers(given))
    low, high = _range(formulas, domain, lam, given)
    grid = _potential_grid(formulas, np.linspace(low, high, GRID_POINTS), given)
    axes = new_axes(axes)
    for w0 in _energies(grid, levels):
        _draw_orbit(axes, grid.lam, w0 - grid.potential, color=ORBIT_COLOUR, linewidth=0.9)
    for top in grid.maxima:
        inside = _reachable(grid.potential, top)
        _draw_orbit(
            axes,
            grid.lam[inside],
            grid.potential[top] - grid.potential[inside],
            color=SEPARATRIX_COLOUR,
            linewidth=2.0,
            label="separatrix",
        )
    for launch in through:
        lam0, velocity = (read_number(number, where="through").value for number in launch)
        if domain.period and not low <= lam0 <= high:
            lam0 = low + (lam0 - low) % domain.period
        w0 = np.interp(lam0, grid.lam, grid.potential) + velocity**2
        _draw_orbit(axes, grid.lam, w0 - grid.potential, color=LAUNCH_COLOUR)
        axes.plot(lam0, velocity, ">", color=LAUNCH_COLOUR, markeredgecolor="white", markersize=9, label="launch")
    for indices, marker, label in (
        (grid.minima, "o", "stable equilibrium"),
        (grid.maxima, "X", "unstable equilibrium"),
    ):
        if len(indices):
            at = grid.lam[indices]
            axes.plot(at, 0 * at, marker, color="black", markeredgecolor="white", markersize=8, label=label, zorder=5)
    axes.set_xlim(low, high)
    return finished(axes, formulas.parameter, "velocity ds/dt (m/s)")


@require("plot")
def period_against_amplitude(
    module: ModuleType, places: Sequence[Any], *, axes: "Axes | None" = None, **parameters: Any
) -> "Figure":
    """Draw the period of librations released from rest against their amplitude.

    The amplitude is half the arc length between the two turning points.

    Parameters
    ----------
    module : module
        A generated module.
    places : sequence of numbers
        Launch places (values of the curve parameter) in one potential well. Places from which the motion is not a
        libration are omitted.
    axes : matplotlib Axes, optional
        The axes to draw on; by default a new figure is made.
    parameters
        Run-time parameters of the module.

    Returns
    -------
    matplotlib.figure.Figure
        Amplitudes in metres, periods in seconds.

    Raises
    ------
    SolutionError
        If no place gives a libration.
    """
    found = [motion for place in places if (motion := module.solve(place, **parameters)).kind == "libration"]
    if not found:
        raise SolutionError(
            "period_against_amplitude: a body released at these places never librates; give places in a potential well"
        )
    arcs = [0.5 * abs(motion.state(motion.half_period).s - motion.state(0.0).s) for motion in found]
    order = np.argsort(arcs)
    amplitude, period = np.array(arcs)[order], np.array([motion.period for motion in found])[order]
    axes = new_axes(axes)
    axes.plot(amplitude, period, "o-", color=ORBIT_COLOUR, markersize=4)
    if np.ptp(period) <= EQUAL_PERIODS * period.max():
        axes.set_ylim(0.9 * period.mean(), 1.1 * period.mean())
    return finished(axes, "amplitude along the arc (m)", "period (s)")


def _range(
    formulas: CompiledModel, domain: Domain, lam: tuple[Any, Any] | None, given: tuple[Any, ...]
) -> tuple[float, float]:
    if lam is not None:
        low, high = (read_number(end, where="lam", unit=formulas.units.get(formulas.parameter)).value for end in lam)
        if not low < high:
            raise InputError(f"lam: must be a range (lo, hi) with lo < hi, got {lam!r}")
        return low, high
    if domain.period:
        grid = _potential_grid(formulas, np.linspace(-0.5 * domain.period, 0.5 * domain.period, GRID_POINTS), given)
        centre = float(grid.lam[np.nanargmin(grid.potential)])
        half_width = 0.5 * PERIODS_DRAWN * domain.period
        return centre - half_width, centre + half_width
    if not np.isfinite([domain.low, domain.high]).all():
        raise InputError("lam: the curve extends to infinity; give the range (lo, hi) to draw")
    return domain.low, domain.high


def _potential_grid(formulas: CompiledModel, lam: Array, given: tuple[Any, ...]) -> _PotentialGrid:
    """Tabulate the potential on a grid of places, to which the extrema between them are added."""
    middle = float(lam[len(lam) // 2])

    def potential_at(places: Array) -> Array:
        potential: Array = -formulas.pass1(LaunchRequest(middle), given, places).v2
        return np.where(np.isfinite(potential), potential, np.nan)

    potential = potential_at(lam)
    if not np.isfinite(potential).any():
        raise SolutionError("phase portrait: the energy is finite nowhere in the range; give another lam")
    extrema = [(_locate(potential_at, lam[k - 1], lam[k + 1], sign), sign) for k, sign in _extrema(potential)]
    lam = np.union1d(lam, np.array([place for place, _ in extrema]))
    at = {sign: np.searchsorted(lam, [place for place, own_sign in extrema if own_sign == sign]) for sign in (-1, 1)}
    return _PotentialGrid(lam, potential_at(lam), minima=at[-1], maxima=at[1])


def _extrema(potential: Array) -> Iterator[tuple[int, int]]:
    """Yield the index of each minimum (with -1) and maximum (with +1); a long flat part counts as neither."""
    steps = np.diff(potential)
    slopes = np.sign(np.where(np.abs(steps) <= ROUNDING_STEP * np.nanmax(np.abs(potential)), 0.0, steps))
    for before, after in pairwise(np.flatnonzero(slopes)):
        turns = slopes[before] * slopes[after] < 0.0 and np.isfinite(slopes[before : after + 1]).all()
        if turns and after - before <= MAX_FLAT_WIDTH * len(potential):
            yield int(before + 1 + after) // 2, int(slopes[before])


def _locate(potential_at: Any, low: float, high: float, sign: int) -> float:
    """Return the place between two others at which the potential has its minimum (sign -1) or maximum (sign +1)."""

    def signed(places: Array) -> Array:
        values: Array = sign * potential_at(places)
        return np.where(np.isnan(values), -np.inf, values)

    *_, peak = grid_peaks(signed, low, high, GRID_POINTS, NESTED_GRIDS)
    return 0.5 * (peak.low + peak.high)


def _energies(grid: _PotentialGrid, levels: int) -> Array:
    """Return the energies to draw, in the units of the potential."""
    lowest = np.nanmin(grid.potential)
    highest = np.nanmax(grid.potential)
    if len(grid.maxima):
        highest = lowest + ENERGY_RANGE * (np.max(grid.potential[grid.maxima]) - lowest)
    return lowest + (highest - lowest) * (np.arange(1, levels + 1) / levels) ** 2


def _reachable(potential: Array, top: int) -> slice:
    """Return the grid points that a body starting at rest from a maximum can reach, and one more at each end."""
    above = np.flatnonzero(~(potential <= potential[top]))
    first = above[above < top].max(initial=0)
    last = above[above > top].min(initial=len(potential))
    return slice(int(first), int(last) + 1)


def _draw_orbit(axes: "Axes", lam: Array, w: Array, **style: Any) -> None:
    """Draw both velocities for V**2 = w where w is not negative; each branch ends exactly at its turning points."""
    cuts = np.flatnonzero(np.diff(np.sign(w)) * np.isfinite(np.diff(w)))
    fractions = w[cuts] / (w[cuts] - w[cuts + 1])
    turns = lam[cuts] + fractions * (lam[cuts + 1] - lam[cuts])
    lam, w = np.insert(lam, cuts + 1, turns), np.insert(w, cuts + 1, 0.0)
    speed = np.sqrt(np.where(w >= 0.0, w, np.nan))
    (line,) = axes.plot(lam, speed, **style)
    axes.plot(lam, -speed, **{**style, "label": None, "color": line.get_color()})
