"""Tracks made from a period agree with Abel's integral in 30 digits, and with the cycloid."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import GQMError

ULP = 2.0**-52


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder for the modules of this file."""
    return tmp_path_factory.mktemp("designs")


def built(folder: Path, name: str, *law: Any, **options: Any) -> ModuleType:
    """Return the module of a track made from its period."""
    return gqm.build(gqm.derive(gqm.design.from_period(*law, **options), gqm.Gravity()), name=name, folder=folder)


def lengths(period: Any, height: Any) -> Any:
    """Return the arc length between both places of a height, by Abel's integral with s = z sin(phi)**2."""
    share = mp.quad(lambda phi: period(height * mp.sin(phi) ** 2) * mp.sin(phi), [0, mp.pi / 2])
    return mp.sqrt(2 * mpf(981) / 100 * height) / mp.pi * share


@pytest.fixture(scope="module")
def growing(folder: Path) -> ModuleType:
    """Return the symmetric track whose period is 2 s at the bottom and grows by a quarter for each metre."""
    return built(folder, "growing", "2*(1 + h/4)")


def heights_of(places: np.ndarray, share: Any, period: Any) -> list[Any]:
    """Return the heights of places given by the arc length from the bottom."""
    found = []
    for place in map(abs, map(mpf, places.tolist())):
        found.append(mp.findroot(lambda w, s=place: share * lengths(period, w * w) - s, place, tol=1e-55) ** 2)
    return found


@pytest.mark.extended
def test_a_period_that_grows(growing: ModuleType) -> None:
    """The prescribed period is met by declaration, chart and sweep to 3 ulp, and by `period_to` to 20 digits."""
    with mp.workdps(30):
        period = lambda h: 2 * (1 + h / 4)  # noqa: E731
        places = np.array([-1.6, -0.9, -0.31, 0.02, 0.2, 0.75, 1.2, 1.75])
        true = [period(h) for h in heights_of(places, mpf(1) / 2, period)]
        swept = growing.sweep("period", places).values
        for value, exact in zip(swept, true, strict=True):
            assert abs(value - exact) <= 3 * ULP * exact
        assert abs(mpf(growing.solve(0.75).period_to(22)) - true[5]) <= mpf("1e-20")


@pytest.mark.extended
def test_an_uneven_share(folder: Path) -> None:
    """A period that is no polynomial is met with a third of the length on the right; the time on both sides is the
    same.
    """
    track = gqm.design.from_period("T0*sqrt(1 + h)", "1/3", up_to="0.15", parameters={"T0": "3/2"})
    module = gqm.build(gqm.derive(track, gqm.Gravity()), name="uneven", folder=folder)
    with mp.workdps(30):
        period = lambda h: mpf(3) / 2 * mp.sqrt(1 + h)  # noqa: E731
        end = lengths(period, mpf("0.15"))
        chart = module.MODEL.chart.chart(())
        assert abs(chart.high - end / 3) <= 4 * ULP
        assert abs(chart.low + 2 * end / 3) <= 4 * ULP
        assert chart.breaks.tolist() == [0.0]
        for share, places in ((mpf(1) / 3, [0.05, 0.2]), (mpf(2) / 3, [-0.05, -0.4])):
            swept = module.sweep("period", np.array(places)).values
            for value, height in zip(swept, heights_of(np.array(places), share, period), strict=True):
                assert abs(value - period(height)) <= 4 * ULP * value


def test_a_constant_period_is_that_of_a_cycloid(folder: Path) -> None:
    """Every place and the greatest height are those of the cycloid, to rounding."""
    radius = 9.81 / (4.0 * np.pi**2) * 2.0**2 / 4.0
    assert gqm.design.height_limit(2) == pytest.approx(2 * radius, rel=4 * ULP)
    assert gqm.design.height_limit(2, "1/3") == pytest.approx(2 * radius * 4 / 9, rel=4 * ULP)
    assert gqm.design.height_limit("2 + h") == pytest.approx(gqm.design.height_limit("2 + h", "0.5"), rel=0)
    module = built(folder, "cycloid_again", 2)
    s = np.linspace(-0.98, 0.98, 41)
    half = np.arcsin(s / (4 * radius))  # half the wheel's angle
    found = module.pass1(s, lam0=0.3)
    assert found.x == pytest.approx(radius * (2 * half + np.sin(2 * half)), abs=4e-16)
    assert found.z == pytest.approx(radius * (1 - np.cos(2 * half)), abs=4e-16)
    assert module.sweep("period", np.array([1e-6, 0.3, 0.9])).values == pytest.approx([2, 2, 2], rel=3 * ULP)


def test_there_is_no_greatest_height() -> None:
    """A track whose period grows fast has no greatest height; then the height must be given."""
    assert gqm.design.height_limit("2 + 3*h") == np.inf
    with pytest.raises(GQMError, match="up_to: such a track has no greatest height"):
        gqm.design.from_period("2 + 3*h")
    assert "polynomials joined" in str(gqm.design.from_period("2 + 3*h", up_to=1))


BAD = {
    "too high": (("2",), {"up_to": 0.5}, "exists up to a height of 0.49698"),
    "falls to nothing": (("1 - 9*h",), {"up_to": 0.2}, "exists up to a height of"),
    "no period at the bottom": (("sqrt(h)",), {}, "the period at the bottom must be positive"),
    "no finite period at the bottom": (("2 + log(h)",), {}, "'2 + log(h)' has no finite real value there"),
    "no real period at the bottom": (("2 + sqrt(h - 1)",), {}, "has no finite real value there"),
    "negative": (("h - 1",), {}, "the period at the bottom must be positive"),
    "a pole": (("2/(1 - 40*h)",), {}, "finite value"),
    "no value": (("T0",), {}, "'T0' has no value"),
    "not in the law": (("2",), {"parameters": {"T0": 1}}, "'T0' is not in the law"),
    "a share of one": (("2", 1), {}, "share: must be between 0 and 1"),
    "a share of nothing": (("2", 0), {}, "share: must be positive"),
    "no number": (("2",), {"g": "g"}, "g: must be a number"),
    "no grammar": (("2*(",), {}, "law"),
    "an unknown argument": (("2",), {"height": 1}, "there is no argument 'height'"),
}


@pytest.mark.parametrize("case", BAD)
def test_periods_that_no_track_has(case: str) -> None:
    """Each period that no track has gives one clear error."""
    law, options, said = BAD[case]
    with pytest.raises(GQMError) as raised:
        gqm.design.from_period(*law, **options)
    assert said in str(raised.value)
