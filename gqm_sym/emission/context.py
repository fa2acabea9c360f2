"""What the lowered functions of one model share: its names, its parameters, and how a function is made of forms."""

from collections.abc import Iterable

import sympy
from sympy import Expr, Symbol

from gqm_sym.derivation import Model
from gqm_sym.emission.ir import Assignment, ExactIR, FunctionIR
from gqm_sym.emission.sharing import check_size, straight_line
from gqm_sym.emission.subscripts import at


class Names:
    """Names of our own inside emitted functions: a user's name never begins with an underscore, so ours may."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = frozenset(taken)

    def __call__(self, name: str) -> str:
        """``name``, or ``_name`` where the user has that one."""
        return f"_{name}" if name in self._taken else name

    def symbol(self, name: str) -> Symbol:
        """The same as a symbol."""
        return Symbol(self(name), real=True)


class Lowering:
    """The functions of one model, sharing its names."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.place = model.parameter
        self.order = {name: i for i, (name, _) in enumerate(model.defaults)}
        self.names = Names([self.place.name, *self.order])

    def bounds(self) -> FunctionIR:
        """Interval enclosures of the effective potential's slope and of ds."""
        outputs = (self.model.effective_potential_slope, self.model.ds)
        replaced, reduced = sympy.cse(outputs, symbols=sympy.numbered_symbols("_t", real=True), order="canonical")
        lam = self.place
        lo, hi, p, out = (self.names(name) for name in ("lo", "hi", "p", "out"))
        return FunctionIR(
            name="bounds",
            signature="BOUNDS",
            arguments=(lo, hi, p, out),
            doc=f"Bounds of dU/d{lam} and ds/d{lam} for {lo} <= {lam} <= {hi}, by interval arithmetic.",
            views=((p, str(len(self.order))), (out, "4")),
            parameters=self.used(outputs),
            before=(),
            inside=tuple(Assignment(name=s.name, value=v) for s, v in replaced),
            outputs=tuple(reduced),
        )

    def constants(self, name: str, doc: str, values: tuple[Expr | None, ...]) -> ExactIR:
        """A function of the run-time parameters alone."""
        return ExactIR(
            name=name,
            doc=doc,
            places=(),
            parameters=self.used(value for value in values if value is not None),
            inside=(),
            outputs=values,
        )

    def exact_function(
        self, name: str, doc: str, outputs: tuple[Expr, ...], places: tuple[Symbol, ...] = ()
    ) -> ExactIR:
        """A formula over a namespace of operations."""
        replaced, reduced = sympy.cse(outputs, symbols=sympy.numbered_symbols("_t", real=True), order="canonical")
        return ExactIR(
            name=f"exact_{name}",
            doc=doc,
            places=tuple(place.name for place in places),
            parameters=self.used(outputs),
            inside=tuple(Assignment(name=s.name, value=v) for s, v in replaced),
            outputs=tuple(reduced),
        )

    def function(
        self,
        name: str,
        arguments: tuple[str | Symbol, ...],
        doc: str,
        *,
        inside: list[tuple[Symbol, Expr]],
        outputs: tuple[Expr, ...],
        batch: bool = False,
        rows_behind: int = 0,
    ) -> FunctionIR:
        """Share common subexpressions, and move what does not depend on the place in front of the loop.

        Parameters
        ----------
        name, doc
            The function's name, and what its docstring says.
        arguments
            Between the number of places and the run-time parameters: the name of an array that has one element for
            each place, or the symbol of a single number.
        inside
            What the loop begins with: each symbol that depends on the place, and its value.
        outputs
            One form for each row of ``out``.
        batch, rows_behind
            In a function of a batch each place has run-time parameters of its own, and so many more rows stand behind
            them.
        """
        check_size(outputs, where=name)
        n, p, out = (self.names(s) for s in ("n", "p", "out"))
        used = self.used([*outputs, *(value for _, value in inside)])
        if batch:
            inside, used = [*((Symbol(s, real=True), at(p, row)) for s, row in used), *inside], ()
        before, kept, results = straight_line(outputs, inside)
        return FunctionIR(
            name=name,
            signature=name.upper(),
            arguments=(n, *map(str, arguments), p, out),
            doc=doc,
            views=(
                *((array, n) for array in arguments if isinstance(array, str)),
                (p, f"({len(self.order) + rows_behind}, {n})" if batch else str(len(self.order))),
                (out, f"({len(outputs)}, {n})"),
            ),
            parameters=used,
            before=before,
            inside=kept,
            outputs=results,
            batch=batch,
        )

    def used(self, expressions: Iterable[Expr]) -> tuple[tuple[str, int], ...]:
        """The run-time parameters in some expressions, and where they stand in ``p``."""
        free = {s.name for e in expressions for s in e.free_symbols}
        return tuple((name, i) for name, i in self.order.items() if name in free)
