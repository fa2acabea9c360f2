"""The force law as data: the slots of one linear equation for W = V**2, added slot by slot.

A kernel contributes a potential per unit mass (the applied force is minus its gradient) and an
inertia factor. See section 2 of the notes on the mathematics: dW/ds = 2*(F.t)/inertia.
"""

from dataclasses import dataclass, field

import sympy as sp

from gqm_sym.errors import DeclarationError
from gqm_sym.parameters import COMMON, Given, Value, read_argument

X = sp.Symbol("x", real=True)
Z = sp.Symbol("z", real=True)
"""The coordinates of the plane, in which potentials are written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """A force law; ``first + second`` is the law with both forces.

    Attributes
    ----------
    potential
        Potential energy per unit mass in the coordinates ``x`` and ``z``.
    inertia
        What multiplies the acceleration: 1 for sliding, ``1 + beta`` for rolling.
    terms
        Name and one line of text of every force in it.
    defaults
        Its run-time parameters in order, each with its default or None.
    positive
        Parameters promised to be positive.
    """

    terms: tuple[tuple[str, str], ...]
    potential: sp.Expr = field(default=sp.S.Zero)
    inertia: sp.Expr = field(default=sp.S.One)
    defaults: tuple[tuple[str, Value | None], ...] = ()
    positive: tuple[str, ...] = ()

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the run-time parameters, in order."""
        return tuple(name for name, _ in self.defaults)

    def __add__(self, other: "Kernel") -> "Kernel":
        if not isinstance(other, Kernel):
            return NotImplemented
        _refuse_clashes(self, other)
        known = dict(self.defaults)
        return Kernel(
            terms=self.terms + other.terms,
            potential=self.potential + other.potential,
            # 1 + beta of one kernel and 1 of another: the excesses add.
            inertia=self.inertia + other.inertia - 1,
            defaults=(*self.defaults, *(pair for pair in other.defaults if pair[0] not in known)),
            positive=tuple(dict.fromkeys(self.positive + other.positive)),
        )


def _refuse_clashes(first: Kernel, second: Kernel) -> None:
    names = dict(first.terms)
    for name, _ in second.terms:
        if name in names and name in _ONCE:
            raise DeclarationError(f"kernel: {name} is given twice; give it once")
    values = dict(first.defaults)
    for name, value in second.defaults:
        if name not in values:
            continue
        if name not in COMMON or value != values[name]:
            raise DeclarationError(
                f"kernel: the name {name!r} means one thing in "
                f"{' + '.join(term for term, _ in first.terms)} and another in "
                f"{' + '.join(term for term, _ in second.terms)}; give one of them another name, "
                f'as in {name}="{name}2"'
            )


# Forces that act on a body as a whole: a second one is a mistake, not a sum.
_ONCE = frozenset({"gravity", "rolling", "rotating_frame"})


def parameter(given: Given | None, name: str, *, where: str) -> tuple[sp.Symbol, tuple[str, Value | None]]:
    """Read a kernel's argument: another name for its parameter, a value for it, or nothing.

    Returns the symbol to write the law with and the pair of name and default.
    """
    called, default = read_argument(given, name, where=where)
    return sp.Symbol(called, real=True), (called, default)
