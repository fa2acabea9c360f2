"""Gradients in sweeps agree with closed forms, and with those of single motions."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from mpmath import mp, mpf
from paths import ROOT

import gqm_sym as gqm
from gqm_sym.errors import InputError
from gqm_sym.loading import load
from gqm_sym.runtime.launch.request import LaunchRequest
from gqm_sym.runtime.sweep.quantities import LOWER_END, UPPER_END
from gqm_sym.runtime.sweep.sweep import sweep_with_columns

ULP = 2.0**-52


def generated(name: str) -> ModuleType:
    """Return a module of the repository."""
    return load(str(ROOT / "generated" / f"{name}.py"), name)


def test_pendulums() -> None:
    """Periods over a table of amplitude and length have dT/dA in closed form and dT/dL = T/(2L)."""
    amplitudes, lengths = np.linspace(0.1, 3.0, 15), np.array([[0.5], [2.0]])
    found = generated("circle").sweep("period", lam0=amplitudes, L=lengths, g=9.81, gradient=("L", "lam0"))
    assert found.values.shape == (2, 15)
    assert found.gradient.shape == (2, 15, 2)
    np.testing.assert_allclose(found.gradient[..., 0], found.values / (2 * lengths), rtol=2 * ULP)
    for (i, j), value in np.ndenumerate(found.gradient[..., 1]):
        length, amplitude = lengths[i, 0], amplitudes[j]
        with mp.workdps(40):
            k = mp.sin(mpf(amplitude) / 2)
            shape = mp.ellipe(k**2) / (k * (1 - k**2)) - mp.ellipk(k**2) / k
            wanted = 2 * mp.sqrt(mpf(length) / mpf(9.81)) * mp.cos(mpf(amplitude) / 2) * shape
            assert abs(value - wanted) <= 2 * ULP * abs(wanted)


@pytest.mark.extended
@pytest.mark.parametrize("lam0", [0.6, 1.2, -0.5])
def test_wells_of_two_shapes(lam0: float, generated_folder: Path) -> None:
    """An attraction in a turning frame has wells about both ends of an ellipse's axis, which have different shapes.

    Swept derivatives are those of the time between mirror images, as an integral with 40 digits.
    """
    force = gqm.CentralForce(centre=(0, "-1/3"), k=4) + gqm.RotatingFrame(Omega="3/10")
    curve = gqm.Curve.parametric(x="2*cos(u)", z="sin(u)", parameter="u", period="2*pi")
    module = gqm.build(gqm.derive(curve, force), name="two_wells", folder=generated_folder)
    found = module.sweep("half_period", [lam0], gradient=("lam0", "k", "Omega"))

    def half_period(start: mpf, k: mpf, omega: mpf) -> mpf:
        def potential(u: mpf) -> mpf:
            x, z = 2 * mp.cos(u), mp.sin(u) + mpf(1) / 3
            return -k / mp.sqrt(x * x + z * z) - omega**2 * x * x / 2

        middle = mp.pi / 2 if start > 0 else -mp.pi / 2
        width = abs(middle - start)

        def rate(phi: mpf) -> mpf:
            u = middle + width * mp.sin(phi)
            ds = mp.sqrt(4 * mp.sin(u) ** 2 + mp.cos(u) ** 2)
            return ds * width * mp.cos(phi) / mp.sqrt(2 * (potential(start) - potential(u)))

        return 2 * mp.quad(rate, [0, mp.pi / 4, mp.pi / 2], method="gauss-legendre")

    with mp.workdps(40):
        at, step = (mpf(lam0), mpf(4), mpf(3) / 10), mpf(10) ** -10
        assert float(half_period(*at)) == pytest.approx(found.values[0], rel=4 * ULP)
        for row in range(3):
            sides = [half_period(*(x + sign * step * (i == row) for i, x in enumerate(at))) for sign in (1, -1)]
            assert found.gradient[0, row] == pytest.approx(float((sides[0] - sides[1]) / (2 * step)), rel=1e-14)


@pytest.mark.parametrize(("sign", "top", "bottom"), [(-1, -2, 1), (1, 4, 3)])
def test_wells_of_powers(sign: int, top: int, bottom: int, generated_folder: Path) -> None:
    """Along a graph of a power of 1 + x**2, whose time is an integral with a divided difference of the power, swept
    derivatives are those of the integral with 40 digits.
    """
    curve = gqm.Curve.graph(z=f"{sign}*(1 + x**2)**({top}/{bottom})")
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name=f"power_{bottom}", folder=generated_folder)
    lam0 = [0.2, 0.7]
    found = module.sweep("half_period", lam0=lam0, g=9.81, gradient=("lam0", "g"))

    def half_period(width: mpf, power: mpf) -> mpf:
        def rate(phi: mpf) -> mpf:
            x = width * mp.sin(phi)
            slope = 2 * power * x * (1 + x * x) ** (power - 1)
            fall = sign * ((1 + width**2) ** power - (1 + x * x) ** power)
            return mp.sqrt(1 + slope**2) * width * mp.cos(phi) / mp.sqrt(2 * mpf(9.81) * fall)

        return 2 * mp.quad(rate, [0, mp.pi / 4, mp.pi / 2], method="gauss-legendre")

    with mp.workdps(40):
        for k, place in enumerate(lam0):
            step, at, power = mpf(10) ** -10, mpf(place), mpf(top) / bottom
            by_place = (half_period(at + step, power) - half_period(at - step, power)) / (2 * step)
            assert found.gradient[k, 0] == pytest.approx(float(by_place), rel=4 * ULP)
            assert found.gradient[k, 1] == pytest.approx(float(-half_period(at, power) / (2 * mpf(9.81))), rel=4 * ULP)


def test_turning_points_come_with_times() -> None:
    """A pendulum at rest turns at its mirror image; a thrown one turns where its energy ends; a lap has no turns."""
    module, lam0, v0 = generated("circle"), np.array([0.3, -1.2, 0.0, 0.5]), np.array([0.0, 0.0, 1.0, 12.0])
    parameters = tuple(module.PARAMETERS.values())
    swept, columns = sweep_with_columns(
        module.MODEL, "period", LaunchRequest(lam0, v0), parameters, None, module.MODEL.solve, UPPER_END + 1
    )
    turn = float(2 * mp.asin(1 / mp.sqrt(4 * mpf("9.81") * mpf("0.9"))))
    assert (swept.status == 0).all()
    np.testing.assert_array_equal(columns[:2, LOWER_END:], [[-0.3, 0.3], [-1.2, 1.2]])
    np.testing.assert_allclose(columns[2, LOWER_END:], [-turn, turn], rtol=2 * ULP)
    np.testing.assert_array_equal(columns[3, LOWER_END:], [np.nan, np.inf])


@pytest.mark.extended
@pytest.mark.parametrize("name", ["ellipse", "rolling_circle", "double_well", "circle_spring"])
def test_as_single_motions(name: str) -> None:
    """For random launches in both directions, sweeps and single motions agree on librations and circulations, for all
    names.
    """
    module, random = generated(name), np.random.default_rng(5)
    lam0, v0 = random.uniform(0.1, 1.4, 300), random.choice([0.0, 1.0, 3.0, 12.0], 300)
    direction = random.choice([1, -1], 300)
    names = (*module.PARAMETERS, "lam0", "v0")
    found = module.sweep("period", lam0=lam0, v0=v0, direction=direction, gradient=names)
    kinds = set()
    for k in range(0, 300, 11):
        if found.status[k] != 0:
            assert np.isnan(found.gradient[k]).all()
            continue
        motion = module.solve(lam0=float(lam0[k]), v0=float(v0[k]), direction=int(direction[k]))
        wanted = np.array(list(motion.gradient("period", names).values()))
        kinds.add(motion.kind)
        np.testing.assert_allclose(found.gradient[k], wanted, rtol=4 * ULP, atol=1e-25)
    assert kinds >= {"libration"}


def test_turning_points_and_extremes_of_pendulums() -> None:
    """Derivatives of turning points and extremes agree with closed forms, for swings launched with a speed and for
    laps.
    """
    g, length, mass = 9.81, 0.8, 1.5
    lam0, v0 = np.array([0.2, 0.7, 1.1, 0.4, -0.9]), np.array([0.0, 1.2, 2.0, 9.0, 8.0])
    cosine = np.cos(lam0) - v0**2 / (2 * g * length)
    swings = v0 < 3
    angle = np.arccos(cosine[swings])
    by_lam0, by_v0 = np.sin(lam0[swings]) / np.sin(angle), v0[swings] / (g * length * np.sin(angle))
    given = {"lam0": lam0, "v0": v0, "L": length, "g": g, "m": mass, "gradient": ("lam0", "v0", "m")}
    ring = generated("circle")
    ends = ring.sweep("turning_points", **given)
    assert ends.gradient.shape == (5, 2, 3)
    assert np.isnan(ends.gradient[~swings]).all()
    for side, sign in enumerate((-1, 1)):
        np.testing.assert_allclose(ends.gradient[swings, side, 0], sign * by_lam0, rtol=8 * ULP)
        np.testing.assert_allclose(ends.gradient[swings, side, 1], sign * by_v0, rtol=8 * ULP)
        np.testing.assert_array_equal(ends.gradient[swings, side, 2], 0.0)
    # N/m is V**2/L + g cos(lam), with V**2 from the launch: 3 g cos(lam) + v0**2/L - 2 g cos(lam0).
    fastest, heaviest = (ring.sweep(name, **given).gradient for name in ("v_max", "normal_force_max"))
    v = np.sqrt(v0**2 + 2 * g * length * (1 - np.cos(lam0)))
    np.testing.assert_allclose(fastest.T, [g * length * np.sin(lam0) / v, v0 / v, 0 * v], rtol=8 * ULP)
    load = 3 * g + v0**2 / length - 2 * g * np.cos(lam0)
    np.testing.assert_allclose(heaviest.T, [2 * mass * g * np.sin(lam0), 2 * mass * v0 / length, load], rtol=8 * ULP)
    slowest, lightest = (ring.sweep(name, **given).gradient for name in ("v_min", "normal_force_min"))
    np.testing.assert_array_equal(slowest[swings], 0.0)
    lap, speed = lam0[~swings], v0[~swings]
    v = np.sqrt(speed**2 - 2 * g * length * (1 + np.cos(lap)))
    np.testing.assert_allclose(slowest[~swings, :2].T, [g * length * np.sin(lap) / v, speed / v], rtol=8 * ULP)
    # At its turns the N of a swinging body is m g cos(angle).
    at_turn = [-mass * g * np.sin(lam0[swings]), -mass * v0[swings] / length, g * np.cos(angle)]
    np.testing.assert_allclose(lightest[swings].T, at_turn, rtol=8 * ULP)


@pytest.mark.extended
@pytest.mark.parametrize("name", ["ellipse", "double_well", "rolling_circle"])
def test_extremes_of_random_launches(name: str) -> None:
    """Extremes are those of single motions, which improve their places in another way; none is solved singly."""
    module, random = generated(name), np.random.default_rng(9)
    lam0, v0 = random.uniform(0.1, 1.4, 40), random.choice([0.0, 1.0, 3.0, 12.0], 40)
    names = (*module.PARAMETERS, "lam0", "v0")
    for quantity in ("turning_points", "v_min", "v_max", "normal_force_min", "normal_force_max"):
        found = module.sweep(quantity, lam0=lam0, v0=v0, gradient=names)
        assert found.route_counts().get("solve", 0) == 0
        for k in range(0, 40, 7):
            if found.status[k] != 0:
                assert np.isnan(found.gradient[k]).all()
                continue
            motion = module.solve(lam0=float(lam0[k]), v0=float(v0[k]))
            wanted = np.stack(list(motion.gradient(quantity, names).values()), axis=-1)
            if wanted.ndim > 1 and motion.turning_points[0] > motion.turning_points[1]:
                wanted = wanted[::-1]
            np.testing.assert_allclose(found.gradient[k], wanted, rtol=2e-13, atol=1e-20)


def test_gradients_where_a_horizon_cuts_the_motion() -> None:
    """The largest speed before the horizon is that at the horizon, which compiled code does not compute."""
    found = generated("parabola").sweep("v_max", lam0=[1.0], t_max=0.01, gradient=("lam0", "g"))
    motion = generated("parabola").solve(1.0, t_max=0.01)
    wanted = list(motion.gradient("v_max", ("lam0", "g")).values())
    assert found.route_counts() == {"solve": 1}
    np.testing.assert_array_equal(found.gradient[0], wanted)


def test_launches_without_a_value() -> None:
    """Launches without a value have no gradient, and without a request there is none."""
    module = generated("parabola")
    found = module.sweep("half_period", lam0=[1.0, np.nan, 0.0], gradient="a")
    assert found.gradient.shape == (3, 1)
    assert np.isfinite(found.gradient[:, 0]).tolist() == (found.status == 0).tolist() == [True, False, False]
    assert module.sweep("half_period", lam0=1.0).gradient is None
    assert module.sweep("half_period", lam0=1.0, gradient="a").gradient.shape == (1,)
    assert module.sweep("half_period", lam0=[], gradient=("a", "g")).gradient.shape == (0, 2)


@pytest.mark.parametrize("quantity", ["half_period", "period", "turning_points"])
def test_sweeps_without_any_value(quantity: str, generated_folder: Path) -> None:
    """Where no launch has a value, none has a derivative."""
    plane = gqm.Curve.graph("-x", parameter="x", domain=(-3, 3))
    module = gqm.build(gqm.derive(plane, gqm.Gravity()), name="swept_plane", folder=generated_folder)
    swept = module.sweep(quantity, [0.1, 0.2], gradient=("lam0", "g"))
    assert swept.gradient.shape == (*swept.values.shape, 2)
    assert np.isnan(swept.gradient).all()
    assert swept.status.all()


def test_what_has_no_gradient() -> None:
    """A quantity without a gradient gives one clear error."""
    with pytest.raises(InputError, match="did you mean 'L'"):
        generated("circle").sweep("period", lam0=1.0, gradient="l")
    for quantity in ([], np.zeros(2)):
        with pytest.raises(InputError, match="quantity: "):
            generated("circle").sweep(quantity, lam0=1.0, gradient="L")


def test_quantities_of_solved_motions() -> None:
    """On a ring times grow as the root of L/g and change with drag as b L/m does; each launch is solved."""
    amplitudes = np.array([0.3, 1.2, 2.5])
    names = ("L", "g", "b", "m")
    found = generated("circle_drag").sweep("time_at", lam0=amplitudes, lam=-0.1, b=0.2, m=2, gradient=names)
    by_length, by_gravity, by_drag, by_mass = found.gradient.T
    np.testing.assert_allclose(by_gravity, -0.5 * found.values / 9.81, rtol=1e-12)
    np.testing.assert_allclose(by_mass, -0.1 * by_drag, rtol=1e-12)
    np.testing.assert_allclose(by_length, 0.5 * found.values + 0.2 * by_drag, rtol=1e-12)
    assert found.route_counts() == {"solve": 3}
    rests = generated("circle_coulomb").sweep("t_end", lam0=amplitudes, L=1.3, gradient=("L", "g"))
    assert rests.status.tolist() == [0, 0, 0]
    np.testing.assert_allclose(rests.gradient[:, 0], 0.5 * rests.values / 1.3, rtol=1e-12)
    np.testing.assert_allclose(rests.gradient[:, 1], -0.5 * rests.values / 9.81, rtol=1e-12)
    fastest = generated("circle").sweep("v_max", lam0=amplitudes, L=1, gradient="lam0")
    np.testing.assert_allclose(fastest.gradient[:, 0], np.sqrt(9.81) * np.cos(0.5 * amplitudes), rtol=1e-14)


def test_a_cluster_is_refused() -> None:
    """A gradient on a cluster is refused, and the message says what to leave out."""
    with pytest.raises(InputError, match="leave one of them out"):
        generated("circle").sweep("period", lam0=1.0, gradient="L", client=object())


def test_an_axis_that_parameters_move(generated_folder: Path) -> None:
    """From rest in z = a x**2 + b x the distance from the axis of symmetry changes with a and b."""
    curve = gqm.Curve.graph("a*x**2 + b*x", parameters={"a": "4/5", "b": "-1/2"})
    module = gqm.build(gqm.derive(curve, gqm.Gravity()), name="moving_axis", folder=generated_folder)
    for launch in ({"lam0": 1.3}, {"lam0": -0.7}, {"lam0": 1.3, "v0": 0.25}):
        swept = module.sweep("half_period", **launch, gradient=("a", "b", "lam0"))
        found = module.solve(**launch).gradient("half_period", ("a", "b", "lam0"))
        np.testing.assert_allclose(swept.gradient.reshape(-1), list(found.values()), rtol=1e-15)
    # A shift of the well by -b/(2 a) shifts the launch: dT/db = dT/dlam0 / (2 a), where b changes its depth only.
    assert found["b"] == pytest.approx(found["lam0"] / 1.6, rel=1e-14)
