"""Divided differences of the elementary functions agree with mpmath with digits to spare."""

import math
import random
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import permutations

import numpy as np
import pytest
from mpmath import mp, mpf

from gqm_sym.runtime import vocabulary

Real = Callable[[mpf], mpf]
Points = tuple[float, float, float, float, float]

# The tolerance is a few roundings. Worst on 1000 triples of each row: 3.0 (rpow 0.99), otherwise 2.1 (sinh).
FIRST_ULPS = 4.0
# Worst on 1000 triples of each row but those below: 4.3 (tanh).
SECOND_ULPS = 6.0
# Just beyond their closed form, with f'' still small about 0, these two subtract first differences near 1 whose last
# digits have more weight. Worst on 1000 triples: 13.8 (atan), 12.7 (asinh).
INFLECTED_ULPS = 16.0
INFLECTED = frozenset({"atan", "asinh"})
# Worst measured: 1.8; at amplitude 2.8, near the barrier, 5.8, because of the rounding of (y+b)/2.
PENDULUM_ULPS = 7.0

# The modules of the divided differences, and the names in them except those for near points alone.
HOME, SHAPE = "arithmetic.divided_differences", re.compile(r"divdiff[12]_[a-z]+$")

TRIPLES = 150
# The number of digits that a second difference over a spread of 1e-60 may lose, those of a double, and some more.
DIGITS = 240
COINCIDENT = 1e-60
NUDGE = mpf(10) ** -30


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A function, its derivatives, the points to try and the domain."""

    name: str
    f: Real
    slope: Real
    bend: Real
    places: tuple[float, ...]
    domain: tuple[float, float] = (-math.inf, math.inf)
    exponent: int | float | None = None

    @property
    def second_ulps(self) -> float:
        """Return the tolerance for the second difference, in ulps."""
        return INFLECTED_ULPS if self.name in INFLECTED else SECOND_ULPS

    @property
    def slug(self) -> str:
        """Return the name of the test."""
        return self.name if self.exponent is None else f"{self.name}_{self.exponent}"

    def helper(self, order: int) -> Callable[..., float]:
        """Return the function under test."""
        function = getattr(vocabulary, f"divdiff{order}_{self.name}")
        if self.exponent is None:
            return function
        return lambda *points: function(*points, self.exponent)


def _power(p: float) -> tuple[Real, Real, Real]:
    e = mpf(p)
    return (
        lambda u: u**e,
        lambda u: e * u ** (e - 1),
        lambda u: e * (e - 1) * u ** (e - 2),
    )


def _row(name: str, f: Real, slope: Real, bend: Real, places: str, *domain: float) -> Row:
    spots = tuple(float(place) for place in places.split())
    return Row(name=name, f=f, slope=slope, bend=bend, places=spots, domain=domain or (-1e9, 1e9))


def _power_row(name: str, p: float, places: str, *domain: float) -> Row:
    f, slope, bend = _power(p)
    spots = tuple(float(place) for place in places.split())
    return Row(
        name=name,
        f=f,
        slope=slope,
        bend=bend,
        places=spots,
        domain=domain or (-1e9, 1e9),
        exponent=p,
    )


WAVES = "0 1e-9 -3e-4 0.02 0.7 -1.5707963 2 3.1 -3.14159 17"
UNIT = "0 1e-6 -0.003 0.2 -0.6 0.95 -0.9999 0.99999999"
WIDE = "0 1e-5 -0.01 0.3 -1 4 -60 2e3 -1e7"
POSITIVE = "1e-6 2e-3 0.4 1 7 3e3 1e6"
SIGNED = "1e-3 -0.02 0.3 -1 4 -60"

ROWS = [
    _row("sin", mp.sin, mp.cos, lambda u: -mp.sin(u), WAVES),
    _row("cos", mp.cos, lambda u: -mp.sin(u), lambda u: -mp.cos(u), WAVES),
    _row(
        "tan",
        mp.tan,
        lambda u: mp.sec(u) ** 2,
        lambda u: 2 * mp.tan(u) * mp.sec(u) ** 2,
        "0 1e-6 -0.003 0.2 -0.8 1.3 -1.57",
        -1.5707,
        1.5707,
    ),
    _row(
        "asin",
        mp.asin,
        lambda u: (1 - u * u) ** -0.5,
        lambda u: u * (1 - u * u) ** -1.5,
        UNIT,
        -1 + 1e-12,
        1 - 1e-12,
    ),
    _row(
        "acos",
        mp.acos,
        lambda u: -((1 - u * u) ** -0.5),
        lambda u: -u * (1 - u * u) ** -1.5,
        UNIT,
        -1 + 1e-12,
        1 - 1e-12,
    ),
    _row("atan", mp.atan, lambda u: 1 / (1 + u * u), lambda u: -2 * u / (1 + u * u) ** 2, WIDE),
    _row("sinh", mp.sinh, mp.cosh, mp.sinh, "0 1e-7 -0.02 0.6 -3 20 -80", -100, 100),
    _row("cosh", mp.cosh, mp.sinh, mp.cosh, "0 1e-7 -0.02 0.6 -3 20 -80", -100, 100),
    _row(
        "tanh",
        mp.tanh,
        lambda u: mp.sech(u) ** 2,
        lambda u: -2 * mp.tanh(u) * mp.sech(u) ** 2,
        "0 1e-7 -0.02 0.6 -3 12 -30",
        -40,
        40,
    ),
    _row(
        "asinh",
        mp.asinh,
        lambda u: (1 + u * u) ** -0.5,
        lambda u: -u * (1 + u * u) ** -1.5,
        WIDE,
    ),
    _row(
        "acosh",
        mp.acosh,
        lambda u: (u * u - 1) ** -0.5,
        lambda u: -u * (u * u - 1) ** -1.5,
        "1.00000001 1.001 1.3 2 40 1e6",
        1 + 1e-12,
        1e9,
    ),
    _row(
        "atanh",
        mp.atanh,
        lambda u: 1 / (1 - u * u),
        lambda u: 2 * u / (1 - u * u) ** 2,
        UNIT,
        -1 + 1e-12,
        1 - 1e-12,
    ),
    _row("exp", mp.exp, mp.exp, mp.exp, "0 1e-7 -0.02 0.6 -3 20 -80", -100, 100),
    _row("log", mp.log, lambda u: 1 / u, lambda u: -1 / u**2, POSITIVE, 1e-12, 1e12),
    *[_power_row("ipow", n, SIGNED) for n in (0, 1, 2, 3, 4, 5, 8, 13)],
    *[_power_row("ipow", n, POSITIVE, 1e-6, 1e9) for n in (-1, -2, -3, -6)],
    _power_row("ipow", -1, "-1e-3 -1 -60", -1e9, -1e-9),
    *[
        _power_row("rpow", p, POSITIVE, 1e-12, 1e12)
        for p in (1.5, 0.5, -0.5, -1.5, 0.01, 0.3, 0.99, 1.0, 1.01, 2.0, 7.3, -2.2)
    ],
]


def spreads(source: random.Random) -> Iterator[float]:
    """Return gaps from far below rounding to far apart, most of them where the closed forms change over."""
    while True:
        yield 10.0 ** source.uniform(-300, -20)
        yield 10.0 ** source.uniform(-20, 0)
        yield 10.0 ** source.uniform(-3, 1)
        yield source.uniform(0.5, 3.0)


def triples(row: Row, count: int = TRIPLES) -> Iterator[Points]:
    """Draw points in any order, some coincident, whose gaps have digits that the points have lost."""
    source = random.Random(row.slug)
    for spread in spreads(source):
        y = source.choice(row.places)
        unit = max(abs(y), 1e-3) if source.random() < 0.5 else 1.0
        h1, h2 = (source.uniform(-1, 1) * spread * unit for _ in range(2))
        match source.randrange(8):
            case 0:
                h1 = 0.0
            case 1:
                h2 = 0.0
            case 2:
                h1 *= 10.0 ** source.uniform(-12, 0)
            case 3:
                h2 = -h1 * source.choice((1.0, 1 + 1e-13, 1 + 1e-8, 1.1))
            case 4:
                h2 = h1
        x, w = y - h1, y + h2
        if row.domain[0] <= min(x, w) and max(x, w) <= row.domain[1]:
            yield x, y, w, h1, h2
            count -= 1
            if not count:
                return


def true_first(row: Row, x: mpf, y: mpf) -> mpf:
    """Return f[x,y] by its definition, or by the derivative if even 240 digits do not suffice."""
    if abs(y - x) < COINCIDENT:
        return row.slope((x + y) / 2)
    return (row.f(y) - row.f(x)) / (y - x)


def true_second(row: Row, *points: mpf) -> mpf:
    """Return f[x,y,w] by its definition, or by the second derivative if even 240 digits do not suffice."""
    a, b, c = sorted(points)
    if c - a < COINCIDENT:
        return row.bend((a + b + c) / 3) / 2
    return (true_first(row, b, c) - true_first(row, a, b)) / (c - a)


def ulps(actual: float, true: mpf, scale: mpf) -> float:
    """Return the error in units in the last place of ``scale``."""
    return float(abs(mpf(actual) - true) / mpf(np.spacing(float(scale)))) if true != actual else 0.0


def sensitivity(difference: Callable[..., mpf], *points: mpf) -> mpf:
    """Return the change of the result per relative change of each point, added up."""
    total, value = mpf(0), difference(*points)
    for k, point in enumerate(points):
        moved = (*points[:k], point * (1 + NUDGE), *points[k + 1 :])
        total += abs(difference(*moved) - value) / NUDGE
    return total


def first_error(row: Row, points: Points) -> float:
    """Return the error of f[x,y] in ulps of it and of the effect of rounding the points."""
    x, y, _w, h, _h2 = points
    exact = mpf(y) - mpf(h), mpf(y)
    true = true_first(row, *exact)
    moves = sensitivity(lambda *p: true_first(row, *p), *exact)
    return ulps(row.helper(1)(x, y, h), true, abs(true) + moves)


def second_error(row: Row, points: Points) -> float:
    """Return the error of f[x,y,w] in ulps of it, of f''/2 nearby if that is larger, and of rounding.

    For points far apart the scale is that of the first differences over the spread, if that is smaller.
    """
    _x, y, _w, h1, h2 = points
    exact = mpf(y) - mpf(h1), mpf(y), mpf(y) + mpf(h2)
    true = true_second(row, *exact)
    scale = max(abs(row.bend(point)) for point in exact) / 2
    spread = max(exact) - min(exact)
    if spread > COINCIDENT:
        slopes = true_first(row, *exact[:2]), true_first(row, *exact[1:])
        scale = min(scale, max(abs(slope) for slope in slopes) / spread)
    moves = sensitivity(lambda *p: true_second(row, *p), *exact)
    return ulps(row.helper(2)(*points), true, max(abs(true), scale) + moves)


@pytest.mark.sample(20)
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.slug)
def test_first_difference_keeps_its_digits(row: Row) -> None:
    """f[x,y] is right to a few ulps at any gap, even if only the gap itself, and not x and y, has its digits."""
    with mp.workdps(DIGITS):
        error, points = max((first_error(row, points), points) for points in triples(row))
    assert error <= FIRST_ULPS, f"{row.slug}1{points}: {error:.1f} ulps"


@pytest.mark.sample(20)
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.slug)
def test_second_difference_keeps_its_digits(row: Row) -> None:
    """f[x,y,w] is right to a few ulps at any spread and in any order of the points."""
    with mp.workdps(DIGITS):
        error, points = max((second_error(row, points), points) for points in triples(row))
    assert error <= row.second_ulps, f"{row.slug}2{points}: {error:.1f} ulps"


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.slug)
def test_coincident_points_give_derivatives(row: Row) -> None:
    """f[x,x] is f'(x), and f[x,x,x] is f''(x)/2."""
    for x in row.places:
        points = (x, x, x, 0.0, 0.0)
        with mp.workdps(DIGITS):
            assert first_error(row, points) <= FIRST_ULPS, points
            assert second_error(row, points) <= row.second_ulps, points


@pytest.mark.sample(40)
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.slug)
@pytest.mark.parametrize("spread", [1e-9, 0.2, 5.0])
def test_order_of_points_does_not_matter(row: Row, spread: float) -> None:
    """f[x,y] and f[x,y,w] are the same in any order of their points, up to rounding."""
    low, high = row.domain
    middle = row.places[len(row.places) // 2]
    points = [p for p in (middle - 0.3 * spread, middle, middle + 0.7 * spread) if low <= p <= high]
    points += [middle] * (3 - len(points))
    for x, y, w in permutations(points):
        given = (x, y, w, y - x, w - y)
        with mp.workdps(DIGITS):
            assert second_error(row, given) <= row.second_ulps, given
            assert first_error(row, given) <= FIRST_ULPS, given


@pytest.mark.parametrize("amplitude", [1e-8, 1e-3, 0.3, 1.0, 2.0, 2.8])
@pytest.mark.parametrize("turned", [False, True], ids=["about_0", "about_half_pi"])
def test_pendulum_factorises(amplitude: float, turned: bool) -> None:
    """cos[-b,y,b] is -sinc((y+b)/2) sinc((b-y)/2)/2, so that the pendulum's turning points divide out."""
    bottom = math.pi / 2 if turned else 0.0
    for share in np.linspace(0.0, 1.0, 41):
        left, right = float(2 * amplitude * share), float(2 * amplitude * (1 - share))
        y = bottom + (left - right) / 2
        function = vocabulary.divdiff2_sin if turned else vocabulary.divdiff2_cos
        actual = function(y - left, y, y + right, left, right)
        with mp.workdps(DIGITS):
            true = -mp.sinc(mpf(left) / 2) * mp.sinc(mpf(right) / 2) / 2
            error = ulps(actual, true, abs(true))
        assert error <= PENDULUM_ULPS, f"amplitude {amplitude}, {left} from a: {error:.1f} ulps"


@pytest.mark.parametrize(
    ("points", "first", "second"),
    [
        ((1.0, 2.0, 5.0), 1.0, 0.0),
        ((-1.0, -2.0, -5.0), -1.0, 0.0),
        ((-1.0, 3.0, 4.0), 0.5, 0.1),
        ((3.0, -1.0, 4.0), 0.5, 0.1),
        ((4.0, 3.0, -1.0), 1.0, 0.1),
        ((-4.0, -2.0, 1.0), -1.0, 2 / 15),
        ((0.0, 0.0, 2.0), 1.0, 0.0),
    ],
)
def test_absolute_value(points: tuple[float, float, float], first: float, second: float) -> None:
    """The second difference of |u| differs from zero only because of the kink."""
    x, y, w = points
    assert vocabulary.divdiff1_abs(x, y, y - x) == first
    assert vocabulary.divdiff2_abs(x, y, w, y - x, w - y) == pytest.approx(second, rel=1e-15, abs=0.0)


def test_every_function_has_both_orders() -> None:
    """Emitted modules can import a first and a second difference of each function."""
    for order in ("1", "2"):
        found = {name for name, home in vocabulary.HOMES.items() if home.startswith(HOME) and SHAPE.match(name)}
        assert {name.partition("_")[2] for name in found if name[7] == order} == {row.name for row in ROWS} | {"abs"}


@pytest.mark.parametrize("name", ["log", "atanh", "acosh"])
def test_pole_gives_infinity(name: str) -> None:
    """At the end of a domain the slope is infinite, and no error is raised."""
    end = {"log": 0.0}.get(name, 1.0)
    assert math.isinf(getattr(vocabulary, f"divdiff1_{name}")(end, end, 0.0))
