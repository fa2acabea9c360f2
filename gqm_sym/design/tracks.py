"""The common parts of designs: reading of arguments, and tracks made of polynomials."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import Context, Decimal
from typing import Any, NamedTuple

import sympy as sp
from sympy.printing.pycode import MpmathPrinter

from gqm_sym.arguments import mapping, short
from gqm_sym.declare.curve import Curve
from gqm_sym.declare.polynomials import PolynomialPieces
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import Source, read_expression
from gqm_sym.literals.grammar import FUNCTIONS
from gqm_sym.literals.units import split_unit
from gqm_sym.parameters import Given, exact_value, read_value
from gqm_sym.sympy_charts import chart_x, chart_z

# The number of decimal digits with which tracks are computed, and the number of digits with which their coordinates are
# written.
DIGITS, WRITTEN_DIGITS = 45, 28

# The number of coefficients of a polynomial; the last two must be below this share of the largest one.
TERMS, MAX_TAIL = 24, 1e-22

# The largest number of times that a piece is halved.
MAX_HALVINGS = 40
# Nonzero numbers in a design must lie between this power of ten and its inverse.
MAX_EXPONENT = 60


def _chebyshev_rows(constant: int, factor: int) -> list[list[int]]:
    """Return the coefficients of the Chebyshev polynomials of ``constant + factor*u``, lowest power first."""
    rows = [[1], [constant, factor]]
    for n in range(2, TERMS):
        here, before = rows[n - 1] + [0], rows[n - 2] + [0, 0]
        times_u = [0, *rows[n - 1]]
        rows.append([2 * (constant * here[k] + factor * times_u[k]) - before[k] for k in range(n + 1)])
    return rows


# For u in [0, 1], and for u in [-1, 1].
_FROM_0, _CENTRED = _chebyshev_rows(-1, 2), _chebyshev_rows(0, 1)


class Piece(NamedTuple):
    """Polynomials for x and z in powers of u, lowest first, for u from ``begin`` to ``end``, each -1, 0 or 1."""

    begin: int
    end: int
    x: list[Any]
    z: list[Any]

    def mirrored(self) -> "Piece":
        """Return the mirror image about the z axis, passed in the opposite direction."""
        x, z = ([(-1) ** j * term for j, term in enumerate(row)] for row in (self.x, self.z))
        return Piece(-self.end, -self.begin, [-term for term in x], z)


def polynomial_curve(mp: Any, pieces: Sequence[Piece], *, origin: int, breaks: tuple[int, ...], title: str) -> Curve:
    """Return the curve of polynomials joined end to start; after the first ``origin`` of them, x = z = s = 0.

    Coefficients are written as multiples of one power of ten, and constant terms are chosen such that pieces meet
    exactly.
    """
    size = max(abs(term) for piece in pieces for row in (piece.x, piece.z) for term in row)
    places = WRITTEN_DIGITS - int(mp.ceil(mp.log10(size)))
    scale = mp.mpf(10) ** places
    rounded = [[[int(mp.nint(term * scale)) for term in row] for row in (piece.x, piece.z)] for piece in pieces]

    def at(k: int, row: int, u: int) -> int:
        return sum(term * u**j for j, term in enumerate(rounded[k][row]))

    for row in range(2):
        for k in range(origin, len(pieces)):
            rounded[k][row][0] += (at(k - 1, row, pieces[k - 1].end) if k > origin else 0) - at(k, row, pieces[k].begin)
        for k in range(origin - 1, -1, -1):
            begin = at(k + 1, row, pieces[k + 1].begin) if k + 1 < len(pieces) else 0
            rounded[k][row][0] += begin - at(k, row, pieces[k].end)
    lines = [
        " ".join([str(piece.begin), str(piece.end), *(_decimal(term, places) for term in (*x, *z))])
        for piece, (x, z) in zip(pieces, rounded, strict=True)
    ]
    made = PolynomialPieces(pieces="\n".join(lines), origin=origin, breaks=breaks)
    s = sp.Symbol("s", real=True)
    return Curve(kind="polynomial", x=chart_x(s), z=chart_z(s), parameter=s, title=title, definition=made)


def _decimal(number: int, places: int) -> str:
    """Return a multiple of a power of ten as text."""
    return str(Decimal(number).scaleb(-places, Context(prec=60)).normalize(Context(prec=60)))


def interpolated(
    mp: Any, function: Callable[[Any], Sequence[Any]], low: Any, high: Any
) -> tuple[list[list[Any]], bool]:
    """Return Chebyshev coefficients of functions on an interval, and whether they are resolved."""
    nodes = [mp.cos(mp.pi * (2 * i + 1) / (2 * TERMS)) for i in range(TERMS)]
    values = [function((low + high) / 2 + (high - low) / 2 * node) for node in nodes]
    waves = [mp.cos(mp.pi * k / (2 * TERMS)) for k in range(4 * TERMS)]
    rows = []
    resolved = True
    for row in zip(*values, strict=True):
        terms = [
            mp.fdot((value, waves[j * (2 * i + 1) % (4 * TERMS)]) for i, value in enumerate(row)) * 2 / TERMS
            for j in range(TERMS)
        ]
        terms[0] /= 2
        resolved &= max(map(abs, terms[-2:])) <= MAX_TAIL * max(map(abs, terms))
        rows.append(terms)
    return rows, bool(resolved)


def powers(mp: Any, terms: Sequence[Any], begin: int) -> list[Any]:
    """Return the coefficients of powers of u of a Chebyshev series, for u from ``begin`` (0 or -1) to 1."""
    table = _FROM_0 if begin == 0 else _CENTRED
    return [mp.fdot((terms[n], table[n][j]) for n in range(j, len(terms))) for j in range(len(terms))]


def read_law(
    law: Source, variables: Iterable[str], parameters: Mapping[str, Given] | None, *, where: str, unit: str
) -> sp.Expr:
    """Read a law as an expression in one of some variables, with numbers for its parameters.

    Raises
    ------
    DeclarationError
        If a parameter has no value, or is not used, or if there is more than one variable.
    """
    form = read_expression(law, where=f"{where}: law", unit=unit)
    own = tuple(variables)
    found = {symbol.name for symbol in form.free_symbols}
    given = mapping(parameters, where=f"{where}: parameters", example="{'T0': 2}")
    if unused := sorted(set(given) - found):
        raise DeclarationError(f"{where}: parameters: {unused[0]!r} is not in the law {short(str(form))}; remove it")
    if unset := sorted(found - set(own) - set(given)):
        raise DeclarationError(
            f"{where}: law: {unset[0]!r} has no value; the law is a function of {' or '.join(own)}, and all else "
            f"is given by parameters={{{unset[0]!r}: ...}}"
        )
    if len(both := sorted(found & set(own) - set(given))) > 1:
        raise DeclarationError(f"{where}: law: must be a function of one of {', '.join(own)}, got {' and '.join(both)}")
    values = {sp.Symbol(name, real=True): exact_value(read_value(value, where=name)) for name, value in given.items()}
    return _bounded(form.xreplace(values), f"{where}: law")


def read_constant(given: Source, name: str, *, where: str, unit: str) -> sp.Expr:
    """Read a number exactly."""
    number = read_expression(given, where=f"{where}: {name}", unit=unit)
    if not number.is_number:
        raise DeclarationError(f"{where}: {name}: must be a number, got {short(given)}")
    return _bounded(number, f"{where}: {name}")


def _bounded(form: sp.Expr, where: str) -> sp.Expr:
    """Refuse numbers whose squares would be out of the range of doubles."""
    if (
        form.is_number
        and form.is_real
        and form != 0
        and not -MAX_EXPONENT < sp.log(abs(form), 10).evalf() < MAX_EXPONENT
    ):
        raise DeclarationError(f"{where}: must be between 1e-{MAX_EXPONENT} and 1e{MAX_EXPONENT} in size")
    return form


def read_positive(given: Source, name: str, *, where: str, unit: str) -> sp.Expr:
    """Read a positive number exactly."""
    number = read_constant(given, name, where=where, unit=unit)
    if not number > 0:
        raise DeclarationError(f"{where}: {name}: must be positive, got {short(given)}")
    return number


def with_unit(given: object, unit: str) -> str:
    """Return a quantity as it was given, and its unit in SI behind it if it was given without one."""
    has_unit = split_unit(given) is not None if isinstance(given, str) else hasattr(given, "units")
    return str(given) if has_unit else f"{given} {unit}"


def extended_precision() -> Any:
    """Return an mpmath context in which tracks are computed."""
    from mpmath import MPContext

    context = MPContext()
    context.dps = DIGITS
    return context


def evaluated(mp: Any, number: sp.Expr) -> Any:
    """Return an exact number in an mpmath context."""
    return mp.mpf(str(sp.N(number, mp.dps + 5)))


def function_in(mp: Any, place: str, form: sp.Expr) -> Callable[[Any], Any]:
    """Return an expression in one variable as a function over an mpmath context."""
    names = {name: getattr(mp, name) for name in (*FUNCTIONS, "mpf", "pi", "e") if hasattr(mp, name)}
    printer = MpmathPrinter({"fully_qualified_modules": False, "inline": True})
    function: Callable[[Any], Any] = sp.lambdify(sp.Symbol(place, real=True), form, modules=[names], printer=printer)
    return function
