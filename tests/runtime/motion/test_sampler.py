"""Periodic motions at many times agree with closed forms, and with the reading of one exact time."""

from collections.abc import Callable
from fractions import Fraction
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.polynomial.chebyshev import chebval

from generated import circle_coulomb
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.runtime.arithmetic.clenshaw import GROUP
from gqm_sym.runtime.compiled import threads
from gqm_sym.runtime.inversion.fourier import fit_wave, sum_cosines, sum_sines
from gqm_sym.runtime.motion.motion import Motion
from gqm_sym.runtime.motion.parts.positions import Positions

ModuleOf = Callable[[str], ModuleType]

# The tolerance relative to the scale (MATHS, section 7). Worst measured: 3.7e-16.
PLACE = 5e-16
# The tolerance relative to the swing next to the separatrix, where the panels' own noise grows. Worst measured:
# 1.6e-15.
STEEP = 2.5e-15
# The tolerance of speeds beside a hilltop, relative to the largest one. Worst measured: 4.8e-16.
SPEED = 8e-16
# The tolerance of coefficients, relative to the swing or the lap, is the rounding of the nodes.
SERIES = 4e-16
# The relative tolerances of velocities just after a release, which follow from the slope of a polynomial at its end,
# and of arc lengths, which follow from its curvature. Worst measured: 3.3e-14 and 5.8e-14.
RELEASED, RELEASED_LENGTH = 6e-14, 1.2e-13
# The compiled loop and the reading of exact times differ by the rounding of both.
AGREE = 1.5e-15

# A row has the track and launch of a motion; together they have short series, long ones, and none.
MOTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "swing": ("circle", {"lam0": "6/5", "L": 1}),
    "swing on the way down": ("circle", {"lam0": 0.3, "v0": 2.0, "direction": -1, "L": 1}),
    "tiny swing": ("circle", {"lam0": 1e-6, "L": 1}),
    "wide swing": ("circle", {"lam0": 3.1, "L": 1}),
    "almost to the top": ("circle", {"lam0": 1, "v0": "sqrt(2*9.81*(1 + cos(1)))*(1 - 1e-7)", "L": 1}),
    "just past the top": ("circle", {"lam0": 0.0, "v0": "2*sqrt(9.81)*(1 + 1e-7)", "L": 1}),
    "once round": ("circle", {"lam0": 0.3, "v0": 9.0, "L": 1}),
    "once round the other way": ("circle", {"lam0": 0.3, "v0": 9.0, "direction": -1, "L": 1}),
    "barely round": ("circle", {"lam0": 0.0, "v0": 6.2642, "L": 1}),
    "tautochrone": ("cycloid_plus", {"lam0": 1.0, "R": 1}),
}


@pytest.fixture(params=MOTIONS, scope="module")
def motion(request: pytest.FixtureRequest, module_of: ModuleOf) -> Any:
    """Return each motion in turn."""
    track, launch = MOTIONS[request.param]
    return module_of(track).solve(**launch)


@pytest.mark.parametrize(("amplitude", "allowed"), [("6/5", PLACE), (1e-3, PLACE), (2.0, PLACE), (3.0, STEEP)])
def test_a_pendulum_at_random_times(amplitude: Any, allowed: float, module_of: ModuleOf) -> None:
    """The angle is 2 asin(k cd(w t)), also after hundreds of periods."""
    motion = module_of("circle").solve(amplitude, L=1)
    t = np.random.default_rng(5).uniform(-1000.0, 1000.0, 60)
    places = motion.lam(t)
    with mp.workdps(40):
        top = mpf(6) / 5 if amplitude == "6/5" else mpf(amplitude)
        k, w = mp.sin(top / 2), mp.sqrt(mpf("9.81"))
        for place, time in zip(places, t, strict=True):
            truth = 2 * mp.asin(k * mp.ellipfun("cd", w * mpf(float(time)), m=k * k))
            assert abs(mpf(float(place)) - truth) <= allowed * 2 * top


@pytest.mark.parametrize("given", [range(6), [0, 1.5, 2], [[0.0, 1], [2, 3.5]], np.arange(3), np.float32([0.1, 0.2])])
@pytest.mark.parametrize("rough", [False, True])
def test_times_that_are_no_array_of_doubles(rough: bool, given: Any, module_of: ModuleOf) -> None:
    """Ranges, lists and other arrays are read as the doubles that they hold, in their shape."""
    motion = circle_coulomb.solve(0.3, mu="1/100") if rough else module_of("circle").solve(0.3, L=1)
    times = np.array(given, dtype=np.float64)
    assert np.abs(motion.lam(given) - motion.lam(times)).max() <= AGREE
    assert np.abs(motion.state(given).lam - motion.state(times).lam).max() <= AGREE
    assert motion.lam(given).shape == motion.state(given).lam.shape == motion.error_bound(given).shape == times.shape


@pytest.mark.parametrize("direction", [1, -1])
def test_a_whirling_pendulum_at_random_times(direction: int, module_of: ModuleOf) -> None:
    """The angle grows as twice the amplitude of Jacobi, lap by lap, and a place in a later lap is reached once."""
    motion = module_of("circle").solve(0.0, 9.0, direction, L=1)
    t = np.random.default_rng(6).uniform(-100.0, 100.0, 60)
    places = motion.lam(t)
    with mp.workdps(40):
        m = 4 * mpf("9.81") / 81
        loop = 4 * mp.ellipk(m) / 9
        for place, time in zip(places, t, strict=True):
            laps = mp.nint(mpf(float(time)) / loop)
            u = (mpf(float(time)) - laps * loop) * mpf(9) / 2
            truth = direction * 2 * (mp.asin(mp.ellipfun("sn", u, m=m)) + laps * mp.pi)
            assert abs(mpf(float(place)) - truth) <= PLACE * max(abs(truth), 2 * mp.pi)
        passed = mp.ellipf(10, m) * 2 / 9
        assert abs(mpf(motion.time_at(20.0 * direction)) - passed) <= PLACE * passed
    with pytest.raises(SolutionError, match="never at"):
        motion.time_at(-direction)
    assert motion.events_between(0, 1000) == ()


@pytest.mark.parametrize("share", [1e-4, -1e-8, 1e-12, -1e-14])
def test_states_beside_the_hilltop(share: float, module_of: ModuleOf, monkeypatch: pytest.MonkeyPatch) -> None:
    """Angle, arc length and speed are Jacobi's functions there, and one call of compiled code finds them."""
    monkeypatch.delattr(Positions, "_rows_of_states")
    v0 = float(np.sqrt(4 * 9.81 * (1 + share)))
    motion = module_of("circle").solve(0.0, v0, L=1)
    assert motion.kind == ("circulation" if share > 0 else "libration")
    rng, slowest = np.random.default_rng(9), motion.period * (0.5 if share > 0 else 0.25)
    t = np.concatenate([rng.uniform(0.0, 2.0 * motion.period, 12), slowest + rng.uniform(-1.0, 1.0, 8)])
    state = motion.state(t)
    with mp.workdps(50):
        speed, ratio = mpf(v0), mpf(v0) ** 2 / (4 * mpf("9.81"))
        for k, time in enumerate(t.tolist()):
            if share > 0:
                loop = 4 * mp.ellipk(1 / ratio) / speed
                laps = mp.nint(mpf(time) / loop)
                u = (mpf(time) - laps * loop) * speed / 2
                place = 2 * (mp.asin(mp.ellipfun("sn", u, m=1 / ratio)) + laps * mp.pi)
                rate = speed * mp.ellipfun("dn", u, m=1 / ratio)
            else:
                u = mp.sqrt(mpf("9.81")) * mpf(time)
                place = 2 * mp.asin(mp.sqrt(ratio) * mp.ellipfun("sn", u, m=ratio))
                rate = speed * mp.ellipfun("cn", u, m=ratio)
            assert abs(mpf(float(state.lam[k])) - place) <= PLACE * max(abs(place), 2 * mp.pi)
            assert abs(mpf(float(state.s[k])) - place) <= PLACE * max(abs(place), 2 * mp.pi)
            assert abs(mpf(float(state.v[k])) - rate) <= SPEED * speed


def test_the_compiled_loop_agrees_with_exact_reading(motion: Any) -> None:
    """All columns of the state agree, within the first period and hundreds of periods away, in both directions of
    time.
    """
    period = motion.period
    for reach in (0.99 * period, 300.0 * period):
        t = np.append(np.linspace(-reach, reach, 501), [0.0, 0.5 * period])
        state, plain = motion.state(t), Motion.state(motion, t)
        assert (motion.lam(t) == state.lam).all()
        width = abs(motion._segment.b - motion._segment.a)
        for name, got, old in zip(state._fields, state, plain, strict=True):
            if name == "error":  # an estimate, which is of the same size in both directions
                assert np.all((got <= 2.0 * old) & (old <= 2.0 * got))
                continue
            scale = max(np.abs(old).max(), width) if name == "lam" else np.abs(old).max()
            assert np.abs(got - old).max() <= AGREE * scale, name


def test_at_launch_it_is_at_the_launch_place(motion: Any) -> None:
    """At launch the place is exactly that of the launch, not within rounding."""
    state = motion.state(np.zeros(3))
    assert (state.lam == motion.problem.lam0).all()
    assert (state.s == 0.0).all()
    assert (np.abs(state.v) == motion.problem.launch.v0.value).all()


def test_one_time_or_many_give_the_same(motion: Any) -> None:
    """Floats, ints and arrays of any shape and stride give the same results, whatever the number of threads."""
    t = np.linspace(0.0, 37.0, 24)
    places, state = motion.lam(t), motion.state(t)
    assert [motion.lam(float(time)) for time in t] == list(places)
    assert type(motion.lam(1)) is float
    assert motion.lam(37) == places[-1]
    assert motion.lam(t.reshape(2, 3, 4)[:, ::2].T).shape == (4, 2, 2)
    assert (motion.lam(t[::-5]) == places[::-5]).all()
    for k in (0, 5, 23):
        assert tuple(motion.state(float(t[k]))) == tuple(row[k] for row in state)
    assert type(motion.lam(np.array(37.0))) is float
    assert motion.lam(np.array(37.0)) == places[-1]
    assert motion.lam(np.empty((0, 2))).shape == (0, 2)


def test_threads_change_nothing(module_of: ModuleOf, monkeypatch: pytest.MonkeyPatch) -> None:
    """Large arrays are cut into parts, each of which has the same results."""
    motion = module_of("circle").solve(1.0, L=1)
    t = np.linspace(0.0, 1e4, 2**17 + 77)
    alone = motion.lam(t)
    monkeypatch.setattr(threads, "cores", lambda: 3)
    assert (motion.lam(t) == alone).all()


def test_times_that_cannot_be_are_refused_as_before(module_of: ModuleOf) -> None:
    """NaN and times beyond the horizon are refused as before."""
    motion = module_of("circle").solve(1.0, L=1, t_max=5)
    with pytest.raises(InputError, match="NaN"):
        motion.lam(np.array([0.0, np.nan]))
    with pytest.raises(InputError, match="ends at 5"):
        motion.state(5.5)


@pytest.mark.parametrize("launch", [{"lam0": 1.0}, {"lam0": 0.3, "v0": 9.0}, {"lam0": 0.3, "v0": 9.0, "direction": -1}])
def test_arc_length_on_a_circle(launch: dict[str, Any], module_of: ModuleOf) -> None:
    """From the launch on, arc length is radius times angle, also backwards in time."""
    motion = module_of("circle").solve(**launch, L=2)
    state = motion.state(np.array([-3.3, -0.1, 0.0, 0.2, 1.0, 7.7, 100.3]))
    assert state.s == pytest.approx(2.0 * (state.lam - launch["lam0"]), rel=1e-14, abs=1e-14)


def test_arc_length_almost_to_the_top_far_from_zero(module_of: ModuleOf) -> None:
    """The length of a swing is that of its exact ends, which are rounded much when a body has been round a million
    times.
    """
    motion = module_of("circle").solve("2000000*pi", "2*sqrt(9.81)*(1 - 1e-7)", L=1)
    with mp.workdps(30):
        top = 2 * mp.asin(1 - mpf("1e-7"))
        assert abs(mpf(motion.state(0.25 * motion.period).s) - top) <= PLACE * top


def test_events_of_later_periods(module_of: ModuleOf) -> None:
    """A swing turns each half period and a lap passes the lowest point once, also between late times."""
    swing = module_of("circle").solve(1.0, L=2)
    half = swing.half_period
    for first in (-7, 1, 40):
        turns = [
            event for event in swing.events_between((first - 0.3) * half, (first + 4.3) * half) if event.kind == "turn"
        ]
        assert [event.t for event in turns] == pytest.approx([(first + k) * half for k in range(5)], rel=1e-14)
        assert [event.lam for event in turns] == pytest.approx([(-1.0) ** (first + k) for k in range(5)], rel=1e-15)


def series(motion: Any, there_and_back: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients of a motion's series."""
    segment = motion._segment
    return fit_wave(segment.edges, *segment.edge_times, segment.panels[3], there_and_back)


@pytest.mark.parametrize("amplitude", [0.1, 1.2, 2.9])
def test_the_series_of_a_swing(amplitude: float, module_of: ModuleOf) -> None:
    """The series of a swing is that of 2 asin(k sn u), by the nome (DLMF 22.11)."""
    cosines, sines = series(module_of("circle").solve(amplitude, L=1), True)
    assert sines.size == 0
    k, n = mp.sin(mpf(amplitude) / 2), np.arange(cosines.size)
    q = float(mp.qfrom(k=k))
    truth = np.sin(0.5 * np.pi * n) * 8.0 * q ** (0.5 * n) / (np.maximum(n, 1) * (1.0 + q**n)) / amplitude
    assert np.abs(cosines - truth).max() <= SERIES
    assert cosines.sum() == pytest.approx(1.0, abs=4 * SERIES)


@pytest.mark.parametrize("v0", [7.0, 12.0])
def test_the_series_of_a_lap(v0: float, module_of: ModuleOf) -> None:
    """The series of a lap is that of the amplitude function, less its mean rate."""
    cosines, sines = series(module_of("circle").solve(0.0, v0, L=1), False)
    q, n = float(mp.qfrom(k=2 * mp.sqrt(mpf("9.81")) / mpf(v0))), np.arange(cosines.size)
    assert np.abs(cosines).max() <= SERIES
    truth = 2.0 * q**n / (np.pi * np.maximum(n, 1) * (1.0 + q ** (2 * n))) * (n > 0)
    assert np.abs(sines - truth).max() <= SERIES
    assert sines.size > 5


@pytest.mark.parametrize("count", [1, 2, 3, 4, 9, 40])
@pytest.mark.parametrize("places", [1, 7, GROUP, GROUP + 1])
def test_sums_of_waves(count: int, places: int) -> None:
    """Sums of cosines agree with numpy, and sums of sines, each over sin(phi), with the product of both."""
    c = np.random.default_rng(count).normal(size=count)
    phi = np.linspace(0.1, np.pi - 0.1, places)
    x, out, work = np.zeros(2 * GROUP), np.empty(2 * GROUP), np.empty(2 * GROUP)
    x[:places] = np.cos(phi)
    sum_cosines(c, x, places, out, work)
    assert out[:places] == pytest.approx(chebval(x[:places], c), rel=1e-13, abs=1e-13)
    sum_sines(c, x, places, out, work)
    sines = np.sin(np.outer(phi, np.arange(count))) @ c
    assert out[:places] * np.sin(phi) == pytest.approx(sines, rel=1e-13, abs=1e-13)


def test_series_are_as_long_as_they_must_be(module_of: ModuleOf) -> None:
    """The tautochrone's series is one cosine, a swing's has a few terms, and next to the separatrix, where the table is
    faster, there is none.
    """

    def terms(lam0: float) -> int:
        return len(series(module_of("circle").solve(lam0, L=1), True)[0])

    assert 0 < terms(1e-4) <= 10
    assert 0 < terms(1.2) <= 24
    assert 32 < terms(2.9) <= 64
    assert terms(3.14) == 0


@pytest.mark.parametrize("place", [1.2, -1.2])
@pytest.mark.parametrize("t", [1e-9, 1e-7, 1e-5])
def test_just_after_a_release(place: float, t: float, module_of: ModuleOf) -> None:
    """Just after a pendulum is released velocity and arc length have the digits of elliptic functions."""
    motion = module_of("circle").solve(place, L=1, g=9.81)
    with mp.workdps(40):
        modulus, rate = mp.sin(abs(mpf(place)) / 2), mp.sqrt(mpf(9.81))
        cd, sd, nd = (mp.ellipfun(name, rate * mpf(t), m=modulus**2) for name in ("cd", "sd", "nd"))
        fall = (1 - modulus**2) * sd * nd
        wanted = -mp.sign(place) * 2 * modulus * rate * fall / mp.sqrt(1 - (modulus * cd) ** 2)
        way = mp.sign(place) * (2 * mp.asin(modulus * cd) - abs(mpf(place)))
    for states in (motion.state(t), motion.state(Fraction(t)), motion.state(np.array([t, 2.0]))):
        assert abs(np.atleast_1d(states.v)[0] / wanted - 1) <= RELEASED
        assert abs(np.atleast_1d(states.s)[0] / way - 1) <= RELEASED_LENGTH
