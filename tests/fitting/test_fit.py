"""Fits agree with the parameters that made the measurements and with closed forms, and say what data do not
determine.
"""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pint
import pytest
from paths import ROOT
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk, ellipkinc

import gqm_sym as gqm
from gqm_sym.errors import InputError, SolutionError
from gqm_sym.fitting.data import read_measurements
from gqm_sym.fitting.fit import Free, Residuals, _free, _until_rest
from gqm_sym.loading import load

u = pint.UnitRegistry()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder for the modules of this file."""
    return tmp_path_factory.mktemp("fits")


@pytest.fixture(scope="module")
def pendulum(folder: Path) -> ModuleType:
    """Return a pendulum, of one metre unless given otherwise; its angle is measured from the bottom."""
    return gqm.build(gqm.derive(gqm.families.circle(L=1), gqm.Gravity()), name="fitted_pendulum", folder=folder)


@pytest.fixture(scope="module")
def spring(folder: Path) -> ModuleType:
    """Return a body on a level line with a spring and dry friction."""
    force = gqm.Gravity() + gqm.Potential("k*x**2/2", parameters={"k": 40}) + gqm.CoulombFriction(mu="1/10")
    return gqm.build(gqm.derive(gqm.Curve.graph("0*x"), force), name="fitted_spring", folder=folder)


def test_positions_and_speeds(pendulum: ModuleType) -> None:
    """Estimates lie within four standard deviations, which are those of the linear theory; chi2 is as expected."""
    true = pendulum.solve(0.8, 0.3, L=1.3)
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0.0, 50.0, 300))
    state = true.state(t)
    sigma = {"x": np.full(300, 1e-3), "v": np.full(300, 5e-3)}
    data = {"t": t, "sigma": sigma, **{q: getattr(state, q) + rng.normal(0.0, s) for q, s in sigma.items()}}
    found = gqm.fit(pendulum, data, {"L": 1.29, "lam0": (0.6, 1), "v0": (0, 0.5, 1)})
    for name, value in {"L": 1.3, "lam0": 0.8, "v0": 0.3}.items():
        assert abs(found.estimates[name] - value) < 4.0 * found.std[name]
    assert found.names == ("L", "lam0", "v0")
    assert (found.rank, found.unidentified, found.degrees_of_freedom) == (3, (), 597)
    assert abs(found.chi2 - 597) < 5.0 * (2.0 * 597) ** 0.5
    moved = true.sensitivity(t, wrt=found.names)
    jacobian = np.vstack([moved.x.T / 1e-3, moved.v.T / 5e-3])
    assert found.covariance == pytest.approx(np.linalg.inv(jacobian.T @ jacobian), rel=2e-2)
    assert np.diag(found.correlation) == pytest.approx(np.ones(3), rel=1e-12)
    assert found.residuals["x"] == pytest.approx(data["x"] - pendulum.solve(**found.estimates).state(t).x, abs=1e-12)


def test_data_without_noise_are_met(pendulum: ModuleType) -> None:
    """Data without noise are met to rounding, amplified by the dependence of the unknowns on the measurements."""
    t = np.linspace(0.0, 20.0, 50)
    data = {"t": t, "lam": pendulum.solve(0.8, 0.3, L=1.3).lam(t)}
    found = gqm.fit(pendulum, data, {"L": 1.2, "lam0": 0.7, "v0": (0, 1)})
    assert found.estimates == pytest.approx({"L": 1.3, "lam0": 0.8, "v0": 0.3}, rel=1e-12)


def test_measurements_in_nanometres(pendulum: ModuleType) -> None:
    """Measurements that are small numbers are met like others."""
    length, amplitude = 2e-9, 0.3
    k, rate = np.sin(amplitude / 2), (9.81 / length) ** 0.5
    t = np.linspace(0.1, 12.0, 15) / rate
    swing = 2.0 * np.arcsin(k * ellipj(ellipk(k * k) - rate * t, k * k)[0])
    data = {"t": t, "x": length * np.sin(swing), "lam": swing}
    for name in ("x", "lam"):
        free = {"L": (0.0, 0.99 * length, 2.0 * length), "lam0": (0.0, 1.01 * amplitude, 1.0)}
        found = gqm.fit(pendulum, {"t": t, name: data[name]}, free)
        assert found.estimates == pytest.approx({"L": length, "lam0": amplitude}, rel=1e-12, abs=0.0)


def test_passages_and_quotients_in_nanometres(pendulum: ModuleType) -> None:
    """Short times of passage have all digits, and steps of difference quotients are small for small unknowns."""
    length, start, place = 3e-9, 1.1, 0.4
    k, rate = np.sin(start / 2), (9.81 / length) ** 0.5
    first = (ellipk(k * k) - ellipkinc(np.arcsin(np.sin(place / 2) / k), k * k)) / rate
    passages = np.array([first, 4.0 * ellipk(k * k) / rate - first])
    measured = read_measurements({"passages": passages, "place": place}, {}, None)
    free = _free(pendulum.MODEL, {"L": length}, {})
    residuals = Residuals(pendulum, measured, free, {"lam0": start})
    assert residuals.predicted(free.start) == pytest.approx(passages, rel=1e-14, abs=0.0)
    assert residuals._differences(free.start)[:, 0] == pytest.approx(0.5 * passages / length, rel=1e-9)


def test_periods_against_the_complete_elliptic_integral(pendulum: ModuleType) -> None:
    """Periods at many amplitudes determine the length if g is known; a DataFrame and quantities are accepted."""
    lam0 = np.linspace(0.1, 2.8, 12)
    period = 4.0 * np.sqrt(1.3 / 9.81) * ellipk(np.sin(0.5 * lam0) ** 2)
    found = gqm.fit(pendulum, pd.DataFrame({"lam0": lam0, "period": period, "sigma": 1e-3}), {"L": None})
    assert found.estimates["L"] == pytest.approx(1.3, rel=1e-14)
    # T is in proportion to sqrt(L), so dT/dL = T/(2 L).
    assert found.std["L"] == pytest.approx(1e-3 * 2.6 / np.linalg.norm(period), rel=1e-9)
    degrees = {"lam0": np.rad2deg(lam0) * u.deg, "period": period * 1e3 * u.ms}
    assert gqm.fit(pendulum, degrees, {"L": 1.2}).estimates["L"] == pytest.approx(1.3, rel=1e-13)


def test_what_periods_cannot_determine(pendulum: ModuleType) -> None:
    """Periods determine only g/L: the result says so, and neither number has a finite standard deviation."""
    lam0 = np.linspace(0.1, 2.8, 12)
    period = 4.0 * np.sqrt(1.3 / 9.81) * ellipk(np.sin(0.5 * lam0) ** 2)
    found = gqm.fit(pendulum, {"lam0": lam0, "period": period, "sigma": 1e-3}, {"L": 1.2, "g": None})
    assert (found.rank, found.unidentified) == (1, (("L", "g"),))
    assert found.std == {"L": np.inf, "g": np.inf}
    assert found.estimates["g"] / found.estimates["L"] == pytest.approx(9.81 / 1.3, rel=1e-9)
    assert "do not tell L and g apart" in str(found)


@pytest.mark.parametrize("launch", [{"lam0": 0.8, "v0": 0.3}, {"lam0": -3.0, "v0": 9.0}])
def test_passages(pendulum: ModuleType, launch: dict[str, float]) -> None:
    """Passages through the lowest point, of swings and of rounds, and through two places in turn are fitted."""
    true = pendulum.solve(**launch, L=1.3)
    period = true.period if true.kind == "libration" else 2.0 * true.period
    first = true.time_at(0)
    times = first + 0.5 * period * np.arange(12)
    found = gqm.fit(pendulum, {"passages": times, "place": 0}, {"L": 1.25}, **launch)
    assert found.estimates["L"] == pytest.approx(1.3, rel=1e-11)
    assert not found.unidentified
    if true.kind == "libration":
        some = {"passages": [first, true.time_at(-0.5)], "place": [0, -0.5]}
        assert gqm.fit(pendulum, some, {"L": 1.25}, **launch).estimates["L"] == pytest.approx(1.3, rel=1e-11)


def test_friction(spring: ModuleType) -> None:
    """Amplitudes of a spring with dry friction decrease by 2 mu g/k in a half swing; after ten seconds the body
    rests.
    """
    mu, k, start = 0.1, 40.0, 1.0
    rate, offset = np.sqrt(k), mu * 9.81 / k
    t = np.linspace(0.0, 8.0, 200)
    n = np.floor(t * rate / np.pi)
    last = np.ceil((start - offset) / (2.0 * offset))
    n = np.minimum(n, last)
    side, left = (-1.0) ** n, start - (2.0 * n + 1.0) * offset
    x = side * (offset + left * np.cos(rate * t - np.pi * n))
    x[n == last] = (-1.0) ** last * (start - 2.0 * last * offset)
    found = gqm.fit(spring, {"t": t, "x": x}, {"mu": (0, 0.09, 1), "k": (30, 39.9, 50)}, lam0=start)
    assert found.estimates == pytest.approx({"mu": mu, "k": k}, rel=1e-12)
    # The first guess may be a limit, and such a body, which hardly loses energy, is not followed until it rests.
    found = gqm.fit(spring, {"t": t[:50], "x": x[:50]}, {"mu": (0, 0, None)}, lam0=start)
    assert found.estimates["mu"] == pytest.approx(mu, rel=1e-12)
    nearly = Residuals(
        spring, read_measurements({"t": t, "x": x}, {}, None), _free(spring.MODEL, {"mu": 1e-9}, {}), {"lam0": start}
    )
    assert nearly.motion(np.array([1e-9])).t_end == 12.0
    assert _until_rest(spring.solve(1), np.array([5.0, 12.0])) == pytest.approx([5.0, last * np.pi / rate], rel=1e-14)
    # These are passages through the equilibrium place of swings to the left, which lies in their middle and later on
    # the swings back.
    n = np.arange(5)
    half = np.where(n % 2, np.arccos(-2.0 * offset / (start - (2.0 * n + 1.0) * offset)), 0.5 * np.pi)
    data = {"passages": (n * np.pi + half) / rate, "place": offset}
    assert gqm.fit(spring, data, {"k": 39}, lam0=start).estimates["k"] == pytest.approx(k, rel=1e-12)
    # The derivatives are exact, and after the body has come to rest its speed does not change.
    free = Free(("mu", "k", "lam0"), np.array([mu, k, start]), np.full(3, -np.inf), np.full(3, np.inf))
    late = np.array([0.3, 4.1, 12.0])
    residuals = Residuals(spring, read_measurements({"t": late, "x": late, "v": late}, {}, None), free, {})
    exact = residuals.jacobian(free.start)
    assert residuals.exact
    assert exact == pytest.approx(residuals._differences(free.start), rel=1e-6, abs=1e-7)
    assert exact[-1].tolist() == [0.0, 0.0, 0.0]


def test_an_estimate_on_its_limit(spring: ModuleType) -> None:
    """Swings that grow would be fitted best by a negative friction; with the limit zero it is held there, and the
    other estimate and its deviation are those of the undamped swing cos(sqrt(k) t). A limit may be the only one, and
    without a guess the fit begins with the value that is given elsewhere.
    """
    t = np.linspace(0.1, 6.0, 100)
    x = (1.0 + 1e-3 * t) * np.cos(np.sqrt(40.0) * t)

    def slope(k: float) -> Any:
        return -0.5 * t / np.sqrt(k) * np.sin(np.sqrt(k) * t)

    best = brentq(lambda k: slope(k) @ (np.cos(np.sqrt(k) * t) - x), 39.5, 40.5, xtol=1e-13)
    data = {"t": t, "x": x, "sigma": 1e-3}
    found = gqm.fit(spring, data, {"mu": (0, 1e-3, None), "k": (None, 39.9, 50)}, lam0=1)
    assert (found.at_limits, found.estimates["mu"], found.std["mu"]) == (("mu",), 0.0, 0.0)
    assert found.estimates["k"] == pytest.approx(best, rel=1e-10)
    assert found.std["k"] == pytest.approx(1e-3 / np.linalg.norm(slope(best)), rel=1e-9)
    assert (found.rank, found.degrees_of_freedom, found.covariance[0].tolist()) == (1, 99, [0.0, 0.0])
    assert "mu  0.0, which is its limit" in str(found)
    alone = gqm.fit(spring, data, {"k": (41, 42, None)}, lam0=1, mu=0)
    assert (alone.at_limits, alone.rank, alone.degrees_of_freedom) == (("k",), 0, 100)


def test_derivatives_are_the_difference_quotients(pendulum: ModuleType) -> None:
    """Derivatives of every kind of measurement agree with difference quotients to the accuracy of the quotients."""
    free = Free(("L", "lam0", "v0"), np.array([1.3, 0.8, 0.3]), np.full(3, -np.inf), np.full(3, np.inf))
    t = np.linspace(0.5, 9.0, 7)
    many = {
        "states": {"t": t, "lam": t, "s": t, "x": t, "z": t, "v": t},
        "periods": {"period": t, "half_period": t},
        "passages": {"passages": t, "place": 0.1},
    }
    for data in many.values():
        residuals = Residuals(pendulum, read_measurements(data, {}, None), free, {})
        exact = residuals.jacobian(free.start)
        assert residuals.exact
        quotients = residuals._differences(free.start)
        assert exact == pytest.approx(quotients, rel=1e-6, abs=1e-7 * np.abs(exact).max())


@pytest.mark.extended
def test_coverage(pendulum: ModuleType) -> None:
    """Each true value lies within a standard deviation in 68 +- 7 % of 500 sets of measurements."""
    true = pendulum.solve(1, L=1.3)
    t = np.linspace(0.1, 6.0, 25)
    exact, rng = true.lam(t), np.random.default_rng(5)
    within = np.zeros(2)
    for _ in range(500):
        data = {"t": t, "lam": exact + rng.normal(0.0, 1e-3, t.size), "sigma": 1e-3}
        found = gqm.fit(pendulum, data, {"L": 1.29, "lam0": 0.99})
        within += [abs(found.estimates[name] - value) < found.std[name] for name, value in (("L", 1.3), ("lam0", 1.0))]
    assert (np.abs(within / 500 - 0.6827) < 0.07).all()


BAD = {
    "no mapping": ([1, 2], {"L": 1}, "data: must be a mapping"),
    "nothing measured": ({"t": [1]}, {"L": 1}, "data: needs at least one of lam, s, x"),
    "an unknown column": ({"t": [1], "q": [1], "x": [1]}, {"L": 1}, "there is no column 'q'"),
    "no times": ({"x": [1, 2]}, {"L": 1}, "data: give t with lam"),
    "nan": ({"t": [1, 2], "x": [1, np.nan]}, {"L": 1}, "data: x: row 2 is not a finite number"),
    "another length": ({"t": [1, 2], "x": [1, 2, 3]}, {"L": 1}, "data: t: has 2 rows where others have 3"),
    "too few": ({"t": [1], "x": [1]}, {"L": 1, "lam0": 1}, "1 measurements cannot determine 2 numbers"),
    "a deviation of zero": ({"t": [1], "x": [1], "sigma": 0}, {"L": 1}, "sigma: standard deviations must be positive"),
    "no place": ({"passages": [1]}, {"L": 1}, "the place is missing"),
    "an unknown name": ({"t": [1], "x": [1]}, {"l": 1}, "free: there is no argument 'l'; did you mean 'L'"),
    "nothing free": ({"t": [1], "x": [1]}, {}, "free: must be a mapping"),
    "a guess outside": ({"t": [1], "x": [1]}, {"L": (1, 3, 2)}, "free: L: the first guess 3.0 must lie between"),
    "too many numbers": ({"t": [1], "x": [1]}, {"L": (1, 2, 3, 4)}, "free: L: must be a guess, (low, high), None, or"),
    "a limit beyond what is given": ({"t": [1], "x": [1]}, {"L": (9, None)}, "free: L: the first guess 1.0 must lie"),
    "both": ({"t": [1], "x": [1]}, {"g": 9}, "free: g has a first guess here and a value by keyword"),
    "too many passages": ({"passages": [1, 2], "place": 3}, {"L": 1}, "the body passes only 0 times"),
    "passages out of order": (
        {"passages": [2, 3, 1], "place": 0},
        {"L": 1},
        "passages: must be positive times in ascending order; row 3 is 1",
    ),
    "a period of zero": ({"lam0": [0.5, 1], "period": [2, 0]}, {"L": 1}, "period: must be positive; row 2 is 0"),
    "no derivatives": ({"t": [1, 2], "lam": [0, 1]}, {"L": 1e-300}, "have no finite derivatives at [1e-300]"),
    "a free column": ({"lam0": [1], "period": [1]}, {"lam0": 1}, "free: lam0 is a column of the data"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_fitted_is_refused(case: str, pendulum: ModuleType) -> None:
    """Input that cannot be used is refused with one clear error."""
    data, free, said = BAD[case]
    fixed = {} if "lam0" in free or "lam0" in data else {"lam0": 1}
    with pytest.raises((InputError, SolutionError)) as raised:
        gqm.fit(pendulum, data, free, g=9.8, **fixed)
    assert said in str(raised.value)


def test_what_is_shown(pendulum: ModuleType) -> None:
    """A result shows itself as text, as a table for a notebook and as a figure."""
    data = {"lam0": [0.5, 1.0], "period": [2.3, 2.4], "sigma": 0.02}
    found = gqm.fit(pendulum, data, {"L": 1.2})
    assert "L  1." in str(found)
    assert "+-" in str(found)
    assert repr(found).startswith("<fit of L = 1.")
    assert found._repr_html_().startswith("<table>")
    figure = found.plot()
    assert [axes.get_ylabel() for axes in figure.axes] == ["period (s)", "residual (s)"]
    assert figure.axes[1].get_xlabel() == "lam0"


def test_places_in_space() -> None:
    """A radius and a launch are found again from places along Viviani's curve; a planar curve has no y."""
    viviani = load(str(ROOT / "generated" / "viviani.py"), "viviani")
    t = np.linspace(0.0, 3.0, 40)
    state = viviani.solve(0.7, 1.0, a=1.5).state(t)
    found = gqm.fit(viviani, {"t": t, "x": state.x, "y": state.y, "z": state.z}, {"a": 1.4, "lam0": 0.8}, v0=1.0)
    assert found.estimates["a"] == pytest.approx(1.5, rel=1e-12)
    assert found.estimates["lam0"] == pytest.approx(0.7, rel=1e-12)
    with pytest.raises(InputError, match="y: this curve lies in the plane of x and z"):
        gqm.fit(load(str(ROOT / "generated" / "circle.py"), "circle"), {"t": t, "y": t}, {"L": 1.4}, lam0=1.0)
