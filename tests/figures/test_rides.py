"""The picture of a ride shows what the states of the motion say."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import generated.viviani
import gqm_sym as gqm
from gqm_sym.errors import InputError


@pytest.fixture(scope="module")
def hills(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A closed track with three hills, banked for 14 m/s."""
    track = gqm.Curve.space(
        x="40*cos(u)", y="60*sin(u)", z="6*cos(3*u)", parameter="u", roll=("coordinated", 14), heartline="1.1"
    )
    return gqm.build(gqm.derive(track, gqm.Gravity()), name="hills", folder=tmp_path_factory.mktemp("rides"))


def test_a_ride(hills: ModuleType, tmp_path: Path) -> None:
    """Track and loads are those of states, the colours are the vertical load, limits stand where they were given."""
    motion = hills.solve(0, 10)
    figure = gqm.figures.ride(motion, limits={"vertical": (-1, 5), "lateral": 1.5})
    view, plan, elevation, felt = (axes for axes in figure.axes if axes.get_ylabel() != "vertical load (9.80665 m/s²)")
    x, y = plan.lines[0].get_data()
    assert (x / 40) ** 2 + (y / 60) ** 2 == pytest.approx(np.ones(x.size), rel=1e-14)
    below = np.stack(view.lines[0].get_data_3d())
    s, z = elevation.lines[0].get_data()
    assert np.linalg.norm(below - np.stack([x, y, z]), axis=0) == pytest.approx(np.full(s.size, 1.1), rel=1e-13)
    lines = {line.get_label(): line for line in felt.lines}
    vertical = lines["vertical"].get_ydata()
    assert vertical.max() == pytest.approx(motion.n_vertical_max.value, rel=1e-3)
    (line,) = (shown for shown in view.collections if shown.get_array() is not None)
    assert np.asarray(line.get_array()) == pytest.approx(0.5 * (vertical[1:] + vertical[:-1]))
    levels = [line.get_ydata()[0] for line in felt.lines if line.get_linestyle() == "--"]
    assert levels == [-1.0, 5.0, 1.5]
    figure.savefig(tmp_path / "ride.svg")
    assert (tmp_path / "ride.svg").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ([1, 2], "limits: must be levels by load"),
        ({"upwards": 1}, "limits: must be one of vertical"),
        ({"lateral": "high"}, "limits: lateral: must be finite numbers"),
    ],
)
def test_bad_limits(hills: ModuleType, limits: Any, message: str) -> None:
    """One error says what is wrong."""
    with pytest.raises(InputError, match=message):
        gqm.figures.ride(hills.solve(0, 10), limits=limits)


def test_no_ride_without_a_banking() -> None:
    """What riders feel is not known there."""
    with pytest.raises(InputError, match="ride: the load on a rider depends on the banking"):
        gqm.figures.ride(generated.viviani.solve("3/10"))
