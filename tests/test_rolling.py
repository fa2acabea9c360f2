"""A body of finite radius: the path of its centre, derived from the track it rolls on."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from naive import pendulum_half_period, ulps
from textbook import DIGITS, Textbook

import generated.parabola_rolling
import gqm_sym as gqm
from gqm_sym.errors import LaunchError, SolutionError

ROUNDINGS = 8 * 2.0**-53
HALF_PERIOD_ULPS = 4.0


@pytest.fixture(scope="module")
def bowl(generated_folder: Path) -> ModuleType:
    """A round track."""
    force = gqm.Gravity() + gqm.Rolling(radius="rho")
    return gqm.build(gqm.derive(gqm.families.circle(), force), name="ball_in_a_bowl", folder=generated_folder)


@pytest.mark.parametrize(("rho", "path"), [("1/4", "1"), ("-3/4", "2"), ("0", "5/4")])
def test_in_a_round_track_it_is_a_pendulum(bowl: ModuleType, rho: str, path: str) -> None:
    """Of length L - rho, g over 1 + β, on either side of the track."""
    motion = bowl.solve("6/5", L="5/4", rho=rho, beta="2/5", g="9.81")
    with mp.workdps(DIGITS):
        length = sp.Rational(path)
        frequency = mp.sqrt(mpf("9.81") / mpf("1.4") / (mpf(int(length.p)) / int(length.q)))
        assert ulps(motion.half_period, pendulum_half_period(mpf("1.2"), frequency)) <= HALF_PERIOD_ULPS


def test_the_centre_moves_beside_the_track() -> None:
    """x, z, σ, κ and N of the parallel curve, by definitions; λ stays that of the track."""
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
    """In a circle: a circle of radius L - rho."""
    model = gqm.derive(gqm.families.circle(), gqm.Gravity() + gqm.Rolling(radius="rho"))
    length, rho, theta = (sp.Symbol(name, real=True) for name in ("L", "rho", "theta"))
    assert sp.simplify(model.x - (length - rho) * sp.sin(theta)) == 0
    assert sp.simplify(model.ds - (length - rho)) == 0
    assert sp.simplify(model.kappa - 1 / (length - rho)) == 0
    assert model.turning_angle == theta - model.lam0


def test_a_body_that_does_not_fit_is_an_error(bowl: ModuleType) -> None:
    """At launch, or where it comes to such a place; not if the motion ends before."""
    with pytest.raises(LaunchError, match=r"radius rho does not fit .* theta = 0\.5; launch elsewhere"):
        bowl.solve(0.5, L=1, rho=1, beta=0)
    # kappa*rho = 1 where (1 + (2 a x)**2)**1.5 = 2 a rho
    launch = {"lam0": 1.5, "a": 0.5, "rho": 1.5, "beta": "2/5"}
    place = np.sqrt(1.5 ** (2 / 3) - 1)
    with pytest.raises(SolutionError, match=r"does not fit .* after .* s; give rho") as error:
        generated.parabola_rolling.solve(**launch)
    assert abs(float(str(error.value).partition(" = ")[2].partition(",")[0]) - place) < 1e-6
    assert generated.parabola_rolling.solve(**launch, t_max=0.1).kind == "transit"


def test_without_a_radius_the_curve_is_the_centre_s_path() -> None:
    """As it always was."""
    bare = gqm.derive(gqm.families.parabola(), gqm.Gravity() + gqm.Rolling())
    sliding = gqm.derive(gqm.families.parabola(), gqm.Gravity())
    assert (bare.x, bare.z, bare.ds, bare.kappa) == (sliding.x, sliding.z, sliding.ds, sliding.kappa)
    assert "radius" not in bare.force.terms[-1][1]


@pytest.fixture(scope="module")
def slippery(generated_folder: Path) -> ModuleType:
    """A round track whose friction is known."""
    force = gqm.Gravity() + gqm.Rolling(radius="rho", mu_static="mu_s")
    return gqm.build(gqm.derive(gqm.families.circle(), force), name="slippery_bowl", folder=generated_folder)


def grip(theta: float, start: float, beta: float) -> float:
    """Needed over carried: beta/(1 + beta)*sin θ against cos θ + 2 (cos θ - cos θ0)/(1 + beta), after release."""
    carried = np.cos(theta) + 2 * (np.cos(theta) - np.cos(start)) / (1 + beta)
    return beta / (1 + beta) * np.sin(theta) / carried


def test_slip_is_told_where_it_begins(slippery: ModuleType) -> None:
    """Released where friction holds, up to the other side; the launch where it does not, and every swing's far part."""
    beta, start = 0.4, 1.25
    launch = {"lam0": start, "L": 2, "rho": 0.5, "beta": beta, "g": 9.81}
    worst = grip(start, start, beta)
    assert [e.kind for e in slippery.solve(**launch, mu_s=1.001 * worst).events] == ["turn", "turn"]
    # Less than is needed at rest there: it slips at once, then rolls, and slips again beyond the mirrored place.
    place = 0.8
    motion = slippery.solve(**launch, mu_s=grip(place, start, beta))
    slipping = [event for event in motion.events if event.kind == "slip"]
    assert [event.kind for event in motion.events if event.kind != "slip"] == ["turn", "turn"]
    assert slipping[0].t == 0.0
    assert [event.lam for event in slipping] == pytest.approx([start, -place, place], abs=1e-13)
    assert [float(motion.lam(event.t)) for event in slipping] == pytest.approx([start, -place, place], abs=1e-12)


def test_without_a_coefficient_nothing_slips(bowl: ModuleType) -> None:
    """Nothing is said of friction, so nothing is told."""
    assert [event.kind for event in bowl.solve(3, L=1, rho="1/4", beta=1).events].count("slip") == 0
