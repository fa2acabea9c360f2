"""Tests audit the syntax of emitted modules and compare their compiled functions with the declared text."""

import ast
from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, c_double, c_ssize_t, c_void_p
from functools import cache
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import sympy as sp
from mpmath import mp, mpf

import gqm_sym as gqm
from gqm_sym import runtime
from gqm_sym.derivation import Model
from gqm_sym.runtime import interface

DIGITS = 50
# The tolerances in roundings (2**-53) of the terms of a value. Worst measured: 6.1, 2.0, 1.9 and 6.7.
PATH, POTENTIAL, DIVDIFF1, DIVDIFF2 = 8, 3, 3, 9
# Bounds at a single place are as wide as a few roundings outwards of each operation.
POINT_WIDTH = 1e-13

# The ends, and a place between or beyond them, near and far, have exact differences.
TRIPLES = (
    (0.25, 0.5, 1.125),
    (0.5, 0.75, 0.75),
    (0.5, 0.5, 1.0),
    (0.625, 0.625 + 2.0**-20, 0.625 + 2.0**-19),
    (0.75 - 2.0**-40, 0.75, 0.75 + 2.0**-35),
    (1.0, 0.875, 0.5),
)

NODES = (
    *(ast.Module, ast.Expr, ast.Constant, ast.ImportFrom, ast.alias, ast.Assign, ast.Dict, ast.Name, ast.Load),
    *(ast.Store, ast.Call, ast.keyword, ast.FunctionDef, ast.arguments, ast.arg, ast.For, ast.Tuple, ast.Subscript),
    *(
        ast.If,
        ast.BinOp,
        ast.Add,
        ast.Sub,
        ast.Mult,
        ast.Div,
        ast.Pow,
        ast.UnaryOp,
        ast.USub,
        ast.Return,
        ast.Attribute,
    ),
)
IMPORTS = ("math", "typing", "numba", "gqm_sym.runtime", "gqm_sym.runtime.vocabulary")


def declared(text: str, *, title: str = "", parameter: str = "u", **parameters: str) -> Model:
    """Derive the motion on a graph under gravity."""
    curve = gqm.Curve.graph(text, parameter=parameter, parameters=parameters or None, title=title)
    return gqm.derive(curve, gqm.Gravity())


@cache
def oracle(text: str, names: tuple[str, ...]) -> Callable[..., list[mpf]]:
    """Return z, z' and z'' by the first name, as SymPy and mpmath read the text."""
    known = {name: sp.Symbol(name, real=True) for name in names} | {"e": sp.E, "ln": sp.log}
    known["cbrt"] = lambda w: w ** sp.Rational(1, 3)
    z = sp.sympify(text, locals=known, rational=True)
    first = known[names[0]]
    return sp.lambdify(
        [known[n] for n in names], [z, z.diff(first), z.diff(first, 2)], [{"DiracDelta": lambda _: 0}, "mpmath"]
    )


def interpreted(text: str, name: str) -> ModuleType:
    """Return the module of an emitted text whose functions Python runs; each has the address at which the compiled one
    would be.
    """
    module = ModuleType(name)
    module.__file__ = f"{name}.py"

    def compiled(_: object) -> Callable[[Any], Any]:
        return lambda function: SimpleNamespace(address=function)

    with patch.object(runtime, "compiler", lambda *_, **__: compiled):
        exec(compile(text, module.__file__, "exec"), vars(module))  # noqa: S102
    return module


class Compiled:
    """The compiled functions of a module, called by address as the runtime calls them; or `interpreted` ones."""

    def __init__(self, module: ModuleType, values: tuple[float, ...]) -> None:
        self.addresses = module.MODEL.functions.addresses()
        self.p = np.array([*values, 9.75, 2.0])

    def _call(self, name: str, rows: int, n: int | None, *arguments: float | list[float]) -> np.ndarray:
        line = POINTER(c_double)
        out = np.full((rows, n or 1), np.nan)
        given = [np.array(a) if isinstance(a, list) else a for a in arguments] + [self.p, out]
        types = [line if isinstance(a, np.ndarray) else c_double for a in given]
        count = [] if n is None else [c_ssize_t]
        function = getattr(self.addresses, name)
        if not callable(function):
            function = CFUNCTYPE(None, *count, *types)(c_void_p.from_address(function).value)
        with np.errstate(divide="ignore", invalid="ignore"):  # as compiled code does
            function(
                *([] if n is None else [n]),
                *(a.ctypes.data_as(line) if isinstance(a, np.ndarray) else a for a in given),
            )
        return out

    def path_and_contact_force(self, places: list[float], speeds: list[float]) -> np.ndarray:
        """Return the rows x, z, ds, kappa and contact force."""
        return self._call("path_and_contact_force", interface.PATH_ROWS, len(places), places, speeds)

    def effective_potential(self, places: list[float]) -> np.ndarray:
        """Return the rows U and dU/dlam."""
        return self._call("effective_potential", 2, len(places), places)

    def potential_divdiff1(self, a: float, places: list[float], offsets: list[float]) -> np.ndarray:
        """Return the rows of the first difference and ds."""
        return self._call("potential_divdiff1", 2, len(places), a, places, offsets)

    def potential_divdiff2(self, a: float, b: float, left: list[float], right: list[float]) -> np.ndarray:
        """Return the rows of the second difference and ds."""
        return self._call("potential_divdiff2", 2, len(left), a, b, left, right)

    def bounds(self, lo: float, hi: float) -> np.ndarray:
        """Return the ends of the slope's enclosure, and of that of ds."""
        return self._call("bounds", 4, None, lo, hi)[:, 0]


def near(actual: float, truth: mpf, roundings: int, scale: mpf | None = None) -> None:
    """Check a number against a true one of 50 digits, in roundings of it or of its scale."""
    allowed = roundings * mpf(2) ** -53 * (abs(truth) if scale is None else scale)
    assert abs(mpf(float(actual)) - truth) <= allowed, (actual, mp.nstr(truth, 20))


def check_numbers(
    module: ModuleType, text: str, values: dict[str, float], parameter: str = "u", *, kink: float | None = None
) -> None:
    """Check all five compiled functions against the declared text, for g = 9.75 and m = 2.

    At a kink the slope jumps, so that bounds are not checked there; across it they may be infinite.
    """
    compiled = Compiled(module, tuple(values.values()))
    with mp.workdps(DIGITS):
        function = oracle(text, (parameter, *values))
        given = [mpf(v) for v in values.values()]

        @cache
        def at(place: mpf | float) -> tuple[mpf, ...]:
            z, slope, bend = function(mpf(place), *given)
            ds = mp.sqrt(1 + slope**2)
            return mpf(z), slope, ds, bend / ds**3, bend

        g, m, v2 = mpf("9.75"), mpf(2), mpf("3.5")
        for a, y, b in TRIPLES:
            z, slope, ds, kappa, bent = at(y)
            size = abs(z) + abs(slope) + abs(bent)
            x, *path = compiled.path_and_contact_force([0.125, y], [0.0, float(v2)])[:, 1]
            assert x == y
            near(path[0], z, PATH, size)
            near(path[1], ds, PATH)
            near(path[2], kappa, PATH, size / ds**3)
            near(path[3], m * (g / ds + kappa * v2), PATH, m * (g / ds + size / ds**3 * v2))
            potential = compiled.effective_potential([y, y])[:, 1]
            near(potential[0], g * z, POTENTIAL, g * size)
            near(potential[1], g * slope, POTENTIAL, g * size)

            def first(x: float, y: float) -> mpf:
                return at(x)[1] if x == y else (at(y)[0] - at(x)[0]) / (mpf(y) - mpf(x))

            divdiff1 = compiled.potential_divdiff1(a, [y, y], [y - a, y - a])[:, 1]
            near(divdiff1[0], g * first(a, y), DIVDIFF1, g * size)
            near(divdiff1[1], ds, PATH)
            second = (first(y, b) - first(a, y)) / (mpf(b) - mpf(a))
            low, high = min(a, y), max(a, y)
            divdiff2 = compiled.potential_divdiff2(a, b, [y - a, y - a], [b - y, b - y])[:, 1]
            largest = max(abs(at(s)[0]) + abs(at(s)[1]) + abs(at(s)[4]) for s in (a, y, b))
            near(divdiff2[0], g * second, DIVDIFF2, g * largest)
            near(divdiff2[1], ds, PATH)
            bounds = compiled.bounds(low, high)
            assert np.isfinite(bounds).all() or (kink is not None and low <= kink <= high)
            for k in range(9):
                place = mpf(low) + (mpf(high) - mpf(low)) * k / 8
                _, slope, ds, _, _ = at(place)
                if kink is None or abs(place - mpf(kink)) > 1e-15:
                    assert bounds[0] <= g * slope <= bounds[1]
                    assert bounds[2] <= ds <= bounds[3]
            point = compiled.bounds(y, y)
            assert point[1] - point[0] <= POINT_WIDTH * g * size
            assert point[3] - point[2] <= POINT_WIDTH * ds


def audit(text: str) -> ast.Module:
    """Parse emitted text, and check every node, name, import and call against what a module may have."""
    tree = ast.parse(text)
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    imported = {a.name for node in tree.body if isinstance(node, ast.ImportFrom) for a in node.names}
    for node in ast.walk(tree):
        assert isinstance(node, NODES), type(node)
        if isinstance(node, ast.ImportFrom):
            assert node.module in IMPORTS
            assert node.level == 0
            assert all(a.asname is None and a.name != "*" for a in node.names)
        elif isinstance(node, ast.If):  # names that only annotations need
            assert isinstance(node.test, ast.Name)
            assert node.test.id == "TYPE_CHECKING"
            assert all(isinstance(part, ast.ImportFrom) for part in (*node.body, *node.orelse))
        elif isinstance(node, ast.Name):
            assert "__" not in node.id or node.id == "__file__"
        elif isinstance(node, ast.Attribute):
            assert isinstance(node.value, ast.Name)
            owners = {"op": node.attr, "MODEL": node.attr} | dict.fromkeys(functions, "address")
            assert owners[node.value.id] == node.attr
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id in imported | {"compiled", "range", "abs"}
    kinds = (ast.Expr, ast.ImportFrom, ast.If, ast.Assign, ast.FunctionDef)
    assert all(isinstance(node, kinds) for node in tree.body)
    assert [n for n in tree.body if isinstance(n, ast.Expr)] == [tree.body[0]]
    return tree
