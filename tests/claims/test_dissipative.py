"""Motions that lose energy agree with the reference cases on all legs and with closed forms, and end where they
should.
"""

import json
import math
import random
from collections.abc import Callable
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import DATA
from scipy.integrate import solve_ivp

import gqm_sym as gqm
from gqm_sym.errors import BudgetError
from gqm_sym.runtime.legs import driver

CASES = {case["id"]: case for case in json.loads((DATA / "paper_cases.json").read_text())["cases"]}
LOSING = [case for case in CASES if case.startswith(("example2", "table2_3", "table2_4", "table2_5"))]
GRADIENTS = json.loads((DATA / "gradients.json").read_text())["losses"]
KINDS = {"turning_point": "turn", "N_zero_crossing": "contact-sign", "final_rest": "rest"}

# The tolerance of places relative to the leg that they end, and of V**2 and N relative to their largest value.
ASKED = 1e-13
# The tolerance of closed forms: a few roundings of a time or place, times the amplification by many legs and slow tops.
FEW = 2e-14
G = 9.81

Build = Callable[..., ModuleType]


def circle() -> Any:
    """Return a full circle, whose angle is measured from the bottom."""
    return gqm.Curve.parametric(x="sin(th)", z="-cos(th)", parameter="th", period="2*pi")


@pytest.fixture(scope="module")
def dragged(build: Build) -> ModuleType:
    """Return a circle with quadratic drag."""
    return build("dragged_circle", circle(), gqm.QuadraticDrag(b="c"))


@pytest.fixture(scope="module")
def rubbed(build: Build) -> ModuleType:
    """Return a circle with friction."""
    return build("rubbed_circle", circle(), gqm.CoulombFriction(mu="mu"))


def reference(build: Build, name: str) -> tuple[Any, dict[str, Any]]:
    """Return the motion of a reference case and what is known of it."""
    case = CASES[name]
    known, given, launch = case["kernel"]["params"], case["curve"], case["initial"]
    force = {
        "coulomb": lambda: gqm.CoulombFriction(mu=known["mu"]),
        "drag": lambda: gqm.QuadraticDrag(b=known["b"]),
        "droplet": lambda: gqm.SurfaceTension(gamma=known["cd"], ell_c=1),
    }[case["kernel"]["name"]]()
    curve = gqm.Curve.parametric(x=given["x"], z=given["z"], parameter="lam", parameters=given["params"] or None)
    module = build(f"losing_{name}", curve, force)
    speed, expected = launch["V0"], case["expected"]
    told = [float(row["t"]) for key in ("events", "positions", "passages") for row in expected[key]]
    motion = module.solve(
        lam0=launch["lam0"],
        v0=speed.lstrip("-"),
        direction=-1 if speed.startswith("-") else 1,
        t_max=None if expected["comes_to_rest"] else max(told) + 0.01,
        m=case["m"],
        g=case["g"],
    )
    return motion, expected


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", GRADIENTS)
def test_derivatives_of_reference_cases(name: str, build: Build) -> None:
    """Turning points and places of rest have the derivatives of differences of 30 digits, leg after leg."""
    motion, expected = reference(build, name)
    released, rests = motion.problem.w0 == 0.0, expected["comes_to_rest"]
    for by, known in GRADIENTS[name]["by"].items():
        variable = {"cd": "gamma"}.get(by, by)
        found = list(motion.gradient("turning_points", variable)[variable])[released:]
        if rests:
            found.append(motion.gradient("rest_position", variable)[variable])
        assert 0 < len(known) <= len(found)  # of many legs the first ones are known
        for value, wanted in zip(found, known, strict=False):
            assert value == pytest.approx(float(wanted), rel=ASKED, abs=ASKED), by


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", LOSING)
def test_reference_cases_through_all_their_legs(name: str, build: Build) -> None:
    """Events, positions and passages agree with two independent methods on every leg, and the bound of lam holds."""
    motion, expected = reference(build, name)
    events = [event for event in motion.events if event.kind != "horizon"]
    assert [event.kind for event in events] == [KINDS[row["kind"]] for row in expected["events"]]
    assert motion.kind == "dissipative"
    ends = {leg.t_end: leg for leg in motion.legs}
    for event, row in zip(events, expected["events"], strict=True):
        assert event.t == pytest.approx(float(row["t"]), rel=ASKED)
        leg = ends.get(event.t)
        width = abs(leg.lam_end - leg.lam_start) if leg else 1.0
        for got, key in ((event.lam, "lam"), (event.x, "x"), (event.z, "z")):
            assert abs(got - float(row[key])) <= ASKED * max(abs(float(row[key])), width)
    turns = [float(row["lam"]) for row in expected["events"] if row["kind"] == "turning_point"]
    released = (float(CASES[name]["initial"]["lam0"]),) if float(CASES[name]["initial"]["V0"]) == 0.0 else ()
    assert motion.turning_points == pytest.approx((*released, *turns), rel=ASKED, abs=ASKED)
    assert (motion.t_end == events[-1].t) == expected["comes_to_rest"]
    for row in expected["positions"]:
        state = motion.state(row["t"])
        assert abs(state.lam - float(row["lam"])) <= min(float(motion.error_bound(row["t"])), ASKED)
        assert state.v == pytest.approx(float(row["V"]), rel=ASKED)
    largest = max(float(row["V2"]) for row in expected["passages"])
    strongest = max(abs(float(row["N"])) for row in expected["passages"])
    path = [float(row["path_length"]) for row in expected["passages"]]
    for row, length in zip(expected["passages"], path, strict=True):
        state = motion.state(row["t"])
        assert abs(state.lam - float(row["lam"])) <= ASKED
        assert state.v2 == pytest.approx(float(row["V2"]), rel=ASKED, abs=ASKED * largest)
        assert state.normal_force == pytest.approx(float(row["N"]), rel=ASKED, abs=ASKED * strongest)
        assert np.sign(state.v) == row["direction"]
        if row["passage"] == 1 and float(row["lam"]) != float(CASES[name]["initial"]["lam0"]):
            assert motion.time_at(row["lam"]) == pytest.approx(float(row["t"]), rel=ASKED)
        assert _travelled(motion, float(row["t"])) == pytest.approx(length, rel=ASKED)


def _travelled(motion: Any, t: float) -> float:
    """Return the length of the path up to a time, from the arc lengths at the ends of legs."""
    times = [leg.t_end for leg in motion.legs if leg.t_end < t]
    return float(np.abs(np.diff(motion.state(np.array([0.0, *times, t])).s)).sum())


@pytest.mark.parametrize("name", [name for name in LOSING if "coulomb" in name])
def test_work_of_friction_is_the_energy_lost(name: str, build: Build) -> None:
    """On each leg, the energy decreases by the integral of friction's power over time, computed by a separate Gauss
    rule.
    """
    motion, _ = reference(build, name)
    mass, mu = float(CASES[name]["m"]), float(CASES[name]["kernel"]["params"]["mu"])
    nodes, weights = np.polynomial.legendre.leggauss(60)
    turned_over = 0.0
    lost, work = [], []
    for leg in motion.legs:
        if abs(leg.lam_end) > 3.0:
            continue  # the body moves away for ever
        half = 0.5 * (leg.t_end - leg.t_start)
        state = motion.state(leg.t_start + half * (1.0 + nodes))
        work.append(half * float(weights @ (mu * np.abs(state.normal_force * state.v))))
        ends = motion.state(np.array([leg.t_start, leg.t_end]))
        energy = mass * (0.5 * ends.v2 + G * ends.z)
        lost.append(float(energy[0] - energy[1]))
        turned_over = max(turned_over, float(np.ptp(mass * G * state.z)), 0.5 * mass * float(state.v2.max()))
    assert np.abs(np.cumsum(lost) - np.cumsum(work)).max() <= ASKED * turned_over


@pytest.mark.extended
def test_ten_thousand_legs(dragged: ModuleType) -> None:
    """With drag alone the motion has no end; leg 10000 ends at the place of the closed form of V**2, as exactly as leg
    1.
    """
    # Each leg is compared from the end of the one before, because roundings add up as in any start that is not exact.
    count = 10000
    motion = dragged.solve(lam0=1, c="0.01")
    assert motion.t_end == math.inf
    motion.lam(10000.0)
    assert [leg.end for leg in motion.legs] == ["turn"]  # whatever was asked before
    turns = dragged.solve(lam0=1, c="0.01", t_max=10000).turning_points
    with mp.workdps(25):
        k, worst = mpf("0.02"), mpf(0)
        for before, turn in list(pairwise(turns[: count + 1]))[::7]:
            # On a leg from -a to b, e^(k th) (k sin th - cos th) is the same at both ends.
            amplitude = abs(mpf(before))
            start = mp.exp(-k * amplitude) * (-k * mp.sin(amplitude) - mp.cos(amplitude))
            b = abs(mpf(turn))
            for _ in range(3):
                miss = mp.exp(k * b) * (k * mp.sin(b) - mp.cos(b)) - start
                b -= miss / (mp.exp(k * b) * (1 + k * k) * mp.sin(b))
            worst = max(worst, abs(abs(turn) - b) / b)
    assert len(turns) > 9900
    assert worst <= 1e-13
    assert all(np.diff(np.abs(turns)) < 0.0)


def test_laps_then_libration_then_rest(rubbed: ModuleType) -> None:
    """A fast body makes laps of a circle with friction until it no longer reaches the top; lam keeps counting, and V**2
    agrees with an integration.
    """
    motion = rubbed.solve(lam0=0, v0=30, mu="0.1")
    assert motion.legs[-1].end == "rest"
    turns = motion.turning_points
    assert turns[0] > 4.0 * math.pi
    last = motion.legs[-1].lam_end
    assert abs(last - 2.0 * math.pi * round(last / (2.0 * math.pi))) <= math.atan(0.1)
    # While N > 0, W' = -2 g sin - 2 mu (W + g cos) has an elementary solution.
    with mp.workdps(30):
        mu, g, place = mpf("0.1"), mpf("9.81"), mpf(12)
        k = 2 * mu
        part = lambda a: 2 * g * ((1 - 2 * mu**2) * mp.cos(a) - 3 * mu * mp.sin(a)) / (1 + k**2)  # noqa: E731
        w = part(place) + (900 - part(mpf(0))) * mp.exp(-k * place)
    state = motion.state(motion.time_at(12))
    assert state.lam == pytest.approx(12.0, rel=1e-15)
    assert state.v2 == pytest.approx(float(w), rel=FEW)
    assert state.s == pytest.approx(12.0, rel=FEW)
    assert state.x == pytest.approx(math.sin(12.0), abs=FEW)


def test_rest_and_release(rubbed: ModuleType) -> None:
    """A body stays on a slope that friction holds it on; on a steeper one it moves downhill, whatever direction was
    requested.
    """
    held = rubbed.solve(lam0="0.0996", mu="0.1")
    assert held.kind == "rest"
    assert [event.kind for event in held.events] == ["rest"]
    assert held.state(5.0).lam == 0.0996
    for start, way in (("0.5", -1), ("-0.5", 1)):
        motion = rubbed.solve(lam0=start, direction=-way, mu="0.1")
        assert motion.direction == way
        assert [leg.end for leg in motion.legs] == ["turn", "rest"]
        assert motion.turning_points[0] == float(start)
        with pytest.raises(gqm.GQMError, match="rest"):
            motion.lam(math.nextafter(motion.t_end, math.inf))


@pytest.mark.parametrize(("contact", "v0", "at_once"), [("above", 6, False), ("below", 6, True), ("above", 20, None)])
def test_contact_from_one_side(contact: str, v0: int, at_once: bool | None, rubbed: ModuleType) -> None:
    """A body inside a loop leaves it where N vanishes: at once if the track would have to pull, and never if it is
    fast.
    """
    motion = rubbed.solve(lam0=0, v0=v0, mu="0.05", contact=contact, t_max=0.6)
    if at_once is None:
        assert motion.legs[-1].end == "horizon"
        return
    assert motion.events[-1].kind == motion.legs[-1].end == "liftoff"
    assert motion.t_end == motion.events[-1].t
    assert (motion.t_end == 0.0) is at_once
    if not at_once:
        free = rubbed.solve(lam0=0, v0=v0, mu="0.05", t_max=0.6)
        lost, changed = motion.events[-1], free.events[0]
        assert changed.kind == "contact-sign"
        assert (lost.t, lost.lam) == pytest.approx((changed.t, changed.lam), rel=1e-15)
        assert abs(motion.state(motion.t_end).normal_force) <= 1e-12


def test_contact_sign_ends_no_leg_without_friction(dragged: ModuleType) -> None:
    """With drag alone a change of the sign of N is an event, but does not end a leg."""
    motion = dragged.solve(lam0=0, v0=6, c="0.1", t_max=1)
    assert [event.kind for event in motion.events] == ["contact-sign", "turn", "contact-sign", "horizon"]
    assert [leg.end for leg in motion.legs] == ["turn", "horizon"]
    assert abs(motion.state(motion.events[0].t).normal_force) <= 1e-12


def test_launch_where_the_contact_force_vanishes(build: Build) -> None:
    """If N is 0 at launch, the contact sign is that of N afterwards, the same on both sides of exactly zero."""
    module = build("cubic_rubbed", gqm.Curve.graph("x**3", parameter="x"), gqm.CoulombFriction(mu="mu"))
    speed = math.sqrt(G * (1.0 + 9e-4) / 0.6)  # kappa V**2 + g dx/ds = 0 at x = -0.1
    places = [
        module.solve(lam0="-0.1", v0=speed * (1.0 + shift), direction=way, mu="0.1", t_max=0.2).lam(0.2)
        for way in (1, -1)
        for shift in (0.0, 1e-13, -1e-13)
    ]
    assert places[1:3] == pytest.approx([places[0]] * 2, rel=1e-12)
    assert places[4:] == pytest.approx([places[3]] * 2, rel=1e-12)


def test_approach_to_the_top(dragged: ModuleType) -> None:
    """A body with exactly the speed that leads to rest at the top never reaches it; its times on the way agree with an
    integration.
    """
    with mp.workdps(40):
        k, g = mpf("0.2"), mpf("9.81")
        f = lambda a: mp.exp(k * a) * (k * mp.sin(a) - mp.cos(a))  # noqa: E731
        v0 = mp.sqrt(2 * g / (1 + k**2) * (f(mp.pi) - f(0)))
        motion = dragged.solve(lam0=0, v0=float(v0), c="0.1")
        w = lambda a: (v0**2 - 2 * g / (1 + k**2) * (f(a) - f(0))) / mp.exp(k * a)  # noqa: E731
        time = mp.quad(lambda a: 1 / mp.sqrt(w(a)), [0, 1, 2, 2.5, 3])
    assert [leg.end for leg in motion.legs] == ["asymptote"]
    assert motion.legs[0].lam_end == pytest.approx(math.pi, abs=4e-15)
    assert motion.time_at(3) == pytest.approx(float(time), rel=FEW)
    assert motion.lam(100.0) == pytest.approx(math.pi, abs=4e-15)
    assert motion.t_end == math.inf


def test_drag_on_straight_tracks(build: Build) -> None:
    """On a level track V falls as 1/(1 + c v0 t) without end; on a slope it tends to the terminal speed."""
    level = build("level_dragged", gqm.Curve.graph("0*x", parameter="x"), gqm.QuadraticDrag(b="c"))
    motion, t = level.solve(lam0=0, v0=3, c="0.1"), np.array([0.1, 1.0, 10.0, 1000.0])
    assert motion.lam(t) == pytest.approx(10.0 * np.log1p(0.3 * t), rel=FEW)
    assert motion.state(t).v == pytest.approx(3.0 / (1.0 + 0.3 * t), rel=FEW)
    assert motion.time_at(20) == pytest.approx(math.expm1(2.0) / 0.3, rel=FEW)
    # A run over many powers of ten of V**2 had a table with errors as large as its width.
    late = np.logspace(-1, 6, 8)
    assert np.all(motion.error_bound(late) <= 1e-14 * (10.0 + motion.lam(late)))
    slope = build("slope_dragged", gqm.Curve.graph("-x/2", parameter="x"), gqm.QuadraticDrag(b="c"))
    motion = slope.solve(lam0=0, c="0.1")
    pull = G / math.sqrt(5.0)
    rate = math.sqrt(0.1 * pull)
    assert motion.lam(t) == pytest.approx(np.log(np.cosh(rate * t)) / 0.1 * 2.0 / math.sqrt(5.0), rel=FEW)


def test_slow_launch_keeps_its_digits(build: Build) -> None:
    """On a straight slope with friction the time is elementary, and a slow launch keeps its digits."""
    module = build("slope_rubbed", gqm.Curve.graph("-x", parameter="x"), gqm.CoulombFriction(mu="mu"))
    pull = G * 0.75 / math.sqrt(2.0)
    for v0 in (1.0, 1e-3, 1e-5, 1e-7):
        motion = module.solve(lam0=0, v0=v0, mu="0.25")
        length = np.array([1e-6, 1e-3, 1.0, 3.0]) * math.sqrt(2.0)
        exact = 2.0 * length / (v0 + np.sqrt(v0**2 + 2.0 * pull * length))
        got = [motion.time_at(float(x)) for x in length / math.sqrt(2.0)]
        assert got == pytest.approx(exact, rel=FEW, abs=1e-16)


@pytest.mark.parametrize("v0", ["1e-3", "1e-7", "1e-9", "1e-12"])
def test_slow_launch_on_a_bend_keeps_its_digits(v0: str, rubbed: ModuleType) -> None:
    """On a circle with friction W is elementary; times integrated with 30 digits show that no launch is too slow."""
    motion = rubbed.solve(lam0=1, v0=v0, direction=-1, mu="0.1")
    with mp.workdps(30):
        k, g, start = mpf("0.2"), mpf("9.81"), mpf(v0) ** 2
        # While N > 0: W' = -2 g sin + k (W + g cos).
        a = g * (2 - k**2) / (1 + k**2)
        part = lambda x: a * mp.cos(x) + k * (g + a) * mp.sin(x)  # noqa: E731
        rest = (start - part(1)) * mp.exp(-k)
        w = lambda x: part(x) + rest * mp.exp(k * x)  # noqa: E731
        behind = mp.sqrt(start / (2 * g * mp.sin(1) - k * (start + g * mp.cos(1))))
        for place in (0.999, 0.9, 0.25):
            # With 1 - x = y (y + 2 behind) the integrand is smooth.
            stop = mp.sqrt(behind**2 + (1 - mpf(place))) - behind
            pace = lambda y: 2 * (y + behind) / mp.sqrt(w(1 - y * (y + 2 * behind)))  # noqa: E731
            assert motion.time_at(place) == pytest.approx(float(mp.quad(pace, [0, stop])), rel=FEW)


def test_droplet_over_kinks(build: Build) -> None:
    """The droplet's resistance has a kink at each inflection, and its work is c_d times the turning angle."""
    module = build(
        "well_droplet", gqm.Curve.graph("x**4/4 - x**2/2", parameter="x"), gqm.SurfaceTension(gamma="0.3", ell_c=1)
    )
    motion = module.solve(lam0="1.7", t_max=3)
    bend = 1.0 / math.sqrt(3.0)
    slope = lambda x: math.atan(x**3 - x)  # noqa: E731

    def turned(x: float) -> float:
        """Return the turning angle from 1.7 to x, of which every part counts as positive."""
        marks = [1.7, *(m for m in (bend, -bend) if m > x), x]
        return sum(abs(slope(b) - slope(a)) for a, b in pairwise(marks))

    height = lambda x: x**4 / 4.0 - x**2 / 2.0  # noqa: E731
    places = np.array([1.2, 0.5, 0.0, -0.6, -1.2, -1.6])
    times = np.array([motion.time_at(float(x)) for x in places])
    w = [2.0 * G * (height(1.7) - height(x)) - 0.6 * turned(x) for x in places]
    assert motion.state(times).v2 == pytest.approx(w, rel=FEW, abs=FEW * max(w))
    assert [event.kind for event in motion.events].count("contact-sign") == 2


def test_the_first_leg_of_example_2_to_its_last_digits() -> None:
    """The places and times of the change of contact and of the turn agree with the table's forty digits to a unit or
    two.
    """
    from generated import cubic_coulomb

    first = [event for event in CASES["example2_cubic_coulomb"]["expected"]["events"] if event["leg"] == 1]
    found = cubic_coulomb.solve("-1", "6.2088").events[:2]
    assert [event.kind for event in found] == [KINDS[event["kind"]] for event in first]
    for event, known in zip(found, first, strict=True):
        assert event.lam == pytest.approx(float(known["lam"]), rel=0.0, abs=2e-16)
        assert event.t == pytest.approx(float(known["t"]), rel=4e-16, abs=0.0)


RATES = {
    "squared": ("-direction*k*W**2", lambda v: -0.05 * v * abs(v) ** 3, "0.05"),
    "viscous": ("-direction*k*sqrt(W)", lambda v: -0.3 * v, "0.3"),
}


@pytest.mark.parametrize("law", RATES)
def test_laws_of_the_user(law: str, build: Build) -> None:
    """Laws that are not linear in V**2, and one that goes like V, agree with an integration in time."""
    text, rate, k = RATES[law]
    curve = gqm.Curve.graph("x**2/2", parameter="x")
    module = build(f"parabola_{law}", curve, gqm.Kernel.law(text, parameters={"k": k}))
    motion, t = module.solve(lam0=1, t_max=4), np.linspace(0.0, 4.0, 41)

    def pull(_: float, y: np.ndarray) -> list[float]:
        ds = math.hypot(1.0, y[0])
        return [y[1] / ds, -G * y[0] / ds + rate(y[1])]

    truth = solve_ivp(pull, (0.0, 4.0), [1.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-13, t_eval=t, max_step=0.01).y
    assert np.abs(motion.lam(t) - truth[0]).max() <= 1e-12
    assert len(motion.turning_points) >= 4


def test_a_viscous_law_on_the_level(build: Build) -> None:
    """The body slows down for ever, and approaches a place at the distance v0/c from the launch (it was refused at any
    speed).
    """
    law = gqm.Kernel.law("-direction*c*sqrt(W)", parameters={"c": "1"})
    module = build("level_viscous", gqm.Curve.graph("0*x", parameter="x"), law)
    for lam0, v0, c in ((1.0, 0.5, 0.3), (-2.0, 1e-7, 1.9), (0.0, 3.0, 40.0)):
        motion, t = module.solve(lam0, v0, c=c), np.array([0.01, 1.0, 10.0, 100.0, 1e5])
        assert motion.t_end == math.inf
        assert motion.legs[-1].end == "asymptote"
        with mp.workdps(40):
            true = [mpf(lam0) - mpf(v0) / mpf(c) * mp.expm1(-mpf(c) * mpf(one)) for one in t.tolist()]
            off = [float(abs(mpf(place) - one)) for place, one in zip(motion.lam(t).tolist(), true, strict=True)]
        assert np.all(off <= motion.error_bound(t))
        assert np.all(motion.error_bound(t) <= 1e-12 * max(1.0, abs(lam0) + v0 / c))


@pytest.mark.extended
@pytest.mark.parametrize("loss", ["friction", "drag"])
def test_every_body_that_comes_to_a_cusp_ends_there(loss: str, build: Build) -> None:
    """Every body ends at a cusp, with losses too (one in ten went through if the nodes of its panels did not show the
    cusp).
    """
    curve = gqm.Curve.parametric(x="u**3", z="-u**2/2", parameter="u")
    force = gqm.CoulombFriction(mu="1/10") if loss == "friction" else gqm.QuadraticDrag(b="1/10")
    module, draw = build(f"semicubical_{loss}", curve, force), random.Random(2)
    assert module.solve("1/2", 6, -1, t_max=5).legs[-1].end == "cusp"
    for _ in range(150):
        side, start, v0 = draw.choice((1, -1)), draw.uniform(0.2, 1.5), draw.uniform(3.0, 12.0)
        legs = module.solve(side * start, v0, -side, t_max=1).legs
        assert all(side * leg.lam_end > -1e-13 for leg in legs)
        assert legs[-1].end == "cusp" or legs[0].end in ("turn", "horizon")
        assert legs[-1].end != "cusp" or abs(legs[-1].lam_end) <= 1e-13


CUSPED = {
    "deltoid": ("2*cos(u) + cos(2*u)", "2*sin(u) - sin(2*u)", math.tau / 3.0, 0.0),
    "turns back on itself": ("sin(3*u)", "cos(2*u)", math.pi, 0.5 * math.pi),
}
LOSSES = {
    "friction": gqm.CoulombFriction(mu="1/100"),
    "drag": gqm.QuadraticDrag(b="1/100"),
    "droplet": gqm.SurfaceTension(gamma="1/1000", ell_c="3/1000"),
}


@pytest.mark.extended
@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("name", CUSPED)
def test_cusps_at_places_that_are_not_zero(name: str, loss: str, build: Build) -> None:
    """The body ends at the cusp itself (it was up to 5e-8 from it, or was refused; droplets went on)."""
    x, z, apart, first = CUSPED[name]
    curve = gqm.Curve.parametric(x=x, z=z, parameter="u", period="2*pi")
    module = build(f"cusped_{name.split()[0]}_{loss}", curve, LOSSES[loss])
    draw = random.Random(7)
    for _ in range(10):
        u, heading = draw.uniform(-7.0, 7.0), draw.choice((1, -1))
        motion = module.solve(u, 10.0, heading)
        count = math.floor((u - first) / apart) + (heading > 0)
        end = motion.legs[-1]
        assert end.end == "cusp"
        assert abs(end.lam_end - (first + count * apart)) <= 2e-15
        assert module.sweep("t_end", u, 10.0, heading).values == pytest.approx(motion.t_end, rel=1e-14)


def test_ends_at_a_cusp(build: Build) -> None:
    """After an arch of a cycloid the body ends at its cusp, with the V**2 that friction left of the height."""
    module = build("arch_rubbed", gqm.families.cycloid(), gqm.CoulombFriction(mu="mu"))
    motion = module.solve(lam0="pi", v0=1, mu="0.1", R=1)
    assert [leg.end for leg in motion.legs] == ["contact-sign", "cusp"]
    assert motion.legs[-1].lam_end == pytest.approx(2.0 * math.pi, rel=1e-15)
    assert motion.state(motion.t_end).z == pytest.approx(0.0, abs=1e-14)


def test_pass1_is_the_launch_leg(rubbed: ModuleType, dragged: ModuleType) -> None:
    """pass1 gives V**2 on the launch leg up to its first turn, through changes of contact sign, and NaN elsewhere."""
    lam = np.array([-0.5, 0.0, 0.5, 1.5, 1.9, 2.5])
    rows = rubbed.pass1(lam, lam0=0, v0=6.3, mu="0.1")
    assert np.isnan(rows.v2).tolist() == [True, False, False, False, False, True]
    motion = rubbed.solve(lam0=0, v0=6.3, mu="0.1")
    passed = motion.state(np.array([motion.time_at(float(a)) for a in lam[2:5]]))
    assert rows.v2[1] == pytest.approx(6.3**2, rel=1e-15)
    assert rows.v2[2:5] == pytest.approx(passed.v2, rel=FEW)
    assert rows.normal_force[2:5] == pytest.approx(passed.normal_force, rel=FEW, abs=FEW)
    k = 0.2
    f = lambda a: math.exp(k * a) * (k * math.sin(a) - math.cos(a))  # noqa: E731
    w = (400.0 - 2.0 * G / (1.0 + k * k) * (f(9.0) - f(0.0))) * math.exp(-9.0 * k)
    assert dragged.pass1(9.0, lam0=0, v0=20, c="0.1").v2 == pytest.approx(w, rel=FEW)


def test_questions_without_an_answer(rubbed: ModuleType, dragged: ModuleType) -> None:
    """Places that are never reached, times after the rest and times before the launch are refused with the reason."""
    for module, given in ((rubbed, {"mu": "0.1"}), (dragged, {"c": "0.1"})):
        motion = module.solve(lam0=1, **given)
        with pytest.raises(gqm.GQMError, match="never at"):
            motion.time_at("1.5")
        with pytest.raises(gqm.GQMError, match="negative"):
            motion.lam(-0.1)
        with pytest.raises(gqm.GQMError, match="period"):
            _ = motion.period


def test_a_motion_of_too_many_legs(dragged: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """A motion of so many legs that memory would not suffice says how far it got, and keeps its earlier answers."""
    monkeypatch.setattr(driver, "MAX_STORED", 40)
    motion = dragged.solve(0.3, c="1e-6")
    early = motion.lam(5.0)
    words = r"^motion: 4\d pieces of legs reach t = \d+\.\d+ only; give a shorter t_max, or ask for earlier times"
    with pytest.raises(BudgetError, match=words):
        motion.lam(1e9)
    assert motion.lam(5.0) == early
