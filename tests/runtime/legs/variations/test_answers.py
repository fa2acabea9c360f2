"""Derivatives of motions with losses agree with closed forms in mpmath."""

from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.loading import load

Launch = Mapping[str, str]
Build = Callable[..., ModuleType]
STATES = ("lam", "s", "x", "z", "v", "normal_force")

# The largest error of a derivative, relative to it or to the largest one at any of the times.
TOLERANCE = 1e-13


def derivative(truth: Callable[..., Any], launch: Launch, name: str, digits: int = 60) -> list[Any]:
    """Return the derivatives of numbers that follow from a launch, by differences; at v0 = 0 for greater speeds."""
    with mp.workdps(digits):
        at = {key: mpf(value) for key, value in launch.items()}
        step = mpf(10) ** (-digits // 3)
        below = at[name] - step if name != "v0" or at[name] else at[name]
        ends = [truth(**{**at, name: place}) for place in (below, at[name] + step)]
        return [(b - a) / (at[name] + step - below) for a, b in zip(*ends, strict=True)]


def assert_close(found: Any, wanted: Any, what: Any) -> None:
    """Check that all derivatives with respect to one variable are right, relative to the largest of them or to 1 in SI
    units.
    """
    wanted = np.array([float(value) for value in wanted])
    error = np.abs(np.asarray(found) - wanted).max()
    assert error <= TOLERANCE * max(np.abs(wanted).max(), 1.0), (what, error, wanted)


def assert_states(motion: Any, times: Any, truth: Callable[..., Any], launch: Launch, fields: tuple[str, ...]) -> None:
    """Check that derivatives of fields of states are those of ``truth(t, **launch)``, which gives these fields."""
    found = motion.sensitivity(times, list(launch))
    for k, name in enumerate(launch):
        rows = np.array([[float(d) for d in derivative(lambda **at: truth(mpf(t), **at), launch, name)] for t in times])  # noqa: B023
        for field, wanted in zip(fields, rows.T, strict=True):
            assert_close(getattr(found, field)[k], wanted, (field, name))


class RoughSpring:
    """A spring with dry friction, with half swings about +-mu g/k, each ``(begin, centre, amplitude, phase)``."""

    def __init__(self, lam0: mpf, v0: mpf, k: mpf, mu: mpf, g: mpf, direction: int = 1) -> None:
        self.rate, shift = mp.sqrt(k), mu * g / k
        self.swings, self.turns, time, place = [], [], mpf(0), lam0
        if v0 > 0:
            centre = -direction * shift
            amplitude = mp.hypot(lam0 - centre, v0 / self.rate)
            phase = -mp.atan2(v0 / self.rate, direction * (lam0 - centre))
            self.swings.append((time, centre, direction * amplitude, phase))
            time, place = -phase / self.rate, centre + direction * amplitude
            self.turns.append(place)
        while abs(place) > shift:
            centre = shift * mp.sign(place)
            self.swings.append((time, centre, place - centre, mpf(0)))
            time, place = time + mp.pi / self.rate, 2 * centre - place
            self.turns.append(place)
        self.end = time

    def at(self, t: mpf) -> list[mpf]:
        """Return place and velocity."""
        begin, centre, amplitude, phase = next(s for s in reversed(self.swings) if s[0] <= t)
        angle = self.rate * (t - begin) + phase
        return [centre + amplitude * mp.cos(angle), -amplitude * self.rate * mp.sin(angle)]


ROUGH = {"lam0": "0.3", "v0": "1.7", "k": "7", "mu": "0.05", "g": "9.81"}


@pytest.mark.parametrize(
    ("changed", "direction"),
    [({}, 1), ({}, -1), ({"v0": "1e-7"}, -1), ({"v0": "1e-6"}, 1), ({"v0": "0"}, 1), ({"v0": "0"}, -1)],
)
def test_a_spring_with_dry_friction(build: Build, changed: Launch, direction: int) -> None:
    """States at any time, turning points, the place of rest and its time have the right derivatives."""
    module = build("changing_spring", gqm.Curve.graph("0*x"), gqm.Potential("k*x**2/2") + gqm.CoulombFriction())
    launch = {**ROUGH, **changed}
    motion = module.solve(**launch, direction=direction)
    start = RoughSpring(**{k: mpf(v) for k, v in launch.items()}, direction=direction)
    times = float(start.end) * np.array([0.01, 0.05, 0.2, 0.37, 0.55, 0.77, 0.93, 0.9999])
    assert_states(motion, times, lambda t, **at: RoughSpring(**at, direction=direction).at(t), launch, ("lam", "v"))
    # At the last two turns the margins are of equal size, and both on one side.
    margins = [float(start.rate**2 * abs(place) / (mpf(launch["mu"]) * mpf("9.81"))) - 1.0 for place in start.turns]
    nearest = motion.nearest_switch
    assert abs(nearest.margin) == pytest.approx(np.abs(margins).min(), rel=1e-12)
    assert (nearest.lam, nearest.margin) in [
        (pytest.approx(float(place), rel=1e-12), pytest.approx(margin, rel=1e-12))
        for place, margin in zip(start.turns, margins, strict=True)
    ]
    names = [name for name in launch if name != "v0" or launch["v0"] != "0"]
    turns = motion.gradient("turning_points", names)
    rest, last = motion.gradient("rest_position", names), motion.gradient("t_end", names)
    for name in names:
        wanted = derivative(lambda **at: RoughSpring(**at, direction=direction).turns, launch, name)
        assert_close(turns[name][-len(wanted) + 1 :], wanted[:-1], name)
        assert_close(rest[name], wanted[-1:], name)
        assert_close(
            last[name], derivative(lambda **at: [RoughSpring(**at, direction=direction).end], launch, name), name
        )


class Damped:
    """A spring with a resistance proportional to the speed."""

    def __init__(self, lam0: mpf, v0: mpf, k: mpf, c: mpf, **_: mpf) -> None:
        self.decay = c / 2
        self.rate = mp.sqrt(k - self.decay**2)
        self.cosine, self.sine = lam0, (v0 + self.decay * lam0) / self.rate

    def at(self, t: mpf) -> list[mpf]:
        """Return place and velocity."""
        a, b, shrinks = self.cosine, self.sine, mp.exp(-self.decay * t)
        cosine, sine = mp.cos(self.rate * t), mp.sin(self.rate * t)
        place = shrinks * (a * cosine + b * sine)
        return [place, shrinks * self.rate * (b * cosine - a * sine) - self.decay * place]

    def turns(self, count: int) -> list[mpf]:
        """Return the first places, after the launch, at which the velocity vanishes."""
        a, b = self.cosine, self.sine
        angle = mp.atan2(self.rate * b - self.decay * a, self.rate * a + self.decay * b) % mp.pi
        angle += mp.pi if angle < mpf(10) ** -30 else 0
        return [self.at((angle + k * mp.pi) / self.rate)[0] for k in range(count)]


@pytest.mark.parametrize(
    "launch", [{"lam0": "0.8", "v0": "0"}, {"lam0": "-0.4", "v0": "2"}, {"lam0": "0.3", "v0": "1e-4"}]
)
def test_a_law_that_is_not_linear(build: Build, launch: Launch) -> None:
    """With a resistance that grows with the speed itself, states and forty turns have the right derivatives."""
    force = gqm.Potential("k*x**2/2") + gqm.LinearDrag()
    module = build("changing_damper", gqm.Curve.graph("0*x"), force)
    launch = {**launch, "k": "3", "c": "0.06"}
    motion = module.solve(**launch, t_max=80)
    times = [0.02, 0.4, 1.1, 2.3, 9.0, 30.0, 79.0]
    assert_states(motion, times, lambda t, **at: Damped(**at).at(t), launch, ("lam", "v"))
    turns = motion.gradient("turning_points", names := [name for name in launch if launch[name] != "0"])
    released = int(launch["v0"] == "0")
    for name in names:
        wanted = derivative(lambda **at: Damped(**at).turns(40), launch, name)
        assert_close(turns[name][released : released + 40], wanted, name)


@pytest.mark.parametrize(
    ("lam0", "v0", "direction", "k", "c"),
    [(2.33, 3.92, -1, 2.298, 3.126), (0.507, 10.4, -1, 0.7481, 1.555), (2.88, 7.21, -1, 1.708, 2.558)],
)
def test_a_damped_spring_that_dies_away(
    lam0: float, v0: float, direction: int, k: float, c: float, build: Build
) -> None:
    """Derivatives of late places have all their digits, relative to the largest of them at the same time.

    They were small differences of the launch's shift and that of the time, off by up to 3e-11 of the largest.
    """
    force = gqm.Potential("k*x**2/2") + gqm.Kernel.law("-c*direction*sqrt(W)")
    motion = build("dying_damper", gqm.Curve.graph("0*x", domain=(None, None)), force).solve(
        lam0, v0, direction, k=k, c=c
    )
    given = {"lam0": mpf(lam0), "v0": mpf(v0), "k": mpf(k), "c": mpf(c)}

    def place(t: float, **at: mpf) -> Any:
        decay = at["c"] / 2
        rate = mp.sqrt(mp.mpc(at["k"] - decay**2))
        swing = at["lam0"] * mp.cos(rate * t) + (direction * at["v0"] + decay * at["lam0"]) / rate * mp.sin(rate * t)
        return (mp.exp(-decay * t) * swing).real

    for t in (1.0, 3.0, 5.0, 7.5, 9.2):
        with mp.workdps(60):
            true = []
            for name in given:
                step = mpf(10) ** -20
                ends = [place(t, **{**given, name: given[name] + sign * step}) for sign in (-1, 1)]
                true.append((ends[1] - ends[0]) / (2 * step))
            errors = [
                abs(mpf(float(one)) - other)
                for one, other in zip(motion.sensitivity(t, list(given)).lam, true, strict=False)
            ]
            assert max(errors) <= 3.0 * TOLERANCE * max(map(abs, true))


def test_the_papers_second_example() -> None:
    """The turn on a cubic track with friction, passed with N of either sign, has the right derivatives (22 digits, by
    differences).
    """
    motion = load(str(ROOT / "generated" / "cubic_coulomb.py"), "cubic_coulomb").solve("-1", "6.2088", mu="1/10")
    found = motion.gradient("turning_points", ("mu", "v0"))
    assert found["mu"][0] == pytest.approx(-1.370490175291658727794, rel=1e-14)
    assert found["v0"][0] == pytest.approx(0.1812676943574192802416, rel=1e-14)
    # At a change of the sign of N, this is the change of the place less the effect of the change of the time.
    event = next(event for event in motion.events if event.kind == "contact-sign")
    there = motion.sensitivity(event.t, ("mu", "v0"))
    with mp.workdps(30):
        v2, at = mpf(motion.state(event.t).v2), mpf(event.lam)

        def force(x: mpf) -> mpf:  # friction vanishes with N
            q = 1 + 9 * x**4
            return 6 * x * (v2 - 2 * mpf("9.81") * (x**3 - at**3)) / q ** mpf("1.5") + mpf("9.81") / mp.sqrt(q)

        moved = there.lam - there.normal_force / float(mp.diff(force, at))
    np.testing.assert_allclose(moved, [-0.199715357031180251266677, 0.0658603740906338497936358], rtol=1e-13)


def falling(lam0: mpf, v0: mpf, L: mpf, mu: mpf, g: mpf, m: mpf, **_: mpf) -> Any:
    """Return V**2 on a rough ring by the angle from its lowest point, for N > 0 and growing angles, and N."""
    b = -6 * mu * g * L / (1 + 4 * mu**2)
    a = 2 * g * L + 2 * mu * b
    start = v0**2 - a * mp.cos(lam0) - b * mp.sin(lam0)

    def v2(angle: mpf) -> mpf:
        return start * mp.exp(-2 * mu * (angle - lam0)) + a * mp.cos(angle) + b * mp.sin(angle)

    return v2, lambda angle: m * (v2(angle) / L + g * mp.cos(angle))


RING = {"lam0": "-0.9", "v0": "5.6", "L": "1.1", "mu": "0.05", "g": "9.81", "m": "0.7"}


@pytest.mark.extended
def test_where_contact_is_lost() -> None:
    """A bead on a rough ring that can only push inwards lifts off at a time with the right derivatives, and so are its
    extremes before.
    """
    motion = load(str(ROOT / "generated" / "circle_coulomb.py"), "circle_coulomb").solve(**RING, contact="above")
    assert motion.legs[-1].end == "liftoff"
    place, peak = motion.legs[-1].lam_end, motion.normal_force_max.lam
    quickest = motion.v_max.lam

    def lost(**at: mpf) -> list[mpf]:
        v2, force = falling(**at)
        end = mp.findroot(force, place)
        return [mp.quad(lambda angle: at["L"] / mp.sqrt(v2(angle)), mp.linspace(at["lam0"], end, 5))]

    def peaks(**at: mpf) -> list[mpf]:
        v2, force = falling(**at)
        fastest = mp.findroot(lambda angle: mp.diff(v2, angle), quickest)
        return [force(mp.findroot(lambda angle: mp.diff(force, angle), peak)), mp.sqrt(v2(fastest))]

    for name in RING:
        assert_close(motion.gradient("t_end", name)[name], derivative(lost, RING, name, 40), name)
        force, speed = derivative(peaks, RING, name)
        assert_close(motion.gradient("normal_force_max", name)[name], [force], name)
        assert_close(motion.gradient("v_max", name)[name], [speed], name)
        assert abs(motion.gradient("normal_force_min", name)[name]) <= 1e-12


def test_the_end_of_an_inclined_plane(build: Build) -> None:
    """A block thrown up a rough plane slides back to the end of the plane, which is a parameter."""
    curve = gqm.Curve.graph("a*x", domain=("-d", "9"))
    module = build("changing_plane", curve, gqm.CoulombFriction())
    launch = {"lam0": "0.2", "v0": "3", "a": "0.6", "d": "0.7", "mu": "0.2", "g": "9.81"}
    motion = module.solve(**launch)

    def truth(lam0: mpf, v0: mpf, a: mpf, d: mpf, mu: mpf, g: mpf, **_: mpf) -> list[mpf]:
        slope = mp.sqrt(1 + a**2)
        up, down = g * (a + mu) / slope, g * (a - mu) / slope
        reach = v0**2 / (2 * up)
        way = reach + (lam0 + d) * slope
        return [v0 / up + mp.sqrt(2 * way / down), lam0 + reach / slope, mp.sqrt(2 * down * way)]

    for name in launch:
        end, turn, speed = derivative(truth, launch, name)
        assert_close(motion.gradient("t_end", name)[name], [end], name)
        assert_close(motion.gradient("turning_points", name)[name], [turn], name)
        assert_close(motion.gradient("v_max", name)[name], [speed], name)


def test_small_swings_beside_zero() -> None:
    """Small swings beside zero are followed by distances from their equilibrium, and agree with those about one at
    0.
    """
    beside, about = (load(str(ROOT / "generated" / f"{name}.py"), name) for name in ("ellipse_drag", "circle_drag"))
    lam0, times = 1e-6 - np.pi / 2, np.linspace(0.0, 20.0, 9)[1:]
    with mp.workdps(40):
        exact = mp.nstr(mpf(lam0) + mp.pi / 2, 35)
    found = beside.solve(lam0, a=1, b=1, b_air="0.05", m=1).sensitivity(times, ("lam0", "g", "v0"))
    wanted = about.solve(exact, L=1, b="0.05", m=1).sensitivity(times, ("lam0", "g", "v0"))
    for k in range(3):
        assert np.abs(found.lam[k] - wanted.lam[k]).max() <= TOLERANCE * np.abs(wanted.lam[k]).max()
        assert np.abs(found.v[k] - wanted.v[k]).max() <= TOLERANCE * np.abs(wanted.v[k]).max()


def test_all_fields_over_laps() -> None:
    """A bead goes round with drag, and its law does not depend on how places on the ring are counted."""
    module = load(str(ROOT / "generated" / "circle_drag.py"), "circle_drag")
    motion, times = module.solve(0.3, 30, L="1.25", b="0.02"), np.array([0.01, 0.4, 1.3, 2.9, 6.0])
    found, state, n = motion.sensitivity(times), motion.state(times), module.PARAMETERS
    assert state.lam.max() > 25.0
    rows = {name: k for k, name in enumerate(found.wrt)}
    assert found.wrt == ("lam0", "v0", *n)
    # In units of length L and of time sqrt(L/g), the motion depends on b L/m and v0/sqrt(g L) only.
    mass, drag, length, gravity = (rows[name] for name in ("m", "b", "L", "g"))
    np.testing.assert_allclose(found.lam[mass] * 1.0, -found.lam[drag] * 0.02, rtol=1e-12)
    rates = state.v / 1.25
    of_scale = found.lam[gravity] * 9.81 + 0.5 * 30.0 * found.lam[rows["v0"]] - 0.5 * rates * times
    assert np.abs(of_scale).max() <= 1e-12 * np.abs(rates * times).max()
    of_length = found.lam[length] * 1.25 + found.lam[rows["v0"]] * 15.0 - found.lam[drag] * 0.02 + 0.5 * rates * times
    assert np.abs(of_length).max() <= 1e-12 * np.abs(rates * times).max()
    # s = L (lam - lam0), and x, z and N follow from lam and v. At the first time the terms of ds/dL all but cancel, so
    # that the limit is a share of the terms.
    of_path = found.s[length] - (state.lam - 0.3 + 1.25 * found.lam[length])
    assert np.all(np.abs(of_path) <= 1e-15 * np.abs(state.lam - 0.3))
    np.testing.assert_allclose(found.s[rows["lam0"]], 1.25 * (found.lam[rows["lam0"]] - 1.0), rtol=1e-9)
    np.testing.assert_allclose(found.x[gravity], 1.25 * np.cos(state.lam) * found.lam[gravity], rtol=1e-11)
    np.testing.assert_allclose(found.z[gravity], 1.25 * np.sin(state.lam) * found.lam[gravity], rtol=1e-11)
    force = 2.0 * state.v * found.v[gravity] / 1.25 - 9.81 * np.sin(state.lam) * found.lam[gravity] + np.cos(state.lam)
    np.testing.assert_allclose(found.normal_force[gravity], force, rtol=1e-11)


@pytest.mark.parametrize(
    ("launch", "quantity", "error", "text"),
    [
        ({}, "period", SolutionError, "does not repeat, and so it has no period"),
        ({}, "turning_point", InputError, "did you mean 'turning_points'"),
        ({}, "t_end", SolutionError, "goes on for ever and has no t_end"),
        ({"t_max": 3}, "rest_position", SolutionError, "it ends with 'horizon'"),
    ],
)
def test_what_has_no_gradient(launch: Any, quantity: str, error: type[Exception], text: str) -> None:
    """Each answer without a gradient gives one clear error."""
    motion = load(str(ROOT / "generated" / "circle_drag.py"), "circle_drag").solve(1, **launch)
    with pytest.raises(error, match=text):
        motion.gradient(quantity)


def test_ends_that_do_not_move() -> None:
    """The horizon does not move, nor does the least speed of a body that turns, and for no times there are no
    changes.
    """
    module = load(str(ROOT / "generated" / "circle_coulomb.py"), "circle_coulomb")
    assert module.solve(1).sensitivity(np.empty((0, 2)), "L").normal_force.shape == (1, 0, 2)
    assert module.solve(1, t_max="0.2").gradient("t_end", ("L", "mu")) == {"L": 0.0, "mu": 0.0}
    assert module.solve(3, "0.1", contact="above").gradient("t_end", "L") == {"L": 0.0}
    assert load(str(ROOT / "generated" / "circle_drag.py"), "circle_drag").solve(1).nearest_switch is None
    assert module.solve(1).gradient("v_min", ("L", "mu")) == {"L": 0.0, "mu": 0.0}


@pytest.mark.parametrize("t_max", [0.5, 2.9, 3.1, 6.1, None])
def test_turning_points_alone(t_max: float | None) -> None:
    """Each turning point of a motion has its derivatives, whatever has been asked before, also where the motion ends
    short of the next one.
    """
    circle = load(str(ROOT / "generated" / "circle_coulomb.py"), "circle_coulomb")
    alone, asked = (circle.solve(0.9, 0.0, mu=0.05, t_max=t_max) for _ in range(2))
    later = asked.sensitivity(0.4 if t_max is None else t_max)
    assert np.isfinite(later.lam).all()
    found = alone.gradient("turning_points")
    assert found == asked.gradient("turning_points")
    assert {len(row) for row in found.values()} == {len(alone.turning_points)}
    assert found["lam0"][0] == 1.0
    longer = circle.solve(0.9, 0.0, mu=0.05).gradient("turning_points")
    assert found == {name: row[: len(alone.turning_points)] for name, row in longer.items()}
