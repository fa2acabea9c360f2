"""Sweeps can be kept: they print, make tables, know their launches, and are copied and pickled."""

import copy
import pickle
from types import ModuleType

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.errors import ArgumentError
from gqm_sym.runtime import Sweep


@pytest.fixture(scope="module")
def swing(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a pendulum."""
    return gqm.build(
        gqm.derive(gqm.families.circle(L=1), gqm.Gravity()), name="swing", folder=tmp_path_factory.mktemp("a")
    )


@pytest.fixture(scope="module")
def grid(swing: ModuleType) -> Sweep:
    """Return a sweep over three launches and two lengths; one launch is at rest."""
    swept: Sweep = swing.sweep("period", [[0.1], [0.2], [0]], L=[1, 2])
    return swept


def test_the_launches_are_kept(grid: Sweep) -> None:
    """A sweep keeps the quantity and the arguments, as they were given."""
    assert grid.quantity == "period"
    assert grid.arguments["L"] == [1, 2]
    assert grid.arguments["v0"] == 0.0
    values, status, route = grid
    assert values is grid.values
    assert status.shape == route.shape == (3, 2)


def test_a_table(grid: Sweep, swing: ModuleType) -> None:
    """A table has a row for each launch, without what is the same for all, and two columns for turning points."""
    table = grid.to_pandas()
    assert list(table.columns) == ["lam0", "L", "period", "status"]
    assert len(table) == 6
    assert table["L"].tolist() == [1, 2] * 3
    assert table.attrs["g"] == "9.81"
    turns = swing.sweep("turning_points", [0.1, 0.2]).to_pandas()
    assert turns["turning_point_upper"].tolist() == pytest.approx([0.1, 0.2])


def test_a_dataset(grid: Sweep, swing: ModuleType) -> None:
    """An axis along which one argument varies has its name and values; others are numbered."""
    data = grid.to_xarray()
    assert dict(data.sizes) == {"lam0": 3, "L": 2}
    assert data["period"].attrs["units"] == "s"
    assert float(data["period"].sel(L=2).isel(lam0=0)) == grid.values[0, 1]
    together = swing.sweep("half_period", [0.1, 0.2], L=[1.0, 2.0]).to_xarray()
    assert dict(together.sizes) == {"axis_0": 2}
    assert together["L"].dims == ("axis_0",)
    assert swing.sweep("turning_points", [0.1, 0.2]).to_xarray()["turning_point_lower"].dims == ("lam0",)
    assert swing.sweep("period", 0.1).to_xarray()["period"].dims == ()


def test_a_sweep_prints_itself(grid: Sweep, swing: ModuleType) -> None:
    """A sweep prints its size, what is missing and why, and the first rows with units; notebooks show a table."""
    text = str(grid)
    assert text.startswith("period of 6 launches")
    assert "2 without a value" in text
    assert "period (s)" in text
    assert str(swing.sweep("period", np.linspace(0, 1, 30))).endswith("... and 20 more")
    assert grid._repr_html_().count("<tr>") == 7


def test_copies(grid: Sweep) -> None:
    """Copies have everything that the sweep has."""
    for twin in (copy.deepcopy(grid), pickle.loads(pickle.dumps(grid))):
        assert np.array_equal(twin.values, grid.values, equal_nan=True)
        assert (twin.quantity, twin.arguments) == (grid.quantity, grid.arguments)


def test_an_argument_that_there_is_not(swing: ModuleType) -> None:
    """The methods say which argument was probably meant, and which ones there are."""
    calls = {
        "solve": lambda: swing.solve(lam_0=1),
        "sweep": lambda: swing.sweep("period", lam0=1, l=2),
        "pass1": lambda: swing.pass1(0, 1, mass=1),
        "equilibria": lambda: swing.equilibria(G=1),
    }
    hints = {"solve": "did you mean 'lam0'", "sweep": "did you mean 'L'", "pass1": "it takes", "equilibria": "'g'"}
    for name, call in calls.items():
        with pytest.raises(ArgumentError, match=hints[name]) as caught:
            call()
        assert isinstance(caught.value, TypeError)
        assert str(caught.value).startswith(f"swing.{name}: there is no argument")
