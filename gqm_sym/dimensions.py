"""The dimensions of parameters, as far as the formulas that contain them determine these.

Every parameter has unknown powers of mass, length and time. A formula of known dimension gives linear equations for
them: all terms of a sum have the same dimension, and arguments of functions are numbers. Numbers are often written
without units (z = x**2 is a curve, in metres). Therefore numbers, and terms without parameters, give no equation if
they might stand for a quantity with a unit, and formulas that contradict each other determine nothing.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

import sympy as sp

Dimension = tuple[Fraction, Fraction, Fraction]
"""Powers of kilogram, metre and second."""


def dimension(kilogram: int = 0, metre: int = 0, second: int = 0) -> Dimension:
    """Return the dimension with these powers."""
    return Fraction(kilogram), Fraction(metre), Fraction(second)


NUMBER, LENGTH = dimension(), dimension(metre=1)
SPEED_SQUARED, ACCELERATION = dimension(metre=2, second=-2), dimension(metre=1, second=-2)
COMMON = {"m": dimension(kilogram=1), "g": ACCELERATION}


@dataclass(slots=True)
class Formulas:
    """Formulas with the dimensions that they must have.

    Attributes
    ----------
    equal
        Pairs of a formula and its dimension, which is None if only parts of the formula determine dimensions.
    variables
        Dimensions of symbols that are not parameters; None for those to be determined.
    """

    equal: list[tuple[sp.Expr, Dimension | None]] = field(default_factory=list)
    variables: dict[str, Dimension | None] = field(default_factory=dict)

    def __add__(self, other: "Formulas") -> "Formulas":
        return Formulas([*self.equal, *other.equal], {**self.variables, **other.variables})


def found_dimensions(formulas: Formulas, known: Mapping[str, Dimension]) -> dict[str, Dimension]:
    """Return the dimensions of all symbols that the formulas determine uniquely; none if they contradict each other."""
    equations = _Equations(formulas.variables, known)
    for form, wanted in formulas.equal:
        equations.require(form, wanted)
    return equations.solved()


def unit_of(found: Dimension | None) -> str:
    """Return the SI unit of a dimension as text; "1" for a number, and an empty text if it is unknown or has no
    name.
    """
    if found is None or any(power.denominator != 1 for power in found):
        return ""
    powers = {name: int(power) for name, power in zip(("kg", "m", "s"), found, strict=True) if power}
    above = "*".join(_power(name, power) for name, power in powers.items() if power > 0)
    below = "/".join(_power(name, -power) for name, power in powers.items() if power < 0)
    return "/".join(part for part in (above or "1", below) if part)


def _power(name: str, power: int) -> str:
    return name if power == 1 else f"{name}**{power}"


@dataclass(slots=True)
class _Form:
    """A dimension with unknowns: powers of the dimensions of symbols, and a known part."""

    powers: dict[str, Fraction]
    known: Dimension = NUMBER

    def times(self, other: "_Form") -> "_Form":
        powers = {
            name: self.powers.get(name, 0) + other.powers.get(name, 0) for name in {**self.powers, **other.powers}
        }
        kilogram, metre, second = (a + b for a, b in zip(self.known, other.known, strict=True))
        return _Form({name: Fraction(power) for name, power in powers.items() if power}, (kilogram, metre, second))

    def to(self, power: Fraction) -> "_Form":
        kilogram, metre, second = (part * power for part in self.known)
        return _Form({name: own * power for name, own in self.powers.items()}, (kilogram, metre, second))

    @property
    def is_number(self) -> bool:
        return not self.powers and self.known == NUMBER


class _Equations:
    """Linear equations for the dimensions of symbols."""

    def __init__(self, variables: Mapping[str, Dimension | None], known: Mapping[str, Dimension]) -> None:
        self.variables = variables
        self.known = {**{name: found for name, found in variables.items() if found is not None}, **known}
        self.rows: list[_Form] = []  # each row is the dimension of a number

    def require(self, form: sp.Expr, wanted: Dimension | None) -> None:
        """Add equations that say that a formula has a dimension. Each term gives its own, because a number in another
        term may stand for a quantity with a unit.
        """
        if wanted is None:
            self._of(form)
            return
        for term in sp.Add.make_args(form):
            if self._has_parameters(term):
                self._same(self._of(term), _Form({}, wanted))

    def solved(self) -> dict[str, Dimension]:
        """Solve the equations by elimination; the result is empty if there is a contradiction."""
        done: dict[str, _Form] = {}
        for row in self.rows:
            for name, other in done.items():
                if name in row.powers:
                    row = row.times(other.to(-row.powers[name]))
            if row.is_number:
                continue
            if not row.powers:
                return {}
            name = min(row.powers)
            row = row.to(1 / row.powers[name])
            for key, other in done.items():
                if name in other.powers:
                    done[key] = other.times(row.to(-other.powers[name]))
            done[name] = row
        alone = {name: row.to(Fraction(-1)).known for name, row in done.items() if len(row.powers) == 1}
        return {**self.known, **alone}

    def _has_parameters(self, form: sp.Expr) -> bool:
        return any(symbol.name not in self.variables for symbol in form.free_symbols)

    def _same(self, one: _Form | None, other: _Form | None) -> None:
        if one is not None and other is not None:
            self.rows.append(one.times(other.to(Fraction(-1))))

    def _of(self, form: sp.Expr) -> _Form | None:
        """Return the dimension of a formula; None if a number in it may stand for a quantity with a unit."""
        if form.is_number:
            return _Form({})
        if isinstance(form, sp.Symbol):
            found = self.known.get(form.name)
            return _Form({form.name: Fraction(1)}) if found is None else _Form({}, found)
        if isinstance(form, sp.Mul):
            return self._of_product([self._of(factor) for factor in form.args])
        if isinstance(form, sp.Add):
            return self._of_sum(form)
        if isinstance(form, sp.Pow):
            return self._of_power(form)
        inner = self._of(form.args[0])
        if isinstance(form, sp.Abs):
            return inner
        if self._has_parameters(form.args[0]):
            self._same(inner, _Form({}))
        return _Form({})

    def _of_product(self, factors: list[_Form | None]) -> _Form | None:
        total = _Form({})
        for factor in factors:
            if factor is None:
                return None
            total = total.times(factor)
        return total

    def _of_power(self, form: sp.Pow) -> _Form | None:
        base, exponent = form.args
        inner = self._of(base)
        if exponent.is_Rational:
            return None if inner is None else inner.to(Fraction(exponent.p, exponent.q))
        if self._has_parameters(exponent):
            self._same(self._of(exponent), _Form({}))
        return None

    def _of_sum(self, form: sp.Add) -> _Form | None:
        with_parameters = [term for term in form.args if self._has_parameters(term)]
        known = [found for term in with_parameters if (found := self._of(term)) is not None]
        others = [self._of(term) for term in form.args if term not in with_parameters]
        numbers = any(other is not None and other.is_number for other in others)
        # for example cos(u) - ecc: the cosine is a number without a unit, while a 1 may stand for a quantity with one
        waves = any(
            other is not None and other.is_number and term.free_symbols
            for term, other in zip((t for t in form.args if t not in with_parameters), others, strict=True)
        )
        lengths = [other for other in others if other is not None and not other.is_number]
        hidden = None in others or (numbers and lengths) or any(length != lengths[0] for length in lengths)
        for one in known[1:]:
            self._same(one, known[0])
        if known:
            moving = any(symbol.name in self.variables for term in with_parameters for symbol in term.free_symbols)
            if not hidden and lengths:
                self._same(known[0], lengths[0])
            elif not hidden and numbers and (moving or waves):
                self._same(known[0], _Form({}))
            return known[0]
        if hidden or with_parameters:
            return None
        return lengths[0] if lengths else _Form({})
