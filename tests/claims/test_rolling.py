"""The path of the centre of a body of finite radius is derived from the track on which it rolls."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from naive import pendulum_half_period, ulps
from textbook import DIGITS, Textbook

import generated.circle_drag
import generated.parabola_rolling
import gqm_sym as gqm
from gqm_sym.errors import LaunchError, SolutionError
from gqm_sym.runtime.sweep import quantities

ROUNDINGS = 8 * 2.0**-53
# Times are the nearest doubles. Worst measured: 0.46.
NEAREST = 0.51
# The relative errors of double-double arithmetic beside a curve. Worst measured: 7e-18, for a thousandth of a radian
# and a ball that nearly fills its track.
USEFUL_ERROR = 1e-17
# The tolerance for charted curves at t < 100 s, relative to the size of the curve.
EARLY = 1e-13


@pytest.fixture(scope="module")
def bowl(generated_folder: Path) -> ModuleType:
    """Return a round track."""
    force = gqm.Gravity() + gqm.Rolling(radius="rho")
    return gqm.build(gqm.derive(gqm.families.circle(), force), name="ball_in_a_bowl", folder=generated_folder)


@pytest.mark.parametrize(("rho", "path"), [("1/4", "1"), ("-3/4", "2"), ("0", "5/4")])
def test_in_a_round_track_it_is_a_pendulum(bowl: ModuleType, rho: str, path: str) -> None:
    """The body moves as a pendulum of length L - rho with gravity g/(1 + β), on either side of the track."""
    motion = bowl.solve("6/5", L="5/4", rho=rho, beta="2/5", g="9.81")
    with mp.workdps(DIGITS):
        length = sp.Rational(path)
        frequency = mp.sqrt(mpf("9.81") / mpf("1.4") / (mpf(int(length.p)) / int(length.q)))
        assert ulps(motion.half_period, pendulum_half_period(mpf("1.2"), frequency)) <= NEAREST


@pytest.fixture(scope="module")
def loop(generated_folder: Path) -> ModuleType:
    """Return a round track that is given by an equation only."""
    curve = gqm.Curve.implicit("x**2 + z**2 - L**2", start=(0, "-L"), parameters={"L": "5/4"})
    force = gqm.Gravity() + gqm.Rolling(radius="rho", beta="2/5")
    return gqm.build(gqm.derive(curve, force), name="ball_in_a_loop", folder=generated_folder)


@pytest.mark.sample(1)
@pytest.mark.parametrize("angle", ["1/1000000", "6/5", "29/10"])
def test_on_a_charted_curve_as_on_one_with_formulas(loop: ModuleType, bowl: ModuleType, angle: str) -> None:
    """Both are the pendulum, with the same places at the same times but for the rounding of the tangent's angle."""
    numbers = {"rho": "1/4", "beta": "2/5", "g": "9.81"}
    motion = loop.solve(sp.Rational(angle) * sp.Rational("5/4"), **numbers)
    twin = bowl.solve(angle, L="5/4", **numbers)
    with mp.workdps(DIGITS):
        exact = pendulum_half_period(
            mp.mpf(sp.Rational(angle).p) / sp.Rational(angle).q, mp.sqrt(mpf("9.81") / mpf("1.4"))
        )
        assert ulps(motion.half_period, exact) <= NEAREST
    times = np.linspace(0.0, 20.0, 41)
    ours, theirs = motion.state(times), twin.state(times)
    assert np.abs(ours.lam - 1.25 * theirs.lam).max() <= EARLY * 1.25
    assert np.abs(ours.normal_force - theirs.normal_force).max() <= 2e-13 * 9.81


@pytest.mark.sample(1)
@pytest.mark.parametrize("rho", ["1/4", "-1/4", "-100", "0", "99/80"])
@pytest.mark.parametrize("angle", ["1/1000", "2", "29/10", "157/50"])
def test_times_and_turning_points_hold_their_bounds(angle: str, rho: str, loop: ModuleType) -> None:
    """Bounds hold for swings on either side of a track, beside the top, and of a body that nearly fills the track."""
    motion = loop.solve(sp.Rational(angle) * sp.Rational("5/4"), rho=rho, g="9.81")
    with mp.workdps(DIGITS):
        exact_angle, radius = (mpf(q.p) / q.q for q in map(sp.Rational, (angle, rho)))
        exact = pendulum_half_period(exact_angle, mp.sqrt(mpf("9.81") / mpf("1.4") / (mpf("1.25") - radius)))
        assert ulps(motion.half_period, exact) <= NEAREST
        orbit = motion._orbit
        for (high, low, error), truth in zip(orbit, (exact, -1.25 * exact_angle, 1.25 * exact_angle), strict=True):
            assert abs(mpf(high) + mpf(low) - truth) <= error <= USEFUL_ERROR * abs(truth)


@pytest.mark.extended
def test_in_extended_precision_beside_a_track(loop: ModuleType) -> None:
    """Extended precision is used where double-double arithmetic does not suffice, and for more digits than it has."""
    for angle, rho in (("1/1000000000", "-1/4"), ("1/1000", "1249999/1000000")):
        motion = loop.solve(sp.Rational(angle) * sp.Rational("5/4"), rho=rho, g="9.81")
        assert motion._orbit is None
        with mp.workdps(DIGITS):
            exact_angle, radius = (mpf(q.p) / q.q for q in map(sp.Rational, (angle, rho)))
            exact = pendulum_half_period(exact_angle, mp.sqrt(mpf("9.81") / mpf("1.4") / (mpf("1.25") - radius)))
            assert ulps(motion.half_period, exact) <= NEAREST
    with mp.workdps(DIGITS):
        exact = 2 * pendulum_half_period(mpf(2), mp.sqrt(mpf("9.81") / mpf("1.4")))
        assert loop.solve("5/2", rho="1/4", g="9.81").period_to(34) == mp.nstr(exact, 34)


def test_rounds_inside_and_outside_a_loop(loop: ModuleType) -> None:
    """The time of a round is a complete elliptic integral; the body's path is shorter inside and longer outside."""
    for rho, sense in (("1/4", 1), ("1/4", -1), ("-3/4", 1)):
        motion = loop.solve(0, 12, direction=sense, rho=rho, g="9.81")
        with mp.workdps(DIGITS):
            size = mpf("1.25") - mpf(sp.Rational(rho).p) / sp.Rational(rho).q
            m = 4 * mpf("9.81") / mpf("1.4") * size / 144
            assert motion.kind == "circulation"
            assert ulps(motion.period, 4 * size / 12 * mp.ellipk(m)) <= NEAREST


@pytest.mark.extended
def test_on_a_parabola_by_its_equation(generated_folder: Path) -> None:
    """Answers from the same points, and in sweeps, equal those on the parabola with formulas to the last place."""
    curve = gqm.Curve.implicit("a*x**2 - z", start=(0, 0), domain=(-2, 2), parameters={"a": "3/4"})
    force = gqm.Gravity() + gqm.Rolling(radius="rho", beta="beta")
    module = gqm.build(gqm.derive(curve, force), name="ball_by_equation", folder=generated_folder)
    for x, numbers in (("1", {"rho": "3/8"}), ("1/8", {"rho": "1/2"}), ("3/4", {"rho": "-2"})):
        place = sp.Rational(x)
        motion = module.solve(point=(x, sp.Rational("3/4") * place**2), beta="2/5", **numbers)
        twin = generated.parabola_rolling.solve(x, a="3/4", beta="2/5", **numbers)
        assert motion.half_period == twin.half_period
        late = 1e6 * twin.period + np.linspace(0.0, 2.0, 5)
        error = np.abs(motion.state(late).x - twin.state(late).x).max()
        assert error <= 4 * ROUNDINGS
        swept = module.sweep("half_period", motion.state(0.0).lam, beta=0.4, rho=float(sp.Rational(numbers["rho"])))
        assert float(swept.values) == pytest.approx(twin.half_period, rel=3 * 2.0**-53)
        with pytest.raises(SolutionError, match="gradients: there are none along tracks of rolling bodies"):
            motion.gradient("half_period")


def test_on_a_flat_bottom(generated_folder: Path) -> None:
    """On x**4 + z**4 = 1 the time is the integral along the path of the centre."""
    curve = gqm.Curve.implicit("x**4 + z**4 - 1", start=(0, -1))
    force = gqm.Gravity() + gqm.Rolling(radius="rho", beta="2/5")
    module = gqm.build(gqm.derive(curve, force), name="ball_on_a_flat_bottom", folder=generated_folder)
    x, rho = mpf("0.5"), mpf("0.125")
    with mp.workdps(DIGITS):
        end = -mp.root(1 - x**4, 4)
        motion = module.solve(point=("1/2", mp.nstr(end, 45)), rho="1/8", g="9.81")

        def below(at: mpf) -> tuple[mpf, mpf]:
            """Return the height of the centre, and the derivative of the length of its path with respect to x."""
            depth = mp.root(1 - at**4, 4)
            slope, bend = at**3 / depth**3, 3 * at**2 / depth**7
            root = mp.sqrt(1 + slope**2)
            return rho / root - depth, root * (1 - rho * bend / root**3)

        top, _ = below(x)

        def slowness(share: mpf) -> mpf:
            height, length = below(x * (1 - share**2))
            return 2 * x * share * length / mp.sqrt(2 * mpf("9.81") / mpf("1.4") * (top - height))

        exact = 2 * mp.quad(slowness, [0, mpf("0.5"), 1], method="gauss-legendre")
        assert ulps(motion.half_period, exact) <= NEAREST


@pytest.mark.extended
@pytest.mark.parametrize("share", ["1/2", "9/10", "99/100"])
def test_small_swings_of_a_ball_that_all_but_fills_its_loop(share: str, loop: ModuleType, bowl: ModuleType) -> None:
    """The path of the centre has the rounding errors of the curve, magnified; places were up to seven bounds off."""
    numbers = {"rho": sp.Rational(share) * sp.Rational("5/4"), "beta": "2/5", "g": "9.81"}
    for angle in np.geomspace(1e-6, 1e-2, 9).tolist():
        motion = loop.solve(1.25 * angle, **numbers)
        times = np.linspace(0.05, 0.95, 7) * motion.period
        exact = 1.25 * bowl.solve(angle, L="5/4", **numbers).lam(times)
        assert np.all(np.abs(motion.lam(times) - exact) <= motion.error_bound(times))


def test_on_a_rail_of_arcs_and_a_line(generated_folder: Path) -> None:
    """Between two arcs the centre moves straight; on each arc it is a pendulum of length 2 - rho."""
    pieces = [gqm.arc(radius=2, angle="3/2"), gqm.line(length=3), gqm.arc(radius=2, angle="3/2")]
    force = gqm.Gravity() + gqm.Rolling(radius="rho", beta="1/2")
    rail = gqm.Curve.piecewise(pieces, start=(0, 0), heading="-3/2")
    module = gqm.build(gqm.derive(rail, force), name="ball_in_a_channel", folder=generated_folder)
    motion = module.solve("1", rho="1/2", g="9.81")  # half a radian from the end of the first arc
    with mp.workdps(DIGITS):
        size, rate = mpf(3) / 2, 2 * mpf("9.81") / mpf("1.5")
        deepest = mpf(1)  # the angle of release: 3/2 - 1/2

        def slowness(share: mpf) -> mpf:
            fallen = deepest * share**2
            drop = 2 * mp.sin(deepest - fallen / 2) * mp.sin(fallen / 2)
            return 2 * deepest * share * size / mp.sqrt(rate * size * drop)

        exact = 2 * mp.quad(slowness, [0, 1]) + 3 / mp.sqrt(rate * size * (1 - mp.cos(deepest)))
        assert ulps(motion.half_period, exact) <= NEAREST


def test_the_centre_moves_beside_the_track() -> None:
    """x, z, σ, κ and N are those of the parallel curve by definition; λ remains that of the track."""
    module, (a, beta, rho) = generated.parabola_rolling, (0.75, 0.5, 0.375)
    places, g, m = [-1.25, -0.1, 0.0, 0.625, 3.0], 9.75, 2.0
    rows = module.pass1(places, 0.5, 2, a=a, beta=beta, rho=rho, g=g, m=m)
    with mp.workdps(DIGITS):
        track = Textbook(x=lambda t: t, z=lambda t: mpf(a) * t**2, push=lambda _x, _z: (mpf(0), -mpf(g)))
        centre = track.centre(mpf(rho))
        launch = centre.z(mpf(0.5))
        for i, lam in enumerate(map(mpf, places)):
            ds, _, _, kappa = centre.shape(lam)
            height = centre.z(lam)
            w = 4 - 2 * mpf(g) * (height - launch) / (1 + mpf(beta))
            force = mpf(m) * (kappa * w + centre.forces(lam)[1])
            truth = (centre.x(lam), height, ds, kappa, w, force)
            sizes = (1, 1 + abs(height), ds, kappa, 4 + g * (1 + abs(height)), m * (g + kappa * abs(w)))
            for row, value, size in zip(rows, truth, sizes, strict=True):
                assert abs(mpf(float(row[i])) - value) <= ROUNDINGS * size


def test_the_closed_forms_are_the_centre_s() -> None:
    """The closed forms in a circle are those of a circle of radius L - rho."""
    model = gqm.derive(gqm.families.circle(), gqm.Gravity() + gqm.Rolling(radius="rho"))
    length, rho, theta = (sp.Symbol(name, real=True) for name in ("L", "rho", "theta"))
    assert sp.simplify(model.x - (length - rho) * sp.sin(theta)) == 0
    assert sp.simplify(model.ds - (length - rho)) == 0
    assert sp.simplify(model.kappa - 1 / (length - rho)) == 0
    assert model.turning_angle == theta - model.lam0


def test_a_body_that_does_not_fit_is_an_error(bowl: ModuleType) -> None:
    """A body that does not fit is refused at launch or at such a place, but not if the motion ends before it."""
    with pytest.raises(LaunchError, match=r"this rho a body does not fit .* theta = 0\.5; launch elsewhere"):
        bowl.solve(0.5, L=1, rho=1, beta=0)
    # kappa*rho is 1 where (1 + (2 a x)**2)**1.5 = 2 a rho
    launch = {"lam0": 1.5, "a": 0.5, "rho": 1.5, "beta": "2/5"}
    place = np.sqrt(1.5 ** (2 / 3) - 1)
    with pytest.raises(SolutionError, match=r"does not fit .* after .* s; give rho") as error:
        generated.parabola_rolling.solve(**launch)
    assert abs(float(str(error.value).partition(" = ")[2].partition(",")[0]) - place) < 1e-6
    assert generated.parabola_rolling.solve(**launch, t_max=0.1).kind == "transit"


def test_without_a_radius_the_curve_is_the_centre_s_path() -> None:
    """Without a radius the curve is still the path of the centre."""
    bare = gqm.derive(gqm.families.parabola(), gqm.Gravity() + gqm.Rolling())
    sliding = gqm.derive(gqm.families.parabola(), gqm.Gravity())
    assert (bare.x, bare.z, bare.ds, bare.kappa) == (sliding.x, sliding.z, sliding.ds, sliding.kappa)
    assert "radius" not in bare.force.terms[-1][1]


@pytest.fixture(scope="module")
def slippery(generated_folder: Path) -> ModuleType:
    """Return a round track with a known coefficient of friction."""
    force = gqm.Gravity() + gqm.Rolling(radius="rho", mu_static="mu_s")
    return gqm.build(gqm.derive(gqm.families.circle(), force), name="slippery_bowl", folder=generated_folder)


def grip(theta: float, start: float, beta: float) -> float:
    """Return the required over the available friction after release: beta/(1 + beta)*sin θ against cos θ + 2 (cos θ -
    cos θ0)/(1 + beta).
    """
    carried = np.cos(theta) + 2 * (np.cos(theta) - np.cos(start)) / (1 + beta)
    return beta / (1 + beta) * np.sin(theta) / carried


@pytest.mark.extended
def test_slip_is_told_where_it_begins(slippery: ModuleType) -> None:
    """Slip events occur at the launch if friction does not hold there, otherwise on the other side, and in the outer
    part of every swing.
    """
    beta, start = 0.4, 1.25
    launch = {"lam0": start, "L": 2, "rho": 0.5, "beta": beta, "g": 9.81}
    worst = grip(start, start, beta)
    assert [e.kind for e in slippery.solve(**launch, mu_s=1.001 * worst).events] == ["turn", "turn"]
    # The coefficient is less than a body at rest there needs: it slips at once, then rolls, and slips again beyond the
    # mirrored place.
    place = 0.8
    motion = slippery.solve(**launch, mu_s=grip(place, start, beta))
    slipping = [event for event in motion.events if event.kind == "slip"]
    assert [event.kind for event in motion.events if event.kind != "slip"] == ["turn", "turn"]
    assert slipping[0].t == 0.0
    assert [event.lam for event in slipping] == pytest.approx([start, -place, place], abs=1e-13)
    assert [float(motion.lam(event.t)) for event in slipping] == pytest.approx([start, -place, place], abs=1e-12)


def test_without_a_coefficient_nothing_slips(bowl: ModuleType) -> None:
    """Without a coefficient of friction there are no events of slipping."""
    assert [event.kind for event in bowl.solve(3, L=1, rho="1/4", beta=1).events].count("slip") == 0


@pytest.mark.extended
def test_a_ball_lifts_off_long_before_its_formulas_overflow(tmp_path: Path) -> None:
    """A ball that falls beside a hyperbolic sine loses contact, though the track goes on to where its slope has no
    square. Place and time are those of the laws of motion of its centre.
    """
    force = gqm.Gravity() + gqm.Rolling(radius="1/20", beta="2/5")
    curve = gqm.Curve.graph("x/5 + sinh(x)/9", parameter="x")
    module = gqm.build(gqm.derive(curve, force), name="falls_away", folder=tmp_path)
    motion = module.solve(-0.5, 1.5, -1, contact="above")
    with mp.workdps(30):
        g, radius = mpf("9.81"), mpf(1) / 20

        def slope(x: mpf) -> mpf:
            return mpf(1) / 5 + mp.cosh(x) / 9

        def curvature(x: mpf) -> mpf:
            return mp.sinh(x) / 9 / (1 + slope(x) ** 2) ** 1.5

        def squared_speed(x: mpf) -> mpf:
            start, here = (y / 5 + mp.sinh(y) / 9 + radius / mp.sqrt(1 + slope(y) ** 2) for y in (mpf("-0.5"), x))
            return mpf("1.5") ** 2 + 2 * g * (start - here) / (1 + mpf(2) / 5)

        def load(x: mpf) -> mpf:
            kappa = curvature(x) / (1 - radius * curvature(x))
            return kappa * squared_speed(x) + g / mp.sqrt(1 + slope(x) ** 2)

        def time_per_x(x: mpf) -> mpf:
            return (1 - radius * curvature(x)) * mp.sqrt((1 + slope(x) ** 2) / squared_speed(x))

        end = mp.findroot(load, (-3, -1), solver="anderson")
        truth = mp.quad(time_per_x, [end, 0.5 * (end - 0.5), mpf("-0.5")])
        assert motion.t_end == pytest.approx(float(truth), rel=EARLY)
        assert motion.events[-1].kind == "liftoff"
    assert module.sweep("t_end", [-0.5], [1.5], -1, contact="above").values[0] == pytest.approx(motion.t_end, rel=EARLY)
    # Without a lift-off the ball never comes to an end: dt/dx grows like exp(|x|/2).
    assert module.solve(-0.5, 1.5, -1, t_max=0.5).lam(0.5) == pytest.approx(motion.lam(0.5), rel=EARLY)
    assert module.solve(-0.5, 1.5, -1).t_end == np.inf


def test_sweeps_refuse_a_radius_on_a_track_with_corners_too(tmp_path: Path) -> None:
    """They went on as if the centre of the body jumped from one plane to the next."""
    track = gqm.Curve.sampled([(-1, 1), (0, 0), (2, 1)], kind="linear")
    module = gqm.build(
        gqm.derive(track, gqm.Gravity() + gqm.Rolling(radius="1/20", beta="2/5")), name="cornered", folder=tmp_path
    )
    with pytest.raises(LaunchError, match="corner"):
        module.solve(0.3)
    for quantity in ("half_period", "t_end", "v_max"):
        swept = module.sweep(quantity, [0.3, np.nan, 99.0])
        assert np.isnan(swept.values).all()
        assert swept.status.tolist() == [6, 3, 4]


def test_swept_balls_with_drag_in_a_bowl(generated_folder: Path) -> None:
    """They move like bodies that slide along the path of the centre, with gravity and drag divided by 1 + beta."""
    force = gqm.Gravity() + gqm.Rolling(radius="rho") + gqm.QuadraticDrag()
    module = gqm.build(gqm.derive(gqm.families.circle(), force), name="ball_with_drag", folder=generated_folder)
    angles, beta, b = np.linspace(0.1, 3.0, 30), 0.25, 0.0625
    given = {"L": 1.5, "rho": 0.5, "beta": beta, "b": b, "t_max": 10}
    for quantity in ("t_end", "v_max", "v_min", "time_at"):
        place = {"lam": 0.05} if quantity == "time_at" else {}
        swept = module.sweep(quantity, angles, 0.0, **place, **given)
        assert (swept.route == quantities.SINGLE).all()
        sliding = generated.circle_drag.sweep(
            quantity, angles, 0.0, L=1, b=b / (1 + beta), g=9.81 / (1 + beta), t_max=10, **place
        )
        assert swept.values == pytest.approx(sliding.values, rel=4 * ROUNDINGS, abs=0)
    assert np.isnan(module.sweep("v_max", angles, 0.0, **{**given, "rho": 1.5}).values).all()


# The largest contact force on balls released at x = 0.9 on z = x**2, and their radii: the largest value of
# g cos + kappa W on the first passage, with the integral for W in 40 digits.
NARROW_BENDS = {
    0.3: "54.0197283253705925",
    0.45: "167.041721082625918",
    0.49: "769.575675262203416",
    0.499: "7547.93550571558401",
}


@pytest.mark.extended
def test_swept_contact_forces_in_narrow_bends(generated_folder: Path) -> None:
    """Where a ball with drag only just fits, its contact force is resolved by itself; 10 % were missing.

    At the bottom 1 - 2 rho is the smallest 1 - kappa rho. With a radius a little above 1/2 the place where the ball
    does not fit was passed between the nodes of a polynomial, by `solve` too.
    """
    force = gqm.Gravity() + gqm.Rolling(radius="rho") + gqm.QuadraticDrag()
    module = gqm.build(gqm.derive(gqm.families.parabola(a=1), force), name="narrow_bend", folder=generated_folder)
    given, rho = {"beta": 0.4, "b": 0.05, "t_max": 10}, np.array(list(NARROW_BENDS))
    swept = module.sweep("normal_force_max", 0.9, 0.0, rho=rho, **given)
    assert (swept.route == quantities.SINGLE).all()
    exact = np.array([float(value) for value in NARROW_BENDS.values()])
    assert (np.abs(swept.values / exact - 1) <= 4 * ROUNDINGS / (1 - 2 * rho)).all()
    for radius in (0.5002, 0.501, 0.53):
        with pytest.raises(SolutionError, match=r"a body does not fit .* where it comes after"):
            module.solve(0.9, rho=radius, **given)
    for quantity in ("t_end", "time_at", "normal_force_min"):
        place = {"lam": 0.5} if quantity == "time_at" else {}
        swept = module.sweep(quantity, 0.9, 0.0, rho=[0.5002, 0.53], **place, **given)
        assert (swept.status == quantities.REFUSED).all()


def test_rails_narrower_than_a_ball_with_drag(generated_folder: Path) -> None:
    """A ball that rolls from a line onto an arc of a smaller radius than its own was followed along the arc."""
    line, arc = gqm.line, gqm.arc
    rail = gqm.Curve.piecewise(
        [line(length=1), arc(radius=3, angle="pi/2"), line(length=4)], start=(-5, 4), heading="-pi/2"
    )
    force = gqm.Gravity() + gqm.Rolling(radius="rho") + gqm.QuadraticDrag()
    module = gqm.build(gqm.derive(rail, force), name="ball_on_a_rail", folder=generated_folder)
    given = {"beta": 0.4, "b": 0.05, "t_max": 8}
    assert module.solve(0.3, rho=2.9, **given).legs[0].lam_end > 1
    with pytest.raises(
        SolutionError, match=r"this rho a body does not fit .* s = 1\.0, where it comes after 0\.44\d* s"
    ):
        module.solve(0.3, rho=3.5, **given)
    assert module.solve(0.3, rho=3.5, **{**given, "t_max": 0.1}).legs[0].lam_end < 1
    with pytest.raises(SolutionError, match=r"does not fit .* s = \d\.\d*, where it comes after"):
        module.solve(7.0, rho=3.5, direction=-1, v0=9, **given)
    for quantity in ("v_max", "t_end", "time_at", "normal_force_max"):
        place = {"lam": 0.5} if quantity == "time_at" else {}
        swept = module.sweep(quantity, [0.3, 2.0], 0.0, rho=3.5, **place, **given)
        assert np.isnan(swept.values).all()
        assert (swept.status == quantities.REFUSED).all()
