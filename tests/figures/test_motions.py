"""Figures show what the motion says, and files are written in the requested format."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import gqm_sym as gqm
from gqm_sym.errors import InputError
from gqm_sym.figures import animations

# The tolerances for lengths of lines of 800 pieces, and for the distance to an equilibrium that is approached.
SHOWN = 1e-3


@pytest.fixture(scope="module")
def circle(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a pendulum that swings so high that its rod pushes and pulls."""
    model = gqm.derive(gqm.families.circle(), gqm.Gravity(), parameters={"L": 1})
    return gqm.build(model, name="swing", folder=tmp_path_factory.mktemp("figures"))


def labels(axes: object) -> set[str]:
    """Return the entries of a legend."""
    return {text.get_text() for text in axes.get_legend().get_texts()}  # type: ignore[attr-defined]


def test_track(circle: ModuleType) -> None:
    """The coloured line is the orbit, its colours are N, and every kind of event is in the legend."""
    motion = circle.solve(2.5)
    figure = motion.plot()
    axes, bar = figure.axes
    (line,) = axes.collections
    points = np.concatenate(line.get_segments())
    assert np.abs(np.hypot(*points.T) - 1.0).max() <= 1e-14
    assert abs(points[:, 0].max() - 1.0) <= 1e-4
    assert abs(points[:, 1].max() + np.cos(2.5)) <= 1e-12
    force = line.get_array()
    state = motion.state(np.linspace(0.0, motion.period, 200))
    assert abs(force.max() - state.normal_force.max()) <= 0.01 * force.max()
    assert line.norm.vcenter == 0.0
    assert labels(axes) == {"launch", "turn", "contact-sign"}
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (m)", "z (m)")
    assert bar.get_ylabel() == "contact force N (N)"


def test_speed_and_force(circle: ModuleType) -> None:
    """Speed is above and force below, over the arc from turn to turn."""
    motion = circle.solve(2.5)
    above, below = motion.plot("speed_and_force").axes
    s, speed = above.lines[0].get_data()
    assert abs((s.max() - s.min()) - 5.0) <= 1e-13
    assert abs(speed.max() - motion.state(motion.period / 4).v.__abs__()) <= 1e-4
    assert below.get_xlabel() == "arc length s (m)"


def test_a_liftoff_is_marked_where_it_is(circle: ModuleType) -> None:
    """The marker stands at the place where contact is lost."""
    motion = circle.solve(0.3, 5, contact="above")
    axes = motion.plot().axes[0]
    (mark,) = [line for line in axes.lines if line.get_label() == "liftoff"]
    event = motion.events[-1]
    assert mark.get_xydata().tolist() == [[event.x, event.z]]


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("kind", "launch", "arc"),
    [
        ("rest", {"lam0": 0}, 0.0),
        ("circulation", {"lam0": 0, "v0": 20}, 2 * np.pi),
        ("asymptotic", {"lam0": "pi/2", "v0": "sqrt(2*9.81)"}, np.pi / 2),
    ],
)
def test_every_kind_can_be_drawn(circle: ModuleType, kind: str, launch: dict[str, object], arc: float) -> None:
    """Rest, circulation, and a motion without end: each figure shows the arc that is passed."""
    motion = circle.solve(**launch)
    assert motion.kind == kind
    track, speeds, portrait = (motion.plot(what) for what in ("track", "speed_and_force", "portrait"))
    for figure in (track, speeds, portrait):
        figure.draw_without_rendering()
    points = track.axes[0].lines[0].get_xydata()
    assert np.hypot(*np.diff(points, axis=0).T).sum() == pytest.approx(arc, rel=SHOWN)
    assert np.ptp(speeds.axes[0].lines[0].get_xdata()) == pytest.approx(arc, rel=SHOWN)
    curves = [line.get_ydata() for line in portrait.axes[0].lines]
    assert sum(np.isfinite(curve).any() for curve in curves) > 1


@pytest.mark.extended
def test_notebooks_show_figures(circle: ModuleType) -> None:
    """IPython shows each figure as a picture, without pyplot."""
    for what in ("track", "speed_and_force", "portrait"):
        assert circle.solve(1.0).plot(what)._repr_png_().startswith(b"\x89PNG")


def test_axes_of_the_caller(circle: ModuleType) -> None:
    """Figures are drawn on axes that the caller gives."""
    from matplotlib.figure import Figure

    figure = Figure()
    axes = figure.subplots()
    assert circle.solve(1.0).plot(axes=axes) is figure
    pair = Figure()
    assert circle.solve(1.0).plot("speed_and_force", axes=pair.subplots(2, 1)) is pair


def test_an_unknown_figure(circle: ModuleType) -> None:
    """The message lists the figures that there are."""
    with pytest.raises(InputError, match="plot: what: must be one of track, speed_and_force, portrait, got 'map'"):
        circle.solve(1.0).plot("map")


@pytest.mark.extended
def test_animation(circle: ModuleType, tmp_path: Path) -> None:
    """A GIF has as many frames as requested."""
    animations.animate(circle.solve(1.0), tmp_path / "swing.gif", duration=0.2, rate=20)
    assert (tmp_path / "swing.gif").read_bytes().startswith(b"GIF89a")
    with pytest.raises(InputError, match="duration: must be positive"):
        animations.animate(circle.solve(1.0), tmp_path / "none.gif", duration=0)
    with pytest.raises(InputError, match="path: must end in one of"):
        animations.animate(circle.solve(1.0), tmp_path / "swing.foo")
