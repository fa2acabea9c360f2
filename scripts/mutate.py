"""Change the code at random and see whether a test notices: ``mutate.py [COUNT] [SEED]``.

Each mutant differs from `gqm_sym/derivation` or `gqm_sym/runtime` in one place: a comparison, an operator, a sign, a
number, a condition, or a statement left out. First all tests run once, uncompiled (`tests/support/uncompiled.py`), to
learn which lines each of them runs. Then every mutant meets the tests that run its line, the quick ones first, in a
process of its own; the file on disk is never touched. Mutants that no test notices are printed: each is a gap in the
tests, or changes nothing that can be seen. What was learnt stays in ``.mutants``; remove that after an edit.
"""

import ast
import copy
import json
import os
import random
import resource
import signal
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from itertools import zip_longest
from pathlib import Path
from types import FrameType
from typing import Any

os.environ["NUMBA_DISABLE_JIT"] = "1"
ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]

# Imported once, for all mutants; none of them imports the package.
import coverage  # noqa: E402
import hypothesis  # noqa: E402, F401
import jinja2  # noqa: E402, F401
import mpmath  # noqa: E402, F401
import numba.core.ccallback  # noqa: E402, F401
import pint  # noqa: E402, F401
import pydantic  # noqa: E402, F401
import pytest  # noqa: E402
import ruamel.yaml  # noqa: E402, F401
import scipy.integrate  # noqa: E402, F401
import sympy  # noqa: E402, F401
import xarray  # noqa: E402, F401
import zarr  # noqa: E402, F401

FOLDERS = ("gqm_sym/derivation", "gqm_sym/runtime")
WORK = ROOT / ".mutants"
WORKERS = int(os.environ.get("WORKERS", "1"))
MEASURING = str(Path(coverage.__file__).parent)
# Tests whose subject is another process, a disk or compilation; and those that would need one.
LEFT_OUT = (
    *("claims/test_architecture", "claims/test_docs", "claims/test_faults", "claims/test_family_pages"),
    *("claims/test_hostile", "claims/test_processes", "claims/test_uncompiled", "runtime/compiled/test_calls"),
    *("runtime/compiled/test_jit", "specfile/test_starter", "studies/test_studies", "test_errors"),
)
IMPORTS = ("--import-mode=importlib", "--continue-on-collection-errors", "--assert=plain")
# Processor time in seconds that a test may take to be one of the quick ones, and by how much a mutant may slow it down.
SLOW, SLOWER = 2.5, 4.0
# Rounds of tests that a mutant meets until one notices: so long together, by what they took before, and so many.
ROUNDS = ((6.0, 120), (90.0, 2000))


class Slow(BaseException):
    """A test took too long to be among those that mutants meet."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Stop the block after this processor time."""

    def stop(_: int, frame: FrameType | None) -> None:
        while frame is not None:
            if frame.f_code.co_filename.startswith(MEASURING):  # it may hold its lock
                signal.setitimer(signal.ITIMER_PROF, 0.01)
                return
            frame = frame.f_back
        raise Slow

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


class Recorder:
    """Notes what each test runs, how long it takes, and whether it passes."""

    def __init__(self, measured: coverage.Coverage) -> None:
        self.measured = measured
        self.taken: dict[str, float] = {}
        self.failed: set[str] = set()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Iterator[None]:
        """Give the test's name to what it runs."""
        self.measured.switch_context(item.nodeid)
        begin = time.process_time()
        try:
            return (yield)
        finally:
            self.taken[item.nodeid] = time.process_time() - begin

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: Any) -> Iterator[None]:
        """Stop a test that is slow."""
        with limited(SLOW):
            try:
                return (yield)
            except Slow:
                pytest.fail("slow")

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Note a failure."""
        if report.failed:
            self.failed.add(report.nodeid)


def options() -> list[str]:
    """Options of every run of pytest here."""
    return ["-q", "--no-header", "--extended", "-p", "no:cacheprovider", "-p", "no:nbmake", "-o", "addopts=", *IMPORTS]


def in_tests(file: Path) -> str:
    """Return the name of a file of tests: its path inside the folder of tests, without its suffix."""
    return file.relative_to(ROOT / "tests").with_suffix("").as_posix()


def found_by(file: Path) -> Path:
    """Return the file that records the lines that a file of tests runs."""
    return WORK / f"{in_tests(file).replace('/', '.')}.json"


def record(file: Path) -> None:
    """Run a file of tests, and write down which of them run which lines, and how long they take."""
    measured = coverage.Coverage(
        data_file=str(WORK / f"coverage.{found_by(file).stem}"),
        branch=True,
        source=[str(ROOT / "gqm_sym")],
        config_file=False,
    )
    recorder = Recorder(measured)
    measured.start()
    pytest.main([*options(), str(file)], plugins=[recorder])
    measured.stop()
    measured.save()
    data = measured.get_data()
    lines: dict[str, dict[int, list[str]]] = {}
    for name in data.measured_files():
        path = Path(name).relative_to(ROOT).as_posix()
        if path.startswith(FOLDERS):
            told = data.contexts_by_lineno(name).items()
            lines[path] = {line: sorted({*tests} - recorder.failed - {""}) for line, tests in told}
    found_by(file).write_text(json.dumps({"taken": recorder.taken, "lines": lines}), encoding="utf-8")


def known_tests() -> tuple[dict[str, float], dict[str, dict[str, list[str]]]]:
    """Return the duration of each test, and the tests that run each line of each file; both are recorded once for each
    file.
    """
    WORK.mkdir(exist_ok=True)
    taken: dict[str, float] = {}
    lines: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    files = [file for file in sorted((ROOT / "tests").rglob("test_*.py")) if in_tests(file) not in LEFT_OUT]
    running: set[int] = set()
    for file in files:
        if found_by(file).exists():
            continue
        if len(running) == WORKERS:
            running.discard(os.wait()[0])
        child = os.fork()
        if not child:
            try:
                record(file)
            finally:
                os._exit(0)
        running.add(child)
    while running:
        running.discard(os.wait()[0])
    for file in files:
        if found_by(file).exists():  # else what it runs ended the process
            told = json.loads(found_by(file).read_text(encoding="utf-8"))
            taken |= told["taken"]
            for path, places in told["lines"].items():
                for line, tests in places.items():
                    lines[path][line] += tests
    return taken, lines


# What can be changed, and into what.

SWAPS: dict[type, type] = {
    **{ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq},
    **{ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or, ast.Or: ast.And},
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult},
    **{ast.FloorDiv: ast.Div, ast.Mod: ast.Mult, ast.BitOr: ast.BitAnd, ast.BitAnd: ast.BitOr},
}
MIRRORED: dict[type, type] = {ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE}
LEFT_OUT_STATEMENTS = (ast.Assign, ast.AugAssign, ast.Expr, ast.Continue, ast.Break, ast.Raise)


def changed_number(value: complex | str | bytes | None) -> Any:
    """Return another number: the next one, or a tolerance or limit ten thousand times as large or small."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    assert isinstance(value, float)
    if value == 0.0 or 1e-3 <= abs(value) <= 1e3:
        return value + 1.0
    return value * 1e4 if abs(value) < 1.0 else value / 1e4


def places(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes that run: no annotations, decorators, texts of errors, or docstrings."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "exc") or isinstance(node, ast.JoinedStr):
            continue
        for child in value if isinstance(value, list) else [value]:
            if not isinstance(child, ast.AST) or isinstance(child, ast.Import | ast.ImportFrom):
                continue
            if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
                continue
            yield child
            yield from places(child)


def changes(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Return where a change can be made: a node's number among `places`, and the kind of change."""
    for number, node in enumerate(places(tree)):
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield number, "swap"
            if type(node.ops[0]) in MIRRORED:
                yield number, "mirror"
        elif (isinstance(node, ast.BinOp | ast.AugAssign) and type(node.op) in SWAPS) or isinstance(node, ast.BoolOp):
            yield number, "swap"
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
            yield number, "drop"
        elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            yield number, "number"
        elif isinstance(node, ast.If | ast.While | ast.IfExp):
            yield number, "negate"
        if isinstance(node, LEFT_OUT_STATEMENTS):
            yield number, "leave out"


def mutated(tree: ast.Module, number: int, kind: str) -> tuple[ast.Module, ast.AST, str, str]:
    """Return a copy of the tree with one change; the node that stands there now, and both spelled out."""
    tree = copy.deepcopy(tree)
    node: Any = next(node for k, node in enumerate(places(tree)) if k == number)
    before = ast.unparse(node).split("\n")[0]
    new: Any = node
    if kind in ("swap", "mirror") and isinstance(node, ast.Compare):
        node.ops[0] = (SWAPS if kind == "swap" else MIRRORED)[type(node.ops[0])]()
    elif kind == "swap":
        node.op = SWAPS[type(node.op)]()
    elif kind == "number":
        node.value = changed_number(node.value)
    elif kind == "negate":
        node.test = ast.copy_location(ast.UnaryOp(ast.Not(), node.test), node.test)
    else:
        new = node.operand if kind == "drop" else ast.Pass()
        replaced = ast.copy_location(new, node)
        for parent in [tree, *places(tree)]:
            for name, value in ast.iter_fields(parent):
                if value is node:
                    setattr(parent, name, replaced)
                elif isinstance(value, list) and any(one is node for one in value):
                    setattr(parent, name, [replaced if one is node else one for one in value])
    ast.fix_missing_locations(tree)
    return tree, new, before, ast.unparse(new).split("\n")[0]


# Runs


def quiet(tests: list[str], path: Path, tree: ast.Module, seconds: float) -> str:
    """Run some tests on a mutant and return the outcome: "lives", "dies" or "hangs"."""
    child = os.fork()
    if child:
        status = os.waitpid(child, 0)[1]
        code = os.waitstatus_to_exitcode(status)
        return "lives" if code == 0 else "hangs" if code == -signal.SIGXCPU else "dies"
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    plain = SourceFileLoader.get_code

    def get_code(self: Any, name: str) -> Any:
        if Path(self.get_filename(name)) == path:
            return compile(tree, str(path), "exec")
        return plain(self, name)

    SourceFileLoader.get_code = get_code  # type: ignore[method-assign]
    code = 3
    try:
        code = int(pytest.main([*options(), "-x", *tests]))
    finally:
        os._exit(code)


def users(path: Path, trees: dict[Path, ast.Module]) -> list[str]:
    """Return a file, or if it has no functions the files that import it."""
    if any(isinstance(node, ast.FunctionDef) for node in ast.walk(trees[path])):
        return [path.relative_to(ROOT).as_posix()]
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    told = ((other, node) for other, tree in trees.items() for node in ast.walk(tree))
    found = {other for other, node in told if isinstance(node, ast.ImportFrom) and node.module == module}
    return [other.relative_to(ROOT).as_posix() for other in sorted(found)]


def meeting(tests: list[str], taken: dict[str, float]) -> Iterator[tuple[list[str], float]]:
    """Return the tests of each round, and how long they take: the quickest of each file first, as they are alike."""
    files = defaultdict(list)
    for test in sorted(tests, key=lambda test: taken[test]):
        files[test.split("::")[0]].append(test)
    waiting = [test for turn in zip_longest(*files.values()) for test in turn if test]
    for together, most in ROUNDS:
        chosen: list[str] = []
        total = 0.0
        for test in waiting:
            if total + taken[test] < together and len(chosen) < most:
                chosen.append(test)
                total += taken[test]
        waiting = [test for test in waiting if test not in chosen]
        if chosen:
            yield chosen, total


def main(count: int, seed: int) -> int:
    """Run mutants, and print those that no test notices."""
    taken, lines = known_tests()
    trees = {
        path: ast.parse(path.read_text(encoding="utf-8"))
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*.py")
    }
    every = [(path, *change) for path, tree in sorted(trees.items()) for change in changes(tree)]
    draw, counts = random.Random(seed), Counter[str]()
    print(f"{len(every)} possible mutants", flush=True)
    for path, number, kind in draw.sample(every, count):
        tree, node, before, after = mutated(trees[path], number, kind)
        name = path.relative_to(ROOT).as_posix()
        tests = lines[name][str(node.lineno)]
        if not tests:  # run as the module loads: a table, a limit
            tests = sorted({test for user in users(path, trees) for line in lines[user].values() for test in line})
        what, met = "unseen", 0
        for chosen, total in meeting(tests, taken):
            met += len(chosen)
            what = quiet(chosen, path, tree, 10.0 + SLOWER * total)
            if what != "lives":
                break
        counts[what] += 1
        print(".", end="", flush=True)
        if what in ("lives", "unseen"):
            print(
                f"{what}: {name}:{node.lineno}: {before}  ->  {after}  ({met} of {len(tests)} tests)",
                flush=True,
            )
    print(f"{count} mutants: {dict(counts)}")
    return 1 if counts["lives"] + counts["unseen"] else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 300, int(sys.argv[2]) if len(sys.argv) > 2 else 0))
