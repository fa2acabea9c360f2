"""SymPy expressions as Python text: over floats, over a namespace of operations, and over intervals."""

import re
from collections.abc import Collection
from typing import Any

from sympy import Basic, Expr, Integer, Rational, Symbol, pi
from sympy.core.function import AppliedUndef
from sympy.core.numbers import Exp1
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.str import StrPrinter

from gqm_sym.derivation.algebra.bottom_up import parts_in_order
from gqm_sym.errors import EmissionError
from gqm_sym.sympy_charts import SPACE_CHARTS, TRAIN_LOADS

# Every integer up to this is a double.
MAX_INTEGER = 2**53

# The largest number of digits of integers that are doubles.
MAX_DIGITS = 308

# The names of SymPy's functions in the standard library.
FUNCTIONS = {
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "asin": "asin",
    "acos": "acos",
    "atan": "atan",
    "sinh": "sinh",
    "cosh": "cosh",
    "tanh": "tanh",
    "asinh": "asinh",
    "acosh": "acosh",
    "atanh": "atanh",
    "exp": "exp",
    "log": "log",
    "Abs": "fabs",
}

# Rows of a chart, which compiled code reads from the array ``chart``.
CHARTED = frozenset(
    {"chart_x", "chart_z", "chart_alpha", "chart_kappa"}
    | {head.__name__ for rows in SPACE_CHARTS.values() for head in rows}
    | {head.__name__ for head in TRAIN_LOADS}
)
_CHART_CALL = re.compile(r"(divdiff[12]_)?chart_[a-z]+")
# In space each coordinate has a chart, whose height is the coordinate and whose rows of angle, curvature and x are its
# derivatives. The same holds for the roll angle, and for the means of the height and of other parts of a potential over
# a train.
_SPACE_CALL = re.compile(r"(i?(?:divdiff[12]_)?)space_(d*)(x|y|z|roll|h|u[0-9])")
ROWS_BY_ORDER = ("chart_z", "chart_alpha", "chart_kappa", "chart_x")


def check_emittable(expr: Expr, names: Collection[str], *, where: str) -> None:
    """Refuse a form that contains an expression which the printers below cannot write; the message names it.

    Parameters
    ----------
    expr
        A closed form, before it is lowered.
    names
        The curve's parameter and the run-time parameters.
    where
        The name of the form, for messages.
    """
    for node in parts_in_order([expr]):
        if isinstance(node, Symbol):
            if node.name not in names:
                raise EmissionError(f"{where}: {node.name} is neither the curve's parameter nor a run-time parameter")
        elif isinstance(node, AppliedUndef) or not _has_text(node):
            what = f"{node.func.__name__}: no such function" if node.args else f"{node}: no such number"
            raise EmissionError(f"{where}: {what} in emitted code; known are {', '.join(sorted(FUNCTIONS))}, pi and E")


def _has_text(node: Basic) -> bool:
    if isinstance(node, Rational):
        return True
    if node.is_Add or node.is_Mul or node.is_Pow or node in (pi, Exp1()):
        return True
    return type(node).__name__ in {*FUNCTIONS, *CHARTED}


def check_size(number: Rational) -> None:
    """Raise an error if a number is no double, or its numerator or denominator is none: formulas over floats need
    both.
    """
    as_double(number)
    digits = max(len(str(abs(number.p))), len(str(number.q)))
    if digits > MAX_DIGITS:
        raise EmissionError(f"a number of {digits} digits; formulas take numbers of at most {MAX_DIGITS}")


def as_double(number: Rational) -> float:
    """Return the double nearest to a rational number; raise an error if that is out of range."""
    try:
        value: float = number.p / number.q
    except OverflowError:
        value = 0.0
    if value == 0.0 and number.p:
        digits = f"{float(len(str(abs(number.p))) - len(str(number.q))):.0f}"
        raise EmissionError(f"a number near 10**{digits} is beyond the range of doubles; choose other units")
    return value


def is_double(number: Rational) -> bool:
    """Return whether numerator and denominator are doubles, and integers that compiled code can represent."""
    return all(abs(part) <= MAX_INTEGER for part in (number.p, number.q))


class CodePrinter(StrPrinter):  # type: ignore[misc]
    """A printer of numba code over floats; ``used`` collects the functions that must be imported, and ``charts`` the
    charts.
    """

    printmethod = "_emitted"
    prefix = ""
    names = FUNCTIONS

    def __init__(self, index: str = "i") -> None:
        super().__init__({"order": None})
        self.index = index
        self.used: set[str] = set()
        self.charts: set[str] = set()

    def _call(self, name: str, *arguments: Expr) -> str:
        texts, chart = [self._print(a) for a in arguments], "chart"
        if in_space := _SPACE_CALL.fullmatch(name):
            before, primes, axis = in_space.groups()
            name = before + ROWS_BY_ORDER[len(primes)]
            chart = f"along_{axis}"
            if axis.startswith("u"):  # its slope has no scale, unlike that of a coordinate
                name = name.replace("ichart_alpha", "ichart_slope")
        self.used.add(name)
        if in_space or _CHART_CALL.fullmatch(name.removeprefix("i")):
            texts.insert(0, chart)
            self.charts.add(chart)
        return f"{self.prefix}{name}({', '.join(texts)})"

    def _print_Function(self, expr: Expr) -> str:
        name = type(expr).__name__
        if name == "at":  # the element of an array in the current step of the loop
            array, *rows = expr.args
            return f"{array}[{', '.join([*map(str, rows), self.index])}]"
        if isinstance(expr, AppliedUndef) or name in CHARTED:  # a helper of the runtime
            return self._call(name, *expr.args)
        return self._call(self.names[name], *expr.args)

    _print_Abs = _print_exp = _print_log = _print_Function

    def _print_Pi(self, expr: Expr) -> str:
        self.used.add("pi")
        return f"{self.prefix}pi"

    def _print_Exp1(self, expr: Expr) -> str:
        self.used.add("e")
        return f"{self.prefix}e"

    def _print_Pow(self, expr: Expr, rational: bool = False) -> str:
        base, exponent = expr.args
        if exponent == Rational(1, 2):
            return self._call("sqrt", base)
        if exponent == Rational(-1, 2):
            return f"1/{self._call('sqrt', base)}"
        if exponent == -1:
            return f"1/{self.parenthesize(base, PRECEDENCE['Pow'])}"
        if isinstance(exponent, Integer) and exponent < 0:
            # numba raises an error for 0.0**(-2), whatever its error model, and leaves the rest of an array unfilled.
            return f"1/{self.parenthesize(base, PRECEDENCE['Pow'])}**{-exponent.p}"
        return f"{self.parenthesize(base, PRECEDENCE['Pow'])}**{self.parenthesize(exponent, PRECEDENCE['Pow'])}"

    def _print_Mul(self, expr: Expr) -> str:
        number, remainder = expr.as_coeff_Mul()
        if number.is_Rational and not is_double(number):
            return f"{self._print(number)}*{self.parenthesize(remainder, PRECEDENCE['Mul'], strict=True)}"
        return str(super()._print_Mul(expr))

    def _print_Rational(self, expr: Rational) -> str:
        return f"{expr.p}/{expr.q}" if is_double(expr) else repr(as_double(expr))

    def _print_Integer(self, expr: Integer) -> str:
        return str(expr.p) if is_double(expr) else repr(as_double(expr))


class ExactPrinter(CodePrinter):
    """A printer of code over a namespace ``op``, in which every rational number stays exact."""

    prefix = "op."

    def _print_Mul(self, expr: Expr) -> str:
        return str(StrPrinter._print_Mul(self, expr))

    def _print_Rational(self, expr: Rational) -> str:
        check_size(expr)
        return f"op.mpf({expr.p})/{expr.q}"

    def _print_Integer(self, expr: Integer) -> str:
        check_size(expr)
        return str(expr.p)

    def _print_Abs(self, expr: Expr) -> str:
        return f"abs({self._print(expr.args[0])})"


class IntervalPrinter(CodePrinter):
    """A printer of code over intervals (lo, hi), as calls of the runtime's interval helpers."""

    def _print_Function(self, expr: Expr) -> str:
        name = type(expr).__name__
        name = self.names.get(name, name)
        return self._call("i" + name.replace("fabs", "abs"), *expr.args)

    _print_Abs = _print_exp = _print_log = _print_Function

    def _fold(self, name: str, terms: list[str]) -> str:
        self.used.add(name)
        out = terms[0]
        for term in terms[1:]:
            out = f"{name}({out}, {term})"
        return out

    def _print_Add(self, expr: Expr, order: Any = None) -> str:
        return self._fold("iadd", [self._print(t) for t in self._as_ordered_terms(expr)])

    def _print_Mul(self, expr: Expr) -> str:
        return self._fold("imul", [self._print(t) for t in expr.as_ordered_factors()])

    def _print_Pow(self, expr: Expr, rational: bool = False) -> str:
        base, exponent = expr.args
        if exponent == Rational(1, 2):
            return self._call("isqrt", base)
        if exponent == -1:
            self.used |= {"idiv", "iconst"}
            return f"idiv(iconst(1.0), {self._print(base)})"
        if isinstance(exponent, Integer):
            self.used.add("ipow")
            return f"ipow({self._print(base)}, {exponent.p})"
        if isinstance(exponent, Rational) and exponent.q == 2:
            self.used |= {"isqrt", "ipow"}
            return f"ipow(isqrt({self._print(base)}), {exponent.p})"
        if not exponent.is_number:
            self.used |= {"iexp", "imul", "ilog"}
            return f"iexp(imul({self._print(exponent)}, ilog({self._print(base)})))"
        self.used.add("irpow")
        return f"irpow({self._print(base)}, {float(exponent)!r})"

    def _number(self, value: Rational) -> str:
        name = "iconst" if is_double(value) else "ipoint"
        self.used.add(name)
        return f"{name}({as_double(value)!r})"

    def _print_Integer(self, expr: Integer) -> str:
        return self._number(expr)

    def _print_Rational(self, expr: Rational) -> str:
        if not is_double(expr):
            return self._number(expr)
        self.used.add("idiv")
        return f"idiv({self._number(Integer(expr.p))}, {self._number(Integer(expr.q))})"

    def _print_Pi(self, expr: Expr) -> str:
        self.used |= {"ipi"}
        return "ipi()"

    def _print_Exp1(self, expr: Expr) -> str:
        self.used |= {"iexp", "iconst"}
        return "iexp(iconst(1.0))"
