"""Tables and datasets of motions have the numbers of the motion, with names, units and their origin."""

import sys
from types import ModuleType
from xml.etree import ElementTree

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.errors import SolutionError
from gqm_sym.export.datasets import VARIABLES


@pytest.fixture(scope="module")
def circle(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a pendulum."""
    model = gqm.derive(gqm.families.circle(), gqm.Gravity(), parameters={"L": 1})
    return gqm.build(model, name="swing", folder=tmp_path_factory.mktemp("display"))


def cells(html: str) -> list[list[str]]:
    """Return the rows of all tables of a well-formed text."""
    return [[cell.text or "" for cell in row] for row in ElementTree.fromstring(f"<div>{html}</div>").iter("tr")]


def test_a_motion_as_html(circle: ModuleType) -> None:
    """The page of a motion has its kind, the launch as written, the period, the parameters and the events."""
    motion = circle.solve("5/2")
    rows = cells(motion._repr_html_())
    assert ["kind", "libration"] in rows
    assert ["launch at theta", "5/2"] in rows
    assert ["period (s)", repr(motion.period)] in rows
    assert ["g", "9.81"] in rows
    assert [row[0] for row in rows[-len(motion.events) :]] == [event.kind for event in motion.events]


@pytest.mark.parametrize("launch", [{"lam0": 0}, {"lam0": 0, "v0": 20}, {"lam0": 1, "v0": 1, "t_max": 2}])
def test_every_kind_has_its_html(circle: ModuleType, launch: dict[str, object]) -> None:
    """Rest, circulation, and a motion that is followed for some time have pages."""
    motion = circle.solve(**launch)
    assert ["kind", motion.kind] in cells(motion._repr_html_())


def test_events_are_a_tuple_and_a_table(circle: ModuleType) -> None:
    """Events compare as the tuple that they are, and notebooks show their fields."""
    motion = circle.solve("5/2")
    for records in (motion.events, motion.legs, motion.events_between(0, 10), circle.solve(0).events):
        assert isinstance(records, tuple)
        assert records == tuple(records)
        assert len(cells(records._repr_html_())) == 1 + len(records)
    assert motion.events_between(0, 0)._repr_html_() == "<p>none</p>"


def test_dataset(circle: ModuleType) -> None:
    """The columns are those of the state, with units; attributes say what was computed, exactly as it was given."""
    motion = circle.solve("5/2", 1, -1, L="0.9")
    times = np.linspace(0.0, 3.0, 7)
    data = motion.to_xarray(times)
    state = motion.state(times)
    assert data.t.values.tolist() == times.tolist()
    for name in VARIABLES:
        assert data[name].values.tolist() == getattr(state, name).tolist()
    assert (data.x.units, data.normal_force.units, data.t.units) == ("m", "N", "s")
    assert data.lam.parameter == "theta"
    assert data.lam_error.values.tolist() == motion.error_bound(times).tolist()
    wanted = {"module": "swing", "kind": "libration", "lam0": "5/2", "v0": "1", "direction": -1, "contact": "bilateral"}
    assert data.attrs == wanted | {"parameter_L": "0.9", "parameter_g": "9.81", "parameter_m": "1"}


def test_dataset_without_times(circle: ModuleType) -> None:
    """Without times, a dataset has equal steps over one period."""
    motion = circle.solve(1)
    t = motion.to_xarray().t.values
    assert (t[0], t[-1]) == (0.0, motion.period)
    table = motion.to_pandas()
    assert table.t.tolist() == t.tolist()
    assert table.lam.tolist() == motion.lam(t).tolist()
    assert motion.to_pandas([0.5, 1.0]).t.tolist() == [0.5, 1.0]


def test_dataset_without_xarray(circle: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the extra that is missing."""
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(SolutionError, match=r"needs xarray, .* install gqm_sym with its extra \[data\]"):
        circle.solve(1).to_xarray()
