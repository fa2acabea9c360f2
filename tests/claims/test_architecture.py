"""The table of ARCHITECTURE.md says which unit imports which; these tests compare it with the imports of the
package.
"""

import ast
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest
from paths import ROOT

PACKAGE = ROOT / "gqm_sym"

# From the top down: a unit imports itself and units of the layers under its own. A room of the runtime or of the
# derivation is a unit; the files beside the rooms are units too.
LAYERS = (
    {"cli"},
    {"report", "studies", "design"},
    {"building", "specfile"},
    {"emission"},
    {"derivation"},
    {"derivation.pipeline"},
    {"derivation.origin"},
    {"derivation.model"},
    {"derivation.wells", "derivation.forces", "derivation.defaults"},
    {"derivation.geometry", "derivation.reality", "derivation.corners"},
    {"derivation.algebra"},
    {"declare", "kernels"},
    {"parameters"},
    {"expressions"},
    {"fitting"},
    {"figures", "export", "jax", "torch"},
    {"runtime", "runtime.vocabulary"},
    {"runtime.model"},
    {"runtime.sweep"},
    {"runtime.legs"},
    {"runtime.motion"},
    {"runtime.gradients"},
    {"runtime.inversion", "runtime.launch"},
    {"runtime.charts"},
    {"runtime.multiprecision"},
    {"runtime.double_double"},
    {"runtime.quadrature"},
    {"runtime.arithmetic"},
    {"runtime.compiled"},
    {"runtime.interface"},
    {"sympy_charts", "literals", "loading", "optional", "smoothing"},
    {"budgets", "arguments", "dimensions"},
    {"errors"},
)

# As in pandas and xarray, a motion has methods for what lies above it: these imports alone go upwards.
PRESENTATION_HOOKS = {
    ("runtime/motion/motion.py", "gqm_sym.figures.motions"),  # Motion.plot
    ("runtime/motion/motion.py", "gqm_sym.export.datasets"),  # Motion.to_pandas, Motion.to_xarray
    ("runtime/motion/aperiodic.py", "gqm_sym.runtime.legs.variations.without_losses"),  # derivatives along charts
    ("declare/curve.py", "gqm_sym.building"),  # Curve.plot
    ("derivation/model.py", "gqm_sym.building"),  # Model.equilibria
    ("derivation/model.py", "gqm_sym.runtime.launch.equilibria"),  # the type of what it returns
    ("runtime/motion/state.py", "gqm_sym.export.datasets"),  # State.to_pandas
    ("runtime/sweep/result.py", "gqm_sym.export.datasets"),  # Sweep.to_pandas, Sweep.to_xarray
}

# These units are not above the runtime, though they lie in a layer above it, because they know it by name only.
KNOWS_NO_RUNTIME = {"emission", "derivation", "declare", "kernels", "parameters", "expressions"}

# No folder of the package holds more files than a reader can survey.
MAX_FILES = 16

# These files of the runtime have no test file of their name in their room; the tests named would fail with them.
DIFFERENCES = "runtime/arithmetic/divided_differences/test_differences.py"
TESTED_THROUGH = {
    "arithmetic/clenshaw.py": "runtime/motion/test_sampler.py",
    "arithmetic/divided_differences/first.py": DIFFERENCES,
    "arithmetic/divided_differences/points.py": DIFFERENCES,
    "arithmetic/divided_differences/second.py": DIFFERENCES,
    "arithmetic/matrices.py": "runtime/legs/panels/test_polynomials.py",
    "arithmetic/power_rows.py": "runtime/charts/test_chart.py",
    "arithmetic/offsets.py": "claims/test_degenerate.py",
    "charts/arc_length.py": "runtime/charts/test_rail.py",
    "charts/continuation.py": "runtime/charts/test_tracing_ends.py",
    "charts/differences.py": "runtime/charts/test_chart.py",
    "charts/double_double/level_samples.py": "runtime/charts/double_double/test_passage.py",
    "charts/double_double/making.py": "runtime/charts/double_double/test_passage.py",
    "charts/double_double/offset_path.py": "claims/test_rolling.py",
    "charts/double_double/parts.py": "runtime/sweep/tables/test_times.py",
    "charts/double_double/pieces.py": "runtime/charts/double_double/test_passage.py",
    "charts/double_double/potential.py": "runtime/charts/double_double/test_passage.py",
    "charts/double_double/times.py": "runtime/charts/double_double/test_passage.py",
    "charts/double_double/turning_points.py": "runtime/charts/double_double/test_passage.py",
    "charts/evaluate.py": "runtime/charts/test_chart.py",
    "charts/exact_parts.py": "runtime/charts/test_exact_normals.py",
    "charts/interpolation.py": "runtime/charts/test_sampled.py",
    "charts/level_pieces.py": "runtime/charts/test_tracing.py",
    "charts/train.py": "claims/test_trains.py",
    "charts/train_load.py": "claims/test_trains.py",
    "compiled/buffers.py": "runtime/charts/test_tracing.py",
    "compiled/intrinsics.py": "runtime/arithmetic/test_elementary.py",
    "compiled/registers.py": "runtime/legs/panels/test_polynomials.py",
    "compiled/stamps.py": "runtime/compiled/test_jit.py",
    "compiled/streaming.py": "runtime/launch/test_speed.py",
    "compiled/strided.py": "runtime/sweep/test_sweep.py",
    "compiled/threads.py": "runtime/launch/test_speed.py",
    "compiled/trial.py": "runtime/compiled/test_emitted.py",
    "compiled/types.py": "runtime/compiled/test_jit.py",
    "double_double/interpreter.py": "runtime/double_double/test_arithmetic.py",
    "double_double/nodes.py": "runtime/double_double/test_orbit_time.py",
    "double_double/quadrature.py": "runtime/double_double/test_orbit_time.py",
    "double_double/tapes.py": "runtime/double_double/test_recording.py",
    "gradients/charts/means.py": "runtime/gradients/test_means.py",
    "gradients/charts/train_orbits.py": "runtime/gradients/test_means.py",
    "gradients/charts/trains.py": "runtime/gradients/test_means.py",
    "gradients/charts/orbit.py": "runtime/gradients/test_charts.py",
    "gradients/charts/programs.py": "runtime/gradients/test_charts.py",
    "gradients/charts/second_durations.py": "runtime/gradients/test_seconds.py",
    "gradients/charts/second_programs.py": "runtime/gradients/test_seconds.py",
    "gradients/charts/shaped_bends.py": "runtime/gradients/test_seconds.py",
    "gradients/charts/shaped_pieces.py": "runtime/gradients/test_charts.py",
    "gradients/charts/space_programs.py": "runtime/gradients/test_space_charts.py",
    "gradients/evaluation.py": "runtime/gradients/test_quantities.py",
    "gradients/formula_orbit.py": "runtime/gradients/test_quantities.py",
    "gradients/lanes/arrivals/beside_hilltops.py": "runtime/gradients/passages/test_arrival.py",
    "gradients/lanes/arrivals/changes.py": "runtime/gradients/lanes/arrivals/test_times.py",
    "gradients/lanes/arrivals/integrals.py": "runtime/gradients/lanes/arrivals/test_times.py",
    "gradients/lanes/arrivals/programs.py": "runtime/gradients/lanes/arrivals/test_times.py",
    "gradients/lanes/arrivals/weights.py": "runtime/gradients/lanes/arrivals/test_times.py",
    "gradients/lanes/assembly.py": "runtime/gradients/lanes/test_differences.py",
    "gradients/lanes/extremes.py": "runtime/gradients/test_sweep.py",
    "gradients/lanes/interpreter.py": "runtime/gradients/lanes/test_differences.py",
    "gradients/lanes/launches.py": "runtime/gradients/lanes/test_evaluation.py",
    "gradients/lanes/machine_code.py": "runtime/gradients/lanes/test_evaluation.py",
    "gradients/lanes/operations.py": "runtime/gradients/lanes/test_differences.py",
    "gradients/lanes/pairs.py": "runtime/gradients/lanes/test_evaluation.py",
    "gradients/lanes/periods.py": "runtime/gradients/lanes/test_evaluation.py",
    "gradients/lanes/programs.py": "runtime/gradients/lanes/test_evaluation.py",
    "gradients/lanes/vectors.py": "runtime/gradients/lanes/test_evaluation.py",
    "gradients/orbit.py": "runtime/gradients/test_quantities.py",
    "gradients/panels.py": "runtime/gradients/test_sensitivity.py",
    "gradients/passages/beside_cusp.py": "runtime/gradients/passages/test_passage.py",
    "gradients/passages/first_differences.py": "runtime/gradients/passages/test_slow_orbits.py",
    "gradients/passages/from_turns.py": "runtime/gradients/passages/test_slow_orbits.py",
    "gradients/passages/launch_limit.py": "runtime/gradients/passages/test_passage.py",
    "gradients/passages/quantities.py": "runtime/gradients/passages/test_passage.py",
    "gradients/path.py": "runtime/gradients/test_sensitivity.py",
    "gradients/programs.py": "runtime/gradients/test_quantities.py",
    "gradients/second_programs.py": "runtime/gradients/test_seconds.py",
    "gradients/series.py": "runtime/gradients/test_sensitivity.py",
    "interface.py": "claims/test_faults.py",
    "inversion/fourier.py": "runtime/motion/test_sampler.py",
    "inversion/records.py": "runtime/motion/test_sampler.py",
    "launch/domain.py": "runtime/launch/test_request.py",
    "launch/ends.py": "runtime/launch/test_zeros.py",
    "launch/formulas.py": "emission/test_render.py",
    "launch/functions.py": "runtime/inversion/test_table.py",
    "launch/kinds.py": "runtime/motion/test_aperiodic.py",
    "launch/poles.py": "claims/test_edges.py",
    "launch/problem.py": "runtime/launch/test_zeros.py",
    "launch/rider.py": "claims/test_riders.py",
    "launch/survey.py": "runtime/compiled/test_calls.py",
    "legs/advance.py": "claims/test_dissipative.py",
    "legs/answers.py": "runtime/sweep/test_dissipative_loop.py",
    "legs/body.py": "runtime/sweep/test_dissipative_loop.py",
    "legs/conditions.py": "runtime/legs/test_order_of_questions.py",
    "legs/driver.py": "runtime/legs/test_dissipative.py",
    "legs/endings.py": "runtime/legs/test_leg_errors.py",
    "legs/followed.py": "runtime/legs/test_dissipative.py",
    "legs/frames/entering.py": "runtime/legs/frames/test_local_frame.py",
    "legs/frames/tiny_legs.py": "runtime/sweep/test_planes_with_friction.py",
    "legs/gaps/blocks.py": "runtime/legs/gaps/test_passing.py",
    "legs/gaps/data.py": "claims/test_space_curves.py",
    "legs/gaps/places.py": "runtime/legs/gaps/test_flows.py",
    "legs/gaps/turn_flows.py": "runtime/legs/gaps/test_flows.py",
    "legs/inherited.py": "runtime/legs/test_leg_errors.py",
    "legs/kinks/places.py": "runtime/legs/kinks/test_parts.py",
    "legs/layout.py": "claims/test_dissipative.py",
    "legs/leg_reading.py": "runtime/sweep/test_dissipative_loop.py",
    "legs/leg_record.py": "claims/test_dissipative.py",
    "legs/leg_segments.py": "runtime/legs/panels/test_polynomials.py",
    "legs/panels/equation.py": "claims/test_closed_forms.py",
    "legs/panels/point.py": "claims/test_dissipative.py",
    "legs/panels/resolution.py": "runtime/legs/panels/test_polynomials.py",
    "legs/panels/widest.py": "claims/test_dissipative.py",
    "legs/questions.py": "runtime/sweep/test_dissipative_loop.py",
    "legs/runs/rest_on_corners.py": "runtime/sweep/test_planes_with_friction.py",
    "legs/runs/run.py": "claims/test_dissipative.py",
    "legs/runs/whole_panels.py": "runtime/legs/runs/test_whole_leg.py",
    "legs/runs/whole_rows.py": "runtime/legs/runs/test_whole_leg.py",
    "legs/runs/whole_tables.py": "runtime/legs/runs/test_whole_leg.py",
    "legs/variations/chain.py": "runtime/legs/variations/test_changes.py",
    "legs/variations/divided.py": "runtime/legs/panels/test_solving.py",
    "legs/variations/equation.py": "runtime/legs/variations/test_answers.py",
    "legs/variations/force_errors.py": "runtime/legs/test_leg_errors.py",
    "legs/variations/formula_changes.py": "runtime/legs/variations/test_answers.py",
    "legs/variations/law.py": "runtime/legs/variations/test_answers.py",
    "legs/variations/law_at_rest.py": "runtime/legs/frames/test_fitting.py",
    "legs/variations/programs.py": "runtime/legs/variations/test_answers.py",
    "legs/variations/solving.py": "runtime/legs/variations/test_changes.py",
    "legs/variations/train_law.py": "runtime/gradients/test_means.py",
    "legs/variations/without_losses.py": "runtime/gradients/test_charts.py",
    "model.py": "claims/test_reference.py",
    "motion/at_rest.py": "runtime/motion/parts/test_tabulated.py",
    "motion/motion.py": "claims/test_reference.py",
    "motion/parts/before_joint.py": "runtime/motion/test_extremes.py",
    "motion/parts/derivatives.py": "runtime/gradients/test_quantities.py",
    "motion/parts/history.py": "runtime/motion/test_events.py",
    "motion/parts/positions.py": "claims/test_reference.py",
    "motion/parts/summary.py": "export/test_datasets.py",
    "motion/periodic.py": "claims/test_properties.py",
    "motion/periodic_times.py": "runtime/motion/test_timing.py",
    "motion/riding/cars.py": "claims/test_trains.py",
    "motion/riding/exceedance.py": "claims/test_riders.py",
    "motion/riding/loads.py": "claims/test_riders.py",
    "motion/rolling.py": "claims/test_rolling.py",
    "motion/rows.py": "export/test_datasets.py",
    "motion/segments/conditioning.py": "claims/test_degenerate.py",
    "motion/segments/errors.py": "claims/test_bounds.py",
    "motion/segments/kinds.py": "runtime/motion/test_aperiodic.py",
    "motion/segments/segment.py": "runtime/motion/test_aperiodic.py",
    "motion/segments/tabulation.py": "runtime/inversion/test_leg_tables.py",
    "motion/trajectory.py": "runtime/motion/test_aperiodic.py",
    "multiprecision/exact_problem.py": "claims/test_degenerate.py",
    "multiprecision/exact_tracks.py": "runtime/charts/test_exact_normals.py",
    "multiprecision/fixed_point.py": "runtime/charts/test_exact_normals.py",
    "multiprecision/slow_rates.py": "runtime/multiprecision/test_exact_panels.py",
    "multiprecision/gauss_legendre.py": "runtime/charts/test_exact_normals.py",
    "quadrature/equilibrium.py": "claims/test_dissipative.py",
    "quadrature/integrands.py": "runtime/quadrature/test_time_panels.py",
    "quadrature/kronrod.py": "runtime/quadrature/test_time_panels.py",
    "quadrature/substitution.py": "runtime/quadrature/test_time_panels.py",
    "sweep/batch/agm_times.py": "runtime/sweep/batch/test_times.py",
    "sweep/batch/known_turns.py": "runtime/sweep/batch/test_batches.py",
    "sweep/batch/waiting.py": "runtime/sweep/batch/test_first_trials.py",
    "sweep/batch/exact_nodes.py": "runtime/sweep/batch/test_exact_ends.py",
    "sweep/batch/rows.py": "runtime/sweep/batch/test_batches.py",
    "sweep/batch/wide_orbits.py": "runtime/sweep/batch/test_times.py",
    "sweep/batch/turning_points.py": "runtime/sweep/batch/test_batches.py",
    "sweep/cluster.py": "studies/test_studies.py",
    "sweep/columns.py": "runtime/sweep/test_sweep.py",
    "sweep/extremes.py": "runtime/sweep/test_leaving.py",
    "sweep/exact_orbits.py": "runtime/sweep/test_separatrices.py",
    "sweep/finding.py": "runtime/sweep/test_sweep.py",
    "sweep/gradients.py": "runtime/gradients/test_sweep.py",
    "sweep/groups.py": "runtime/sweep/tables/test_times.py",
    "sweep/orbit.py": "runtime/sweep/test_sweep.py",
    "sweep/quantities.py": "runtime/sweep/test_sweep.py",
    "sweep/scalar.py": "runtime/sweep/test_sweep.py",
    "sweep/single/arrivals.py": "runtime/sweep/test_sweep.py",
    "sweep/single/orbit_extremes.py": "runtime/sweep/test_sweep.py",
    "sweep/single/slow_places.py": "runtime/sweep/test_separatrices.py",
    "sweep/single/values.py": "runtime/sweep/test_sweep.py",
    "sweep/tables/extremes.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/fitting.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/layout.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/panel_forces.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/passage.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/places.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/potential.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/rests.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/stretches.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/tabulate.py": "runtime/sweep/tables/test_times.py",
    "sweep/tables/turning_points.py": "runtime/sweep/tables/test_times.py",
    "vocabulary.py": DIFFERENCES,
}

# Only some parts import these packages.
ONLY_IN = {
    "distributed": {"runtime"},
    "jax": {"jax"},
    "jinja2": {"emission"},
    "llvmlite": {"runtime"},
    "matplotlib": {"figures", "report"},
    "mpl_toolkits": {"figures"},
    "mpmath": {"runtime", "literals", "figures", "design"},
    "numba": {"runtime"},
    "pandas": {"export"},
    "numpy": {"runtime", "literals", "figures", "export", "design", "fitting", "studies", "smoothing", "jax", "torch"},
    "pint": {"literals"},
    "pydantic": {"specfile", "studies"},
    "pydantic_core": {"specfile", "studies"},
    "ruamel": {"specfile"},
    "scipy": {"runtime", "smoothing", "fitting", "design", "derivation"},
    "torch": {"torch"},
    "sympy": {
        "cli",
        "report",
        "specfile",
        "emission",
        "derivation",
        "declare",
        "kernels",
        "parameters",
        "expressions",
        "sympy_charts",
        "dimensions",
        "design",
    },
    "xarray": {"cli", "export", "studies"},
}

# These are imported when exact digits, splines, pictures, datasets or units are asked for, never when a module loads.
ONLY_INSIDE_FUNCTIONS = {
    *("distributed", "jax", "matplotlib", "mpl_toolkits", "mpmath", "pandas", "pint", "scipy", "torch", "xarray"),
}


class Import(NamedTuple):
    """One import: the file and the unit that import, what they import, and whether the import waits for a call.

    An import that only a type checker reads waits for ever.
    """

    file: str
    unit: str
    target: str
    waits: bool


def _unit(parts: Sequence[str]) -> str:
    """Name the part of the package that a module belongs to, given its path or dotted name below the package."""
    units = (".".join(parts[:2]), parts[0])
    return next((unit for unit in units if unit in LEVEL), parts[0])


def _parts(path: Path) -> tuple[str, ...]:
    """Return the dotted name of a file's module below the package; the front of a folder has the folder's name."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return parts[:-1] if parts[-1] == "__init__" else parts


def _targets(node: ast.stmt) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        assert node.level == 0, "imports are absolute"
        assert node.module is not None
        if node.module == "gqm_sym":
            yield from (f"gqm_sym.{alias.name}" for alias in node.names)
        else:
            yield node.module


def _waits(node: ast.AST) -> bool:
    """Return whether the statements inside do not run when the file is imported."""
    if isinstance(node, ast.If):
        return isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
    return isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)


def _statements(inside: ast.AST, waits: bool = False) -> Iterator[tuple[ast.stmt, bool]]:
    """Return the statements inside, at any depth, and whether each of them waits."""
    for node in ast.iter_child_nodes(inside):
        if isinstance(node, ast.stmt):
            yield node, waits
        if isinstance(node, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield from _statements(node, waits or _waits(node))


LEVEL = {unit: level for level, layer in enumerate(LAYERS) for unit in layer}
FILES = {
    _parts(path): path for path in sorted(PACKAGE.rglob("*.py")) if not {"_templates", "__pycache__"} & set(path.parts)
}


def _modules(target: str, names: Sequence[str]) -> Iterator[str]:
    """Return the modules that ``from target import names`` needs: submodules where the names are some, else the
    target.
    """
    for name in names or [""]:
        inside = (*target.split(".")[1:], name)
        yield f"{target}.{name}" if inside in FILES else target


@cache
def _imports() -> tuple[Import, ...]:
    """Return every import of the package."""
    return tuple(_read_imports())


def _read_imports() -> Iterator[Import]:
    for parts, path in FILES.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node, waits in _statements(tree):
            names = [alias.name for alias in node.names] if isinstance(node, ast.ImportFrom) else []
            for target in _targets(node):
                for module in _modules(target, names):
                    file = path.relative_to(PACKAGE).as_posix()
                    yield Import(file, _unit(parts) if parts else "", module, waits)


def _upward(rows: Iterable[Import]) -> list[str]:
    """Return the imports that do not go downwards; the package's front imports all units, but its imports wait."""
    wrong = []
    for row in rows:
        if not row.target.startswith("gqm_sym.") or not row.unit or (row.file, row.target) in PRESENTATION_HOOKS:
            continue
        unit = _unit(row.target.split(".")[1:])
        knows = unit.split(".")[0] == "runtime" and row.unit.split(".")[0] in KNOWS_NO_RUNTIME
        if unit != row.unit and (LEVEL[unit] <= LEVEL[row.unit] or knows):
            wrong.append(f"{row.file} imports {row.target}")
    return wrong


def test_every_unit_has_its_place() -> None:
    """A new file or folder of the package must be entered in the table before anything imports it."""
    assert {_unit(parts) for parts in FILES if parts} == set(LEVEL)


def test_imports_go_downwards() -> None:
    """Except for the presentation hooks, no unit imports a unit beside or above it."""
    assert _upward(_imports()) == []


@pytest.mark.parametrize("unit", sorted(set(LEVEL) - {"cli"}))
def test_an_upward_import_is_noticed(unit: str) -> None:
    """If any unit imports the command line, which is the highest one, the check fails, also for an import that
    waits.
    """
    file = next(path for parts, path in FILES.items() if parts and _unit(parts) == unit)
    row = Import(file.relative_to(PACKAGE).as_posix(), unit, "gqm_sym.cli.gen", True)
    assert _upward([row]) != []


def test_there_are_no_import_circles() -> None:
    """No file imports itself through others; imports that wait and those for type checkers count, hooks do not."""
    graph: dict[str, set[str]] = {}
    names = {path.relative_to(PACKAGE).as_posix(): ".".join(("gqm_sym", *parts)) for parts, path in FILES.items()}
    for row in _imports():
        if row.target.startswith("gqm_sym") and row.unit and (row.file, row.target) not in PRESENTATION_HOOKS:
            graph.setdefault(names[row.file], set()).add(row.target)
    assert list(TopologicalSorter(graph).static_order())  # raises CycleError, which names the circle


def test_no_folder_holds_too_many_files() -> None:
    """A folder with more files than a reader can survey must be divided into rooms."""
    counts = Counter(path.parent.relative_to(PACKAGE).as_posix() for path in FILES.values())
    assert {folder: count for folder, count in counts.items() if count > MAX_FILES} == {}


def _untested(files: Iterable[str], through: dict[str, str]) -> list[str]:
    """Return the files of the runtime that have neither tests of their own nor a row in the table, and wrong rows."""
    own = {file: f"runtime/{Path(file).parent.as_posix()}/test_{Path(file).name}" for file in files}
    missing = {file for file, test in own.items() if (ROOT / "tests" / test).is_file() == (file in through)}
    return sorted(missing | {file for file, test in through.items() if not (ROOT / "tests" / test).is_file()})


def test_one_can_find_the_tests_of_each_file_of_the_runtime() -> None:
    """The tests of a file lie in the room of its name, or the table says where they are; each row of the table is
    true.
    """
    runtime = {
        path.relative_to(PACKAGE / "runtime").as_posix() for parts, path in FILES.items() if parts[:1] == ("runtime",)
    }
    files = {file for file in runtime if not file.endswith("__init__.py")}
    assert _untested(files, TESTED_THROUGH) == []
    assert set(TESTED_THROUGH) <= files
    assert _untested(["legs/new.py"], {}) == ["legs/new.py"]
    assert _untested(["legs/new.py"], {"legs/new.py": "gone/test_new.py"}) == ["legs/new.py"]


def test_each_room_says_what_it_is_for() -> None:
    """The front of a folder begins with one line about it."""
    for parts, path in FILES.items():
        if path.name == "__init__.py":
            doc = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
            assert doc, parts


def test_the_front_loads_nothing_heavy() -> None:
    """At first, ``import gqm_sym`` loads no other part of the package than the errors."""
    loaded = {row.target for row in _imports() if not row.unit and not row.waits}
    outside = {target for target in loaded if target.split(".")[0] not in sys.stdlib_module_names}
    assert outside <= {"gqm_sym.errors"}


@pytest.mark.parametrize("package", ONLY_IN)
def test_a_package_is_imported_where_it_belongs(package: str) -> None:
    """Only the units listed for a dependency import it; other units call these."""
    users = {row.unit.split(".")[0] for row in _imports() if row.target.split(".")[0] == package}
    assert users <= ONLY_IN[package]


def test_no_other_package_is_imported() -> None:
    """The package imports nothing but the dependencies of the table above and the standard library."""
    names = {row.target.split(".")[0] for row in _imports()}
    assert names - sys.stdlib_module_names - {"gqm_sym"} <= set(ONLY_IN)


def test_some_imports_wait() -> None:
    """Packages that few calls need are imported inside the functions that need them."""
    eager = [row.file for row in _imports() if row.target.split(".")[0] in ONLY_INSIDE_FUNCTIONS and not row.waits]
    assert eager == []


def test_a_module_can_be_read_at_a_sitting() -> None:
    """The pendulum's module is short, and what exists for speed alone stands at its end."""
    lines = (ROOT / "generated" / "pendulum.py").read_text(encoding="utf-8").splitlines()
    heading = next(i for i, line in enumerate(lines) if line.startswith("# ----"))
    assert (len(lines) <= 360, heading <= 250) == (True, True)
