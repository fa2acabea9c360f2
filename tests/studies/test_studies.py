"""Sweep files are read with care, stored part by part, and give the same whoever computes them and however often they
are interrupted.
"""

import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym import studies as sweeps
from gqm_sym.cli import tool
from gqm_sym.cli.progress import Bar
from gqm_sym.errors import InputError, SpecFileError
from gqm_sym.runtime.sweep import cluster
from gqm_sym.runtime.sweep.quantities import QUANTITIES, STATUS_SENTENCES
from gqm_sym.studies import read_sweep, run, sweep_schema
from gqm_sym.studies.plan import evenly
from gqm_sym.studies.results import DESCRIBED

CURVES = {
    "swing": "curve: {family: {name: circle, L: L}}\nkernel: {gravity: {}}\nparameters: {L: {value: 1, unit: m}}\n"
    "launch: {lam0: 1.2, v0: 0}\n",
    "floor": "curve: {graph: {z: 0*x}}\nkernel: {gravity: {}, coulomb: {mu_static: mu_static}}\n"
    "parameters: {mu: 0.1, mu_static: null}\n",
}
PERIODS = """\
title: Pendulums
curve: swing.yaml
quantities: [half_period, turning_points]
grid:
  lam0: {start: 0.1, stop: 3, num: 30}
  L: {values: [50, 100], unit: cm}
"""
# The tolerance of half periods away from barriers, in units in the last place.
ULPS = 4.0


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with curve files and a sweep file, in which commands run."""
    monkeypatch.chdir(tmp_path)
    for name, text in CURVES.items():
        Path(f"{name}.yaml").write_text(f"name: {name}\n{text}")
    Path("periods.yaml").write_text(PERIODS)
    return tmp_path


def half_period(amplitude: float, length: float) -> float:
    """Return the half period of a pendulum in closed form."""
    with mp.workdps(40):
        k = mp.sin(mpf(amplitude) / 2)
        return float(2 * mp.ellipk(k * k) * mp.sqrt(mpf(length) / mpf("9.81")))


# -- results ---------------------------------------------------------------------------------------


def test_a_grid(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A grid has all combinations, in SI, each with its closed form; with names, units and its origin."""
    import xarray

    assert tool.main(["sweep", "periods.yaml"]) == 0
    said = capsys.readouterr()
    assert said.out == "  30 lam0 x 2 L: half_period, turning_points\nwrote periods.nc\n"
    assert said.err == ""
    with xarray.open_dataset("periods.nc", engine="h5netcdf") as data:
        data.load()
    assert data.half_period.dims == ("lam0", "L")
    assert data.lam0.values.tolist() == [float(Fraction(k, 10)) for k in range(1, 31)]
    assert data.L.values.tolist() == [0.5, 1.0]
    assert (data.half_period.units, data.L.units, data.lam0.units, data.turning_point_upper.units) == (
        *"sm",
        *["rad"] * 2,
    )
    for row, amplitude in zip(data.half_period.values, data.lam0.values, strict=True):
        for value, length in zip(row, data.L.values, strict=True):
            truth = half_period(float(amplitude), float(length))
            assert abs(value - truth) <= ULPS * np.spacing(truth)
    assert data.turning_point_upper.values[:, 0].tolist() == data.lam0.values.tolist()
    assert data.turning_point_lower.values[:, 1] == pytest.approx(-data.lam0.values, rel=4e-16)
    assert not data.half_period_status.values.any()
    assert (data.title, data.fixed_v0, data.sweep_file) == ("Pendulums", "0", PERIODS)
    assert data.curve_file == Path("swing.yaml").read_text()
    assert sorted(path.name for path in here.iterdir()) == ["floor.yaml", "periods.nc", "periods.yaml", "swing.yaml"]


def test_a_table_of_bodies_that_come_to_rest(here: Path) -> None:
    """On a rough floor bodies stop after v0^2/(2 mu g) and v0/(mu g); an impossible row says so, and the others are
    computed.
    """
    import xarray

    Path("launches.csv").write_text("v0,mu,lam\n3.6,0.1,0.1\n7.2,0.2,0.1\n7.2,0.5,0.1\n0,0.1,0.1\n")
    Path("rest.yaml").write_text(
        "curve: floor.yaml\nquantities: [rest_position, t_end, v_max, normal_force_min, time_at, period]\n"
        "table: {file: launches.csv, units: {v0: km/h}}\nfixed: {lam0: 0, mu_static: 0.3}\n"
    )
    data = run(read_sweep("rest.yaml"), "rest.zarr")
    v0, mu, g = np.array([1.0, 2.0]), np.array([0.1, 0.2]), 9.81
    assert data.v0.values.tolist() == [1.0, 2.0, 2.0, 0.0]
    assert data.rest_position.dims == ("row",)
    assert data.rest_position.values[:2] == pytest.approx(v0**2 / (2 * mu * g), rel=1e-14)
    assert data.t_end.values[:2] == pytest.approx(v0 / (mu * g), rel=1e-14)
    assert data.v_max.values[:2] == pytest.approx(v0, rel=5e-16)
    assert data.normal_force_min.values[:2] == pytest.approx(9.81, rel=1e-15)
    assert data.time_at.values[:2] == pytest.approx((v0 - np.sqrt(v0**2 - 2 * mu * g * 0.1)) / (mu * g), rel=1e-14)
    assert [STATUS_SENTENCES[k] for k in data.period_status.values[[0, 1]]] == [STATUS_SENTENCES[2]] * 2
    assert np.isnan(data.rest_position.values[2])
    assert "refused" in STATUS_SENTENCES[data.rest_position_status.values[2]]
    assert data.rest_position_status.first_refused == (
        "at v0 = 2.0, mu = 0.5, lam = 0.1: mu_static: must be at least mu = 0.5, got 0.3"
    )
    assert (data.rest_position.values[3], data.rest_position_status.values[3]) == (0.0, 0)
    with xarray.open_zarr("rest.zarr", consolidated=False) as again:
        assert again.load().identical(data)


def test_contact_and_horizon(here: Path) -> None:
    """Outside a circle the body leaves at two thirds of its height; a horizon ends other motions."""
    Path("falls.yaml").write_text(
        "curve: swing.yaml\nquantities: [v_max, t_end]\ncontact: below\ngrid: {lam0: [2.5, 3.0], L: [1, 2]}\n"
    )
    data = run(read_sweep("falls.yaml"), "falls.nc")
    top = np.cos(np.pi - data.lam0.values[:, None])
    assert data.v_max.values == pytest.approx(np.sqrt(2 * 9.81 * data.L.values * top / 3), rel=1e-14)
    Path("falls.yaml").write_text(
        "curve: swing.yaml\nquantities: [v_max, t_end]\nfixed: {t_max: 250 }\ngrid: {lam0: [0.5, 1]}\n"
    )
    data = run(read_sweep("falls.yaml"), "horizon.nc")
    assert data.t_end.values.tolist() == [250.0, 250.0]
    assert data.v_max.values == pytest.approx(np.sqrt(2 * 9.81 * (1 - np.cos([0.5, 1]))), rel=1e-14)


def test_evenly_spaced_numbers_are_the_nearest_doubles() -> None:
    """Thirds, tenths and parts of pi are each rounded once."""
    assert evenly("0", "1", 4).tolist() == [0.0, 1 / 3, 2 / 3, 1.0]
    assert evenly("-0.3", "0.3", 7).tolist() == [-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3]
    with mp.workdps(40):
        assert evenly("-pi", "pi/2", 16).tolist() == [float(mp.pi * (k - 10) / 10) for k in range(16)]
    assert evenly("1e300", "-1e300", 3).tolist() == [1e300, 0.0, -1e300]


# -- files ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "instead", "message"),
    [
        ("title: Pendulums", "titel: Pendulums", "1:1: unknown key 'titel'; did you mean title?"),
        ("curve: swing.yaml", "curve: ../swing.yaml", "2:8: curve: '../swing.yaml': must be a path inside the YAML"),
        ("curve: swing.yaml", "curve: none.yaml", "2:8: curve: 'none.yaml': there is no such file in this folder"),
        ("[half_period, turning", "[half_time, turning", "3:14: quantities.0: must be 'half_period', 'period'"),
        ("[half_period, turning_points]", "[]", "3:13: quantities: must have"),
        (
            "[half_period, turning",
            "[time_at, turning",
            "3:1: 'time_at' needs lam, the place that it asks about; add it",
        ),
        ("grid:", "table: a.csv\ngrid:", "4:1: grid and table are given; give one of them"),
        ("start: 0.1, ", "", "5:3: grid.lam0: does not say what its values are; give start, stop and num, or values"),
        ("num: 30", "num: 30.5", "5:36: grid.lam0.num: must be a whole number from 2 to 10000000, got '30.5'"),
        ("num: 30", "num: 6000000", "6:3: grid: has more than 10000000 points; give fewer values"),
        ("stop: 3", "stop: 1/0", "5:30: grid.lam0.stop: division by zero"),
        ("stop: 3", "stop: __import__('os')", "5:39: grid.lam0.stop: unexpected"),
        ("unit: cm", "unit: kg", "6:32: grid.L.unit: must be in m or a multiple of it, got kg"),
        ("  L:", "  Lo:", "6:3: grid: there is no 'Lo' in swing.yaml; did you mean L?"),
        ("  L:", "  v0:", "6:33: grid.v0.unit: must be in m/s or a multiple of it, got cm"),
        ("[50, 100]", "[-50, 100]", "6:3: grid: L must be positive"),
        ("  L: {values: [50, 100], unit: cm}", "  v0: [-1]", "6:3: grid: v0 is a speed and cannot be negative"),
        ("  L: {values: [50, 100], unit: cm}", "  direction: [0]", "6:3: grid: direction must be 1 or -1"),
        ("grid:", "fixed: {L: 2}\ngrid:", "4:9: fixed: 'L' varies; give its values in one place"),
        ("grid:", "fixed: {lam: 2}\ngrid:", "3:1: lam is for 'time_at', which is not asked; ask it, or remove lam"),
        ("swing.yaml", "floor.yaml", "1:1: mu_static has no value; add fixed: {mu_static: ...}, or let it vary"),
        (PERIODS, "[]", "1:1: the file holds a list, not a mapping; begin with 'curve: ...'"),
        (PERIODS, "", "1:1: the file is empty; give at least curve, quantities and grid"),
        (PERIODS, "title: a", "1:1: curve is missing; add curve: pendulum.yaml"),
    ],
)
def test_mistakes_have_their_place(line: str, instead: str, message: str, here: Path) -> None:
    """Mistakes are reported with file, line, column, what is wrong and what would be right; nothing is run."""
    assert line in PERIODS
    Path("periods.yaml").write_text(PERIODS.replace(line, instead))
    Path("a.csv").write_text("v0\n1\n")
    with pytest.raises(SpecFileError) as caught:
        read_sweep("periods.yaml")
    assert any(mistake.startswith(f"periods.yaml:{message}") for mistake in caught.value.mistakes), caught.value


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (None, "'a.csv': there is no such file in this folder"),
        ("1,2\n3,4\n", "'a.csv', row 1: must name the columns"),
        ("lam0\n", "'a.csv', row 1: must name the columns"),
        ("lam0,lam0\n1,2\n", "'a.csv', row 1: names a column twice"),
        ("lam0,v0\n1,2\n3\n", "'a.csv', row 3: must have 2 numbers, has 1"),
        ("lam0,v0\n1,pi\n", "'a.csv', row 2: 'pi' is not a finite decimal number"),
        ("lam0,v0\n1,inf\n", "'a.csv', row 2: 'inf' is not a finite decimal number"),
        ("lam0,v0\n1,1e-400000000\n", "'a.csv', row 2: '1e-400000000' is not a finite decimal number"),
        ("lam0,v_0\n1,2\n", "there is no 'v_0' in swing.yaml; did you mean v0?"),
    ],
)
def test_bad_tables_are_refused(rows: str | None, message: str, here: Path) -> None:
    """Bad tables are refused with the file and its row."""
    if rows is not None:
        Path("a.csv").write_text(rows)
    Path("a.yaml").write_text("curve: swing.yaml\nquantities: [period]\ntable: a.csv\n")
    with pytest.raises(SpecFileError, match=r"a\.yaml:3:") as caught:
        read_sweep("a.yaml")
    assert message in str(caught.value)


def test_columns_in_units(here: Path) -> None:
    """Columns in units, also of angles, give the nearest doubles of exact products."""
    Path("a.csv").write_text("lam0\tL\n90\t0.3\n-30\t110\n")
    Path("a.yaml").write_text(
        "curve: swing.yaml\nquantities: [period]\ntable: {file: a.csv, units: {lam0: deg, L: cm}}\n"
    )
    place, length = read_sweep("a.yaml").axes
    with mp.workdps(40):
        assert place.values.tolist() == [float(mp.pi / 2), float(-mp.pi / 6)]
    assert length.values.tolist() == [0.003, 1.1]


def test_files_that_are_none_are_refused(here: Path) -> None:
    """A link out of the folder and a pipe without end are refused."""
    os.mkfifo("pipe.yaml")
    Path("inside").mkdir()
    Path("inside/link.yaml").symlink_to(here / "swing.yaml")
    for where, name, message in ((".", "pipe.yaml", "is not a plain file"), ("inside", "link.yaml", "by a link")):
        path = Path(where) / "a.yaml"
        path.write_text(f"curve: {name}\nquantities: [period]\ngrid: {{lam0: [1, 2]}}\n")
        with pytest.raises(SpecFileError, match=message):
            read_sweep(path)


def test_every_quantity_has_a_name_and_a_unit() -> None:
    """Every quantity of a sweep is described in the results."""
    assert set(QUANTITIES) - {"turning_points"} <= set(DESCRIBED)


def test_the_schema_describes_what_is_read(capsys: pytest.CaptureFixture[str]) -> None:
    """`gqm schema --sweep` prints the schema, in the draft that editors know."""
    assert tool.main(["schema", "--sweep"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema == sweep_schema()
    assert schema["$schema"] == "http://json-schema.org/draft-07/schema#"
    assert set(schema["properties"]) == {"title", "curve", "quantities", "grid", "table", "fixed", "contact"}
    assert "rest_position" in schema["properties"]["quantities"]["items"]["enum"]


# -- interrupted, refused, begun anew -------------------------------------------------------------------

LONG = "curve: swing.yaml\nquantities: [half_period]\ngrid: {lam0: {start: 0.1, stop: 2.9, num: 100000}}\n"

# This process ends itself as in a power cut when the second part is stored.
KILLED = """\
import os, signal, sys
from gqm_sym.cli import tool
from gqm_sym.studies.store import Store

put = Store.put

def killing(self, number, swept):
    put(self, number, swept)
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)

Store.put = killing
sys.exit(tool.main(["sweep", "long.yaml"]))
"""


def test_a_killed_sweep_goes_on(here: Path) -> None:
    """Of 100000 points those that were stored are not computed again, and the file is the same to the last byte."""
    Path("long.yaml").write_text(LONG)
    plan = read_sweep("long.yaml")
    run(plan, "whole.nc")
    code = subprocess.run(
        [sys.executable, "-c", KILLED], env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}, check=False
    )
    assert code.returncode == -signal.SIGKILL
    assert not Path("long.nc").exists()
    told: list[tuple[int, int]] = []
    run(plan, "long.nc", progress=lambda *done: told.append(done))
    assert told[0] == (2 * plan.part, 100_000)
    assert told[-1] == (100_000, 100_000)
    assert Path("long.nc").read_bytes() == Path("whole.nc").read_bytes()
    assert not list(here.glob("*.parts"))


def test_a_damaged_part_is_computed_again(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts that an interruption leaves are used if they are sound."""
    plan = read_sweep("periods.yaml")
    object.__setattr__(plan, "part", 13)
    whole = run(plan, "whole.nc")

    def stop(done: int, size: int) -> None:
        if done > 40:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(plan, "cut.nc", progress=stop)
    parts = sorted(Path("cut.nc.parts").glob("*.npz"))
    assert [part.stem for part in parts] == ["000000", "000001", "000002", "000003"]
    parts[0].write_bytes(parts[0].read_bytes()[:-100])
    parts[1].write_bytes(b"")
    np.savez(parts[2], other=np.zeros(3))
    told: list[int] = []
    assert run(plan, "cut.nc", progress=lambda done, _: told.append(done)).identical(whole)
    assert told == [13, 26, 39, 52, 60]
    assert Path("cut.nc").read_bytes() == Path("whole.nc").read_bytes()


def test_an_interruption_says_what_to_do(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The exit code is that of interrupted programs, and the message says that nothing is lost."""

    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(sweeps, "run", interrupted)
    assert tool.main(["sweep", "periods.yaml"]) == 130
    assert "the results so far are stored; the same command continues from there" in capsys.readouterr().err


def test_what_is_there_is_not_lost(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A complete file is kept; other files and parts are refused unless forced; the file's ending determines the
    format.
    """
    assert tool.main(["sweep", "periods.yaml", "-o", "a.nc"]) == 0
    made = Path("a.nc").stat().st_mtime_ns
    assert tool.main(["sweep", "periods.yaml", "-o", "a.nc"]) == 0
    assert Path("a.nc").stat().st_mtime_ns == made
    Path("periods.yaml").write_text(PERIODS.replace("num: 30", "num: 3"))
    capsys.readouterr()
    assert tool.main(["sweep", "periods.yaml", "-o", "a.nc"]) == 2
    assert "a.nc: is there already, and is not of this sweep" in capsys.readouterr().err
    Path("notes.nc").write_text("mine")
    assert tool.main(["sweep", "periods.yaml", "-o", "notes.nc"]) == 2
    Path("b.nc.parts").mkdir()
    assert tool.main(["sweep", "periods.yaml", "-o", "b.nc"]) == 2
    assert "b.nc.parts: holds parts of another sweep" in capsys.readouterr().err
    assert tool.main(["sweep", "periods.yaml", "-o", "a.txt"]) == 2
    assert tool.main(["sweep", "none.yaml"]) == 2
    assert Path("notes.nc").read_text() == "mine"
    assert tool.main(["sweep", "periods.yaml", "-o", "a.nc", "--force"]) == 0
    assert "3 lam0 x 2 L" in capsys.readouterr().out


def test_without_xarray(here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the extra that is missing, before anything is computed."""
    monkeypatch.setitem(sys.modules, "xarray", None)
    assert tool.main(["sweep", "periods.yaml"]) == 3
    assert "install gqm_sym with its extra [data]" in capsys.readouterr().err
    assert not list(here.glob("periods.nc*"))


def test_the_bar() -> None:
    """The bar is drawn in place on a terminal, and nowhere else."""

    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    for stream, drawn in ((Terminal(), True), (io.StringIO(), False)):
        bar = Bar(stream)
        bar(0, 60)
        bar(20, 60)
        bar.close()
        assert stream.getvalue().endswith(f"\r[{'#' * 10}{'.' * 20}]  33%  20 of 60 points\n" if drawn else "")
        assert bool(stream.getvalue()) == drawn


# -- on a cluster -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    """Return a cluster of one worker on this machine, which is a process."""
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as machines,
        distributed.Client(machines) as connected,
    ):
        yield connected


def test_a_cluster_gives_the_same_numbers(client: Any, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The numbers are the same to the last byte of the file, and of the arrays of `module.sweep`; by address from the
    command line.
    """
    Path("long.yaml").write_text(LONG)
    plan = read_sweep("long.yaml")
    run(plan, "here.nc")
    address = client.scheduler.address
    assert tool.main(["sweep", "long.yaml", "-o", "there.nc", "--scheduler", address]) == 0
    assert Path("there.nc").read_bytes() == Path("here.nc").read_bytes()
    spec = gqm.read_spec("swing.yaml")
    module = gqm.build(spec.derive(), name="swing")
    lam0, length = np.linspace(0.1, 2.9, 20_000), np.array([[0.5], [2.0]])
    for quantity in ("half_period", "turning_points"):
        near, far = (module.sweep(quantity, lam0, L=length, client=at) for at in (None, client))
        assert far.values.tobytes() == near.values.tobytes()
        assert far.values.shape == near.values.shape
        assert (far.status == near.status).all()
    one = module.sweep("period", "6/5", client=client)
    assert one.values == module.sweep("period", "6/5").values
    with pytest.raises(InputError, match="v0: is a speed"):
        module.sweep("period", [0.1, 0.2], -1.0, client=client)
    with pytest.raises(InputError, match=r"lam0 \(2,\), v0 \(3,\)"):
        module.sweep("period", [0.1, 0.2], [1, 2, 3], client=client)


def test_a_worker_of_another_version_is_refused(client: Any, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker of another version is refused, because its numbers might differ in their last places."""
    monkeypatch.setattr(cluster, "STAMP", "another")
    module = gqm.build(gqm.read_spec("swing.yaml").derive(), name="swing")
    with pytest.raises(gqm.GQMError, match="another version of gqm_sym"):
        module.sweep("period", [0.1, 0.2], client=client)


@pytest.mark.extended
def test_no_scheduler(here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """An address at which no scheduler answers gives an error."""
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "TIMEOUT", 0.1)
    assert tool.main(["sweep", "periods.yaml", "--scheduler", "tcp://127.0.0.1:1"]) == 2
    assert "no Dask scheduler answers there" in capsys.readouterr().err
