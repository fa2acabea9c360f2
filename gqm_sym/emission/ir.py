"""The data that are printed: functions as straight-line assignments, in their final form."""

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
        Its arguments, in the order of the signature.
    doc : str
        One line of description.
    views : tuple of (str, str)
        Arguments that are used as arrays, with their shapes.
    parameters : tuple of (str, int)
        Run-time parameters that are used, and their indices in ``p``.
    before, inside : tuple of Assignment
        The assignments that do not depend on the place, and those that do.
    outputs : tuple of Expr
        One value for each row of ``out``.
    batch : bool
        Whether every place has run-time parameters of its own.
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
    batch: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ExactIR:
    """One formula over a namespace of operations; an output that does not exist is None.

    ``places`` are its arguments besides the run-time parameters: the curve's parameter, coordinates, or nothing.
    """

    name: str
    doc: str
    places: tuple[str, ...]
    parameters: tuple[tuple[str, int], ...]
    inside: tuple[Assignment, ...]
    outputs: tuple[Expr | None, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChartIR:
    """The part of a module that makes the chart of its curve.

    Attributes
    ----------
    statement : str
        The expression that makes the maker, as in ``Traced(field.address, exact_start, 1)``.
    imports : tuple of str
        Names that it needs from the runtime.
    functions, exact
        Functions that it needs.
    data : tuple of (str, str)
        Names and texts of long literals that it needs.
    names : tuple of str
        The names of the arrays of its charts in emitted functions, in the order in which they follow the run-time
        parameters; all have the same size.
    means : tuple of str
        Those of the means over a train, which follow them and have another size.
    loads : tuple of str
        Those of the load across the track of a train, which follow these and have a third size.
    """

    statement: str
    imports: tuple[str, ...]
    functions: tuple[FunctionIR, ...] = ()
    exact: tuple[ExactIR, ...] = ()
    names: tuple[str, ...] = ()
    means: tuple[str, ...] = ()
    loads: tuple[str, ...] = ()
    data: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SeparatedIR:
    """Potential and load along a chart as sums of products.

    Attributes
    ----------
    function : FunctionIR
        The function for the parts, which depend on the place, with rows in the order of `interface`.
    factors : ExactIR
        The factors, which depend on run-time parameters alone.
    parts : ExactIR or None
        The parts of the potential in terms of coordinates; None if they depend on more.
    potentials : int
        The number of products that belong to the potential.
    """

    function: FunctionIR
    factors: ExactIR
    parts: ExactIR | None
    potentials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ModuleIR:
    """A whole module, ready to print.

    ``functions`` and ``bounds`` serve one motion; ``batch`` and ``bounds_batch`` serve load maps and sweeps, and exist
    only for speed. ``dissipation`` describes a force law that is not conservative; ``bounds`` and the effective
    potential are then compiled when they are first needed. ``rolling_radius`` is the radius of a rolling body that must
    fit into its track, empty for any other; ``static_friction_limit`` names beta and mu_static of one that may slip.
    ``units`` are the SI units of the curve's parameter and of the run-time parameters, as far as they are known.
    ``in_space`` and ``signed`` say whether the curve is a space curve, and whether its contact force has a sign;
    ``sided``, whether that sign, or that of a component, shows on which side the body is; ``directed``, whether the
    contact force depends on the sign of ds/dt; and ``banked``, whether loads on riders are known. ``monotone`` says
    that there are no cusps, and that the effective potential is monotone between places of symmetry.
    """

    name: str
    title: str
    parameter: str
    defaults: tuple[tuple[str, float | int | str | None], ...]
    positive: tuple[str, ...]
    at_least: tuple[tuple[str, str], ...]
    forms: tuple[tuple[str, Expr], ...]
    notes: tuple[str, ...]
    functions: tuple[FunctionIR, ...]
    bounds: FunctionIR | None
    batch: tuple[FunctionIR, ...]
    bounds_batch: FunctionIR | None
    exact: tuple[ExactIR, ...]
    monotone: bool
    dissipation: tuple[tuple[str, bool], ...]
    rolling_radius: str
    static_friction_limit: tuple[str, str] | None
    units: tuple[tuple[str, str], ...]
    chart: ChartIR | None
    separated: SeparatedIR | None
    in_space: bool
    signed: bool
    sided: bool
    directed: bool
    banked: bool
