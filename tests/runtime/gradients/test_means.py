"""Derivatives of the times of trains agree with closed forms and with 30-digit derivatives of quadratures."""

from collections.abc import Callable
from functools import partial
from types import ModuleType
from typing import Any

import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import SolutionError
from gqm_sym.runtime.gradients.charts import shaped_pieces, trains

# The means are known in doubles, to some units in the last place, and derivatives are a few times as sensitive.
ROUNDING = 2e-14

PLACE = mpf(6) / 5
CONSTANTS = {"L": mpf(2), "length": mpf(3) / 2, "g": mpf("9.81"), "k": mpf(3) / 4, "Omega": mpf(1) / 2}


@pytest.fixture(scope="module")
def hoop(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a train on a circle that rotates about the vertical through its centre, with a spring."""
    law = gqm.Gravity() + gqm.Potential("(k - Omega**2)*x**2/2", parameters=["k", "Omega"]) + gqm.Train(cars=3)
    folder = tmp_path_factory.mktemp("gradients")
    return gqm.build(gqm.derive(gqm.families.circle(), law), name="derivatives_on_hoop", folder=folder)


def energy(s: Any, L: Any, length: Any, g: Any, k: Any, Omega: Any) -> Any:
    """Return the mean potential of a train, which has the form of that of a body."""
    half, whole = mp.sinc(length / (2 * L)), mp.sinc(length / L)
    return -g * L * half * mp.cos(s / L) - (k - Omega**2) * L**2 * whole * mp.cos(2 * s / L) / 4


def climb(s: Any, end: Any, L: Any, length: Any, g: Any, k: Any, Omega: Any) -> Any:
    """Return the energy at one place less that at another one, without a subtraction."""
    half, whole, sides = mp.sinc(length / (2 * L)), mp.sinc(length / L), ((end + s), (end - s))
    one, two = (mp.sin(side / (2 * L)) for side in sides), (mp.sin(side / L) for side in sides)
    return 2 * g * L * half * mp.fprod(one) + (k - Omega**2) * L**2 * whole * mp.fprod(two) / 2


def rate(angle: Any, end: Any, **constants: Any) -> Any:
    """Return the time per angle where the place is the turning point times the sine of the angle."""
    return end * mp.cos(angle) / mp.sqrt(2 * climb(end * mp.sin(angle), end, **constants))


def turning_point(lam0: Any, v0: Any, **constants: Any) -> Any:
    """Return the upper turning point."""
    level = v0**2 / 2 + energy(lam0, **constants)
    return mp.findroot(lambda s: energy(s, **constants) - level, lam0) if v0 else lam0


def half_period(lam0: Any, v0: Any, **constants: Any) -> Any:
    """Return the time between both turning points, by the trapezoidal rule for a periodic function."""
    end, count = turning_point(lam0, v0, **constants), 60
    angles = ((2 * i + 1) * mp.pi / (4 * count) for i in range(count))
    return mp.pi / count * mp.fsum(rate(angle, end, **constants) for angle in angles)


def arrival(lam0: Any, v0: Any, **constants: Any) -> Any:
    """Return the time from the launch upwards to the lowest place."""
    end = turning_point(lam0, v0, **constants)
    parts = [mp.asin(lam0 / end), mp.pi / 2], [0, mp.pi / 4, mp.pi / 2]
    return sum(mp.quad(lambda angle: rate(angle, end, **constants), part, method="gauss-legendre") for part in parts)


def lap(lam0: Any, v0: Any, **constants: Any) -> Any:
    """Return the time of a lap."""
    start = energy(lam0, **constants)
    return time_of_lap(constants["L"], lambda s: v0**2 + 2 * (start - energy(s, **constants)))


def time_of_lap(L: Any, squared_speed: Callable[[Any], Any]) -> Any:
    """Return the time of a lap of a circle on which V**2 is the same at the other side of the vertical, by the
    trapezoidal rule for a periodic function.
    """
    step, count = mp.pi * L / 64, 64
    ends = (1 / mp.sqrt(squared_speed(k * count * step)) for k in (0, 1))
    return step * (mp.fsum(ends) + 2 * mp.fsum(1 / mp.sqrt(squared_speed(i * step)) for i in range(1, count)))


def derivative(time: Callable[..., Any], name: str, v0: Any, constants: dict[str, Any]) -> float:
    """Return the derivative of a time with respect to a parameter."""
    at = {"lam0": PLACE, "v0": mpf(v0), **constants}
    return float(mp.diff(lambda value: time(**{**at, name: value}), at[name]))


def derivatives(function: Callable[..., Any], at: dict[str, Any]) -> list[list[float]]:
    """Return the derivatives of each of some functions with respect to each parameter."""

    def part(name: str, k: int, value: Any) -> Any:
        return function(**{**at, name: value})[k]

    with mp.workdps(30):
        count = len(function(**at))
        return [[float(mp.diff(partial(part, name, k), at[name])) for name in at] for k in range(count)]


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("time", "quantity", "v0", "changed"),
    [
        (half_period, "half_period", 0, {}),
        (half_period, "half_period", 1, {"k": 0, "Omega": 0}),
        (lap, "period", 12, {}),
    ],
)
def test_periods(hoop: ModuleType, time: Callable[..., Any], quantity: str, v0: int, changed: dict[str, int]) -> None:
    """Half periods and laps have derivatives with respect to the launch, to the parameters of all forces, to the length
    of the train and to the radius of its track.
    """
    constants = {**CONSTANTS, **{name: mpf(value) for name, value in changed.items()}}
    names = ["lam0", *(["v0"] if v0 else []), *constants]
    given = {name: str(value) for name, value in constants.items()}
    motion = hoop.solve("6/5", v0, **given)
    with mp.workdps(30):
        truth = [derivative(time, name, v0, constants) for name in names]
    found = motion.gradient(quantity, names)
    assert [found[name] for name in names] == pytest.approx(truth, rel=ROUNDING, abs=ROUNDING)
    assert motion.gradient(quantity, "m") == {"m": 0.0}
    swept = hoop.sweep(quantity, [1.2], v0, gradient=names, **given)
    assert swept.gradient[0] == pytest.approx(truth, rel=ROUNDING, abs=ROUNDING)


def test_a_train_at_rest_with_an_end_on_a_joint(hoop: ModuleType) -> None:
    """The turning point lies where two polynomials meet, which differ by their rounding."""
    constants = {**CONSTANTS, "length": 2 * PLACE, "k": mpf(0), "Omega": mpf(0)}
    motion = hoop.solve("6/5", 0, **{name: str(value) for name, value in constants.items()})
    found = motion.gradient("half_period")
    with mp.workdps(30):
        truth = {name: derivative(half_period, name, 0, constants) for name in ("lam0", "length", "g", "L")}
    assert {name: found[name] for name in truth} == pytest.approx(truth, rel=ROUNDING)


@pytest.mark.extended
def test_a_fixed_shape_needs_no_neighbours(hoop: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The changes along the track, which are dear, are made only for what shapes the means, and once for the same
    parameters.
    """
    made, changes = [], trains.ChangesOfTrain
    monkeypatch.setattr(trains, "ChangesOfTrain", lambda problem: made.append(problem) or changes(problem))
    names, given = ("lam0", "v0", "g", "k", "Omega"), {name: str(value) for name, value in CONSTANTS.items()}
    given["g"] = "9.79"
    at = {**CONSTANTS, "g": mpf("9.79")}
    motion = hoop.solve("6/5", 1, **given)
    with mp.workdps(30):
        truth = [derivative(half_period, name, 1, at) for name in names]
    assert list(motion.gradient("half_period", names).values()) == pytest.approx(truth, rel=ROUNDING)
    for quantity in ("turning_points", "action", "v_max"):
        motion.gradient(quantity, names)
    assert motion.period_slope > 0.0
    assert not made
    for place in ("6/5", "1"):
        hoop.solve(place, 1, **given).gradient("half_period", "L")
    assert len(made) == 1


def test_neighbouring_tracks_are_made_once(hoop: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Trains of other lengths, from other places and under other forces share the neighbours of their track."""
    changed = {"L": 3, "k": 1, "Omega": 0}
    known = hoop.solve(1, 0, length=1, **changed).gradient("half_period", "L")["L"]
    monkeypatch.setattr(shaped_pieces, "_beside", None)
    for launch in ({"lam0": 2, "length": 1}, {"lam0": 1, "length": 1.5}, {"lam0": 1, "length": 1, "g": 9}):
        assert hoop.solve(v0=0, **changed | launch).gradient("half_period", "L")["L"] != known
    assert hoop.solve(1, 0, length=1, **changed).gradient("half_period", "L")["L"] == known


def test_turning_points_and_times(hoop: ModuleType) -> None:
    """A turning point moves as the energy does, and a time at a place by the quadrature to there."""
    motion = hoop.solve("6/5", 1, **{name: str(value) for name, value in CONSTANTS.items()})
    with mp.workdps(30):
        end = turning_point(PLACE, mpf(1), **CONSTANTS)
        slope = mp.diff(lambda s: energy(s, **CONSTANTS), end)
        by_v0 = float(1 / slope)
        at_launch = mp.diff(lambda s: energy(s, **CONSTANTS), PLACE)
    found = motion.gradient("turning_points", ("v0", "lam0"))
    low, high = sorted(found["v0"])
    assert (low, high) == pytest.approx((-by_v0, by_v0), rel=ROUNDING)
    assert sorted(found["lam0"]) == pytest.approx([-float(at_launch / slope), float(at_launch / slope)], rel=ROUNDING)

    with mp.workdps(30):
        truth = [derivative(arrival, name, 1, CONSTANTS) for name in ("v0", "length")]
    found = motion.gradient("time_at", ("v0", "length"), lam=0)
    assert list(found.values()) == pytest.approx(truth, rel=ROUNDING)


def swing(t: Any, v0: Any, L: Any, length: Any, g: Any) -> tuple[Any, ...]:
    """Return the place, the coordinates, the velocity and the contact force per mass of a train on a circle, which
    begins at the lowest point: that of a pendulum in a weaker field.
    """
    omega = mp.sqrt(g * mp.sinc(length / (2 * L)) / L)
    k = v0 / (2 * omega * L)
    if k < 1:
        half, rate = mp.asin(k * mp.ellipfun("sn", omega * t, m=k**2)), k * mp.ellipfun("cn", omega * t, m=k**2)
    else:
        quarter, u, m = mp.ellipk(1 / k**2), k * omega * t, 1 / k**2
        half = mp.atan2(mp.ellipfun("sn", u, m=m), mp.ellipfun("cn", u, m=m))
        half, rate = half + 2 * mp.pi * mp.floor((u + 2 * quarter) / (4 * quarter)), k * mp.ellipfun("dn", u, m=m)
    v, angle = 2 * L * omega * rate, 2 * half
    return L * angle, L * mp.sin(angle), -L * mp.cos(angle), v, v * v / L + g * mp.cos(angle)


@pytest.mark.extended
def test_states(tmp_path_factory: pytest.TempPathFactory) -> None:
    """States of trains that swing or go round have the derivatives of elliptic functions, after some periods."""
    law, folder = gqm.Gravity() + gqm.Train(cars=3), tmp_path_factory.mktemp("states")
    module = gqm.build(gqm.derive(gqm.families.circle(), law), name="states_on_circle", folder=folder)
    for v0, t in ((5, 7), (12, 7)):
        at = {"v0": mpf(v0), **{name: CONSTANTS[name] for name in ("L", "length", "g")}}
        found = module.solve(0, v0, L=2, length="3/2").sensitivity(t, tuple(at))
        truths = derivatives(partial(swing, t), at)
        scale = max(abs(number) for truth in truths for number in truth)
        for rows, truth in zip((found.s, found.x, found.z, found.v, found.normal_force), truths, strict=True):
            assert rows == pytest.approx(truth, rel=ROUNDING, abs=ROUNDING * scale)
    (truth,) = derivatives(largest_force, at)
    found = module.solve(0, 12, L=2, length="3/2").gradient("normal_force_max", tuple(at))
    assert list(found.values()) == pytest.approx(truth, rel=ROUNDING, abs=ROUNDING)


def largest_force(v0: Any, L: Any, length: Any, g: Any) -> tuple[Any]:
    """Return the contact force per mass at the lowest point."""
    return (v0**2 / L + g,)


@pytest.mark.extended
def test_three_parts(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Under more parts of a potential than there are coordinates, laps have derivatives too."""
    law, folder = gqm.Gravity() + gqm.Potential("k*x**2/2 + c*x**4/4", parameters=["k", "c"]), tmp_path_factory
    model = gqm.derive(gqm.families.circle(), law + gqm.Train())
    module = gqm.build(model, name="three_parts", folder=folder.mktemp("three"))
    at = {"L": mpf(21) / 10, "length": mpf(3) / 2, "g": mpf("9.81"), "k": mpf(3) / 4, "c": mpf(1) / 4}

    def time(L: Any, length: Any, g: Any, k: Any, c: Any) -> tuple[Any]:
        def climbed(s: Any) -> Any:
            whole, twice = mp.sinc(length / L), mp.sinc(2 * length / L)
            fourth = L**4 * (whole * (1 - mp.cos(2 * s / L)) / 2 - twice * (1 - mp.cos(4 * s / L)) / 8)
            return energy(s, L, length, g, k, 0) - energy(0, L, length, g, k, 0) + c * fourth / 4

        return (time_of_lap(L, lambda s: 225 - 2 * climbed(s)),)

    motion = module.solve(0, 15, **{name: str(value) for name, value in at.items()})
    (truth,) = derivatives(time, at)
    assert motion.period == pytest.approx(float(time(**at)[0]), rel=1e-15)
    assert list(motion.gradient("period", tuple(at)).values()) == pytest.approx(truth, rel=ROUNDING, abs=ROUNDING)


@pytest.mark.extended
def test_a_train_that_leaves_a_helix(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The time to the end of the track has derivatives too, although it does not repeat."""
    law, folder = gqm.Gravity() + gqm.Train(length=3), tmp_path_factory.mktemp("helix")
    module = gqm.build(gqm.derive(gqm.families.helix(domain=(0, 12)), law), name="train_leaves", folder=folder)

    def end(v0: int, lam0: Any, R: Any, c: Any, length: Any, g: Any) -> tuple[Any]:
        """Return the time to an end of the track, the upper one for a train with a speed."""
        step = mp.hypot(R, c)
        ahead = 12 * step - length / 2 - lam0 if v0 else lam0 - length / 2
        fall = g * c / step
        v = mp.sqrt(v0**2 - 2 * fall * ahead if v0 else 2 * fall * ahead)
        return (abs(v - v0) / fall,)

    for v0 in (0, 40):
        at = {"lam0": mpf(20), "R": mpf(2), "c": mpf(3) / 4, "length": mpf(3), "g": mpf("9.81")}
        motion = module.solve(20, v0, R=2, c="3/4")
        (truth,) = derivatives(partial(end, v0), at)
        assert motion.t_end == pytest.approx(float(end(v0, **at)[0]), rel=1e-14)
        found = motion.gradient("t_end", tuple(at))
        assert list(found.values()) == pytest.approx(truth, rel=ROUNDING)

    def state(t: int, R: Any, c: Any, g: Any) -> tuple[Any, ...]:
        """Return the place, the coordinates, the velocity and the contact force per mass while it slides down."""
        step = mp.hypot(R, c)
        s = 20 - g * c / step * t * t / 2
        v, lam = -g * c / step * t, s / step
        force = mp.hypot(v * v * R / step**2, g * R / step)
        return s, R * mp.cos(lam), R * mp.sin(lam), c * lam, v, force

    def force(lam0: Any, R: Any, c: Any, length: Any, g: Any) -> tuple[Any]:
        """Return the contact force per mass at the lower end of the track."""
        step = mp.hypot(R, c)
        return (mp.hypot(2 * g * c / step * (lam0 - length / 2), g * step) * R / step**2,)

    (truth,) = derivatives(force, at)
    found = module.solve(20, R=2, c="3/4").gradient("normal_force_max", tuple(at))
    assert list(found.values()) == pytest.approx(truth, rel=ROUNDING)

    found = module.solve(20, R=2, c="3/4").sensitivity(2, ("R", "c", "length", "g"))
    at = {"R": mpf(2), "c": mpf(3) / 4, "g": mpf("9.81")}
    rows = (found.s, found.x, found.y, found.z, found.v, found.normal_force)
    for row, truth in zip(rows, derivatives(partial(state, 2), at), strict=True):
        assert row[[0, 1, 3]] == pytest.approx(truth, rel=ROUNDING, abs=ROUNDING * max(map(abs, truth)))
        assert row[2] == pytest.approx(0.0, abs=ROUNDING)


def test_what_has_no_derivatives(hoop: ModuleType) -> None:
    """There are no second derivatives by what shapes the means."""
    motion = hoop.solve("6/5", L=2, length="3/2", k=1, Omega=0)
    with pytest.raises(
        SolutionError, match="second derivatives with respect to parameters that shape the curve of a train"
    ):
        motion.gradient("half_period", ("L", "g"), order=2)
