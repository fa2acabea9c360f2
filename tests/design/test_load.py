"""Tracks made from a contact force have it in their motions, and agree with closed forms."""

from pathlib import Path

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.errors import GQMError

G = 9.81


@pytest.mark.extended
def test_constant_load(tmp_path: Path) -> None:
    """For 3 g from 12 m/s the loads are right to 1e-14, and top, shift and times are those of Kepler's equation."""
    track = gqm.design.constant_load(3, 12)
    module = gqm.build(gqm.derive(track, gqm.Gravity()), name="steady_loop", folder=tmp_path)
    motion = module.solve(0, 12)
    state = motion.state(np.linspace(0.0, motion.time_at("2*pi"), 500))
    assert np.abs(state.normal_force / G - 3).max() <= 1e-14
    top, end = motion.state(motion.time_at("pi")), motion.state(motion.time_at("2*pi"))
    assert (top.z, top.v) == pytest.approx((5.504587155963303, 6.0), rel=1e-15)
    assert (end.x, end.v) == pytest.approx((9.171088633813135, 12.0), rel=2e-15)
    psi = np.linspace(0.3, 6.0, 9)
    times = 12 * (3 * psi + np.sin(psi)) / (G * 4 * np.sqrt(8))
    assert [motion.time_at(place) for place in psi] == pytest.approx(times, rel=1e-15)


@pytest.mark.extended
def test_constant_load_with_parameters(tmp_path: Path) -> None:
    """Load, speed and gravity may be run-time parameters."""
    track = gqm.design.constant_load("n", "V", g="g", parameters={"n": 3, "V": 12})
    module = gqm.build(gqm.derive(track, gqm.Gravity()), name="steady_loops", folder=tmp_path)
    psi = np.linspace(-3.0, 7.0, 200)
    for n, speed, g in ((3.0, 12.0, 9.81), (1.5, 3.0, 1.62), (7.0, 20.0, 9.81)):
        found = module.pass1(psi, 0, speed, n=n, V=speed, g=g)
        assert np.abs(found.normal_force / g - n).max() <= 1e-14 * n


@pytest.mark.sample(1)
@pytest.mark.parametrize("law", ["a*t*exp(-t) + 1/2", "1 + 2*sin(pi*s/20)**2"])
def test_prescribed_load(law: str, tmp_path: Path) -> None:
    """The contact force is the prescribed function of arc length or of time."""
    by_time = "t" in law.replace("pi", "")
    given = {"until": 2, "parameters": {"a": 3}} if "a*" in law else {"until": 30}
    track = gqm.design.from_load(law, 12, **given)
    module = gqm.build(gqm.derive(track, gqm.Gravity()), name="prescribed", folder=tmp_path)
    motion, chart = module.solve(0, 12), module.MODEL.chart.chart(())
    state = motion.state(np.linspace(0.0, motion.time_at(chart.high), 300))
    wanted = 3 * state.t * np.exp(-state.t) + 0.5 if "a*" in law else 1 + 2 * np.sin(np.pi * state.s / 20) ** 2
    assert np.abs(state.normal_force / G - wanted).max() <= 3e-14
    assert (state.t if by_time else state.s)[-1] == pytest.approx(given["until"], rel=1e-14)


def test_without_load_the_body_flies(tmp_path: Path) -> None:
    """Without load the track is a parabola, as long as requested."""
    track = gqm.design.from_load(0, 10, until=6, heading="pi/4")
    chart_of = gqm.build(gqm.derive(track, gqm.Gravity()), name="thrown", folder=tmp_path).pass1(
        np.linspace(0.0, 6.0, 50), 0, 10.0
    )
    assert chart_of.z == pytest.approx(chart_of.x - G * chart_of.x**2 / 100.0, abs=1e-15)


BAD = {
    "too small a load": (lambda: gqm.design.constant_load(1, 12), "n: must be greater than 1"),
    "too large a load": (lambda: gqm.design.constant_load(10**400, 12), "n: must be less than"),
    "no title": (lambda: gqm.design.constant_load(3, 12, title=np.zeros(2)), "title: must be text"),
    "backwards": (lambda: gqm.design.constant_load(3, -12), "v0: must be positive"),
    "up to rest": (lambda: gqm.design.from_load(0, 5, until=9, heading="pi/2"), "the body comes to rest"),
    "both": (lambda: gqm.design.from_load("s + t", 5, until=3), "must be a function of one of s, t"),
    "no value": (lambda: gqm.design.from_load("a*s", 5, until=3), "'a' has no value"),
    "no end": (lambda: gqm.design.from_load("s", 5), "'until' must be given"),
}


@pytest.mark.parametrize("case", BAD)
def test_loads_that_no_track_has(case: str) -> None:
    """Each load that no track has gives one clear error."""
    call, said = BAD[case]
    with pytest.raises(GQMError, match=said):
        call()


@pytest.mark.extended
def test_titles_have_one_unit() -> None:
    """The speed in a title is as it was given, with one unit."""
    for speed, said in ((12, "12 m/s"), ("12 m/s", "12 m/s"), ("45 km/h", "45 km/h")):
        assert gqm.design.constant_load("3", speed).title.endswith(f"from v0 = {said}")
        assert gqm.design.from_load("1", speed, until=1).title.endswith(f"from v0 = {said}")


@pytest.mark.extended
def test_a_load_with_a_pole() -> None:
    """Where a load grows without bound the track ends."""
    with pytest.raises(GQMError, match=r"the track ends near s = 0\.99|no finite value"):
        gqm.design.from_load("1/(1 - s)", 5, until=3)
