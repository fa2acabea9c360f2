"""The table of the phase angle over time is the inverse of the panels' time."""

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.runtime.inversion.table import build_table, phase_angles
from gqm_sym.runtime.launch.problem import bind
from gqm_sym.runtime.launch.request import LaunchRequest, read_launch
from gqm_sym.runtime.quadrature.substitution import FROM_TURN, REGULAR, TO_EQUILIBRIUM, TURN_TURN
from gqm_sym.runtime.quadrature.time_panels import lay_panels, read_off_many

ModuleOf = Callable[[str], ModuleType]

ULP = 2.0**-52
# The tolerances of the panels' time at the table's phase angle, in units in the last place of the whole time, and of
# the last angle. Worst measured: 3 (at a cusp, and on a tiny swing of one segment).
THERE_AND_BACK = 4.0
# The tolerance of phase angles against closed forms, in units in the last place of the last phase angle. Worst
# measured: 5.1.
ANOMALY = 6.0
# A first-level cache has room for 300 rows of fifteen numbers; at a cusp segments shrink to the time's last place.
MOST_SEGMENTS = 300
ROOT = 3e-8

# A row has the track, parameters, the kind of segment, its ends, V**2 at its start, and its last phase angle.
STRETCHES: dict[str, tuple[str, dict[str, Any], int, float, float, float, float]] = {
    "pendulum": ("circle", {"L": 1}, TURN_TURN, -1.2, 1.2, 0.0, math.pi),
    "tiny swing": ("circle", {"L": 1}, TURN_TURN, -1e-8, 1e-8, 0.0, math.pi),
    "wide swing": ("circle", {"L": 1}, TURN_TURN, -3.1, 3.1, 0.0, math.pi),
    "next to the separatrix": ("circle", {"L": 1}, TURN_TURN, -math.pi + 1e-4, math.pi - 1e-4, 0.0, math.pi),
    "once round": ("circle", {"L": 1}, REGULAR, 0.0, 2 * math.pi, 45.0, 1.0),
    "barely round": ("circle", {"L": 1}, REGULAR, 0.0, 2 * math.pi, 4 * 9.81 + 1e-3, 1.0),
    "to the hilltop": ("circle", {"L": 1}, TO_EQUILIBRIUM, 0.0, math.pi, 0.0, 64.0),
    "tautochrone": ("cycloid_plus", {"R": 2}, TURN_TURN, -2.0, 2.0, 0.0, math.pi),
    "from rest to a cusp": ("cycloid_inverted", {"R": 1}, FROM_TURN, 1.0, 0.0, 0.0, 1.0),
    "down to a cusp": ("cycloid_arch", {"R": 1}, FROM_TURN, 4.0, 2 * math.pi, 0.0, 1.0),
    "through to a cusp": ("cycloid_arch", {"R": 1}, REGULAR, 4.0, 2 * math.pi, 9.0, 1.0),
    "from cusp to cusp": ("cycloid_plus", {"R": 1}, REGULAR, -math.pi, math.pi, 50.0, 1.0),
    "down a cubic": ("cubic", {}, FROM_TURN, 2.0, -50.0, 0.0, 1.0),
}
REACHABLE = [name for name in STRETCHES if name != "from rest to a cusp"]


class Table:
    """A segment with its panels and its table."""

    def __init__(self, name: str, module_of: ModuleOf) -> None:
        track, given, kind, a, b, w, stop = STRETCHES[name]
        formulas = module_of(track).MODEL
        numbers = formulas.numbers(tuple((formulas.parameters | given).values()))
        functions = bind(formulas, numbers, read_launch(formulas, numbers, LaunchRequest(a)))
        panels = lay_panels(functions.addresses, functions.p, kind, a, b, a, w, np.array([0.0, stop]))
        self.edges, self.marks, _, self.terms = panels[:4]
        self.table = build_table(self.edges, self.marks, np.zeros_like(self.marks), self.terms)
        self.whole, self.stop = float(self.marks[-1]), stop

    def phase_angles(self, t: Any, low: Any = None) -> Any:
        """Return the table's phase angles."""
        t = np.asarray(t, dtype=float)
        return phase_angles(*self.table[:6], t, np.zeros_like(t) if low is None else np.asarray(low))

    def times(self, phi: Any) -> Any:
        """Return the panels' times."""
        return read_off_many(self.edges, self.marks, self.terms, np.asarray(phi))

    def asked(self) -> Any:
        """Return times everywhere, dense at both ends and on both sides of every edge of panels and segments."""
        share = np.concatenate(
            [np.linspace(0, 1, 2001), np.geomspace(1e-14, 0.5, 200), 1 - np.geomspace(1e-14, 0.5, 200)]
        )
        edges = np.concatenate([self.marks, self.table[5]])
        t = np.concatenate([share * self.whole, edges, np.nextafter(edges, 0), np.nextafter(edges, np.inf)])
        return np.unique(np.clip(t, 0.0, self.whole))


@pytest.fixture(scope="module")
def table_of(module_of: ModuleOf) -> Callable[[str], Table]:
    """Return the table of a segment by its name."""
    made: dict[str, Table] = {}

    def table(name: str) -> Table:
        if name not in made:
            made[name] = Table(name, module_of)
        return made[name]

    return table


@pytest.mark.parametrize("name", REACHABLE)
def test_the_time_at_the_phase_angle_is_the_time_asked_for(name: str, table_of: Callable[[str], Table]) -> None:
    """The time at the phase angle differs from the given one only by the rounding of both, also near a separatrix and
    at a cusp.
    """
    table = table_of(name)
    t = table.asked()
    phi = table.phase_angles(t)
    rounding = ULP * table.stop
    beside = [np.clip(phi + k * rounding, 0.0, table.stop) for k in (-THERE_AND_BACK, THERE_AND_BACK)]
    slack = THERE_AND_BACK * math.ulp(table.whole)
    assert (table.times(beside[0]) - slack <= t).all()
    assert (t <= table.times(beside[1]) + slack).all()


@pytest.mark.parametrize("name", REACHABLE)
def test_the_phase_angle_grows_with_time(name: str, table_of: Callable[[str], Table]) -> None:
    """The phase angle grows from 0 to its last value, never backwards by more than rounding, and without jumps between
    segments.
    """
    table = table_of(name)
    phi = table.phase_angles(table.asked())
    rounding = (ROOT if "cusp" in name else ANOMALY * ULP) * table.stop
    assert abs(phi[0]) <= rounding
    assert abs(phi[-1] - table.stop) <= rounding
    assert np.diff(phi).min() >= -rounding


@pytest.mark.parametrize("name", REACHABLE)
def test_a_table_is_small_and_knows_its_error(name: str, table_of: Callable[[str], Table]) -> None:
    """Segments follow each other and fill the time; the index points at or before the right one."""
    table = table_of(name)
    middles, _, scales, powers, index, ends, errors = table.table
    assert len(middles) == len(scales) == len(powers) == len(ends)
    assert ends[-1] == table.whole
    assert (np.diff(ends) > 0).all()
    assert (middles[0], 1 / scales[0]) == (0, pytest.approx(ends[1]))
    begins = np.append(0, ends[1:-1])
    assert middles[1:] - 1 / scales[1:] == pytest.approx(begins, rel=0, abs=4 * math.ulp(table.whole))
    slots = table.whole * np.arange(len(index)) / len(index)
    assert (index <= np.searchsorted(ends, slots, side="right")).all()
    assert len(ends) <= MOST_SEGMENTS
    # At a cusp the phase angle is the root of the remaining time, so that it has an error of the root of the time's
    # last place.
    assert errors.max() <= (ROOT if "cusp" in name else 1e-14) * table.stop


def test_the_tautochrone_s_table_against_its_closed_form(table_of: Callable[[str], Table]) -> None:
    """Arc length oscillates harmonically, so that sin(u/2) = -sin(A/2) cos(w t) and u = -A cos(phi)."""
    table = table_of("tautochrone")
    t = np.linspace(0.0, table.whole, 101)[1:-1]
    phi = table.phase_angles(t)
    with mp.workdps(40):
        w = mp.sqrt(mpf("9.81") / 8)
        for k, time in enumerate(t):
            u = 2 * mp.asin(-mp.sin(1) * mp.cos(w * mpf(float(time))))
            assert abs(mpf(float(phi[k])) - mp.acos(-u / 2)) <= ANOMALY * ULP * math.pi


def test_the_separatrix_s_table_against_its_closed_form(table_of: Callable[[str], Table]) -> None:
    """Towards the hilltop the rest of the angle is 4 atan(exp(-w t)) = pi exp(-phi)."""
    table = table_of("to the hilltop")
    t = np.linspace(0.0, table.whole, 101)
    phi = table.phase_angles(t)
    with mp.workdps(60):
        w = mp.sqrt(mpf("9.81"))
        for k, time in enumerate(t):
            truth = -mp.log(4 * mp.atan(mp.exp(-w * mpf(float(time)))) / mp.pi)
            assert abs(mpf(float(phi[k])) - truth) <= ANOMALY * ULP * table.stop


def test_a_time_of_two_doubles_is_taken_whole(table_of: Callable[[str], Table]) -> None:
    """The low part of the time moves the phase angle: half a last place of the time, twice, has the effect of one."""
    table = table_of("to the hilltop")
    t = np.linspace(0.1, 0.9, 9) * table.whole
    low = 1e-9 * t
    apart = table.phase_angles(t, low) - table.phase_angles(t + low)
    assert np.abs(apart).max() <= ANOMALY * ULP * table.stop
