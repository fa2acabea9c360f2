"""Uncertain answers agree with closed forms, and impossible questions are refused."""

from types import ModuleType

import numpy as np
import pytest
from scipy.special import ellipe, ellipk

import generated.circle as pendulum
import generated.circle_coulomb as rough
import gqm_sym as gqm
from gqm_sym.errors import GQMError
from gqm_sym.fitting.result import Fit


def test_of_a_length() -> None:
    """For T = sqrt(L)*f(amplitude) the linear deviation is right, and so are mean and deviation of the sample."""
    found = gqm.uncertainty(pendulum, "period", {"L": (1.0, 0.02)}, lam0=1.2, samples=20_000)
    period = 4.0 * np.sqrt(1 / 9.81) * ellipk(np.sin(0.6) ** 2)
    assert found.linear == pytest.approx((period, 0.5 * period * 0.02), rel=1e-14)
    assert found.gradient == pytest.approx({"L": 0.5 * period}, rel=1e-14)
    # The mean of sqrt(L) is 1 - var/8; samples scatter by 1/sqrt(n) of the deviation.
    mean, deviation = period * (1 - 0.02**2 / 8), 0.5 * period * 0.02
    assert abs(found.sampled.value - mean) < 4.0 * deviation / np.sqrt(20_000)
    assert found.sampled.std == pytest.approx(deviation, rel=4.0 / np.sqrt(40_000))
    assert (found.samples.size, found.missing) == (20_000, 0)
    again = gqm.uncertainty(pendulum, "period", {"L": (1.0, 0.02)}, lam0=1.2, samples=20_000)
    assert (again.samples == found.samples).all()


def test_of_several_numbers() -> None:
    """Independent numbers add their squares; quantities with units are converted; text and repr show both results."""
    angle = 1.2
    m = np.sin(0.5 * angle) ** 2
    period = 4.0 * np.sqrt(1 / 9.81) * ellipk(m)
    slope = 2.0 * np.sqrt(1 / 9.81) * np.cos(0.6) * (ellipe(m) / (1 - m) - ellipk(m)) / np.sin(0.6)
    uncertain = {"lam0": (angle, 0.01), "g": (9.81, 0.05), "L": ("100 cm", "2 mm")}
    found = gqm.uncertainty(pendulum, "half_period", uncertain)
    parts = [0.5 * slope * 0.01, 0.25 * period / 9.81 * 0.05, 0.25 * period * 0.002]
    assert found.linear.std == pytest.approx(np.linalg.norm(parts), rel=1e-12)
    assert found.sampled.std == pytest.approx(found.linear.std, rel=0.05)
    assert str(found).splitlines()[1].startswith("  linear   1.1015 +- 0.00")
    assert "(10000 draws)" in str(found)
    assert repr(found).startswith("<uncertainty of half_period: 1.1015 +- ")


def test_where_there_is_no_gradient() -> None:
    """Without a gradient difference quotients are used; v_max of a motion with friction is the launch speed."""
    found = gqm.uncertainty(rough, "v_max", {"v0": (2.0, 0.1)}, lam0=0.0, mu=0.2, L=1, samples=500)
    assert found.linear == pytest.approx((2.0, 0.1), rel=1e-9)
    assert found.sampled.std == pytest.approx(0.1, rel=0.15)
    time = gqm.uncertainty(pendulum, "time_at", {"L": (1.0, 1e-3)}, lam0=1.2, lam=0, samples=100)
    assert time.linear.std == pytest.approx(0.5e-3 * np.sqrt(1 / 9.81) * ellipk(np.sin(0.6) ** 2), rel=1e-8)


def test_draws_without_an_answer() -> None:
    """Some launches near the top are circulations, which have no half period."""
    found = gqm.uncertainty(pendulum, "half_period", {"v0": (6.2, 0.05)}, lam0=0.0, L=1, samples=2000)
    assert found.missing > 100
    assert f"{found.missing} more draws have no half_period" in str(found)


def test_draws_that_no_launch_may_have() -> None:
    """Half of the draws about zero are negative, which neither speeds nor friction coefficients are; other draws are
    answered, and so is the derivative of the time to the bottom, which is that of the amplitude's closed form.
    """
    found = gqm.uncertainty(
        rough, "time_at", {"mu": (0, 0.01)}, lam0=1, lam=0, L=1, samples=np.int64(400), seed=np.int64(1)
    )
    assert abs(found.missing - 200) < 60
    assert found.missing + found.samples.size == 400
    found = gqm.uncertainty(pendulum, "period", {"L": (1, 0.5), "v0": (0, 0.1)}, lam0=1, samples=400)
    assert abs(found.missing - 200 - 5) < 60
    angle, w = 1.2, np.sqrt(9.81)
    m = np.sin(0.5 * angle) ** 2
    slope = 0.5 * np.cos(0.6) * (ellipe(m) / (1 - m) - ellipk(m)) / np.sin(0.6) / w
    time = gqm.uncertainty(pendulum, "time_at", {"lam0": (angle, 1e-3)}, lam=0, L=1, samples=100)
    assert time.gradient["lam0"] == pytest.approx(slope, rel=1e-13)


@pytest.fixture(scope="module")
def fitted() -> Fit:
    """Return the fit of length and amplitude to positions."""
    t = np.linspace(0.0, 5.0, 40)
    data = {"t": t, "lam": pendulum.solve(0.8, L=1.3).lam(t), "sigma": 1e-3}
    return gqm.fit(pendulum, data, {"L": 1.3, "lam0": 0.8})


def test_of_a_fit(fitted: Fit) -> None:
    """The uncertainty from a fit uses the covariance of its estimates."""
    found = gqm.uncertainty(pendulum, "period", fitted, samples=4000)
    row = np.array([found.gradient[name] for name in fitted.names])
    assert found.linear.std == pytest.approx(np.sqrt(row @ fitted.covariance @ row), rel=1e-13)
    assert found.sampled.std == pytest.approx(found.linear.std, rel=0.05)
    assert found.linear.value == pytest.approx(pendulum.solve(0.8, L=1.3).period, rel=1e-12)


BAD: dict[str, tuple[ModuleType, str, object, dict, str]] = {
    "an unknown quantity": (pendulum, "colour", {"L": (1, 0.1)}, {}, "quantity: must be one of"),
    "two numbers": (pendulum, "turning_points", {"L": (1, 0.1)}, {}, "are two numbers"),
    "an unknown name": (pendulum, "period", {"l": (1, 0.1)}, {}, "did you mean 'L'"),
    "an unknown argument": (pendulum, "period", {"L": (1, 0.1)}, {"G": 1}, "there is no argument 'G'"),
    "twice": (pendulum, "period", {"L": (1, 0.1)}, {"L": 1}, "L is given twice"),
    "no deviation": (pendulum, "period", {"L": 1}, {}, "must be (value, standard deviation)"),
    "a negative one": (pendulum, "period", {"L": (1, -1)}, {}, "must not be negative"),
    "nothing": (pendulum, "period", {}, {}, "must be a mapping"),
    "no samples": (pendulum, "period", {"L": (1, 0.1)}, {"samples": 1}, "samples: must be a whole number"),
    "not periodic": (rough, "period", {"L": (1, 0.1)}, {"lam0": 1, "mu": 0.1}, "not of a kind"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_refused(case: str) -> None:
    """Input that cannot be used is refused with one clear error."""
    module, quantity, uncertain, options, said = BAD[case]
    with pytest.raises(GQMError) as raised:
        gqm.uncertainty(module, quantity, uncertain, **{"lam0": 0.5, **options})
    assert said in str(raised.value)
