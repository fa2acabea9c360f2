"""The common context of the lowered functions of one model: names, parameters, and functions made from forms."""

from collections.abc import Iterable
from functools import cached_property

import sympy
from sympy import Expr, Symbol, cos, ordered, sin, tan

from gqm_sym.derivation import Model
from gqm_sym.derivation.algebra.angles import with_exact_angles
from gqm_sym.derivation.algebra.bottom_up import symbols_of, with_replaced
from gqm_sym.emission.contact_force import Contact, Vector, contact_at, turned_parts
from gqm_sym.emission.ir import Assignment, ExactIR, FunctionIR
from gqm_sym.emission.sharing import check_size, straight_line
from gqm_sym.emission.subscripts import at
from gqm_sym.kernels.base import DIRECTION
from gqm_sym.sympy_charts import SPACE, chart_x, chart_z

FORWARDS = {DIRECTION: sympy.S.One}
"""In functions without this argument, contact forces that depend on the sign of ds/dt are those of forward motions."""


class Names:
    """Names of our own inside emitted functions. A user's name never begins with an underscore, so ours may."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = frozenset(taken)

    def __call__(self, name: str) -> str:
        """Return ``name``, or ``_name`` if the user has that name."""
        return f"_{name}" if name in self._taken else name

    def symbol(self, name: str) -> Symbol:
        """Return the name as a symbol."""
        return Symbol(self(name), real=True)


class Lowering:
    """The functions of one model, which share its names."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.place = model.parameter
        self.names = Names([self.place.name, *(name for name, _ in model.defaults)])
        self.trigonometric = self._trigonometric()
        order = (*(name for name, _ in model.defaults), *(symbol.name for symbol in self.trigonometric.values()))
        self.order = {name: i for i, name in enumerate(order)}

    def _trigonometric(self) -> dict[Expr, Symbol]:
        """Return sines, cosines and tangents of run-time parameters alone, each with a symbol for its value.

        Their values follow the parameters; if a parameter is given exactly, such as pi, they are exact too.
        """
        model, loss = self.model, self.model.dissipation
        forms = [model.x, model.z, model.ds, model.kappa, model.static_normal_load]
        forms += [model.effective_potential, model.effective_potential_slope]
        forms += [form for _, form in loss.pieces] + [loss.drive, loss.decay, *loss.holds] if loss else []
        known = {name for name, _ in model.defaults}
        calls = {call for form in forms for call in form.atoms(sin, cos, tan)}
        fixed = [call for call in ordered(calls) if {s.name for s in call.free_symbols} <= known]
        outermost = [call for call in fixed if not any(call != other and other.has(call) for other in fixed)]
        return {call: Symbol(f"_p{count}", real=True) for count, call in enumerate(outermost)}

    @cached_property
    def measured(self) -> Symbol:
        """The symbol of a place measured from the model's origin, in functions for divided differences."""
        return self.names.symbol("y") if self.model.origin else self.place

    @cached_property
    def meaning(self) -> str:
        """What `measured` is, as the end of a sentence; empty if it is the place itself."""
        origin = self.model.origin
        return f"; {self.measured} and the ends are measured from {self.place} = {origin}" if origin else ""

    def from_origin(self, form: Expr) -> Expr:
        """Return a form of the model in terms of `measured`.

        The difference of a launch place from the origin is exact next to the origin, and its sum with an offset is
        rounded as a number of its own size, not of the size of the origin.
        """
        origin = self.model.origin
        return form.xreplace({self.place: self.measured + origin}) if origin else form

    @property
    def coordinates(self) -> tuple[Symbol, ...]:
        """The symbols of x and z, or of x, y and z in space, in formulas by coordinates."""
        return tuple(map(self.names.symbol, "xyz" if self.model.curve.in_space else "xz"))

    def by_coordinates(self, form: Expr) -> Expr:
        """Return a form of a charted curve in terms of the coordinates of the body's path, as far as it depends on
        these.
        """
        model, radius = self.model, self.model.force.radius
        if model.curve.in_space:
            return form.xreplace({f(self.place): x for f, x in zip(SPACE, self.coordinates, strict=True)})
        x, z = self.coordinates
        of_curve = {chart_x(self.place): x + radius * model.dzds, chart_z(self.place): z - radius * model.dxds}
        found = form.xreplace(of_curve)
        return sympy.expand(found) if radius and self.place in found.free_symbols else found

    @cached_property
    def _contact(self) -> tuple[Symbol, Contact]:
        v2 = self.names.symbol("v2")
        return v2, contact_at(self.model, v2)

    def contact(self, v2: Expr, direction: Expr = sympy.S.One) -> Contact:
        """Return curvature and contact force for given values of V² and of the sign of ds/dt."""
        symbol, contact = self._contact
        return contact.replaced({symbol: v2, DIRECTION: direction})

    @cached_property
    def turned_parts(self) -> tuple[Vector, Vector]:
        """The components of t × dt/dλ and of -t × F for a curve in no vertical plane."""
        return turned_parts(self.model)

    def accurate(self, forms: Iterable[Expr]) -> tuple[Expr, ...]:
        """Return the forms of a space curve with sines of exact angles, and those of a planar curve as they are."""
        return with_exact_angles(forms, self.place) if self.model.curve.in_space else tuple(forms)

    def trigonometric_values(self) -> tuple[ExactIR, ...]:
        """Yield the function that evaluates them, if there are any."""
        doc = "Trigonometric values, which follow the run-time parameters in the arguments of compiled functions."
        return (self.constants("exact_trigonometric", doc, (*self.trigonometric,)),) if self.trigonometric else ()

    def bounds(self) -> FunctionIR:
        """Return the function for interval enclosures of the effective potential's slope and of ds."""
        forms = (self.model.effective_potential_slope, self.model.ds)
        outputs = tuple(form.xreplace(self.trigonometric) for form in forms)
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
        """Return a function of the run-time parameters alone."""
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
        """Return a formula over a namespace of operations."""
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
        """Return a function in which common subexpressions are shared, and those that do not depend on the place are
        computed before the loop.

        Parameters
        ----------
        name, doc
            The function's name, and the text of its docstring.
        arguments
            The arguments between the number of places and the run-time parameters, each the name of an array that has
            one element for each place, or the symbol of a single number.
        inside
            The assignments at the beginning of the loop: each symbol that depends on the place, and its value.
        outputs
            One form for each row of ``out``.
        batch, rows_behind
            Whether the function is one of a batch, in which each place has run-time parameters of its own, and the
            number of further rows after these.
        """
        check_size(outputs, where=name)
        n, p, out = (self.names(s) for s in ("n", "p", "out"))
        outputs = with_replaced(outputs, self.trigonometric)
        inside = [(symbol, value.xreplace(self.trigonometric)) for symbol, value in inside]
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
        """Return the run-time parameters in some expressions with their positions in ``p``."""
        free = {s.name for s in symbols_of(expressions)}
        return tuple((name, i) for name, i in self.order.items() if name in free)
