"""The curves in figures of models have their energies, and separatrices pass through the equilibria."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.errors import InputError, ParameterError, SolutionError

G = 9.81


@pytest.fixture(scope="module")
def circle(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return the pendulum, with 0 at the bottom."""
    model = gqm.derive(gqm.families.circle(), gqm.Gravity(), parameters={"L": 1})
    return gqm.build(model, name="swing", folder=tmp_path_factory.mktemp("portraits"))


@pytest.fixture(scope="module")
def wells(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return two wells of unequal depth on an endless curve."""
    model = gqm.derive(gqm.Curve.graph("x**4 - 2*x**2 + x/4"), gqm.Gravity())
    return gqm.build(model, name="wells", folder=tmp_path_factory.mktemp("portraits"))


def curves(figure: object, label: str) -> list[np.ndarray]:
    """Return points of the lines of a label, on both branches."""
    (axes,) = figure.axes  # type: ignore[attr-defined]
    named = [k for k, line in enumerate(axes.lines) if line.get_label() == label]
    return [axes.lines[i].get_xydata() for k in named for i in (k, k + 1)]


def test_separatrix_of_the_pendulum(circle: ModuleType) -> None:
    """The separatrix is V = 2*sqrt(g)*|cos(theta/2)|, through the tops, at which the body could rest."""
    figure = gqm.figures.phase_portrait(circle)
    branches = curves(figure, "separatrix")
    assert len(branches) == 4
    for theta, v in map(np.transpose, branches):
        assert np.nanmax(np.abs(np.abs(v) - 2 * np.sqrt(G) * np.abs(np.cos(theta / 2)))) <= 2e-7
    (axes,) = figure.axes
    marks = {line.get_label(): line.get_xdata() for line in axes.lines}
    assert np.abs(marks["unstable equilibrium"] - [-np.pi, np.pi]).max() <= 1e-7
    assert np.abs(marks["stable equilibrium"]).min() <= 1e-7
    assert axes.get_ylabel() == "velocity ds/dt (m/s)"


def test_level_stretches_have_no_equilibria(tmp_path: Path) -> None:
    """The top of a loop is marked; on straight level pieces a body may rest anywhere, and no place is marked."""
    rail = gqm.Curve.piecewise([gqm.line(length=2), gqm.arc(radius=1, angle="2*pi"), gqm.line(length=2)])
    module = gqm.build(gqm.derive(rail, gqm.Gravity()), name="loop", folder=tmp_path)
    (axes,) = gqm.figures.phase_portrait(module).axes
    marks = {line.get_label(): line.get_xdata() for line in axes.lines}
    assert marks["unstable equilibrium"] == pytest.approx([2 + np.pi], abs=1e-6)
    assert "stable equilibrium" not in marks


@pytest.mark.extended
def test_separatrix_ends_at_its_turning_points(wells: ModuleType) -> None:
    """The loops round both wells are closed, and all of their points have the energy of the barrier."""
    figure = gqm.figures.phase_portrait(wells, (-2, 2))
    barrier = np.sort(np.roots([4, 0, -4, 0.25]).real)[1]

    def height(x: np.ndarray) -> np.ndarray:
        return x**4 - 2 * x**2 + x / 4

    # Between places of the grid turning points lie on chords, with an error of at most h''*step**2/8, times 2g.
    chord = G * 44 * (4 / 1600) ** 2 / 4
    for x, v in map(np.transpose, curves(figure, "separatrix")):
        inside = np.isfinite(v)
        energy = v[inside] ** 2 + 2 * G * (height(x[inside]) - height(barrier))
        assert np.abs(energy).max() <= chord
        assert np.abs(energy[1:-1]).max() <= 1e-12
        assert v[inside][0] == v[inside][-1] == 0.0


def test_a_launch_is_on_its_orbit(circle: ModuleType) -> None:
    """The curve that is drawn through a launch has its energy, however many turns away the launch is."""
    figure = gqm.figures.phase_portrait(circle, through=[("4*pi + 1/2", 3)])
    (axes,) = figure.axes
    (mark,) = [line for line in axes.lines if line.get_label() == "launch"]
    assert np.abs(mark.get_xydata() - [0.5, 3.0]).max() <= 1e-14
    orbit = axes.lines[axes.lines.index(mark) - 2].get_xydata()
    theta, v = orbit[np.isfinite(orbit[:, 1])].T
    # The grid is 3*pi/1600 wide, and heights are interpolated between its places.
    assert np.abs(v**2 - 2 * G * np.cos(theta) - (9 - 2 * G * np.cos(0.5))).max() <= G * (3 * np.pi / 1600) ** 2 / 2


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        ({}, InputError, "give the range"),
        ({"lam": (1, 1)}, InputError, "must be a range"),
        ({"lam": (0, 1), "levels": 0}, InputError, "levels: must be at least 1"),
        ({"lam": (0, 1), "h": 2}, ParameterError, "h: is not a parameter of this module; its parameters are g, m"),
    ],
)
def test_what_cannot_be_drawn(options: dict, error: type[Exception], said: str, wells: ModuleType) -> None:
    """The message says what to give."""
    with pytest.raises(error, match=said):
        gqm.figures.phase_portrait(wells, **options)


def test_period_against_amplitude(circle: ModuleType) -> None:
    """Amplitudes along the arc are in ascending order, with the periods of the motions themselves; L scales them."""
    figure = gqm.figures.period_against_amplitude(circle, [2, 1, "pi", "-1/2"], L=4)
    (line,) = figure.axes[0].lines
    amplitude, period = line.get_data()
    assert np.abs(amplitude - [2.0, 4.0, 8.0]).max() <= 1e-13
    assert period.tolist() == [circle.solve(place, L=4).period for place in ("1/2", 1, 2)]
    with pytest.raises(SolutionError, match="never librates"):
        gqm.figures.period_against_amplitude(circle, ["pi", 0])


def test_equal_periods_look_equal(tmp_path_factory: pytest.TempPathFactory) -> None:
    """On the tautochrone the axis does not magnify rounding to the size of the figure."""
    model = gqm.derive(gqm.families.cycloid(inverted=True), gqm.Gravity(), parameters={"R": 1})
    cycloid = gqm.build(model, name="tautochrone", folder=tmp_path_factory.mktemp("portraits"))
    (axes,) = gqm.figures.period_against_amplitude(cycloid, [0.5, 1, 2, 3]).axes
    low, high = axes.get_ylim()
    assert high - low >= 0.1 * 4 * np.pi / np.sqrt(G)


def test_portrait_of_a_motion(wells: ModuleType) -> None:
    """The portrait of a motion shows its orbit, and somewhat more."""
    motion = wells.solve(-1.2, 1, -1)
    (axes,) = motion.plot("portrait").axes
    low, high = axes.get_xlim()
    a, b = sorted(motion.turning_points)
    assert np.abs(np.array([a - low, high - b]) - 0.4 * (b - a)).max() <= 1e-12
    (mark,) = [line for line in axes.lines if line.get_label() == "launch"]
    assert mark.get_xydata().tolist() == [[-1.2, -1.0]]


def test_a_launch_in_another_round_is_drawn_in_this_one(circle: ModuleType) -> None:
    """A launch three rounds away is drawn at the same place."""
    drawn = []
    for place in (0.5, 0.5 + 6.0 * np.pi, 0.5 - 4.0 * np.pi):
        (axes,) = gqm.figures.phase_portrait(circle, levels=1, through=[(place, 2)]).axes
        (launch,) = [line.get_xydata() for line in axes.lines if line.get_label() == "launch"]
        drawn.append(launch[0])
    assert drawn[0] == pytest.approx([0.5, 2.0])
    assert np.abs(np.array(drawn[1:]) - drawn[0]).max() <= 1e-14


def test_a_range_without_a_curve(tmp_path: Path) -> None:
    """A range in which the curve is not real cannot be drawn."""
    module = gqm.build(gqm.derive(gqm.Curve.graph("sqrt(x)"), gqm.Gravity()), name="root", folder=tmp_path)
    with pytest.raises(SolutionError, match="the energy is finite nowhere in the range; give another lam"):
        gqm.figures.phase_portrait(module, (-3, -1))
