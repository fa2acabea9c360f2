"""The tests on the oldest and newest supported versions: ``nox``; one of them by ``nox -s oldest-3.11``.

Sessions of Pythons that are not installed are left out by nox. The text of ``generated/`` belongs to one version of
SymPy (see ``dev`` in pyproject.toml), so ``make lint`` is not part of these.
"""

import shutil
from pathlib import Path

import nox

PYTHONS = ("3.11", "3.12", "3.13")
# The lower bounds of pyproject.toml, exactly.
OLDEST = (
    *("jinja2==3.1.0", "mpmath==1.3.0", "numba==0.61.0", "numpy==2.0.0"),
    *("pint==0.24.4", "pydantic==2.12.0", "ruamel.yaml==0.18.0", "scipy==1.13.0", "sympy==1.13.0"),
    *("distributed==2024.6.0", "h5netcdf==1.3.0", "h5py==3.15.0", "pandas==2.2.2", "xarray==2025.1.2", "zarr==3.0.8"),
    *("ipykernel==6.29.0", "matplotlib==3.8.4", "nbmake==1.5.0"),
    *("gmpy2==2.2.1", "hatchling==1.27.0", "hypothesis==6.100.0", "pytest==8.2.0", "pytest-xdist==3.6.0"),
    "pyparsing<3.3",  # later ones warn of the names that this matplotlib calls
)

# Tests that read nothing of the repository but what is copied.
OUTSIDE = [
    *("tests/literals/test_grammar.py", "tests/kernels/test_kernels.py", "tests/emission/test_render.py"),
    *("tests/claims/test_reference.py", "tests/claims/test_soak.py", "tests/runtime/compiled/test_jit.py"),
]

nox.options.default_venv_backend = "uv|virtualenv"
nox.options.reuse_existing_virtualenvs = True


def _test(session: nox.Session) -> None:
    # A cache of its own: what was compiled is told apart by Python's version, and not by that of numba's neighbours.
    session.env |= {"NUMBA_CACHE_DIR": str(session.create_tmp()), "SYMPY_GROUND_TYPES": "python"}
    session.run("python", "-m", "pytest", *(session.posargs or ["tests"]))


@nox.session(python=PYTHONS)
def newest(session: nox.Session) -> None:
    """The newest of everything."""
    session.install("--upgrade", ".[dask,data,notebook,plot,test]")
    _test(session)


@nox.session(python=PYTHONS[0])
def oldest(session: nox.Session) -> None:
    """The lower bounds that pyproject.toml promises."""
    session.install(".[dask,data,notebook,plot,test]", *OLDEST)
    _test(session)


@nox.session(python=PYTHONS)
def installed(session: nox.Session) -> None:
    """The wheel, made from the sdist, with tests that are run outside the repository, where the package is not."""
    session.install("build")
    folder, here = Path(session.create_tmp()), Path(session.invoked_from)
    session.run("python", "-m", "build", "--outdir", str(folder), ".")
    (wheel,) = folder.glob("*.whl")
    session.install(f"{wheel}[plot,notebook,test]")
    for name in ("tests", "curves", "generated", "scripts"):
        shutil.copytree(here / name, folder / name, dirs_exist_ok=True)
    session.chdir(folder)
    session.env["NUMBA_CACHE_DIR"] = str(folder / "cache")
    session.run("gqm-gen", "--solve", "curves/pendulum.yaml")
    options = ("-o", "addopts=--import-mode=importlib", "-o", "pythonpath=tests/support", "-o", "filterwarnings=error")
    session.run("python", "-m", "pytest", "--rootdir=.", *options, *(session.posargs or OUTSIDE))
