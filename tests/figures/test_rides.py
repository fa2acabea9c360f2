"""The picture of a ride shows what the states of the motion say."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mpl_toolkits.mplot3d import proj3d
from PIL import Image

import generated.viviani
import gqm_sym as gqm
from gqm_sym.errors import InputError


@pytest.fixture(scope="module")
def hills(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Return a closed track with three hills, banked for 14 m/s."""
    track = gqm.Curve.space(
        x="40*cos(u)", y="60*sin(u)", z="6*cos(3*u)", parameter="u", roll=("coordinated", 14), heartline="1.1"
    )
    return gqm.build(gqm.derive(track, gqm.Gravity()), name="hills", folder=tmp_path_factory.mktemp("rides"))


@pytest.mark.extended
def test_a_ride(hills: ModuleType, tmp_path: Path) -> None:
    """Track and loads are those of states, the colours are the vertical load, and limits are drawn at their values."""
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


@pytest.mark.extended
def test_the_labels_of_a_flat_track_do_not_overlap(tmp_path: Path) -> None:
    """The numbers on all axes are apart from each other, although the track is 100 times as long as high."""
    track = gqm.Curve.space(x="20*u", y="8*sin(u/2)", z="cos(u)/2", parameter="u", roll="u/8")
    motion = gqm.build(gqm.derive(track, gqm.Gravity()), name="flat", folder=tmp_path).solve(-3, 30, t_max=4)
    figure = gqm.figures.ride(motion)
    figure.canvas.draw()
    view = next(axes for axes in figure.axes if hasattr(axes, "get_zlim"))
    corner = np.array([view.get_xlim()[1], view.get_ylim()[1], view.get_zlim()[1]])
    for k, axis in enumerate((view.xaxis, view.yaxis, view.zaxis)):
        ticks = axis.get_ticklocs()
        places = np.tile(corner, (len(ticks), 1))
        places[:, k] = ticks
        shown = view.transData.transform(np.transpose(proj3d.proj_transform(*places.T, view.get_proj())[:2]))
        assert len(ticks) > 1
        assert np.linalg.norm(np.diff(shown, axis=0), axis=1).min() > axis.get_ticklabels()[0].get_size()


@pytest.mark.extended
def test_seats_and_their_animation(hills: ModuleType, tmp_path: Path) -> None:
    """Loads of three cars are drawn against their places; the frames of an animation show all cars in space."""
    track = gqm.Curve.space(
        x="40*cos(u)", y="60*sin(u)", z="6*cos(3*u)", parameter="u", roll=("coordinated", 14), heartline="1.1"
    )
    module = gqm.build(gqm.derive(track, gqm.Gravity() + gqm.Train(length=9, cars=4)), name="hilly", folder=tmp_path)
    motion = module.solve(0, 10, t_max=3)
    figure = gqm.figures.seats(motion, limits={"vertical": 3})
    assert [axes.get_ylabel() for axes in figure.axes] == [
        f"{load} load (9.80665 m/s²)" for load in ("vertical", "lateral", "longitudinal")
    ]
    times = gqm.figures.sampled(motion).t
    cars = motion.cars(times)
    for axes, load in zip(figure.axes, ("vertical", "lateral", "longitudinal"), strict=True):
        lines = {line.get_label(): line for line in axes.lines}
        for seat, car in (("first car", 3), ("middle car", 2), ("last car", 0)):
            s, felt = lines[seat].get_data()
            assert np.array_equal(s, cars.lam[car])
            assert np.array_equal(felt, getattr(cars, f"n_{load}")[car])
    gqm.figures.animate(motion, tmp_path / "ride.gif", duration=0.3, rate=10)
    with Image.open(tmp_path / "ride.gif") as frames:
        assert frames.n_frames == 3
    with pytest.raises(InputError, match="is not a train"):
        gqm.figures.seats(hills.solve(0, 10))


def test_an_animation_in_space(tmp_path: Path) -> None:
    """The frames show a bead on a curve in space, coloured by the contact force."""
    gqm.figures.animate(generated.viviani.solve("3/10"), tmp_path / "bead.gif", duration=0.2, rate=10)
    with Image.open(tmp_path / "bead.gif") as frames:
        assert frames.n_frames == 2


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ([1, 2], "limits: must be levels by load"),
        ({"upwards": 1}, "limits: must be one of vertical"),
        ({"lateral": "high"}, "limits: lateral: must be finite numbers"),
    ],
)
def test_bad_limits(hills: ModuleType, limits: Any, message: str) -> None:
    """Each bad limit is refused with a reason."""
    with pytest.raises(InputError, match=message):
        gqm.figures.ride(hills.solve(0, 10), limits=limits)


def test_no_ride_without_a_banking() -> None:
    """Loads on riders are not known without a banking."""
    with pytest.raises(InputError, match="ride: the load on a rider depends on the banking"):
        gqm.figures.ride(generated.viviani.solve("3/10"))
