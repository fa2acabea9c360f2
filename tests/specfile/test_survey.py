"""Files of surveyed tracks are read, as tables with named columns, and as GPX in local metres, which agree with the
ellipsoid in 30 digits.
"""

from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym.errors import GQMError, InputError

COUNT = 9
TABLE = "".join(f"{k / 4}, {3 - k / 4}, {k}, {k * k / 100}\n" for k in range(COUNT))


def test_columns_by_name(tmp_path: Path) -> None:
    """Named columns may be in any order, with the roll angle; without names the order is x, y, z and roll."""
    (tmp_path / "named.csv").write_text("Roll;z;x;y\n" + TABLE.replace(",", ";"))
    (tmp_path / "bare.csv").write_text(TABLE)
    named, bare = gqm.read_track(tmp_path / "named.csv"), gqm.read_track(str(tmp_path / "bare.csv"))
    k = np.arange(COUNT)
    for found, axes in ((named, ("roll", "z", "x", "y")), (bare, ("x", "y", "z", "roll"))):
        for axis, true in zip(axes, (k / 4, 3 - k / 4, k, k * k / 100), strict=True):
            assert found[axis] == tuple(true)
    assert gqm.Curve.sampled(bare).definition.banked
    (tmp_path / "plane.csv").write_text("z x\n1 2\n3 4\n")
    assert gqm.read_track(tmp_path / "plane.csv") == {"x": (2.0, 4.0), "z": (1.0, 3.0)}


def spec(folder: Path, points: str) -> Path:
    """Write a curve file with these points."""
    file = folder / "track.yaml"
    file.write_text(f"name: track\ncurve: {{points: {points}}}\nkernel: {{gravity: {{}}}}\n")
    return file


def test_curve_files(tmp_path: Path) -> None:
    """The column roll banks the track, unless the file says otherwise; coordinates keep their decimals."""
    (tmp_path / "named.csv").write_text("roll,z,x,y\n" + TABLE)
    banked = gqm.read_spec(spec(tmp_path, "{file: named.csv, heartline: 0.9}")).curve
    assert banked.definition.points.startswith("0 0.0 3.0 0.0\n1 0.01 2.75 0.25\n")
    assert str(banked.banking.heartline) == "9/10"
    level = gqm.read_spec(spec(tmp_path, "{file: named.csv, roll: coordinated}")).curve
    assert level.banking.angle is None
    assert not level.definition.banked
    designed = gqm.read_spec(spec(tmp_path, "{file: named.csv, roll: [coordinated, 12]}")).curve
    assert designed.banking.speed == 12


def gpx(points: str, head: str = "") -> str:
    """Write a file of GPX with these points."""
    other = '<trk><trkseg><trkpt lat="0" lon="0"/></trkseg></trk>'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>{head}<gpx xmlns="http://www.topografix.com/GPX/1/1" version="1.1">'
        f'<wpt lat="1" lon="1"/><trk><trkseg>{points}</trkseg></trk>{other}</gpx>'
    )


def test_places_on_the_earth(tmp_path: Path) -> None:
    """East and north of the first point are those of the vectors between points of the ellipsoid; heights are kept."""
    u = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    places = np.stack([46.95 + 0.004 * np.sin(u), 7.44 + 0.006 * np.cos(u), 540.0 + 30.0 * np.sin(2.0 * u)], axis=1)
    lines = [f'<trkpt lat="{a!r}" lon="{b!r}"><ele> {c!r}</ele><time/></trkpt>' for a, b, c in places.tolist()]
    (tmp_path / "way.GPX").write_text(gpx("".join(lines)))
    found = gqm.read_track(tmp_path / "way.GPX")
    with mp.workdps(30):
        long, flat = mpf(6378137), 1 / mpf("298.257223563")

        def vector(latitude: float, longitude: float, height: float) -> object:
            a, b = mp.radians(mpf(latitude)), mp.radians(mpf(longitude))
            square = flat * (2 - flat)
            out = long / mp.sqrt(1 - square * mp.sin(a) ** 2)
            across = (out + height) * mp.cos(a)
            return mp.matrix([across * mp.cos(b), across * mp.sin(b), (out * (1 - square) + height) * mp.sin(a)])

        a, b = (mp.radians(mpf(angle)) for angle in places[0, :2].tolist())
        east = mp.matrix([-mp.sin(b), mp.cos(b), 0])
        north = mp.matrix([-mp.sin(a) * mp.cos(b), -mp.sin(a) * mp.sin(b), mp.cos(a)])
        for k, place in enumerate(places.tolist()):
            step = vector(*place) - vector(*places[0].tolist())
            for axis, way in (("x", east), ("y", north)):
                assert found[axis][k] == pytest.approx(float(mp.fdot(step, way)), abs=1e-8)
    assert found["z"] == tuple(places[:, 2])
    # A degree of latitude is 111.2 km long there, and one of longitude 76.1 km.
    assert np.ptp(found["y"]) == pytest.approx(0.008 * 111.2e3, rel=2e-3)
    assert np.ptp(found["x"]) == pytest.approx(0.012 * 76.1e3, rel=2e-3)
    assert gqm.read_spec(spec(tmp_path, "{file: way.GPX, closed: true, smoothing: 0.01}")).curve.in_space


POINT = '<trkpt lat="46" lon="7"><ele>5</ele></trkpt>'


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "x,y,z,roll\n1,2,3,4\n1,2,3\n", "'a.csv', row 3: must be 4 numbers, x, y, z, roll, got"),
        ("a.csv", "x,z,roll\n1,2,3\n", "'a.csv', row 1: the columns must be x, z, or x, y, z, perhaps with roll, got"),
        ("a.csv", "x,x\n1,2\n", "'a.csv', row 1: the columns must be"),
        ("a.csv", "x,z\n", "'a.csv': has no points; give a CSV file"),
        ("a.csv", "", "'a.csv', row 1: must be numbers, x and z, or x, y and z, as many in each row"),
        (
            "a.csv",
            "x,y,z\n1,2,3\n1,2\n",
            r"'a.csv', row 3: must be 3 numbers, x, y, z, got \['1', '2'\]; a comma separates numbers",
        ),
        ("a.csv", "x,z\n1,2\n1,nan\n", "'a.csv', row 3: 'nan' is not a finite decimal number"),
        ("a.gpx", gpx(POINT)[:-9], r"'a.gpx', line 1: is no GPX \(unclosed token\)"),
        ("a.gpx", "x,z\n1,2", "'a.gpx', line 1: is no GPX"),
        ("a.gpx", gpx(""), r"'a.gpx', point 1: has no height \(ele\)"),
        ("a.gpx", "<gpx/>", r"'a.gpx': has no points of a track \(trkpt\) or a route \(rtept\)"),
        ("a.gpx", gpx(POINT + '<trkpt lat="91" lon="7"/>'), "'a.gpx', point 2: 91.0, 7.0 are no latitude"),
        ("a.gpx", gpx(POINT + '<trkpt lat="46"/>'), "'a.gpx', point 2: lon: '' is not a finite decimal number"),
        ("a.gpx", gpx(POINT + POINT.replace("46", "47")), "'a.gpx', point 2: is 111 km from the first"),
        ("a.gpx", gpx(POINT, '<!DOCTYPE gpx [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]>'), "'a.gpx': has a document type"),
        ("a.csv", "x,z\n1,0,2,0\n", "'a.csv', row 2: must be 2 numbers, x, z, got"),
        ("a.csv", "1,0;2,0\n", "'a.csv', row 1: has commas and semicolons; write decimals with a point"),
        ("a.csv", "x,z\n1_0,2\n", "'a.csv', row 2: '1_0' is not a finite decimal number"),
        ("a.csv", "1,١\n", "'a.csv', row 1: '١' is not a finite decimal number"),
        ("a.gpx", gpx('<trkpt lat="1" lon="1">' + POINT + "</trkpt>"), r"'a.gpx', point 1: has no height \(ele\)"),
        ("a.gpx", gpx('<trkpt lat="1" lon="1"/></trkseg></trk><trk><trkseg><ele>5</ele>'), "'a.gpx', point 1: has no"),
        ("a.gpx", gpx('<trkpt lat="1" lon="1"><ele>1_0</ele></trkpt>'), "'a.gpx', point 1: ele: '1_0' is not a finite"),
        ("b/a.csv", "", "read_track: path: there is no file"),
        ("9" * 300, "", "read_track: path: there is no file"),
    ],
)
def test_what_is_no_track(tmp_path: Path, name: str, text: str, message: str) -> None:
    """Each file that is no track gives one error that says what is wrong and where; nothing in it is expanded."""
    if "/" not in name and len(name) < 300:
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=f"^{message}"):
        gqm.read_track(tmp_path / name)


def test_errors_of_points_name_their_row(tmp_path: Path) -> None:
    """Rows are counted in the file."""
    (tmp_path / "named.csv").write_text("roll,z,x,y\n" + TABLE.replace("0.75, 2.25, 3,", "high, 2.25, 3,"))
    with pytest.raises(GQMError, match=r"'named.csv', row 5: 'high' is not a decimal number"):
        gqm.read_spec(spec(tmp_path, "named.csv"))
