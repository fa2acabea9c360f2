"""Expressions from text or SymPy become exact, with real symbols and few kinds of functions."""

from datetime import timedelta
from decimal import Decimal
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from selection import examples

from gqm_sym.errors import ExpressionError, GQMError, NumberError
from gqm_sym.expressions import RESERVED_NAMES, check_name, is_real_at, name_or_value, read_expression
from gqm_sym.literals.grammar import CONSTANTS, FUNCTIONS

# This limit detects a reader that hangs; a busy machine does not reach it.
NO_HANG = timedelta(seconds=20)

x, y, theta, L = sp.symbols("x y theta L", real=True)
FEW_HEADS = {
    *(sp.Add, sp.Mul, sp.Pow, sp.Symbol, sp.Abs, sp.exp, sp.log),
    *(sp.sin, sp.cos, sp.tan, sp.asin, sp.acos, sp.atan),
    *(sp.sinh, sp.cosh, sp.tanh, sp.asinh, sp.acosh, sp.atanh),
}


def assert_plain(expression):
    """Check that an expression has only functions that later stages know, real symbols, and exact finite numbers."""
    for node in sp.preorder_traversal(expression):
        known = node.func in FEW_HEADS or node.is_Rational or node in (sp.pi, sp.E)
        assert known, f"{node.func} in {expression}"
        if node.is_Symbol:
            assert node == sp.Symbol(node.name, real=True)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("L*sin(theta)", L * sp.sin(theta)),
        ("9.81*x", sp.Rational(981, 100) * x),
        ("2**-1", sp.Rational(1, 2)),
        ("e**x + pi", sp.exp(x) + sp.pi),
        ("ln(x)", sp.log(x)),
        ("cot(x)", sp.cos(x) / sp.sin(x)),
        ("sec(x)", 1 / sp.cos(x)),
        ("csc(x)", 1 / sp.sin(x)),
        ("coth(x)", sp.cosh(x) / sp.sinh(x)),
        ("cbrt(x)", x ** sp.Rational(1, 3)),
        ("cbrt(-8)", -2),
        ("sqrt(x**2)", sp.Abs(x)),
        ("abs(-x)", sp.Abs(x)),
        ("x**y/y - -x", x**y / y + x),
        ("sin(pi/6)", sp.Rational(1, 2)),
        (0.1, sp.Rational(3602879701896397, 36028797018963968)),
        (3, 3),
        (np.int32(3), 3),
        (Fraction(1, 3), sp.Rational(1, 3)),
        (Decimal("0.1"), sp.Rational(1, 10)),
        (sp.Symbol("x") ** 2, x**2),
        (sp.Symbol("x", positive=True) * sp.Symbol("y", integer=True), x * y),
        (sp.Float(0.5) * sp.Symbol("x"), x / 2),
        (sp.Float(0.1), sp.Rational(3602879701896397, 36028797018963968)),
        (sp.cot(sp.Symbol("x")), sp.cos(x) / sp.sin(x)),
        (sp.exp(sp.Symbol("x")) * sp.E, sp.exp(x + 1)),
        (sp.cbrt(sp.Symbol("x")), x ** sp.Rational(1, 3)),
        (sp.sqrt(sp.Symbol("x") ** 2), sp.Abs(x)),
        (sp.Integer(2), 2),
    ],
    ids=str,
)
def test_sources_of_every_kind_are_read(source, expected):
    """The result is the intended expression, in plain functions."""
    expression = read_expression(source, where="t")
    assert sp.powsimp(expression) == sp.powsimp(sp.sympify(expected))
    assert_plain(expression)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("sinn(x)", "curve.graph.z: column 1: unknown function 'sinn'; did you mean 'sin'?"),
        ("__import__('os')", "unexpected"),
        ("9**9**9**9", "an exponent beyond 1000"),
        ("((x*sqrt(3))**999)**999", "numbers of too many digits"),
        ("(sqrt(2)**1000)**1000", "numbers of too many digits"),
        ("x*9**999", "an exact number of more than 420 digits"),
        ("(x - 1)**999", "a power of a sum or function with an exponent beyond 32"),
        ("((x - 1)**99)**-99", "a power of a sum or function with an exponent beyond 32"),
        ("(x**99)**99", "a power of a name with an exponent beyond 1000"),
        ("exp(10**50*log(2))", "exp of a number far outside the range of doubles"),
        ("exp(10**50*x*log(2))", "numbers of too many digits"),
        ("x + exp(exp(exp(9)))", "column 5: exp of a number far outside"),
        ("abs(exp(exp(exp(exp(9)))) - 1)", "exp of a number far outside"),
        ("asin(2)*x", "column 1: asin of a number outside [-1, 1]"),
        ("x*sqrt(-2)", "column 3: sqrt of a number outside [0, oo)"),
        ("(-8)**(1/3)", "a negative number to a power that is not an integer"),
        ("(-7)**y", "a negative number to a power that is not whole"),
        ("x**(y + 10**50)", "an exponent beyond 1000"),
        ("2**(y*10**50)", "an exponent beyond 1000"),
        ("log(0)", "log of a number outside (0, oo)"),
        ("x/(y - y)", "column 6: division by zero"),
        ("(x - x)**(-2)", "column 8: division by zero"),
        ("(x - x)**(-y)", "column 8: not a finite real number"),
        ("x/(sin(1)**2 + cos(1)**2 - 1)", "division by zero"),
        ("tan(pi/2)", "division by zero"),
        ("asin(sin(10**300))", "SymPy cannot take asin of it"),
        (float("nan"), "not a finite number"),
        (True, "is of type bool"),
        (1j, "is of type complex"),
        (None, "NoneType given; give text, a number or a SymPy expression"),
        (["x"], "list given"),
        (sp.I * x, "I is not real"),
        (sp.oo * x, "oo is not finite"),
        (sp.zoo, "zoo is not finite"),
        (sp.nan, "nan is not a number"),
        (sp.Integral(x, x), "Integral is not in the grammar"),
        (sp.Derivative(sp.Function("f")(x), x), "Derivative is not in the grammar"),
        (sp.Function("f")(x), "function 'f' is undefined; write its definition instead"),
        (sp.Function("sin")(x), "function 'sin' is undefined"),
        (sp.Function("f"), "is not in the grammar"),
        (sp.Piecewise((x, x > 0), (0, True)), "Piecewise is not in the grammar"),
        (sp.Max(x, 1), "Max is not in the grammar"),
        (sp.sign(x), "sign is not in the grammar"),
        (sp.atan2(x, y), "atan2 is not in the grammar"),
        (x > 0, "StrictGreaterThan is not in the grammar"),
        (sp.Eq(x, y), "Equality is not in the grammar"),
        (sp.true, "BooleanTrue is not in the grammar"),
        (sp.Matrix([x]), "Matrix is not in the grammar"),
        (sp.EulerGamma, "EulerGamma is not in the grammar"),
        (sp.Dummy("x"), "Dummy is not in the grammar"),
        (sp.Symbol("a b"), "symbol 'a b': a name consists of ASCII"),
        (sp.Symbol("x_{1}"), "symbol 'x_{1}'"),
        (sp.Symbol("\N{GREEK SMALL LETTER THETA}"), "a name consists of ASCII"),
        (sp.Symbol("pi"), "symbol 'pi' has the name of a function, a constant"),
        (sp.Symbol("sin"), "symbol 'sin' has the name of a function"),
        (sp.Symbol("lambda"), "symbol 'lambda' has the name of"),
        (sp.Symbol("x", imaginary=True), "symbol 'x' is declared as not real"),
    ],
    ids=lambda source: str(source)[:40],
)
def test_refusal_names_what_is_wrong(source, message):
    """Anything but a real, finite expression of the grammar is refused by name, and nothing hangs."""
    with pytest.raises((ExpressionError, NumberError)) as caught:
        read_expression(source, where="curve.graph.z")
    assert str(caught.value).startswith("curve.graph.z: ")
    assert message in str(caught.value)


def test_enormous_integers_are_refused_unprinted():
    """Python itself refuses to print an integer so long; the message must not try to."""
    with pytest.raises(ExpressionError, match="t: an exact number of more than 4200 digits"):
        read_expression(sp.Integer(10) ** 10000 * x, where="t")
    with pytest.raises(NumberError, match="t: int given: an exact number of more than 4200"):
        read_expression(10**10000, where="t")


def test_deep_sympy_expressions_are_refused_before_the_stack_ends():
    """Nesting beyond the bound is an error of the package, not a RecursionError."""
    deep = sp.Symbol("x")
    for _ in range(120):
        deep = sp.sin(1 + deep, evaluate=False)
    with pytest.raises(ExpressionError, match="nested deeper than 75 levels; name its parts"):
        read_expression(deep, where="t")


@pytest.mark.sample(2)
@pytest.mark.parametrize("pattern", ["1+2*sin(", "x*sqrt(1+2*", "1+x*exp(-x*", "1/(x+2)/(1+x*"])
def test_the_deepest_text_can_be_differentiated(pattern):
    """An expression that can be read must not exceed SymPy's limit of recursion later on."""
    count = 12 if "-" in pattern or pattern.count("(") == 2 else 25
    text = pattern * count + "x"
    text += ")" * (text.count("(") - text.count(")"))
    expression = read_expression(text, where="t")
    assert expression.diff(x).has(x)
    assert str(expression)


EXPRESSIONS = st.recursive(
    st.one_of(
        st.sampled_from([x, y, theta, sp.pi, sp.E]),
        st.fractions(-9, 9, max_denominator=9).map(lambda f: sp.Rational(f.numerator, f.denominator)),
    ),
    lambda children: st.one_of(
        st.tuples(children, children).map(lambda p: p[0] + p[1]),
        st.tuples(children, children).map(lambda p: p[0] * p[1]),
        st.tuples(children, st.integers(2, 5)).map(lambda p: p[0] ** p[1]),
        st.tuples(
            st.sampled_from([sp.sin, sp.cos, sp.atan, sp.sinh, sp.cosh, sp.tanh, sp.asinh, sp.Abs]),
            children,
        ).map(lambda p: p[0](p[1])),
        children.map(lambda c: sp.exp(-(c**2))),
        children.map(lambda c: sp.sqrt(1 + c**2)),
    ),
    max_leaves=10,
)


@settings(deadline=NO_HANG)
@given(EXPRESSIONS)
def test_an_expression_comes_back_from_itself_and_from_its_text(expression):
    """Reading is the identity on plain real expressions, from SymPy and from what SymPy prints.

    Printed text has Abs and E where the grammar has abs and e; nothing else differs.
    """
    try:
        again = read_expression(expression, where="t")
    except ExpressionError as error:
        # exp(-4**10), which is refused by design, can be drawn too.
        assume("far outside the range of doubles" not in str(error))
        raise
    assert_plain(again)
    text = str(expression).replace("Abs(", "abs(").replace("E", "e")
    from_text = read_expression(text, where="t")
    assert_plain(from_text)
    point = {x: sp.Rational(3, 7), y: sp.Rational(-5, 4), theta: sp.Rational(11, 9)}
    expected = expression.subs(point).evalf(30)
    for read in (again, from_text):
        value = read.subs(point).evalf(30)
        assert abs(value - expected) <= sp.Float(10) ** -20 * max(1, abs(expected))


@settings(deadline=NO_HANG)
@given(st.sampled_from([f for f in FUNCTIONS if f not in ("atanh", "acosh")]), st.integers(1, 99))
def test_every_function_is_the_function_of_that_name(function, percent):
    """At a point inside every domain, the value must be that of mpmath's function."""
    expression = read_expression(f"{function}(x)", where="t").subs(x, sp.Rational(percent, 100))
    names = {"ln": "log", "abs": "fabs"}
    with mpmath.workdps(40):
        truth = getattr(mpmath, names.get(function, function))(mpmath.mpf(percent) / 100)
        assert mpmath.almosteq(mpmath.mpf(str(expression.evalf(40))), truth, 1e-35)


PIECES = st.lists(
    st.sampled_from(
        [
            *(name + "(" for name in FUNCTIONS),
            *CONSTANTS,
            *("x", "y", "9", "1e99", "0.1", "0", "2", "8"),
            *("+", "-", "*", "/", "**", "(", ")", ")", ")", ")**9", ")**999", "9**", "1/", "**0.5"),
        ]
    ),
    max_size=25,
).map("".join)


def _closed(text):
    return text + ")" * max(0, text.count("(") - text.count(")"))


@settings(examples(300), deadline=NO_HANG)
@given(st.one_of(PIECES.map(_closed), st.text(max_size=60)))
@example("acosh(coth(acos(y)/atan((1 - 8)**(y + 10**50))))")
@example("atan(tanh(log(((x - 1)**999)**-1)))")
@example("tanh(acosh((1/3/0.1)**999 + 9**999))")
@example("cbrt(10**50 - cbrt(1e9)**999)")
@example("+".join(f"a{n}" for n in range(700)))
@example("*".join(f"(a{n}+1)" for n in range(400)))
@example("-2*".join(f"a{n}" for n in range(600)))
@example("+".join(f"x/{n}" for n in range(1, 500)))
@example("*".join(["x*9**999"] * 300))
@example("sqrt(abs(sin(10**400)))")
@example("6**(1/10**300)")
@example("(10**59 + 7)**(1/3)")
@example("cos(10**300*pi/7)")
@example("exp(exp((pi*1e40 + 1000) - pi*1e40))")
@example("+".join(f"sqrt({n}**9+1)" for n in range(100, 300)))
def test_hostile_text_gives_an_expression_or_one_clear_error(text):
    """Any text soon gives a plain expression or an error of the package."""
    expression = None
    try:
        expression = read_expression(text, where="t")
    except GQMError as error:
        refusal = str(error)
    if expression is None:
        assert refusal.startswith("t: ")
        assert "\n" not in refusal
    else:
        assert_plain(expression)


@pytest.mark.parametrize("name", ["a", "L", "theta", "b_e", "x1", "lambda_", "n", "p", "E", "g"])
def test_good_names_pass(name):
    """An ordinary name comes back unchanged."""
    assert check_name(name, where="parameters") == name


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("", "begins with a letter"),
        ("_x", "begins with a letter"),
        ("1x", "begins with a letter"),
        ("a b", "made of ASCII letters"),
        ("a-b", "made of ASCII letters"),
        ("\N{GREEK SMALL LETTER THETA}", "made of ASCII letters"),
        ("x\n", "made of ASCII letters"),
        ("lambda", "it is a word of Python's"),
        ("None", "it is a word of Python's"),
        ("sin", "it is a function of the grammar"),
        ("e", "it is a constant (2.71828)"),
        ("pi", "it is a constant (3.14159)"),
        *((name, "it is reserved, as are") for name in sorted(RESERVED_NAMES)),
    ],
)
def test_bad_names_are_refused_with_the_reason(name, reason):
    """A name that is taken, or is none, is refused with the reason."""
    with pytest.raises(ExpressionError) as caught:
        check_name(name, where="parameters")
    assert str(caught.value).startswith("parameters: ")
    assert reason in str(caught.value)


def test_reserved_names_are_for_the_caller_to_say():
    """A curve's own parameter may be lam; a name that is no text is refused by type."""
    assert check_name("lam", where="t", reserved=RESERVED_NAMES - {"lam"}) == "lam"
    with pytest.raises(ExpressionError, match="t: int given; a name is text"):
        check_name(3, where="t")


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("mu_rail", ("mu_rail", None)),
        (" mu_rail ", ("mu_rail", None)),
        ("sin", ("sin", None)),
        ("pi", ("mu", "pi")),
        ("1.62", ("mu", "1.62")),
        ("pi/2", ("mu", "pi/2")),
        (1.62, ("mu", 1.62)),
        (Fraction(1, 3), ("mu", Fraction(1, 3))),
        (sp.pi, ("mu", sp.pi)),
    ],
    ids=str,
)
def test_an_argument_is_another_name_or_a_value(source, expected):
    """Text of one word renames the parameter, and anything else is its value."""
    assert name_or_value(source, "mu") == expected


@pytest.mark.parametrize(
    ("form", "value", "real"),
    [
        (sp.sqrt(x), 2, True),
        (sp.sqrt(x), -2, False),
        (1 / x, 0, False),
        (sp.exp(sp.exp(sp.exp(x))), 50, False),
        (sp.sin(sp.exp(sp.exp(x))), 5, True),
        (x**1500, sp.Rational(12345678, 10000001), True),
        (sp.gamma(x), 2, None),
        (x + y, 2, False),
    ],
)
def test_whether_a_form_is_a_number_somewhere(form, value, real):
    """Whether a form is a number somewhere is found without computing towers; forms outside the grammar are left
    open.
    """
    assert is_real_at(form, {x: sp.sympify(value)}) is real
