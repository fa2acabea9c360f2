"""The grammar reads arithmetic exactly, and nothing else, whatever the text."""

import ast
from datetime import timedelta
from fractions import Fraction

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from selection import examples

from gqm_sym.errors import ExpressionError, GQMError
from gqm_sym.literals.grammar import CONSTANTS, FUNCTIONS, MAX_DEPTH, MAX_LENGTH, parse
from gqm_sym.literals.trees import evaluate

# This limit detects a reader that hangs; a busy machine does not reach it.
NO_HANG = timedelta(seconds=10)

VALUES = {"x": Fraction(3, 7), "L": Fraction(-5, 2), "a_1": Fraction(11)}


class Rationals:
    """A small algebra of fractions, with values for three names."""

    def number(self, value):
        return value

    def name(self, name):
        return VALUES[name]

    def negate(self, value):
        return -value

    def total(self, terms):
        return sum(terms, Fraction(0))

    def product(self, factors):
        result = Fraction(1)
        for factor in factors:
            result *= factor
        return result

    def reciprocal(self, value):
        return 1 / value

    def power(self, base, exponent):
        return base ** int(exponent)

    def call(self, function, argument):
        return {"abs": abs}[function](argument)


def value(text):
    """Evaluate a text in the small algebra."""
    return evaluate(parse(text, where="t"), Rationals(), where="t")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("9.81", Fraction(981, 100)),
        (".5", Fraction(1, 2)),
        ("1.", Fraction(1)),
        ("007", Fraction(7)),
        ("1e-3", Fraction(1, 1000)),
        ("2.5E+2", Fraction(250)),
        ("0.1+0.2", Fraction(3, 10)),
        ("-2**2", Fraction(-4)),
        ("(-2)**2", Fraction(4)),
        ("2**-1*3", Fraction(3, 2)),
        ("2**3**2", Fraction(512)),
        ("2**-2**2", Fraction(1, 16)),
        ("1-2-3", Fraction(-4)),
        ("8/4/2", Fraction(1)),
        ("8/4*2", Fraction(4)),
        ("1-(2-3)", Fraction(2)),
        ("+-+1", Fraction(-1)),
        ("2*-3", Fraction(-6)),
        ("-3*2+1", Fraction(-5)),
        ("x*L + a_1", Fraction(139, 14)),
        ("\n abs( -\t2 ) \r\n", Fraction(2)),
        ("1/3*3-1", Fraction(0)),
    ],
)
def test_value_is_exact_and_precedence_is_that_of_arithmetic(text, expected):
    """Text must mean exactly what it means in Python, with decimals taken literally."""
    assert value(text) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sinn(x)", "column 1: unknown function 'sinn'; did you mean 'sin'? known functions are"),
        ("2*arcsin(x)", "column 3: unknown function 'arcsin'; did you mean 'asin'?"),
        ("x(3)", "column 1: unknown function 'x'"),
        ("2 x", "column 3: no operator between '2' and 'x'; write * for a product"),
        ("2x", "column 2: no operator between '2' and 'x'"),
        ("1_000", "column 2: no operator between '1' and '_000'"),
        ("0x10", "column 2: no operator"),
        ("sin x", "column 1: 'sin' is a function; write its argument in parentheses: sin(x)"),
        ("x^2", "column 2: unexpected '^'; write ** for a power"),
        ("1,5", "column 2: unexpected ','; functions take one argument, and decimals a point"),
        ("z = x", "column 3: unexpected '='; write one expression, not an equation"),
        ("[x]", "column 1: unexpected '['; write parentheses"),
        ("", "empty; write an expression"),
        (" \n", "empty; write an expression"),
        ("1 +", "column 4: the end where a number, a name or '(' should stand"),
        ("sin()", "column 5: ')' where a number, a name or '(' should stand"),
        ("(x", "column 1: '(' is never closed; add ')'"),
        ("x)", "column 2: ')' closes no '('"),
        ("x//2", "column 3: '/' where a number"),
        ("1/(2-2)", "column 5: division by zero"),
        ("_x", "column 1: '_x': names begin with a letter"),
        ("x if y else z", "column 3: no operator between 'x' and 'if'"),
        ("x and", "column 3: no operator"),
        ("9**9**9**9", "column 5: an exponent beyond 1000; exponents lie within -1000 and 1000"),
        ("x**2000", "column 2: an exponent beyond 1000"),
        ("x**(10*101)", "column 2: an exponent beyond 1000"),
        ("x**-1001.5", "column 2: an exponent beyond 1000"),
        ("(9**999)**999", "column 9: an exact power of more than 4200 digits"),
        ("1e401", "column 1: a decimal exponent beyond 400"),
        ("1" * 401, "column 1: a number of more than 400 digits"),
        ("x" * (MAX_LENGTH + 1), "4001 characters; an expression has at most 4000"),
        ("(" * 3000, "nested deeper than 25 levels"),
        ("-" * 3000 + "1", "nested deeper than 25 levels"),
        ("2**" * 1000 + "2", "nested deeper than 25 levels"),
        ("sin(" * 700 + "x" + ")" * 700, "nested deeper than 25 levels"),
        (
            "\N{GREEK SMALL LETTER THETA}",
            "unexpected U+03B8 (greek small letter theta); write theta",
        ),
        ("2*\N{GREEK SMALL LETTER PI}", "column 3: unexpected U+03C0"),
        ("a \N{MINUS SIGN} b", "column 3: unexpected U+2212 (minus sign); write -"),
        ("x\N{SUPERSCRIPT TWO}", "write **2"),
        ("\N{CYRILLIC SMALL LETTER ES}os(x)", "column 1: unexpected U+0441"),
        ("\N{FULLWIDTH DIGIT ONE}", "unexpected U+FF11 (fullwidth digit one); write 1"),
        ("x\N{NO-BREAK SPACE}", "column 2: unexpected U+00A0"),
        ("x\0", "column 2: unexpected '\\x00'"),
        ("\ud800", "column 1: unexpected U+D800"),
    ],
)
def test_refusal_says_where_what_and_what_would_be_right(text, message):
    """Every refusal must name the place, the column and the remedy."""
    with pytest.raises(ExpressionError) as caught:
        parse(text, where="curve.graph.z")
    assert str(caught.value).startswith("curve.graph.z: ")
    assert message in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "().__class__.__bases__",
        "x.real",
        "(lambda: 1)()",
        "lambda x: x",
        "f'{x}'",
        "'a'*9",
        "[x for x in y]",
        "{1: 2}",
        "x if y else z",
        "x := 1",
        "exec(x)",
        "eval(x)",
        "open(x)",
        "sin(*x)",
        "sin(x=1)",
        "sin(x, y)",
        "sin(x)(y)",
        "x[0]",
        "x; y",
        "x # y",
        "x < y",
        "x @ y",
        "x % y",
        "~x",
        "not x",
        "None",
        "True",
        "...",
        "1j",
        "0b1",
        "x\\\ny",
        "x!",
        "await x",
    ],
)
def test_python_beyond_arithmetic_is_refused(text):
    """No other syntax of Python's may pass, however harmless."""
    with pytest.raises(ExpressionError):
        parse(text, where="t")


@pytest.mark.parametrize("given", [None, 3, b"x", ["x"], 1.5])
def test_only_text_is_parsed(given):
    """Anything but text is refused by its type."""
    with pytest.raises(ExpressionError, match=f"t: {type(given).__name__} given"):
        parse(given, where="t")


ATTACK = st.text(
    st.one_of(
        st.sampled_from([*FUNCTIONS, *CONSTANTS, *"0123456789.eE+-*/()_^,= x", "**", "sin("]).flatmap(
            lambda piece: st.sampled_from(piece)
        ),
        st.characters(),
    ),
    max_size=200,
)
PIECES = st.lists(
    st.sampled_from(
        [
            *(name + "(" for name in FUNCTIONS),
            *CONSTANTS,
            *("x", "y1", "9", "1e99", "0.1", "0"),
            *("+", "-", "*", "/", "**", "(", ")", " ", ")**9", ")**999", "9**", "1/"),
        ]
    ),
    max_size=60,
).map("".join)


@settings(examples(400), deadline=NO_HANG)
@given(st.one_of(ATTACK, PIECES, st.text(max_size=100)))
@example("9**9**9**9")
@example("(" * 4000)
@example("-" * 4000)
@example("9" * 4000)
@example("1e" + "9" * 3998)
@example("+".join("x" * 2000))
@example("/".join("7" * 2000))
@example("*".join(["9**999"] * 500))
@example("+".join(f"1/{n}" for n in range(1000, 1600)))
def test_hostile_text_gives_a_tree_or_one_clear_error(text):
    """For any text the reader must end quickly, with a tree or an error of its own."""
    refusal = None
    try:
        tree = parse(text, where="t")
    except GQMError as error:
        refusal = str(error)
    if refusal is None:
        names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        assert not any(name.startswith("_") for name in names)
    else:
        assert refusal.startswith("t: ")
        assert "\n" not in refusal


def _spelled(children):
    """Yield texts of sums, products and powers with every parenthesis written, and their meaning."""
    pair = st.tuples(children, children)
    return st.one_of(
        pair.map(lambda p: (f"({p[0][0]} + {p[1][0]})", p[0][1] + p[1][1])),
        pair.map(lambda p: (f"({p[0][0]}-{p[1][0]})", p[0][1] - p[1][1])),
        pair.map(lambda p: (f"({p[0][0]} * {p[1][0]})", p[0][1] * p[1][1])),
        children.map(lambda c: (f"(-{c[0]})", -c[1])),
        children.map(lambda c: (f"({c[0]})**2", c[1] ** 2)),
    )


SPELLED = st.recursive(
    st.one_of(
        st.decimals(0, 1000, places=3).map(lambda d: (format(d, "f"), Fraction(d))),
        st.sampled_from(sorted(VALUES)).map(lambda name: (name, VALUES[name])),
    ),
    _spelled,
    max_leaves=12,
)


@settings(deadline=NO_HANG)
@given(SPELLED)
def test_what_is_spelled_out_comes_back(spelled):
    """A text written from a value must be read as that value."""
    text, expected = spelled
    assert value(text) == expected


@settings(deadline=NO_HANG)
@given(st.lists(st.sampled_from("+-*/"), min_size=1, max_size=12), st.data())
def test_chains_agree_with_python(operators, data):
    """Without parentheses, precedence and association must be Python's."""
    numbers = data.draw(st.lists(st.integers(1, 9), min_size=len(operators) + 1, max_size=len(operators) + 1))
    text = str(numbers[0])
    # This is slow and simple: products first, then sums, from the left.
    terms = [Fraction(numbers[0])]
    for operator, number in zip(operators, numbers[1:], strict=True):
        text += f" {operator} {number}"
        if operator == "*":
            terms[-1] *= number
        elif operator == "/":
            terms[-1] /= number
        else:
            terms.append(Fraction(number if operator == "+" else -number))
    assert value(text) == sum(terms)


def test_limits_themselves_are_allowed():
    """A bound must admit what it names."""
    assert value("(" * MAX_DEPTH + "1" + ")" * MAX_DEPTH) == 1
    assert value("+".join("1" * (MAX_LENGTH // 2))) == MAX_LENGTH // 2
    assert value("1e400") == 10**400
    assert value("2**1000") == 2**1000
    assert value("9" * 400) == 10**400 - 1


def test_columns_point_into_the_text():
    """A node must remember its column, for later messages about it."""
    tree = parse("1 + sin(x)/0.5", where="t")
    found = {
        getattr(node, "id", getattr(node, "value", None)): node.col_offset
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) or (isinstance(node, ast.Name) and node.id == "x")
    }
    assert found == {Fraction(1): 0, "x": 8, Fraction(1, 2): 11}


def test_an_error_in_an_algebra_has_its_column():
    """A refusal by an algebra must be reported at the operand that caused it."""
    with pytest.raises(ExpressionError, match="t: column 10: "):
        evaluate(parse("1 + 2/(x - x)", where="t"), Rationals(), where="t")


def test_foreign_trees_are_refused():
    """Only trees of this grammar are evaluated, not what Python's parser would make."""
    for text in ("x.y", "'a'", "1.5", "x @ y", "f(x, y)", "not x"):
        with pytest.raises(ExpressionError, match="is not part of arithmetic"):
            evaluate(ast.parse(text, mode="eval").body, Rationals(), where="t")
