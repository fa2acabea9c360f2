"""Sweeps of motions with losses agree with closed forms and with `solve`, and have the same bits on any number of
cores.
"""

import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

import gqm_sym as gqm
from gqm_sym.errors import GQMError, SolutionError
from gqm_sym.runtime.compiled import threads
from gqm_sym.runtime.sweep import quantities

G = 9.81
# The relative tolerance of elementary closed forms.
FEW = 1e-14
# A sweep reads the same panels as a solved motion, which converts them to other polynomials.
ROUNDING = 4e-14

Build = Callable[..., ModuleType]
EXTREMES = ("v_min", "v_max", "normal_force_min", "normal_force_max")
HELD = ("t_end", "rest_position", "v_max", "normal_force_max")


def ring() -> Any:
    """Return a full circle, with its angle from the bottom."""
    return gqm.Curve.parametric(x="sin(th)", z="-cos(th)", parameter="th", period="2*pi")


def surveyed(wave: float = 0.02) -> Any:
    """Return a valley of sixty points, where the curve is not smooth; with a wave above 0.05 it bends both ways."""
    x = np.linspace(-1.5, 1.6, 60)
    return gqm.Curve.sampled(np.column_stack([x, 0.4 * x * x + wave * np.cos(4.0 * x)]))


def test_a_spring_with_friction(generated_folder: Path) -> None:
    """On a level line the body swings about +-mu m g/k, and each swing is 2 mu m g/k shorter on its side.

    Half a swing takes pi sqrt(m/k); the body rests at the first turn within mu m g/k of the middle.
    """
    force = gqm.Gravity() + gqm.Potential("k*x**2/2") + gqm.CoulombFriction()
    module = gqm.build(gqm.derive(gqm.Curve.graph("0*x"), force), name="swept_spring", folder=generated_folder)
    k, mu = 40.0, 0.02
    starts = np.random.default_rng(1).uniform(0.05, 1.0, 50) * np.where(np.arange(50) % 2, 1.0, -1.0)
    offset, half = mu * G / k, math.pi / math.sqrt(k)
    turns = np.ceil((np.abs(starts) - offset) / (2.0 * offset)).astype(int)
    given: dict[str, Any] = {"k": k, "mu": mu}
    ends = module.sweep("t_end", starts, **given)
    assert ends.route_counts() == {"single": 50}
    assert ends.values == pytest.approx(turns * half, rel=FEW)
    rest = np.sign(starts) * (-1.0) ** turns * (np.abs(starts) - 2.0 * offset * turns)
    assert module.sweep("rest_position", starts, **given).values == pytest.approx(rest, rel=0.0, abs=1e-14)
    motion = module.solve(starts[0], **given)
    assert motion.rest_position == pytest.approx(rest[0], rel=0.0, abs=1e-14)
    assert motion.rest_position == motion.legs[-1].lam_end
    with pytest.raises(SolutionError, match=r"rest_position: .*it ends with 'horizon'"):
        module.solve(starts[0], t_max=0.1, **given).rest_position  # noqa: B018
    fastest = math.sqrt(k) * (np.abs(starts) - offset)
    assert module.sweep("v_max", starts, **given).values == pytest.approx(fastest, rel=FEW)
    assert (module.sweep("v_min", starts, **given).values == 0.0).all()
    for quantity in ("normal_force_min", "normal_force_max"):
        assert module.sweep(quantity, starts, m=2, **given | {"k": 2 * k}).values == pytest.approx(2 * G, rel=FEW)
    for quantity in ("half_period", "period", "turning_points"):  # each launch was solved to say that there is none
        without = module.sweep(quantity, [*starts, math.nan], **given)
        assert without.route_counts() == {"single": 50, "solve": 1}
        assert np.isnan(without.values).all()
        assert without.status.tolist() == [quantities.NOT_PERIODIC] * 50 + [quantities.REFUSED]
    # Friction holds a body at the middle, on whichever side of the line it is; from above the line supports it.
    for contact, sense in (("above", 1.0), ("below", math.nan)):
        held = {what: module.sweep(what, [0.0], t_max=2.0, contact=contact, **given) for what in HELD}
        assert all(one.route_counts() == {"single": 1} for one in held.values())
        expected = [2.0 if contact == "above" else 0.0, sense * 0.0, 0.0, G]
        assert [one.values[0] for one in held.values()] == pytest.approx(expected, rel=FEW, nan_ok=True)
    # The body passes the middle after slightly more than a quarter of a swing.
    first = np.arccos(-np.sign(1.0) * offset / (np.abs(starts) - offset)) / math.sqrt(k)
    assert module.sweep("time_at", starts, lam=0.0, **given).values == pytest.approx(first, rel=FEW)
    beyond = module.sweep("time_at", starts, lam=2.0, **given)
    assert (beyond.status == quantities.NEVER_THERE).all()


def test_drag_on_a_ring_to_a_horizon(build: Build) -> None:
    """On the way down W' = -2 g sin - 2 c W is linear, and N = W + g cos is largest where its derivative vanishes."""
    module = build("swept_ring", ring(), gqm.QuadraticDrag(b="c"))
    c, start = 0.3, 2.0
    with mp.workdps(30):
        k, g = 2 * mpf(c), mpf("9.81")

        def wave(a: mpf) -> mpf:  # W on a leg in the direction of falling angles, as a function of -angle
            return 2 * g / (1 + k * k) * (mp.cos(a) - k * mp.sin(a))

        def w(a: mpf) -> mpf:
            return wave(a) - wave(mpf(-start)) * mp.exp(-k * (a + start))

        fastest = mp.findroot(lambda a: mp.diff(w, a), -0.2)
        heaviest = mp.findroot(lambda a: mp.diff(w, a) - g * mp.sin(a), -0.1)
        expected = mp.sqrt(w(fastest)), w(heaviest) + g * mp.cos(heaviest), g * mp.cos(start)
    for quantity, value in zip(("v_max", "normal_force_max", "normal_force_min"), expected, strict=True):
        swept = module.sweep(quantity, [start, -start], c=c, t_max=30.0)
        assert swept.values == pytest.approx([float(value)] * 2, rel=FEW)
    assert module.sweep("t_end", [start], c=c, t_max=30.0).values == 30.0
    assert module.sweep("t_end", [start], c=c).status == quantities.NOT_PERIODIC


@pytest.mark.extended
@pytest.mark.parametrize("roll", [None, "u/5"])
@pytest.mark.parametrize("loss", ["mu", "b", "c"])
@pytest.mark.parametrize("quantity", ["normal_force_max", "normal_force_min"])
def test_the_contact_force_with_losses_in_a_rotating_frame(
    quantity: str, loss: str, roll: str | None, build: Build
) -> None:
    """On a space curve N contains the Coriolis force, so it is not linear in V**2 and depends on the direction of
    motion. Newton's equations in the rotating frame are integrated beside, up to before the first turn.

    The law contains N with friction only, and with a roll its rows hold N along the upward direction of riders.
    """
    curve = gqm.Curve.space(x="u", y="u**2/3", z="u**2/2 + sin(2*u)/10", parameter="u", roll=roll)
    forces = {"mu": gqm.CoulombFriction(mu="0.2"), "b": gqm.QuadraticDrag(b="0.2"), "c": gqm.LinearDrag(c="0.2")}
    name = f"{loss}_in_a_rotating_frame{'_rolled' if roll else ''}"
    module = build(name, curve, gqm.RotatingFrame(Omega="0.5") + forces[loss])
    starts, end, axis = np.array([-1.2, -0.7, 0.9]), 0.9, np.array([0.0, 0.0, 0.5])
    swept = module.sweep(quantity, starts, t_max=end)
    assert swept.route_counts() == {"single": 3}

    def contact(u: float, rate: float) -> tuple[float, float]:
        """Return u'' without friction, and N/m."""
        place = np.array([u, u * u / 3, 0.5 * u * u + 0.1 * math.sin(2 * u)])
        first = np.array([1.0, 2 * u / 3, u + 0.2 * math.cos(2 * u)])
        second = np.array([0.0, 2 / 3, 1.0 - 0.4 * math.sin(2 * u)])
        spin = np.cross(axis, np.cross(axis, place)) + 2 * np.cross(axis, rate * first)
        pull = np.array([0.0, 0.0, -G]) - spin - rate * rate * second
        along = float(pull @ first) / float(first @ first)
        return along, float(np.linalg.norm(pull - along * first))

    def moving(_: float, state: Any, way: float) -> list[float]:
        u, rate = state
        along, load = contact(u, rate)
        metric = math.hypot(1.0, 2 * u / 3, u + 0.2 * math.cos(2 * u))
        slowed = {"mu": load, "b": (metric * rate) ** 2, "c": metric * abs(rate)}[loss]
        return [rate, along - way * 0.2 * slowed / metric]

    sign, times = 1.0 if quantity.endswith("max") else -1.0, np.linspace(0.0, end, 400)
    for start, value in zip(starts.tolist(), swept.values.tolist(), strict=True):
        given: dict[str, Any] = {"rtol": 1e-13, "atol": 1e-15, "args": (-math.copysign(1.0, start),)}
        along = solve_ivp(moving, (0.0, end), [start, 0.0], "DOP853", dense_output=True, **given).sol
        loads = [sign * contact(*along(t))[1] for t in times]
        top = int(np.argmax(loads))
        found = minimize_scalar(
            lambda t, along=along: -sign * contact(*along(t))[1],
            bounds=(times[max(top - 1, 0)], times[min(top + 1, 399)]),
            method="bounded",
            options={"xatol": 1e-10},
        )
        assert value == pytest.approx(sign * max(*loads, -float(found.fun)), rel=1e-11)


@pytest.mark.extended
@pytest.mark.parametrize("lean", ["0", "0.6"])
def test_extremes_of_swings_that_die_away(lean: str, build: Build) -> None:
    """On a ring that leans, the extremes of a swing with quadratic drag that goes on for ever are those of its first
    way down. Compiled code finds them, and `solve` too.

    With the angle from the bottom, W' = -2 g cos(lean) sin(th) + 2 c W on that way, and the contact force has the parts
    W + g cos(lean) cos(th) and g sin(lean).
    """
    curve = gqm.Curve.space(
        x="sin(th)", y=f"-sin({lean})*cos(th)", z=f"-cos({lean})*cos(th)", parameter="th", period="2*pi"
    )
    module = build("leaning_ring" + lean[2:], curve, gqm.QuadraticDrag(b="c_d"))
    start, c = np.linspace(0.3, 2.0, 12), mpf("0.2")
    g, across = mpf(G) * mp.cos(mpf(lean)), mpf(G) * mp.sin(mpf(lean))
    most = []
    for begin in map(mpf, start.tolist()):

        def w(th: Any, begin: Any = begin) -> Any:
            one, other = (2 * g * (mp.cos(x) + 2 * c * mp.sin(x)) / (1 + 4 * c * c) for x in (th, begin))
            return one - other * mp.exp(2 * c * (th - begin))

        place = mp.findroot(lambda th, w=w: mp.diff(w, th) - g * mp.sin(th), 0.1)
        most.append(float(mp.hypot(w(place) + g * mp.cos(place), across)))
    swept = [module.sweep(f"normal_force_{name}", start, c_d=0.2) for name in ("max", "min")]
    assert all(found.route_counts() == {"single": 12} for found in swept)
    assert swept[0].values == pytest.approx(most, rel=FEW)
    motion = module.solve(start[5], c_d=0.2)
    solved = motion.normal_force_max.value, motion.normal_force_min.value
    assert solved == pytest.approx([found.values[5] for found in swept], rel=FEW)


CASES = {
    "friction": (ring, gqm.CoulombFriction, {"mu": 0.15}),
    "drag": (ring, lambda: gqm.QuadraticDrag(b="c"), {"c": 0.2}),
    "droplet": (lambda: surveyed(0.06), gqm.SurfaceTension, {"gamma": 0.05, "ell_c": 0.1}),
    "law": (lambda: gqm.families.parabola(a=1), lambda: gqm.Kernel.law(A="-direction*r/(1 + W/2)"), {"r": 0.8}),
    "rail": (
        lambda: gqm.Curve.piecewise([gqm.line(length=2), gqm.arc(radius=1, angle="pi/2")], start=(-2, 0)),
        gqm.CoulombFriction,
        {"mu": 0.15},
    ),
    "track": (surveyed, lambda: gqm.CoulombFriction() + gqm.QuadraticDrag(b="c"), {"mu": 0.05, "c": 0.1}),
    "planes": (
        lambda: gqm.Curve.sampled([(0, 3), (1, 0), (2, 1), (3, 0.5), (5, -0.25), (6, 4)], kind="linear"),
        lambda: gqm.CoulombFriction() + gqm.QuadraticDrag(b="c"),
        {"mu": 0.15, "c": 0.1},
    ),
    "closed": (
        lambda: gqm.Curve.implicit("x**2 + 2*z**2 - 1", start=(0, "-sqrt(2)/2")),
        gqm.CoulombFriction,
        {"mu": 0.15},
    ),
}


def of_solved(quantity: str, motion: Any, target: float) -> float:
    """Return the quantity of a solved motion; NaN if there is none."""
    try:
        return float(quantities.QUANTITIES[quantity].of_motion(motion, target))
    except SolutionError:
        return math.nan


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("contact", ["bilateral", "above", "below"])
def test_as_each_launch_is_solved(name: str, contact: str, build: Build) -> None:
    """All quantities agree with `solve`, to a horizon and without one; launches without a value have none or are
    refused there too.
    """
    curve, force, given = CASES[name]
    module = build(f"swept_{name}", curve(), force())
    rng = np.random.default_rng(len(name))
    starts, speeds = rng.uniform(0.2, 1.6, 3), np.where(rng.random(3) < 0.5, 0.0, rng.uniform(0.0, 5.0, 3))
    for quantity in ("t_end", "rest_position", "time_at", *EXTREMES):
        # A droplet may turn thousands of times before it rests.
        for horizon in (None, 2.5) if quantity not in EXTREMES and name != "droplet" else (1.5,):
            arguments = {**given, "t_max": horizon, "contact": contact}
            asked = {"lam": 0.9} if quantity == "time_at" else {}
            swept = module.sweep(quantity, starts, speeds, 1, **arguments, **asked)
            for start, speed, value, status in zip(starts, speeds, swept.values, swept.status, strict=True):
                try:
                    motion = module.solve(start, speed, 1, **arguments)
                except GQMError:
                    assert status == quantities.REFUSED
                    continue
                expected = of_solved(quantity, motion, 0.9)
                assert value == pytest.approx(expected, rel=ROUNDING, abs=ROUNDING, nan_ok=True)
                assert (status == quantities.ANSWERED) == (not math.isnan(expected))


@pytest.mark.extended
def test_the_contact_force_of_a_damped_body_at_a_cusp(build: Build) -> None:
    """The contact force grows without bound towards a cusp; sweeps gave its value at the last node before it."""
    cycloid = gqm.Curve.parametric(x="u - sin(u)", z="1 - cos(u)", parameter="u", domain=(0, "2*pi"))
    module = build("swept_cusp", cycloid, gqm.QuadraticDrag(b="0.05"))
    starts = [0.75, 1.12, 3.0]
    for quantity in ("normal_force_min", "normal_force_max"):
        swept = module.sweep(quantity, starts, 0.0, -1, t_max=5.0).values
        expected = [float(getattr(module.solve(start, 0.0, -1, t_max=5.0), quantity).value) for start in starts]
        assert swept == pytest.approx(expected, rel=1e-13)
        assert np.isinf(swept).any() == (quantity == "normal_force_min")


def test_the_same_bits_on_any_number_of_cores(build: Build, monkeypatch: pytest.MonkeyPatch) -> None:
    """A launch is answered independently of the others, with its own parameters."""
    module = build("swept_friction", ring(), gqm.CoulombFriction())
    starts = np.linspace(-2.0, 2.0, 300)
    mu = np.linspace(0.05, 0.3, 300)
    whole = {q: module.sweep(q, starts, 1.0, mu=mu, t_max=5.0).values for q in ("t_end", "normal_force_max")}
    monkeypatch.setattr(threads, "cores", lambda: 3)
    for quantity, values in whole.items():
        assert np.array_equal(module.sweep(quantity, starts, 1.0, mu=mu, t_max=5.0).values, values)
        some = module.sweep(quantity, starts[7:9], 1.0, mu=mu[7:9], t_max=5.0).values
        assert np.array_equal(some, values[7:9])


@pytest.mark.parametrize(("name", "speed"), [("track", 0.5), ("closed", 6.0)])
@pytest.mark.parametrize("quantity", ["t_end", "rest_position", "normal_force_max"])
def test_what_is_kept_of_a_track_is_that_of_any_launch(quantity: str, name: str, speed: float, build: Build) -> None:
    """Between breaks the same data are kept of the curve, whichever launch comes first, for the parameters of that
    launch.

    On the closed curve bodies run round more than once, so that they pass the same part on several laps.
    """
    module, given = build(f"swept_{name}", *(make() for make in CASES[name][:2])), CASES[name][2]
    starts = np.linspace(0.1, 3.2, 60)
    values = module.sweep(quantity, starts, speed, t_max=20.0, **given).values
    assert np.array_equal(module.sweep(quantity, starts[::-1], speed, t_max=20.0, **given).values[::-1], values)
    for k in (0, 17, 59):
        assert module.sweep(quantity, [starts[k]], speed, t_max=20.0, **given).values == values[k : k + 1]
    # Launches with the same parameters share what is kept, also if launches with others lie between them.
    frictions, some = np.array([0.05, 0.02, 0.3, 0.05]), starts[[3, 3, 3, 40]]
    swept = module.sweep(quantity, some, speed, t_max=20.0, **given | {"mu": frictions}).values
    each = [(some[k], given | {"mu": frictions[k : k + 1]}) for k in range(4)]
    alone = [module.sweep(quantity, start, speed, t_max=20.0, **one).values[0] for start, one in each]
    assert np.array_equal(swept, alone, equal_nan=True)
    # Blocks of gaps are kept only for a number that all launches have in common, so that sums are rounded otherwise.
    each = zip(some, frictions, strict=True)
    common = [module.sweep(quantity, start, speed, t_max=20.0, **given | {"mu": mu}).values for start, mu in each]
    np.testing.assert_allclose(swept, common, rtol=FEW)


@pytest.mark.parametrize(("name", "speed"), [("track", 0.5), ("closed", 6.0)])
def test_one_launch_is_passed_as_many_are(name: str, speed: float, build: Build) -> None:
    """`solve` rests at the time and place of a sweep, its places agree with its legs, and its legs do not depend on
    them.
    """
    module, given = build(f"swept_{name}", *(make() for make in CASES[name][:2])), CASES[name][2]
    starts = np.linspace(0.1, 3.2, 8)
    swept = {q: module.sweep(q, starts, speed, **given).values for q in ("t_end", "rest_position")}
    for start, end, place in zip(starts.tolist(), swept["t_end"], swept["rest_position"], strict=True):
        motion = module.solve(start, speed, 1, **given)
        legs = list(motion.legs)
        assert (motion.t_end, legs[-1].lam_end) == pytest.approx((end, place), rel=ROUNDING, abs=ROUNDING)
        for leg in legs:
            assert abs(motion.lam(leg.t_end) - leg.lam_end) <= motion.state(leg.t_end).error
        assert list(motion.legs) == legs
        cut, asked_first = (module.solve(start, speed, 1, t_max=0.6 * end, **given) for _ in range(2))
        asked_first.state(0.3 * end)
        assert list(cut.legs) == list(asked_first.legs)


@pytest.mark.parametrize("name", ["track", "rail"])
def test_arrivals_where_the_curve_is_not_smooth(name: str, build: Build) -> None:
    """A body passes the breaks between its launch and its first turn before that turn, one after the other.

    Segments and panels end there, and a phase angle may be larger by a rounding than the last one.
    """
    module = build(f"swept_{name}", *(make() for make in CASES[name][:2]))
    for start in np.linspace(2.2, 3.3, 23).tolist():
        motion = module.solve(start, 0.6, -1, **CASES[name][2])
        turn, breaks = motion.legs[0], motion.problem.functions.breaks
        passed = breaks[(turn.lam_end < breaks) & (breaks < start)][::-1]
        swept = module.sweep("time_at", start, 0.6, -1, lam=passed, **CASES[name][2])
        solved = np.array([motion.time_at(place) for place in passed.tolist()])
        assert swept.values == pytest.approx(solved, rel=ROUNDING)
        assert passed.size
        assert (np.diff(solved) > 0.0).all()
        for beside in (np.nextafter(passed, -math.inf), np.nextafter(passed, math.inf)):
            near = [motion.time_at(place) for place in beside.tolist()]
            assert near == pytest.approx(solved, rel=ROUNDING, abs=ROUNDING)
        assert solved[-1] < turn.t_end
        assert motion.lam(solved) == pytest.approx(passed, rel=0.0, abs=1e-13)


def test_arrivals_at_the_end_of_a_track(build: Build) -> None:
    """A body that runs off the track is at its end when the motion ends, however its times are rounded."""
    module = build("swept_track", *(make() for make in CASES["track"][:2]))
    end, speeds = module.solve(1.0, 9.0, 1, **CASES["track"][2]).legs[-1].lam_end, np.linspace(6.0, 9.0, 40)
    arrivals = module.sweep("time_at", 1.0, speeds, lam=end, **CASES["track"][2])
    ends = module.sweep("t_end", 1.0, speeds, **CASES["track"][2])
    assert (arrivals.status == quantities.ANSWERED).all()
    assert arrivals.values == pytest.approx(ends.values, rel=2.0**-52)


@pytest.mark.extended
def test_a_curve_for_each_parameter(build: Build) -> None:
    """Launches are grouped by the parameters of the chart; those without a curve are refused one by one."""
    rail = gqm.Curve.piecewise([gqm.line(length="a"), gqm.arc(radius=1, angle="pi/2")])
    module = build("swept_lengths", rail, gqm.CoulombFriction(mu="mu"))
    lengths = np.array([2.0, 3.0, 2.0, 3.0])
    swept = module.sweep("t_end", [0.5, 0.5, 1.5, 99.0], 4.0, mu=0.25, a=lengths)
    for start, length, value in zip((0.5, 0.5, 1.5), lengths, swept.values, strict=False):
        assert value == pytest.approx(module.solve(start, 4.0, mu=0.25, a=float(length)).t_end, rel=ROUNDING)
    assert swept.status.tolist() == [0, 0, 0, quantities.REFUSED]
    assert swept.route.tolist() == [quantities.SINGLE] * 3 + [quantities.SOLVE]
