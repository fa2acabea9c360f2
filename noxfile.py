"""The tests on the oldest and newest supported versions: ``nox``; one of them by ``nox -s oldest-3.11``.

Sessions of Pythons that are not installed are left out by nox. The text of ``generated/`` belongs to one version of
SymPy (see ``dev`` in pyproject.toml), so ``make lint`` is not part of these.
"""

import nox

PYTHONS = ("3.11", "3.12", "3.13")
# The lower bounds of pyproject.toml, exactly.
OLDEST = (
    *("jinja2==3.1.0", "mpmath==1.3.0", "numba==0.61.0", "numpy==2.0.0"),
    *("pydantic==2.7.0", "ruamel.yaml==0.18.0", "sympy==1.13.0"),
)

nox.options.default_venv_backend = "uv|virtualenv"
nox.options.reuse_existing_virtualenvs = True


def _test(session: nox.Session) -> None:
    # A cache of its own: numba's index knows Python's version, and not that of numba's neighbours.
    session.env["NUMBA_CACHE_DIR"] = str(session.create_tmp())
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
    """The wheel, made from the sdist, on its own and outside the repository; warnings are errors in our code."""
    session.install("build")
    folder = session.create_tmp()
    session.run("python", "-m", "build", "--outdir", folder, ".")
    session.install("gqm_sym", "--find-links", folder, "--no-index", "--no-deps")
    session.install("gqm_sym", "--find-links", folder)
    yaml = session.invoked_from + "/curves/pendulum.yaml"
    session.chdir(folder)
    session.run("gqm-gen", "--solve", yaml)
