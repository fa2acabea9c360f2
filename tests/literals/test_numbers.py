"""Numbers mean exactly what is written, in whatever form."""

import copy
import math
import operator
import pickle
import subprocess
import sys
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

from gqm_sym.errors import GQMError, NumberError
from gqm_sym.literals.grammar import CONSTANTS, FUNCTIONS
from gqm_sym.literals.numbers import Number, read_number, read_numbers

# This limit detects a reader that hangs; a busy machine does not reach it.
NO_HANG = timedelta(seconds=20)

# These are more digits than any case below cancels.
TRUTH = mpmath.mp.clone()
TRUTH.prec = 1500


def name_of(given):
    """Return the name of a case: its text, or its type if it cannot be printed."""
    return given[:40] if isinstance(given, str) else f"{type(given).__name__} {given!s:.30}"


def halves(exact):
    """Return both halves of a double-double, from an mpf of many digits, by rounding twice."""
    value = float(exact)
    return value, float(exact - value)


@pytest.mark.parametrize(
    ("given", "fraction"),
    [
        (9.81, Fraction(9.81)),
        (-0.0, Fraction(0)),
        (5e-324, Fraction(5e-324)),
        (3, Fraction(3)),
        (2**70 + 1, Fraction(2**70 + 1)),
        ("9.81", Fraction(981, 100)),
        (" -1/3 ", Fraction(-1, 3)),
        ("1e-3", Fraction(1, 1000)),
        ("2**-10", Fraction(1, 1024)),
        ("sqrt(9/4)", Fraction(3, 2)),
        ("abs(-0.5)", Fraction(1, 2)),
        ("exp(0) + cos(0)", Fraction(2)),
        ("10**400/10**399", Fraction(10)),
        (Decimal("0.1"), Fraction(1, 10)),
        (Fraction(22, 7), Fraction(22, 7)),
        (np.float64(0.1), Fraction(0.1)),
        (np.float32(0.1), Fraction(float(np.float32(0.1)))),
        (np.int64(-7), Fraction(-7)),
        (np.uint8(255), Fraction(255)),
        (sp.Integer(4), Fraction(4)),
        (sp.Rational(2, 3), Fraction(2, 3)),
        (sp.Float(0.1), Fraction(0.1)),
        (mpmath.mpf("0.1"), Fraction(0.1)),
    ],
    ids=repr,
)
def test_rational_numbers_are_kept_exactly(given, fraction):
    """The fraction is the number, the double is the nearest to it, and ``low`` is the nearest to the remainder."""
    number = read_number(given, where="lam0")
    assert number.fraction == fraction
    assert number.value == float(fraction)
    assert Fraction(number.low) == Fraction(float(fraction - Fraction(float(fraction))))
    assert float(number) == number.value


@pytest.mark.parametrize(
    ("given", "truth"),
    [
        ("pi/2", lambda m: m.pi / 2),
        ("-pi/2 + 6/5", lambda m: -m.pi / 2 + m.mpf(6) / 5),
        ("e**pi - pi**e", lambda m: m.exp(m.pi) - m.pi**m.e),
        ("sqrt(2)*1e-300", lambda m: m.sqrt(2) / m.mpf(10) ** 300),
        ("acosh(1 + 1e-100)", lambda m: 2 * m.asinh(m.sqrt(m.mpf(10) ** -100 / 2))),
        ("acos(1 - 1e-80)", lambda m: 2 * m.asin(m.sqrt(m.mpf(10) ** -80 / 2))),
        ("sin(1e300)", lambda m: m.sin(m.mpf(10) ** 300)),
        ("sin(10**400)", lambda m: m.sin(m.mpf(10) ** 400)),
        ("sinh(1e-200)", lambda m: m.sinh(m.mpf(10) ** -200)),
        ("cos(pi/2 + 1e-60)", lambda m: -m.sin(m.mpf(10) ** -60)),
        ("pi - 3.14159265358979323846264338327950288", lambda m: m.mpf("4.1971693993751058e-36")),
        ("exp(1000)/exp(999)", lambda m: m.e),
        ("cbrt(-2)", lambda m: -m.cbrt(2)),
        ("2**0.1", lambda m: m.mpf(2) ** (m.mpf(1) / 10)),
        ("(-pi)**3", lambda m: -(m.pi**3)),
        ("pi**-2", lambda m: m.pi**-2),
        ("ln(10)", lambda m: m.log(10)),
        ("cot(1)*sec(2)*csc(3)*coth(4)", lambda m: m.cot(1) * m.sec(2) * m.csc(3) * m.coth(4)),
        ("tan(asin(acos(atan(1))))", lambda m: m.tan(m.asin(m.acos(m.atan(1))))),
        ("tanh(asinh(atanh(0.5)))", lambda m: m.tanh(m.asinh(m.atanh(0.5)))),
        ("abs(cosh(1) - sqrt(7))", lambda m: abs(m.cosh(1) - m.sqrt(7))),
        (sp.pi / 3, lambda m: m.pi / 3),
        (sp.sqrt(2) * sp.E, lambda m: m.sqrt(2) * m.e),
        (sp.sqrt(2) * sp.Float(0.1), lambda m: m.sqrt(2) * m.mpf(0.1)),
        (sp.exp(2) - sp.log(3), lambda m: m.exp(2) - m.log(3)),
        (sp.Abs(sp.sin(5)), lambda m: abs(m.sin(5))),
    ],
)
def test_irrational_numbers_are_rounded_once(given, truth):
    """Both halves are those of the exact value, and so is every digit asked for later."""
    number = read_number(given, where="lam0")
    assert number.fraction is None
    exact = truth(TRUTH)
    if isinstance(given, str) and given.startswith("pi - 3.14"):
        # The expected value was typed in, to 17 digits.
        assert number.value == float(exact)
        return
    assert (number.value, number.low) == halves(exact)
    for digits in (15, 40, 300):
        ctx = mpmath.mp.clone()
        ctx.dps = digits
        assert number.at(ctx) == ctx.mpf(exact)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("sqrt(2)**2", 2.0),
        ("sqrt(2)*sqrt(8)", 4.0),
        ("sqrt(2)**2 - 2", 0.0),
        ("sin(pi)", 0.0),
        ("cos(pi/2)", 0.0),
        ("cos(2*pi)", 1.0),
        ("tan(pi/4)", 1.0),
        ("asin(sqrt(2)*sqrt(2)/2) - pi/2", 0.0),
        ("exp(log(3))", 3.0),
        ("sqrt(sin(1)**2 + cos(1)**2 - 1)", 0.0),
        ("acosh(sin(1)**2 + cos(1)**2)", 0.0),
        ("(sqrt(2)**2 - 2)**2", 0.0),
    ],
)
def test_what_is_equal_to_200_digits_is_equal(text, value):
    """A hidden integer must come out as that integer, with nothing beyond it."""
    number = read_number(text, where="lam0")
    assert (number.value, number.low) == (value, 0.0)


def test_a_tie_between_two_doubles_goes_to_the_even_one():
    """An irrational way of writing the middle between two doubles is rounded like the middle."""
    number = read_number("sqrt(2)**2/2*(1 + 2**-53)", where="lam0")
    assert (number.value, number.low) == (1.0, 2.0**-53)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (float("nan"), "lam0: nan given; give a finite number"),
        (float("inf"), "lam0: inf given"),
        (np.float64("-inf"), "lam0: float64 given: not a finite number"),
        (Decimal("NaN"), "lam0: Decimal given: not a finite number"),
        (Decimal("sNaN"), "lam0: Decimal given: not a finite number"),
        (Decimal("Infinity"), "lam0: Decimal given: not a finite number"),
        (Decimal("1e999999"), "a decimal exponent beyond 400"),
        (mpmath.inf, "lam0: mpf given: not a finite number"),
        (mpmath.nan, "lam0: mpf given: not a finite number"),
        (mpmath.mpf(2) ** 10**9, "far outside the range of doubles"),
        (sp.nan, "nan is not a number"),
        (sp.oo, "oo is not finite"),
        (sp.zoo, "zoo is not finite"),
        (sp.I, "I is not real"),
        (sp.Symbol("x"), "'x' is not a number"),
        (sp.sqrt(-2), "I is not real"),
        (sp.log(-sp.pi, evaluate=False), "log of a number outside (0, oo)"),
        (True, "True is of type bool; give a real number"),
        (np.bool_(False), "is of type bool"),
        (1j, "is of type complex"),
        (np.complex64(1), "is of type complex64"),
        (None, "NoneType given; give a number, or text such as '9.81' or 'pi/2'"),
        (b"1", "bytes given"),
        ([1.0], "list given"),
        (np.array([1.0]), "ndarray given"),
        (10**400, "beyond the largest double"),
        ("1e309", "beyond the largest double, 1.8e308"),
        ("nan", "'nan' is not a number; write a number such as 9.81 or pi/2"),
        ("inf", "'inf' is not a number"),
        ("", "empty"),
        ("9.81 m", "a unit is not known for it, got m; give a plain number"),
        ("9.81 parsnips", "no operator between '9.81' and 'parsnips'"),
        ("1,5", "decimals a point"),
        ("pi*x", "column 4: 'x' is not a number"),
        ("9**9**9**9", "an exponent beyond 1000"),
        ("2**1000**1000", "an exponent beyond 1000"),
        ("sqrt(2)**(10**9)", "an exponent beyond 1000"),
        ("(((pi**999)**999)**999)", "far outside the range of doubles"),
        ("exp(exp(exp(9)))", "exp of a number far outside the range of doubles"),
        ("exp(exp(exp(exp(9)))*0)", "exp of a number far outside"),
        ("cosh(1e9)", "cosh of a number far outside"),
        ("sin(exp(1000000))", "sine or cosine of a number too large for its digits"),
        ("exp(-1e5)", "far outside the range of doubles"),
        ("sqrt(-1)", "column 1: sqrt of a number outside [0, oo)"),
        ("(-8)**(1/3)", "a negative number to a power that is not an integer"),
        ("(-pi)**e", "a negative number to a power that is not an integer"),
        ("asin(1.0000001)", "asin of a number outside [-1, 1]"),
        ("acos(-2)", "acos of a number outside [-1, 1]"),
        ("atanh(1)", "atanh of a number outside (-1, 1)"),
        ("atanh(sin(1)**2 + cos(1)**2)", "atanh of a number outside (-1, 1)"),
        ("acosh(0.5)", "acosh of a number outside [1, oo)"),
        ("log(0)", "log of a number outside (0, oo)"),
        ("log(sqrt(2)**2 - 2)", "log of a number outside (0, oo)"),
        ("1/0", "division by zero"),
        ("0**-1", "division by zero"),
        ("1/(sqrt(2)**2 - 2)", "division by zero"),
        ("tan(pi/2)", "division by zero"),
        ("cot(0)", "division by zero"),
        ("__import__('os')", "unexpected"),
        ("0x1p3", "no operator between '0' and 'x1p3'"),
    ],
    ids=name_of,
)
def test_what_is_no_finite_real_number_is_refused(given, message):
    """Each such value is refused quickly with one clear line that names its place."""
    with pytest.raises(NumberError) as caught:
        read_number(given, where="lam0")
    assert str(caught.value).startswith("lam0: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def _grown(children):
    functions = st.sampled_from(
        ["sin", "cos", "atan", "tanh", "asinh", "exp", "sinh", "cosh", "abs", "sqrt", "log", "cbrt"]
    )
    binary = st.sampled_from([("+", operator.add), ("-", operator.sub), ("*", operator.mul)])
    return st.one_of(
        st.tuples(functions, children).map(
            lambda p: (
                f"{p[0]}({p[1][0]})",
                lambda: getattr(TRUTH, {"abs": "fabs"}.get(p[0], p[0]))(p[1][1]()),
            )
        ),
        st.tuples(binary, children, children).map(
            lambda p: (f"({p[1][0]} {p[0][0]} {p[2][0]})", lambda: p[0][1](p[1][1](), p[2][1]()))
        ),
        st.tuples(children, children).map(lambda p: (f"({p[0][0]}/{p[1][0]})", lambda: p[0][1]() / p[1][1]())),
        children.map(lambda c: (f"({c[0]})**3", lambda: c[1]() ** 3)),
    )


GROWN = st.recursive(
    st.one_of(
        st.just(("pi", lambda: +TRUTH.pi)),
        st.just(("e", lambda: +TRUTH.e)),
        st.decimals(-20, 20, places=2).map(lambda d: (f"({d:f})", lambda: TRUTH.mpf(int(d * 100)) / 100)),
    ),
    _grown,
    max_leaves=8,
)


@settings(examples(300), deadline=NO_HANG)
@given(GROWN)
def test_values_agree_with_mpmath(grown):
    """At 450 digits mpmath, without intervals, must find the same two doubles."""
    text, compute = grown
    try:
        truth = compute()
    except (ZeroDivisionError, ValueError, OverflowError):
        truth = None
    # For mpmath a cube root of a negative number is complex, and a zero may be exact or pure rounding.
    assume(truth is not None and isinstance(truth, TRUTH.mpf) and TRUTH.isfinite(truth))
    assume(1e-100 < abs(truth) < 1e300)
    try:
        number = read_number(text, where="t")
    except NumberError:
        # The number is refused for the size of a part, or it is an exact zero where mpmath has a small number.
        assume(False)
    value, low = halves(truth)
    assert number.value == value
    # tanh(314) equals 1 to 200 digits, so nothing beyond 1 is stored; ``at`` still has the exact value.
    assert number.low == low or abs(number.low - low) < abs(value) * 2.0**-690
    if number.fraction is None:
        assert number.at(mpmath.mp) == mpmath.mpf(truth)


PIECES = st.lists(
    st.sampled_from(
        [
            *(name + "(" for name in FUNCTIONS),
            *CONSTANTS,
            *("9", "1e99", "0.1", "0", "1", "+", "-", "*", "/", "**", "(", ")", ")", ")"),
            *(")**9", ")**999", "9**", "1/", "exp(exp(", "1000"),
        ]
    ),
    max_size=40,
).map(lambda pieces: "".join(pieces) + ")" * 12)


@settings(examples(300), deadline=NO_HANG)
@given(
    st.one_of(
        PIECES.map(lambda text: text[: len(text) - max(0, text.count(")") - text.count("("))]),
        st.text(max_size=60),
        st.floats(),
        st.decimals(),
        st.fractions(),
        st.complex_numbers(),
        st.integers(),
        st.booleans(),
        st.none(),
        st.binary(max_size=4),
    )
)
@example("exp(exp(exp(exp(9))))")
@example("((pi**999)**999)**999")
@example("1/(pi-pi)**999")
@example("sin(exp(exp(13)))")
@example("exp((sqrt(2)**2-2)*1e300)")
@example("exp(exp((pi*1e40+1000)-pi*1e40))")
@example("acos(cos(1e300))-acos(cos(1e300))")
@example("log(log(log(1e400)))")
@example("+".join(["sin(1e300)"] * 300))
@example("sqrt(" * 25 + "2" + ")" * 25)
@example("+".join(f"sqrt({n})" for n in range(300)))
def test_hostile_numbers_give_a_number_or_one_clear_error(hostile):
    """Any input gives a finite number, or an error of the package, and soon."""
    number = None
    try:
        number = read_number(hostile, where="t")
    except GQMError as error:
        refusal = str(error)
    if number is None:
        assert refusal.startswith("t: ")
    else:
        assert np.isfinite(number.value)
        assert abs(number.low) <= math.ulp(number.value) / 2


@settings(deadline=NO_HANG)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_float_is_its_binary_value_and_its_text_reads_back(x):
    """Nothing may be lost or gained on the way through a float."""
    number = read_number(x, where="t")
    assert number.value == x
    assert number.low == 0.0
    assert number.fraction == Fraction(x)
    assert read_number(number.text, where="t").value == x
    assert number.at(mpmath.mp) == x


@settings(deadline=NO_HANG)
@given(st.fractions(max_denominator=10**40), st.integers(20, 400))
def test_fractions_are_rounded_once_at_any_precision(fraction, bits):
    """``at`` must be the nearest number of that many bits, half to even."""
    ctx = mpmath.mp.clone()
    ctx.prec = bits
    at = read_number(fraction, where="t").at(ctx)
    sign, mantissa, exponent, size = at._mpf_
    assert size <= bits
    value = Fraction(mantissa) * Fraction(2) ** exponent * (-1 if sign else 1)
    if fraction:
        assert abs(value - fraction) <= abs(fraction) * Fraction(1, 2**bits)


@pytest.mark.parametrize("text", ["pi/2", "1/3", "2", "exp(1)*1e-200"])
def test_in_interval_arithmetic_the_number_is_enclosed(text):
    """In ``mpmath.iv`` the answer must contain the number, and be one or two ulps wide."""
    number = read_number(text, where="t")
    interval = number.at(mpmath.iv)
    ctx = mpmath.mp.clone()
    ctx.prec = 400
    exact = number.at(ctx)
    low, high = ctx.mpf(interval.a._mpi_[0]), ctx.mpf(interval.b._mpi_[1])
    assert low <= exact <= high
    assert high - low <= abs(exact) * ctx.mpf(2) ** (3 - mpmath.iv.prec)


@pytest.mark.parametrize(
    "given",
    [
        range(-3, 9, 4),
        range(2**53 - 4, 2**53),
        range(0),
        [0.1, 3, -(2**53) + 1],
        (0.5, 1e300),
        [[0.1, 1], [2, 3.5]],
        [2.0, 2**53 + 1],
        [10**400 // 10**390, 3],
        range(2**53 - 1, 2**53 + 3),
        np.array([0.1, 2.5], dtype=np.float32),
        np.arange(5),
        np.array([2**53 + 1]),
        np.array([[1, 2], [3, 4]], dtype=np.uint8),
        np.array([0.1, 0.7], dtype=np.longdouble),
    ],
    ids=str,
)
def test_many_numbers_at_once_are_those_read_one_by_one(given):
    """Ranges, lists and arrays of doubles are read at once, with the same values, remainders and shape."""
    high, low, shape = read_numbers(given, where="t")
    each = [read_number(v, where="t") for v in np.asarray(given, dtype=object).reshape(-1)]
    assert high.tolist() == [number.value for number in each]
    assert low.tolist() == [number.low for number in each]
    assert shape == np.shape(given)


@pytest.mark.parametrize("given", [[0.0, math.nan], [1, True], np.array([True]), [0.5, None], np.array(["NaT"], "M8")])
def test_what_is_among_many_numbers_and_none_is_refused(given):
    """Reading at once accepts no more than reading one by one."""
    with pytest.raises(NumberError):
        read_numbers(given, where="t")


@pytest.mark.parametrize(
    "given", [range(10**6), [0.1] * 10**6, [7] * 10**6, np.arange(10**6)], ids=lambda g: str(type(g))
)
def test_many_doubles_are_not_read_one_by_one(given, monkeypatch):
    """Ten million times from a range are read quickly (it took 20 s)."""
    monkeypatch.setattr("gqm_sym.literals.numbers.read_number", None)
    assert read_numbers(given, where="t")[0].size == 10**6


def test_numbers_are_values():
    """Numbers are equal if they mean the same; they can be hashed, copied and pickled, and never change."""
    half = read_number("1/2", where="t")
    assert half == read_number(0.5, where="t") == read_number(Fraction(1, 2), where="t")
    assert hash(half) == hash(read_number(0.5, where="t"))
    assert half != read_number("0.3", where="t")
    assert half != "1/2"
    assert read_number("9.81", where="t") != read_number(9.81, where="t")
    angle = read_number("pi/2", where="t")
    assert angle == pickle.loads(pickle.dumps(angle)) == copy.deepcopy(angle)
    assert read_number(angle, where="t") is angle
    assert repr(angle) == "Number('pi/2')"
    assert isinstance(angle, Number)
    with pytest.raises(AttributeError):
        angle.value = 3.0


def test_rational_numbers_need_neither_mpmath_nor_sympy():
    """Reading floats, ints and decimals must not load what exact digits need."""
    code = (
        "import sys\n"
        "from gqm_sym.literals.numbers import read_number\n"
        "for given in (9.81, 3, '9.81', '-6/5', '2**10', 'pi/2', '-pi/2 + 6/5'):\n"
        "    read_number(given, where='t')\n"
        "assert not {'mpmath', 'sympy'} & set(sys.modules)\n"
        "read_number('sqrt(2)', where='t')\n"
        "assert 'mpmath' in sys.modules and 'sympy' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
