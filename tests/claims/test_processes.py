"""Imports are light, machine code is kept, and the bytes written are the same in all processes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

CURVES = sorted(path.stem for path in (ROOT / "curves").glob("*.yaml"))

# This code runs first and makes the named packages impossible to import.
BLOCK = """
import sys

class Block:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"sympy", "jinja2", "pydantic", "ruamel", "scipy"}:
            raise ImportError(f"{name} is blocked")

sys.meta_path.insert(0, Block())
"""

IMPORT_ALL = """
import importlib, json
names = json.loads(sys.argv[1])
modules = {name: importlib.import_module(f"generated.{name}") for name in names}
motion = modules["pendulum"].solve("-pi/2 + 6/5")
print(json.dumps([sorted(modules), motion.half_period.hex(), motion.lam(1000).hex()]))
"""

COUNT_COMPILATIONS = """
import json
from numba.core import event
with event.install_recorder("numba:compile") as compiled:
    import generated.pendulum as pendulum
    motion = pendulum.solve("-pi/2 + 6/5")
    motion.lam(1000), motion.state([0.0, 1.0]), motion.time_at(-1.0)
    pendulum.pass1([0.0, -1.0], lam0="-pi/2 + 6/5")
print(json.dumps([str(entry.data["dispatcher"]) for _, entry in compiled.buffer if entry.is_start]))
"""

GENERATE = """
import sys
from gqm_sym.cli.gen import main
sys.exit(max(main(["--stdout", "--quiet", path]) for path in sys.argv[1:]))
"""

LOADED = """
import json, sys
import generated.pendulum
print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""


COMES_WITH_CODE = """
import json, sys
import numba
before = set(sys.modules)
import generated.pendulum as pendulum
pendulum.solve("-pi/2 + 6/5")
print(json.dumps(sorted(set(sys.modules) - before)))
"""


def run(code: str, *arguments: str, cwd: Path = ROOT, **environment: str) -> str:
    """Run Python code in a fresh process and return what it printed."""
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_there_is_a_generated_module_for_each_curve() -> None:
    """``generated/`` has a module for each file of ``curves/``, no more and no less."""
    generated = {path.stem for path in (ROOT / "generated").glob("*.py")} - {"__init__"}
    assert sorted(generated) == CURVES


def test_generated_modules_need_no_generator() -> None:
    """With SymPy, Jinja, pydantic and YAML blocked, every committed module loads and solves."""
    names, half_period, late = json.loads(run(BLOCK + IMPORT_ALL, json.dumps(CURVES)))
    assert names == CURVES
    assert abs(float.fromhex(half_period) - 1.101541293806252) <= 2.3e-16
    assert abs(float.fromhex(late) - -0.5504098326471206) <= 2e-13 * 2.8


@pytest.mark.extended
def test_importing_a_generated_module_is_light() -> None:
    """A generated module loads numpy, numba and the runtime, and nothing of the generator.

    (numba itself loads scipy where that is installed.)
    """
    loaded = set(json.loads(run(LOADED)))
    assert {"numba", "numpy", "gqm_sym"} <= loaded
    assert not loaded & {"sympy", "mpmath", "jinja2", "pydantic", "ruamel", "matplotlib"}


def test_a_second_process_compiles_nothing() -> None:
    """All that the first process compiled, the second loads from numba's cache."""
    run(COUNT_COMPILATIONS)
    assert json.loads(run(COUNT_COMPILATIONS)) == []


@pytest.mark.extended
def test_a_second_process_imports_no_more_than_it_needs() -> None:
    """Machine code is loaded without what compiled it, and a motion without what sweeps and charts need."""
    run(COMES_WITH_CODE)
    loaded = json.loads(run(COMES_WITH_CODE))
    assert "gqm_sym.runtime.motion.conservative" in loaded
    assert not [name for name in loaded if name.startswith(("numba.np", "numba.cpython"))]
    unneeded = (
        "sweep.sweep",
        "sweep.batch.batches",
        "charts.rail",
        "charts.sampled",
        "charts.tracing",
        "legs.dissipative",
    )
    assert not {f"gqm_sym.runtime.{name}" for name in unneeded} & set(loaded)


@pytest.mark.extended
def test_the_text_does_not_depend_on_the_hash_seed() -> None:
    """One input gives one text, that of the committed modules, whatever order sets and dictionaries have."""
    paths = [f"curves/{name}.yaml" for name in CURVES]
    committed = [(ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8") for name in CURVES]
    assert run(GENERATE, *paths, PYTHONHASHSEED="7") == "".join(committed)


@pytest.fixture(scope="module")
def unpacked_wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel and unpack it outside the repository."""
    from zipfile import ZipFile

    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    (wheel,) = folder.glob("*.whl")
    target = folder / "site"
    with ZipFile(wheel) as archive:
        archive.extractall(target)
    return target


def test_the_wheel_holds_the_package_and_its_templates(unpacked_wheel: Path) -> None:
    """The wheel contains the sources, the typing marker and the templates, but no tests and no output."""
    shipped = {path.relative_to(unpacked_wheel).as_posix() for path in unpacked_wheel.rglob("*")}
    templates = {path.name for path in (ROOT / "templates").glob("*.j2")}
    assert templates
    assert {f"gqm_sym/_templates/{name}" for name in templates} <= shipped
    assert "gqm_sym/py.typed" in shipped
    top = {name.partition("/")[0] for name in shipped}
    assert {name.partition("-")[0] for name in top} == {"gqm_sym"}


@pytest.mark.extended
def test_the_wheel_generates_outside_the_repository(unpacked_wheel: Path, tmp_path: Path) -> None:
    """Installed from the wheel, the command writes the same module as in the repository."""
    code = "import gqm_sym\nprint(gqm_sym.__file__)\n" + GENERATE
    yaml = str(ROOT / "curves" / "pendulum.yaml")
    printed = run(code, yaml, cwd=tmp_path, PYTHONPATH=str(unpacked_wheel))
    origin, _, text = printed.partition("\n")
    assert Path(origin).is_relative_to(unpacked_wheel)
    assert text == run(GENERATE, yaml)


@pytest.mark.extended
def test_the_wheel_of_the_sdist_is_the_same(unpacked_wheel: Path, tmp_path: Path) -> None:
    """Whoever builds from the source distribution gets the same files as from the repository."""
    import tarfile
    from zipfile import ZipFile

    def build(kind: str, source: Path) -> Path:
        command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(tmp_path / kind)]
        subprocess.run(command, cwd=source, check=True, capture_output=True)
        (made,) = (tmp_path / kind).iterdir()
        return made

    with tarfile.open(build("sdist", ROOT)) as archive:
        archive.extractall(tmp_path / "source", filter="data")
    (source,) = (tmp_path / "source").iterdir()
    with ZipFile(build("wheel", source)) as archive:
        held = {name: archive.read(name) for name in archive.namelist() if not name.endswith("/RECORD")}
    shipped = {
        path.relative_to(unpacked_wheel).as_posix(): path.read_bytes()
        for path in unpacked_wheel.rglob("*")
        if path.is_file() and path.name != "RECORD" and "__pycache__" not in path.parts
    }
    assert held == shipped


FRONT = """
import json, sys
import gqm_sym as gqm
light = "sympy" not in sys.modules
import gqm_sym.building, gqm_sym.derivation, gqm_sym.emission
names = [name for name in gqm.__all__ for _ in range(2) if not callable(getattr(gqm, name))]
print(json.dumps([light, names, callable(gqm.families.ellipse)]))
"""


def test_public_names_are_what_they_say() -> None:
    """``import gqm_sym`` is light, and no submodule hides the function of the same name."""
    light, uncallable, families = json.loads(run(FRONT))
    assert light
    assert set(uncallable) == {"design", "families", "figures", "jax", "torch"}
    assert families
