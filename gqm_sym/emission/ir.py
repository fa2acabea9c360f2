"""What the printer receives: functions as straight-line assignments, with everything already decided."""

from dataclasses import dataclass

from sympy import Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class Assignment:
    """``name = value``."""

    name: str
    value: Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class FunctionIR:
    """One emitted function.

    Attributes
    ----------
    name, signature : str
        Its name, and the name of its signature in the runtime's interface.
    arguments : tuple of str
        In the order of the signature.
    doc : str
        One line.
    views : tuple of (str, str)
        Arguments that are seen as arrays, and their shapes.
    parameters : tuple of (str, int)
        Run-time parameters used, and where they stand in ``p``.
    before, inside : tuple of Assignment
        What does not depend on the place, and what does.
    outputs : tuple of Expr
        One value a row of ``out``.
    """

    name: str
    signature: str
    arguments: tuple[str, ...]
    doc: str
    views: tuple[tuple[str, str], ...]
    parameters: tuple[tuple[str, int], ...]
    before: tuple[Assignment, ...]
    inside: tuple[Assignment, ...]
    outputs: tuple[Expr, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ExactIR:
    """One formula over a namespace of operations; an output that does not exist is None."""

    name: str
    doc: str
    parameters: tuple[tuple[str, int], ...]
    inside: tuple[Assignment, ...]
    outputs: tuple[Expr | None, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ModuleIR:
    """A whole module, ready to print."""

    name: str
    title: str
    parameter: str
    defaults: tuple[tuple[str, float | int | str | None], ...]
    positive: tuple[str, ...]
    forms: tuple[tuple[str, Expr], ...]
    notes: tuple[str, ...]
    functions: tuple[FunctionIR, ...]
    bounds: FunctionIR
    exact: tuple[ExactIR, ...]
