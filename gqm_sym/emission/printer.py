"""SymPy expressions as Python text: over floats, over a namespace of operations, and over intervals."""

from typing import Any

from sympy import Expr, Integer, Rational
from sympy.core.function import AppliedUndef
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.str import StrPrinter

from gqm_sym.errors import EmissionError

# SymPy heads and what the standard library calls them.
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


class CodePrinter(StrPrinter):  # type: ignore[misc]
    """Numba code over floats; ``used`` collects the functions that must be imported."""

    prefix = ""
    names = FUNCTIONS

    def __init__(self, index: str = "i") -> None:
        super().__init__({"order": None})
        self.index = index
        self.used: set[str] = set()

    def _call(self, name: str, *arguments: Expr) -> str:
        self.used.add(name)
        return f"{self.prefix}{name}({', '.join(self._print(a) for a in arguments)})"

    def _print_Function(self, expr: Expr) -> str:
        name = type(expr).__name__
        if name == "at":  # the element of an array that the loop stands at
            return f"{expr.args[0]}[{self.index}]"
        if isinstance(expr, AppliedUndef):  # a helper of the runtime
            return self._call(name, *expr.args)
        if name not in self.names:
            raise EmissionError(f"{name}: no such function in emitted code; known are {', '.join(sorted(self.names))}")
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
        return f"{self.parenthesize(base, PRECEDENCE['Pow'])}**{self.parenthesize(exponent, PRECEDENCE['Pow'])}"

    def _print_Rational(self, expr: Rational) -> str:
        return f"{expr.p}/{expr.q}"

    def _print_Integer(self, expr: Integer) -> str:
        return str(expr.p)

    def _unknown(self, expr: Any) -> str:
        raise EmissionError(f"{type(expr).__name__}: {expr} is not a finite real number and cannot be emitted")

    _print_ImaginaryUnit = _print_NaN = _print_Infinity = _print_NegativeInfinity = _print_ComplexInfinity = _unknown
    _print_Integral = _print_Derivative = _print_Piecewise = _print_Relational = _unknown

    def emptyPrinter(self, expr: Any) -> str:
        """Refuse what no method above prints."""
        return self._unknown(expr)


class ExactPrinter(CodePrinter):
    """Code over a namespace ``op``, in which every rational number stays exact."""

    prefix = "op."

    def _print_Rational(self, expr: Rational) -> str:
        return f"op.mpf({expr.p})/{expr.q}"

    def _print_Abs(self, expr: Expr) -> str:
        return f"abs({self._print(expr.args[0])})"


class IntervalPrinter(CodePrinter):
    """Code over intervals (lo, hi), as calls of the runtime's interval helpers."""

    def _print_Function(self, expr: Expr) -> str:
        name = type(expr).__name__
        if name not in self.names:
            raise EmissionError(f"{name}: no interval bounds for this function")
        return self._call("i" + self.names[name].replace("fabs", "abs"), *expr.args)

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

    def _number(self, value: float) -> str:
        self.used.add("iconst")
        return f"iconst({value!r})"

    def _print_Integer(self, expr: Integer) -> str:
        return self._number(float(expr.p))

    def _print_Rational(self, expr: Rational) -> str:
        self.used |= {"idiv", "iconst"}
        return f"idiv(iconst({float(expr.p)!r}), iconst({float(expr.q)!r}))"

    def _print_Pi(self, expr: Expr) -> str:
        self.used |= {"ipi"}
        return "ipi()"

    def _print_Exp1(self, expr: Expr) -> str:
        self.used |= {"iexp", "iconst"}
        return "iexp(iconst(1.0))"
