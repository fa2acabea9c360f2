"""The only parser of arithmetic text; `gqm_sym.literals.trees.evaluate` evaluates the trees that it returns.

::

    sum      = product {("+" | "-") product}
    product  = signed {("*" | "/") signed}
    signed   = ("+" | "-") signed | power
    power    = operand ["**" signed]
    operand  = number | name | function "(" sum ")" | "(" sum ")"

A tree consists of Python's ``ast`` nodes (BinOp, UnaryOp, Call, Name, Constant), so that ``ast.walk`` works on it.
Python's own parser is not used: it accepts far more than arithmetic, reads ``9.81`` as a double, and can be overrun by
deep nesting. Constants contain Fractions. Text is never executed.
"""

import ast
import keyword
import re
import unicodedata
from fractions import Fraction
from typing import NamedTuple

from gqm_sym.arguments import nearest
from gqm_sym.errors import ExpressionError
from gqm_sym.literals import rationals
from gqm_sym.literals.trees import at_column, check_exponents, constant

__all__ = ["CONSTANTS", "FUNCTIONS", "NAME", "parse", "unknown"]
FUNCTIONS = (
    *("sin", "cos", "tan", "cot", "sec", "csc", "asin", "acos", "atan"),
    *("sinh", "cosh", "tanh", "coth", "asinh", "acosh", "atanh"),
    *("exp", "log", "ln", "sqrt", "cbrt", "abs"),
)
CONSTANTS = ("pi", "e")
MAX_LENGTH = 4000

# The largest depth, which no practical text reaches. SymPy differentiates by recursion and survives 30 levels on an
# empty stack.
MAX_DEPTH = 25

# The largest number of digits, which exceeds that of any measurement, so that the output of ``period_to`` can be read
# back.
MAX_DIGITS = 400
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_TOKEN = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r"|(?P<sign>\*\*|[-+*/()])"
    r"|(?P<space>[ \t\r\n]+)"
)
_ALLOWED = "allowed are numbers, names, + - * / **, parentheses and calls such as sin(x)"
_HINTS = {
    "^": "write ** for a power",
    ",": "functions take one argument, and decimals a point",
    "=": "write one expression, not an equation",
    "[": "write parentheses",
    "{": "write parentheses",
    ".": "there are no attributes; " + _ALLOWED,
}
_REPLACEMENTS = {
    **dict.fromkeys("\N{MINUS SIGN}\N{EN DASH}\N{EM DASH}\N{HYPHEN}\N{NON-BREAKING HYPHEN}", "-"),
    **dict.fromkeys("\N{MULTIPLICATION SIGN}\N{MIDDLE DOT}\N{DOT OPERATOR}\N{ASTERISK OPERATOR}", "*"),
    **dict.fromkeys("\N{DIVISION SIGN}\N{DIVISION SLASH}\N{FRACTION SLASH}", "/"),
    **{"\N{SUPERSCRIPT TWO}": "**2", "\N{SUPERSCRIPT THREE}": "**3", "\N{SQUARE ROOT}": "sqrt( )"},
}

# Precedence of operators; that of a sign lies between products and powers: -2**2 is -(2**2).
_PRECEDENCE = {"+": 1, "-": 1, "*": 2, "/": 2, "**": 4}
_SIGN_PRECEDENCE = 3
_OPERATORS: dict[str, type[ast.operator]] = {
    "+": ast.Add,
    "-": ast.Sub,
    "*": ast.Mult,
    "/": ast.Div,
    "**": ast.Pow,
}


def parse(text: str, *, where: str) -> ast.expr:
    """Read arithmetic text.

    Parameters
    ----------
    text
        At most 4000 ASCII characters.
    where
        The name of the text in messages of errors, such as ``curve.graph.z``.

    Returns
    -------
    ast.expr
        A tree for ``evaluate``. Columns (``col_offset``) count from 0 in ``text``.

    Raises
    ------
    ExpressionError
        If the text is not in the grammar; the message gives the column, counted from 1.
    """
    if not isinstance(text, str):
        raise ExpressionError(f"{where}: {type(text).__name__} given; write an expression as text")
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"{where}: {len(text)} characters; an expression has at most {MAX_LENGTH}")
    tree = _Parser(_tokens(text, where), where).parse()
    check_exponents(tree, where=where)
    return tree


def unknown(what: str, given: str, known: tuple[str, ...]) -> str:
    """Return a message about an unknown name, with the most similar known one and all known ones."""
    near = nearest(given, known)
    hint = f"did you mean {near!r}? " if near else ""
    return f"unknown {what} {given!r}; {hint}known {what}s are {', '.join(known)}"


class _Token(NamedTuple):
    kind: str  # number, name, sign, end
    text: str
    column: int


def _refuse(where: str, column: int, what: str) -> ExpressionError:
    return ExpressionError(f"{where}: column {column + 1}: {what}")


def _tokens(text: str, where: str) -> list[_Token]:
    tokens = []
    column = 0
    while column < len(text):
        match = _TOKEN.match(text, column)
        if match is None:
            raise _refuse(where, column, _unexpected(text[column]))
        if match.lastgroup != "space":
            tokens.append(_Token(str(match.lastgroup), match.group(), column))
        column = match.end()
    if not tokens:
        raise ExpressionError(f"{where}: empty; write an expression such as L*cos(theta)")
    return [*tokens, _Token("end", "", column)]


def _unexpected(character: str) -> str:
    """Return the message about a character that is not in the grammar, with a remedy."""
    if character.isascii():
        return f"unexpected {character!r}; {_HINTS.get(character, _ALLOWED)}"
    name = unicodedata.name(character, "")
    plain = _REPLACEMENTS.get(character) or unicodedata.normalize("NFKC", character)
    if "GREEK" in name and " LETTER " in name:
        plain = name.split(" LETTER ")[1].split()[0].lower()
    written = f"U+{ord(character):04X}" + (f" ({name.lower()})" if name else "")
    hint = f"write {plain}" if plain.isascii() and plain.isprintable() else "write ASCII"
    return f"unexpected {written}; {hint}"


class _Parser:
    """A precedence-climbing parser over tokens, the last of which marks the end."""

    def __init__(self, tokens: list[_Token], where: str) -> None:
        self.tokens = tokens
        self.where = where
        self.at = 0
        self.depth = 0

    def parse(self) -> ast.expr:
        tree = self.expression(0)
        token = self.tokens[self.at]
        if token.kind != "end":
            raise self.misplaced(token)
        return tree

    def expression(self, lower: int) -> ast.expr:
        """Read operators whose precedence is higher than ``lower``."""
        left = self.operand()
        while True:
            token = self.tokens[self.at]
            precedence = _PRECEDENCE.get(token.text, 0)
            if precedence <= lower:
                return left
            self.at += 1
            # Powers associate to the right, and a sign may follow: 2**-3**2.
            right = self.nested(token, _SIGN_PRECEDENCE) if token.text == "**" else self.expression(precedence)
            left = at_column(ast.BinOp(left, _OPERATORS[token.text](), right), token.column)

    def nested(self, token: _Token, lower: int) -> ast.expr:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise _refuse(self.where, token.column, f"nested deeper than {MAX_DEPTH} levels; name its parts")
        inner = self.expression(lower)
        self.depth -= 1
        return inner

    def operand(self) -> ast.expr:
        token = self.tokens[self.at]
        self.at += 1
        if token.kind == "number":
            return constant(self.literal(token), token.column)
        if token.kind == "name":
            return self.name(token)
        if token.text in ("+", "-"):
            inner = self.nested(token, _SIGN_PRECEDENCE)
            return inner if token.text == "+" else at_column(ast.UnaryOp(ast.USub(), inner), token.column)
        if token.text == "(":
            return self.parenthesis(token)
        given = f"{token.text!r}" if token.text else "the end"
        raise _refuse(self.where, token.column, f"{given} where a number, a name or '(' should stand")

    def parenthesis(self, opening: _Token) -> ast.expr:
        inner = self.nested(opening, 0)
        token = self.tokens[self.at]
        if token.kind == "end":
            raise _refuse(self.where, opening.column, "'(' is never closed; add ')'")
        if token.text != ")":
            raise self.misplaced(token)
        self.at += 1
        return inner

    def name(self, token: _Token) -> ast.expr:
        following = self.tokens[self.at]
        if token.text.startswith("_"):
            raise _refuse(self.where, token.column, f"{token.text!r}: names begin with a letter")
        if keyword.iskeyword(token.text):
            what = f"{token.text!r} is a keyword of Python and cannot be a name; choose another"
            raise _refuse(self.where, token.column, what)
        if following.text == "(":
            if token.text not in FUNCTIONS:
                what = unknown("function", token.text, FUNCTIONS)
                raise _refuse(self.where, token.column, what)
            self.at += 1
            function = ast.Name(token.text, ast.Load())
            call = ast.Call(function, [self.parenthesis(following)], [])
            return at_column(call, token.column)
        if token.text in FUNCTIONS:
            what = f"{token.text!r} is a function; write its argument in parentheses: {token.text}(x)"
            raise _refuse(self.where, token.column, what)
        return at_column(ast.Name(token.text, ast.Load()), token.column)

    def literal(self, token: _Token) -> Fraction:
        """Return the exact value of a number, which is never rounded to a double."""
        mantissa, _, exponent = token.text.lower().partition("e")
        if sum(character.isdigit() for character in mantissa) > MAX_DIGITS:
            raise _refuse(self.where, token.column, f"a number of more than {MAX_DIGITS} digits")
        if exponent and abs(int(exponent)) > rationals.MAX_DECIMAL_EXPONENT:
            what = f"a decimal exponent beyond {rationals.MAX_DECIMAL_EXPONENT}"
            raise _refuse(self.where, token.column, what)
        return Fraction(token.text)

    def misplaced(self, token: _Token) -> ExpressionError:
        """Return the error for a token in the place of an operator or the end."""
        if token.text == ")":
            return _refuse(self.where, token.column, "')' closes no '('")
        before = self.tokens[self.at - 1].text
        what = f"no operator between {before!r} and {token.text!r}; write * for a product"
        return _refuse(self.where, token.column, what)
