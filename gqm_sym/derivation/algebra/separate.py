"""Sums of products of a factor, which depends on parameters alone, and a part, which depends on the place."""

from collections.abc import Collection

from sympy import Add, Expr, Mul, S, Symbol, ordered


def separate(form: Expr, places: Collection[Symbol], held: set[Symbol]) -> dict[Expr, Expr]:
    """Return the parts of a form that depend on the place, each with the factor that does not.

    A parameter that cannot be moved into a factor is added to ``held``. Sums are multiplied out if that moves a
    parameter into a factor, but powers are not, because their terms may cancel.

    Parameters
    ----------
    form
        The form.
    places
        The symbols of a place: the parameter of a curve, or coordinates.
    held
        Parameters that parts may depend on.
    """
    parts: dict[Expr, Expr] = {}
    waiting, fixed = list(Add.make_args(form)), set(places)
    while waiting:
        factor, part = waiting.pop(0).as_independent(*places, as_Add=False)
        if part.free_symbols - held - fixed:
            factors = Mul.make_args(part)
            mixed = next((f for f in factors if f.is_Add and f.free_symbols - held - fixed), None)
            if mixed is not None:
                remainder = factor * Mul(*(f for f in factors if f is not mixed))
                waiting = [remainder * term for term in mixed.args] + waiting
                continue
            held |= part.free_symbols - fixed
        parts[part] = parts.get(part, S.Zero) + factor
    return {part: parts[part] for part in ordered(parts) if parts[part] != 0}
