"""Reading of text or SymPy expressions as SymPy expressions of few functions, on which all later stages rely.

An expression read here consists of real symbols, rational numbers, pi, E, Add, Mul, Pow, Abs and sin cos tan asin acos
atan sinh cosh tanh asinh acosh atanh exp log. It contains no Float, and nothing that is complex or infinite.
"""

import importlib.util
import keyword
import math
import sys
import sysconfig
from collections.abc import Callable, Collection, Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import sympy as sp

from gqm_sym.budgets import budget
from gqm_sym.errors import ExpressionError
from gqm_sym.literals import rationals
from gqm_sym.literals.enclosures import check_constants, enclose
from gqm_sym.literals.grammar import CONSTANTS, FUNCTIONS, NAME, parse
from gqm_sym.literals.sympy_tree import is_sympy, tree_of
from gqm_sym.literals.trees import constant, evaluate
from gqm_sym.literals.units import is_quantity, scale_of, split_unit, unit_of_quantity

Source: TypeAlias = str | int | float | Fraction | Decimal | sp.Expr

S = TypeVar("S")

# Names of present or future arguments of ``solve`` and similar functions.
RESERVED_NAMES = frozenset(
    {
        *("lam", "lam0", "v0", "direction", "t_max", "contact", "point", "quantity", "client", "out"),
        *("wrt", "gradient", "after", "restitution", "scene", "velocity", "spin", "slow", "device"),
    }
)
# The largest length of a name; longer ones do not fit into a line of a message or of a generated module.
MAX_NAME = 60

# The largest size in bits of all rational numbers that one operation may combine into one, and of any number in a
# result. SymPy searches for the factors of a number of which it takes a root, which takes seconds for 3000 bits.
_MAX_COMBINED_BITS = 2**17
_MAX_BITS = 1400
# The largest exponent of anything but a name or a number. SymPy multiplies powers out on many occasions, which can take
# half a minute for (x - 1)**999.
_MAX_POWER = 32
# The number of bits to which a number is computed if only its being real matters.
_REAL_BITS = 10
# The limit of processor time in seconds for one expression; typical ones take a thousandth of it.
SECONDS = 0.5

_HEADS: dict[str, Callable[[sp.Expr], sp.Expr]] = {
    **{
        name: getattr(sp, name)
        for name in (
            *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"),
            *("asinh", "acosh", "atanh", "exp", "log", "sqrt"),
        )
    },
    "ln": sp.log,
    "abs": sp.Abs,
    "cot": lambda u: sp.cos(u) / sp.sin(u),
    "sec": lambda u: 1 / sp.cos(u),
    "csc": lambda u: 1 / sp.sin(u),
    "coth": lambda u: sp.cosh(u) / sp.sinh(u),
    # For a negative number this is the real root; for a symbol it is the power, which is NaN below zero.
    "cbrt": lambda u: -((-u) ** sp.Rational(1, 3)) if u.is_negative else u ** sp.Rational(1, 3),
}
_IMPROPER = (sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I)


def read_expression(source: Source, *, where: str, unit: str | None = None) -> sp.Expr:
    """Read an expression, or a number with a unit.

    Parameters
    ----------
    source
        Text in the grammar of ``gqm_sym.grammar``, a number, or a SymPy expression of the same
        heads. A float means its binary value, text and every other number exactly what it says.
    where
        The name of the expression in errors, such as ``curve.graph.z``.
    unit
        The SI unit to which a quantity, or a text such as "30 deg", is converted, "1" for a plain number or an angle;
        None if no unit is known, so that none is accepted.

    Returns
    -------
    sympy.Expr
        The expression, all of whose symbols are ``Symbol(name, real=True)``.

    Raises
    ------
    ExpressionError
        If it is not in the grammar, or not real and finite.
    NumberError
        If it has a unit of another dimension, or has a unit although none is known.
    BudgetError
        If SymPy takes too long over it.
    """
    measured = _measured(source)
    if measured is not None:
        scale = scale_of(measured[1], unit, where=where)
        factor = sp.Rational(scale.factor.numerator, scale.factor.denominator) * sp.pi**scale.turns
        return read_expression(measured[0], where=where) * factor
    if isinstance(source, str):
        tree = parse(source, where=where)
    elif is_sympy(source):
        tree = tree_of(source, where=where)
    else:
        exact = rationals.read_exact(source, where=where)
        if exact is None:
            raise ExpressionError(f"{where}: {type(source).__name__} given; give text, a number or a SymPy expression")
        tree = constant(exact)
    with budget(where, SECONDS, "write a shorter expression"):
        check_constants(tree, where=where)
        return evaluate(tree, _SymPy(), where=where)


def _measured(source: object) -> tuple[Any, str] | None:
    """Return the number and the unit of a quantity, or of a text such as "30 deg"; None for anything else."""
    if is_quantity(source):
        quantity: Any = source
        return quantity.magnitude, unit_of_quantity(quantity)
    split = split_unit(source) if isinstance(source, str) else None
    return None if split is None else (split[0], split[2])


def common_measure(numbers: Iterable[sp.Rational]) -> sp.Rational:
    """Return the largest number of which each of some rational numbers is an integer multiple.

    SymPy's own ``gcd_list`` stops at the first 1 that it meets: for 1, 3 and 7/6 it returns 1.
    """
    listed = tuple(numbers)
    return sp.Rational(math.gcd(*(int(number.p) for number in listed)), math.lcm(*(int(number.q) for number in listed)))


def is_real_at(form: sp.Expr, values: Mapping[sp.Symbol, sp.Expr]) -> bool | None:
    """Return whether a form is a finite real number for given values of its symbols; None if it contains a function
    that the grammar does not have.

    Each step is bounded, while SymPy's own evaluation would try to compute exp(exp(exp(50))).
    """
    try:
        tree = tree_of(form, where="form")
        known = {symbol.name: tree_of(value, where=symbol.name) for symbol, value in values.items()}
    except ExpressionError:
        return None
    try:
        enclose(tree, _REAL_BITS, where="form", values=known)
    except ExpressionError:
        return False
    return True


def check_name(name: str, *, where: str, reserved: Collection[str] = RESERVED_NAMES) -> str:
    """Return ``name`` if it is allowed as the name of a parameter, and refuse it with the reason otherwise.

    Parameters
    ----------
    name
        The name of a parameter of a curve, a kernel or a model.
    where
        The named object, as errors should call it.
    reserved
        Names that are not available.
    """
    if not isinstance(name, str):
        raise ExpressionError(f"{where}: {type(name).__name__} given; a name is text")
    reason = None
    if not NAME.fullmatch(name):
        reason = "a name is made of ASCII letters, digits and _, and begins with a letter"
    elif len(name) > MAX_NAME:
        reason = f"it is longer than {MAX_NAME} characters"
    elif keyword.iskeyword(name):
        reason = "it is a word of Python's; choose another"
    elif name in FUNCTIONS:
        reason = "it is a function of the grammar; choose another"
    elif name in CONSTANTS:
        reason = f"it is a constant ({sp.N(_SymPy().name(name), 6)}); choose another"
    elif name in reserved:
        reason = f"it is reserved, as are {', '.join(sorted({*reserved} - {name}))}; choose another"
    if reason is not None:
        raise ExpressionError(f"{where}: {name[:40]!r} cannot be a name: {reason}")
    return name


def check_module_name(name: str, *, where: str) -> str:
    """Return ``name`` if it is allowed as the name of a generated module, and refuse it with the reason otherwise."""
    check_name(name, where=where)
    if name in sys.stdlib_module_names or name == "gqm_sym" or _is_installed(name):
        raise ExpressionError(
            f"{where}: {name!r} is the name of a module that Python has already, which a generated one would hide; "
            f"choose another, as {name}_motion"
        )
    return name


def _is_installed(name: str) -> bool:
    """Return whether an installed package has a module of this name; a module in the user's own folders does not
    matter.
    """
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        return False
    if spec is None:
        return False
    folders = [sysconfig.get_paths()[key] for key in ("stdlib", "platlib", "purelib")]
    places = [spec.origin or "", *(spec.submodule_search_locations or ())]
    return any(Path(place).is_relative_to(folder) for place in places if place for folder in folders)


def name_or_value(source: S, default_name: str) -> tuple[str, S | None]:
    """Read the argument of a kernel or a family: another name for its parameter, or a value.

    Returns
    -------
    tuple
        ``(source, None)`` if it is a text of one word (``check_name`` decides whether that can be a name), else
        ``(default_name, source)``.
    """
    if isinstance(source, str):
        text = source.strip()
        is_word = NAME.fullmatch(text) is not None and text not in CONSTANTS
        if is_word:
            return text, None
    return default_name, source


class _SymPy:
    """The algebra of SymPy expressions.

    SymPy computes rational powers and products at once, whatever their size, so each operation here first determines
    the number of bits that it could combine.
    """

    def number(self, value: Fraction) -> sp.Expr:
        return sp.Rational(value.numerator, value.denominator)

    def name(self, name: str) -> sp.Expr:
        if name in CONSTANTS:
            return sp.pi if name == "pi" else sp.E
        return sp.Symbol(name, real=True)

    def negate(self, value: sp.Expr) -> sp.Expr:
        return -value

    def total(self, terms: list[sp.Expr]) -> sp.Expr:
        _check_bits(terms)
        return _proper(sp.Add(*terms))

    def product(self, factors: list[sp.Expr]) -> sp.Expr:
        _check_bits(factors)
        # Roots of numbers become one root, and SymPy searches for the factors of their product.
        roots = (part for factor in factors for part in sp.Mul.make_args(factor) if part.is_Pow)
        _check_bits([root.base for root in roots if root.base.is_Rational], most=_MAX_BITS)
        return _proper(sp.Mul(*factors))

    def reciprocal(self, value: sp.Expr) -> sp.Expr:
        if value.is_zero:
            raise ValueError("division by zero")
        return _proper(1 / value)

    def power(self, base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        for part in (exponent.as_coeff_Add()[0], exponent.as_coeff_Mul()[0]):
            rationals.check_exponent(Fraction(part.p, part.q))
        if base.is_negative and base.is_number and not exponent.is_integer:
            raise ValueError("a negative number to a power that is not whole, which is not real")
        if exponent.is_Rational:
            if base.is_zero and exponent.is_negative:
                raise ValueError("division by zero")
            _check_bits([base], times=abs(exponent.p) // exponent.q + 1)
        return _proper(base**exponent)

    def call(self, function: str, argument: sp.Expr) -> sp.Expr:
        if function == "exp" and argument.has(sp.log):
            # exp(n*log(2)) is computed as 2**n.
            largest = max((abs(number) for number in argument.atoms(sp.Rational)), default=1)
            _check_bits([argument], times=int(largest) + 1)
        try:
            return _proper(_HEADS[function](argument))
        except Exception as error:
            # SymPy evaluates numbers by itself, and fails for some: asin(sin(10**300)) gives an AttributeError.
            raise ValueError(f"SymPy cannot take {function} of it") from error


def _check_bits(operands: list[sp.Expr], *, times: int = 1, most: int = _MAX_COMBINED_BITS) -> None:
    bits = sum(
        max(number.p.bit_length(), number.q.bit_length())
        for operand in operands
        for number in operand.atoms(sp.Rational)
    )
    if bits * times > most:
        raise ValueError("numbers of too many digits; write them as decimals")


def _proper(value: sp.Expr) -> sp.Expr:
    """Refuse expressions that are complex, infinite or undefined, and those on which SymPy would fail later."""
    for node in sp.preorder_traversal(value):
        if node in _IMPROPER:
            raise ValueError("not a finite real number")
        if node.is_Rational and max(node.p.bit_length(), node.q.bit_length()) > _MAX_BITS:
            raise ValueError("an exact number of more than 420 digits; write it as a decimal")
        if node.is_Pow and node.exp.is_Rational:
            bound = rationals.MAX_EXPONENT if node.base.is_Atom else _MAX_POWER
            if abs(node.exp) > bound:
                what = "a name" if node.base.is_Atom else "a sum or function"
                raise ValueError(f"a power of {what} with an exponent beyond {bound}")
    return value
