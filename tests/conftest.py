"""Fixtures of the whole suite give generated modules and motions, each made once in a session."""

import gc
import math
import os
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers
from problems import PROBLEMS, TRACKS, Problem
from selection import EXTENDED_EXAMPLES, USUAL_EXAMPLES, usual

from gqm_sym.runtime.compiled import emitted, jit, trial

# The first example of a test may compile for seconds, and a failure must be reproducible.
settings.register_profile("usual", deadline=None, derandomize=True, print_blob=True, max_examples=USUAL_EXAMPLES)
settings.register_profile("extended", settings.get_profile("usual"), max_examples=EXTENDED_EXAMPLES)
settings.load_profile("usual")

# Hypothesis also draws numbers from the text of all modules imported so far, so that what a test draws would depend on
# the tests before it in the same worker.
if hasattr(providers, "is_local_module_file"):
    providers.is_local_module_file = lambda _: False

# On a busy machine compiling may take any time, and tests check what is printed on standard error.
jit.ANNOUNCER.seconds = 1e6

# Most of the suite's modules are used a few times only, and compiling their functions took half of the time of many
# tests. Python gives the same bits, and may go on until it has taken as long as the compiler would, in however many
# launches: a user's script may run again, but the cache of the suite is not used again.
emitted.MAX_PYTHON_TIME, trial.MAX_LAUNCHES = 0.12, math.inf

# A worker has up to a million objects of SymPy and numba; collecting garbage as often as usual takes a twelfth of the
# time.
gc.set_threshold(1_000_000, 20, 50)

if numba.config.DISABLE_JIT:
    import uncompiled

    uncompiled.install()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option of the extended run."""
    parser.addoption("--extended", action="store_true", help="run every test, with all cases and examples")


def pytest_configure(config: pytest.Config) -> None:
    """Let tests of Hypothesis draw all their examples in the extended run."""
    if config.getoption("extended"):
        settings.load_profile("extended")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what is for the extended run only, unless tests are chosen by name or mark."""
    chosen = config.getoption("keyword") or config.getoption("markexpr") or any("::" in name for name in config.args)
    if not config.getoption("extended") and not chosen:
        items[:], found = usual(items), list(items)
        kept = set(items)
        config.hook.pytest_deselected(items=[item for item in found if item not in kept])


@pytest.fixture(scope="session")
def generated_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder for the suite's modules, which parallel workers share, with numba's cache."""
    base = tmp_path_factory.getbasetemp()
    root = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = root / "modules"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def module_of(generated_folder: Path) -> Callable[[str], ModuleType]:
    """Return the generated module of a track under gravity, by the track's name."""
    import gqm_sym as gqm

    built: dict[str, ModuleType] = {}

    def module(track: str) -> ModuleType:
        if track not in built:
            model = gqm.derive(TRACKS[track].declare(), gqm.Gravity())
            built[track] = gqm.build(model, name=track, folder=generated_folder)
        return built[track]

    return module


@pytest.fixture(scope="module")
def build(generated_folder: Path) -> Callable[..., ModuleType]:
    """Build the module of a curve under gravity and another force, once under one name."""
    import gqm_sym as gqm

    built: dict[str, ModuleType] = {}

    def module(name: str, curve: Any, force: Any) -> ModuleType:
        if name not in built:
            built[name] = gqm.build(gqm.derive(curve, gqm.Gravity() + force), name=name, folder=generated_folder)
        return built[name]

    return module


@pytest.fixture(scope="session")
def motion_of(module_of: Callable[[str], ModuleType]) -> Callable[[Problem], Any]:
    """Return the motion of a problem, solved once."""
    solved: dict[str, Any] = {}

    def motion(problem: Problem) -> Any:
        if problem.slug not in solved:
            solved[problem.slug] = module_of(problem.track).solve(**problem.launch)
        return solved[problem.slug]

    return motion


@pytest.fixture(params=PROBLEMS.values(), ids=PROBLEMS)
def problem(request: pytest.FixtureRequest) -> Problem:
    """Return each problem of the table in turn."""
    return request.param
