"""Tables of polynomials on a panel agree with exact integrals, and no change of sign is missed."""

from itertools import pairwise

import numba
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp, mpf
from numpy.polynomial import chebyshev, legendre

import generated.cubic_coulomb as cubic_coulomb
from gqm_sym.runtime.compiled.registers import LANES, borrowed, copied, on_stack, over_rows
from gqm_sym.runtime.legs import driver
from gqm_sym.runtime.legs.leg_reading import INTEGRAL_BY_NODE, PLAIN_BY_NODE
from gqm_sym.runtime.legs.panels.polynomials import (
    COUNT,
    GRADED_MEANS,
    MEANS,
    SHARES,
    TO_COEFFICIENTS,
    WIDE,
    extent,
    first_change,
    size_of,
    to_means,
)
from gqm_sym.runtime.legs.panels.resolution import DECREASE, DEGREES, MAX_GROWTH, SAFETY_FACTOR, growth, growth_towards

# The tolerance is the rounding of as many products of size 1.
TABLE = 1e-15
NOISE = 1e-15


def test_tables() -> None:
    """The means of every power up to the degree, from the panel's start to each node, and the coefficients are
    right.
    """
    stops = np.append(SHARES, 1.0)
    with mp.workdps(30):
        exact = [mp.sin(mp.pi * (j + mpf("0.5")) / (2 * COUNT)) ** 2 for j in range(COUNT)]
        assert np.abs(SHARES - np.array(exact, dtype=float)).max() <= 1.2e-16
    for n in range(COUNT):
        assert np.abs(MEANS @ SHARES**n - stops**n / (n + 1)).max() <= TABLE
        assert np.abs(GRADED_MEANS @ SHARES**n - stops**n * 2.0 / (n + 2)).max() <= TABLE
    nodes = 2.0 * SHARES - 1.0
    for k in range(COUNT):
        unit = np.zeros(COUNT)
        unit[k] = 1.0
        assert np.abs(TO_COEFFICIENTS @ chebyshev.chebval(nodes, unit) - unit).max() <= 2e-14


def test_sums_in_registers() -> None:
    """Products with the tables, and the extent of a panel's values, are those of numpy, wherever in an array they
    lie.
    """
    values = np.random.default_rng(3).normal(size=3 * WIDE)
    out = np.zeros(2 * WIDE)
    _sums(values, out)
    assert out[WIDE : WIDE + COUNT + 1] == pytest.approx(MEANS @ values[7 : 7 + COUNT], abs=TABLE)
    assert not out[:WIDE].any()
    inside = values[5 : 5 + COUNT]
    assert _span(values) == (inside.min(), inside.max(), np.abs(inside).max())


@numba.njit
def _sums(values, out):  # type: ignore[no-untyped-def]
    to_means(values, 7, out, WIDE)


@numba.njit
def _span(values):  # type: ignore[no-untyped-def]
    return *extent(values, 5), size_of(values, 5)


def test_integrals_in_legendre_polynomials() -> None:
    """For powers, values at the nodes give the function and its integral from the panel's start."""
    x = 2.0 * SHARES - 1.0
    at = np.linspace(-1.0, 1.0, 7)
    for n in range(COUNT):
        assert np.abs(legendre.legval(at, x**n @ PLAIN_BY_NODE) - at**n).max() <= 4.0 * TABLE
        exact = (at ** (n + 1) - (-1.0) ** (n + 1)) / (n + 1)
        assert np.abs(legendre.legval(at, x**n @ INTEGRAL_BY_NODE) - exact).max() <= 4.0 * TABLE


def _series(roots: list[float]) -> np.ndarray:
    """Return Chebyshev coefficients of the polynomial with these roots, the largest of which is 1."""
    c = chebyshev.chebfromroots(roots)
    return np.pad(c, (0, COUNT - len(c))) / np.abs(c).max()


@given(st.lists(st.floats(-1.5, 1.5), min_size=1, max_size=7))
def test_the_first_root_is_found(roots: list[float]) -> None:
    """Of well separated roots the first one inside is found; without a root there is no change."""
    roots = sorted(roots)
    assume(min([b - a for a, b in pairwise(roots)], default=1.0) >= 1e-2)
    assume(all(abs(abs(root) - 1.0) >= 1e-6 for root in roots))
    c = _series(roots)
    inside = [root for root in roots if abs(root) < 1.0]
    x, before, touch = first_change(c, 0, NOISE)
    assert before == np.sign(chebyshev.chebval(-1.0, c))
    assert touch == 2.0
    if inside:
        steepness = abs(chebyshev.chebval(inside[0], chebyshev.chebder(c)))
        assert abs(x - inside[0]) <= 2e-15 + 2e-15 / steepness
    else:
        assert x == 2.0


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_close_roots_are_not_missed(gap: float) -> None:
    """Two roots close together are two changes, as long as the function between them is more than noise."""
    x, before, _ = first_change(_series([0.3, 0.3 + gap]), 0, NOISE)
    assert before == 1
    assert x == pytest.approx(0.3, abs=1e-15 / gap + 1e-15)


def test_zero_touched_is_no_change() -> None:
    """At a double root there is no change, but it is reported; a function that is zero throughout has no sign."""
    x, before, touch = first_change(_series([0.3, 0.3]), 1, NOISE)
    assert (x, before) == (2.0, 1)
    assert touch == pytest.approx(0.3, abs=1e-6)
    assert first_change(np.zeros(COUNT), 0, 0.0)[:2] == (2.0, 0)


@pytest.mark.extended
def test_a_triple_root_is_a_change() -> None:
    """At a triple root the sign changes, although the function is flat there."""
    x, before, _ = first_change(_series([0.3, 0.3, 0.3]), 0, NOISE)
    assert before == -1
    assert x == pytest.approx(0.3, abs=2e-5)


def test_a_wrong_sign_to_begin_with_changes_at_once() -> None:
    """A panel that begins with the other sign than it should changes at its start."""
    assert first_change(_series([1.4]), 1, NOISE)[0] == -1.0
    assert first_change(_series([-0.2]), -1, NOISE)[0] == pytest.approx(-0.2, abs=1e-15)
    assert first_change(_series([-0.2]), 1, NOISE)[0] == -1.0  # also if the sign becomes the right one later
    assert first_change(_series([-1.0 + 1e-11]), 1, NOISE)[0] == 2.0  # but not within the error of its first place


def test_a_series_without_values_has_no_change() -> None:
    """It ends at once, although no bound decides anything on any part."""
    c = _series([0.3])
    c[3] = np.nan
    assert first_change(c, 1, NOISE)[:2] == (2.0, 1)


WIDTH = 3 * LANES
_weighed = over_rows(lambda a, b, c: a - b * c / (2.0 + abs(a)), WIDTH)
_root = over_rows(np.sqrt, WIDTH)
_copy = copied(WIDTH)
_room = on_stack(2 * WIDTH)


@numba.njit
def _in_registers(line, other, c):  # type: ignore[no-untyped-def]
    _weighed(line, 5, 40, WIDTH + 9, c)
    _root(line, 70, 5)
    room = _room()
    _copy(room, 3, borrowed(line), 70)
    _copy(other, 1, room, 3)


def test_rows_in_registers() -> None:
    """A formula over rows gives the bits that NumPy gives, wherever they lie; rows are copied as they are."""
    line = np.random.default_rng(7).normal(size=100)
    before, other = line.copy(), np.zeros(WIDTH + 2)
    with np.errstate(invalid="ignore"):
        _in_registers(line, other, 0.3)
        a, b = before[40 : 40 + WIDTH], before[WIDTH + 9 : 2 * WIDTH + 9]
        expected = a - b * 0.3 / (2.0 + np.abs(a))
        assert np.array_equal(line[5 : 5 + WIDTH], expected)
        assert np.array_equal(other[1:-1], np.sqrt(expected), equal_nan=True)
    assert other[0] == other[-1] == 0.0
    assert np.array_equal(line[:5], before[:5])
    assert np.array_equal(line[5 + WIDTH : 70], before[5 + WIDTH : 70])


@pytest.mark.parametrize("worst", [1e-300, 3e-17, 4.1e-9, 0.02, 0.5, 1.0, 7.0, 1e5])
def test_how_much_wider_a_panel_may_be(worst: float) -> None:
    """The estimated width is the root to a few per cent, and never more than the limit."""
    exact = min(SAFETY_FACTOR * worst ** (-1.0 / DEGREES) / DECREASE, MAX_GROWTH)
    assert growth(worst) == pytest.approx(exact, rel=0.065)
    assert growth(worst) <= MAX_GROWTH


def test_a_record_that_is_too_short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A leg of more panels than a record has room for is followed once more, with the same digits."""
    times = np.linspace(0.0, 3.0, 40)
    expected = cubic_coulomb.solve(-1.0, 6.2088).lam(times)
    monkeypatch.setattr(driver, "FEW_PANELS", 1)
    assert np.array_equal(cubic_coulomb.solve(-1.0, 6.2088).lam(times), expected)


@pytest.mark.parametrize("distance", [0.3, 1.0, 4.0])
def test_how_far_a_panel_may_reach_toward_a_turn(distance: float) -> None:
    """Towards a turn the time rate is the inverse root of the remaining distance, which limits this panel's width and
    the next one's.

    The estimate is made on a panel of width 1; with the estimated width coefficients decrease as they should, to a
    tenth for each degree.
    """

    def middle(width: float, gap: float) -> float:
        """Return coefficients in the middle on a panel with a root at the distance ``gap`` beyond its end."""
        c = TO_COEFFICIENTS @ (1.0 / np.sqrt(gap + width * (1.0 - SHARES)))
        return float(np.abs(c[14:17]).max() / np.abs(c).max())

    level = middle(1.0, distance)
    again, onwards = growth_towards(level, 1.0), growth_towards(level, -1.0)
    if again < 1.0 + distance:
        assert middle(again, 1.0 + distance - again) <= (DECREASE / 1.1) ** -DEGREES
    assert middle(onwards, distance - onwards) <= (DECREASE / 1.1) ** -DEGREES
    assert middle(1.6 * onwards, max(distance - 1.6 * onwards, 1e-9)) >= DECREASE**-DEGREES
