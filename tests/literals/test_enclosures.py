"""Values of trees without names are exact, or enclosed as narrowly as requested, or refused."""

from fractions import Fraction

import pytest
from mpmath import libmp, mp

from gqm_sym.errors import ExpressionError
from gqm_sym.literals.enclosures import MAX_SCALE, _Enclosures, _scale, enclose
from gqm_sym.literals.grammar import parse

BITS = 64
# A literal has at most 400 digits, and a power an exponent of at most 1000.
CHUNK, MOST = 390, 900


def value(text: str) -> Fraction | tuple[Fraction, Fraction]:
    """Return the value of a text: exact, or both ends of its enclosure."""
    found = enclose(parse(text, where="w"), BITS, where="w")
    if isinstance(found, Fraction):
        return found
    low, high = (Fraction(*libmp.to_rational(end)) for end in found)
    return low, high


def less_its_digits(count: int) -> str:
    """Return the text of pi less its first ``count`` decimals, of which a number below 10**-count remains."""
    with mp.workdps(count + 20):
        digits = str(int(mp.pi * mp.mpf(10) ** count))
    terms = ["pi"]
    for begin in range(0, len(digits), CHUNK):
        chunk = digits[begin : begin + CHUNK]
        behind = begin + len(chunk) - 1
        powers = [MOST] * (behind // MOST) + [behind % MOST]
        terms.append(chunk + "".join(f"/10**{power}" for power in powers))
    return " - ".join(terms)


@pytest.mark.parametrize(
    ("text", "exact"), [("0**sqrt(2)", 0), ("pi**0", 1), ("sqrt(9/4)", Fraction(3, 2)), ("sqrt(2)**2 - 2", 0)]
)
def test_rational_numbers_are_exact(text: str, exact: Fraction) -> None:
    """A result that is rational by a law of arithmetic is returned as a rational number, whatever its parts are."""
    assert value(text) == exact


@pytest.mark.parametrize("count", [230, 1200])
def test_what_is_left_of_pi(count: int) -> None:
    """The digits of pi from some place on are enclosed to as many bits as any other number."""
    low, high = value(less_its_digits(count))
    with mp.workdps(count + 400):
        left = mp.pi - mp.floor(mp.pi * mp.mpf(10) ** count) / mp.mpf(10) ** count
        assert mp.mpf(low.numerator) / low.denominator <= left <= mp.mpf(high.numerator) / high.denominator
    assert high - low <= high / 2 ** (BITS - 1)


def test_cube_roots() -> None:
    """A cube root is the real one, of negative numbers too; the cube of its enclosure contains the number."""
    low, high = value("cbrt(2)")
    assert low**3 < 2 < high**3
    assert value("cbrt(-2)") == (-high, -low)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0**(-sqrt(2))", "column 2: division by zero"),
        ("q + pi", "'q' is not a number"),
        # This is too near to zero to tell its digits at first; beyond 4096 bits it counts as zero.
        (less_its_digits(1240), "its digits cancel; write it in another form"),
        # Of an argument of 1100 digits few are left after the point.
        (" - ".join(["sin(10**900*10**200*sqrt(2))"] * 2), "its digits cancel"),
    ],
    ids=["pole", "name", "pi", "sine"],
)
def test_what_has_no_value(text: str, message: str) -> None:
    """If a text has no value, the error says where, and why."""
    with pytest.raises(ExpressionError, match=f"^w: .*{message}|^w: {message}"):
        value(text)


def test_equal_to_all_digits_that_are_tried() -> None:
    """Two numbers that agree to the last precision tried count as equal."""
    assert value(less_its_digits(1300)) == 0


def test_nothing_is_taken_for_growing_unknown() -> None:
    """A function without known bounds is refused; it is not enclosed by its values at the ends."""
    with pytest.raises(ValueError, match="unknown function 'gamma'"):
        _Enclosures(BITS, last=True).call("gamma", Fraction(1, 3))


@pytest.mark.parametrize("number", [libmp.finf, libmp.fninf, libmp.fnan])
def test_what_is_not_finite_is_beyond_all_sizes(number: tuple[int, int, int, int]) -> None:
    """Values that are not finite are larger than all sizes; a library writes them with a mantissa of zero, but they are
    no zeros.
    """
    assert _scale(number) > MAX_SCALE
    with pytest.raises(ValueError, match="far outside the range"):
        _Enclosures(BITS, last=False).checked((number, number))
