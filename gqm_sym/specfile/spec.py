"""The content of a curve file, read and checked."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import sympy as sp

from gqm_sym.declare import Curve
from gqm_sym.derivation import Model, derive
from gqm_sym.errors import InputError, SpecFileError
from gqm_sym.expressions import is_real_at
from gqm_sym.kernels import Kernel
from gqm_sym.parameters import exact_value
from gqm_sym.specfile.locations import locate, node_at, place_of
from gqm_sym.specfile.nodes import MapNode, Mistakes


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """The unit and the description of a parameter in a file."""

    unit: str = ""
    description: str = ""
    given: str = ""  # value and unit as in the file, if the unit is not SI


@dataclass(frozen=True, slots=True, kw_only=True)
class Spec:
    """A curve file.

    Attributes
    ----------
    path
        The path as it was given.
    name, title
        The name and the title of the module that will be generated; the title may be empty.
    curve, kernel
        The declarations.
    parameters
        Names with the exact text of their defaults; None for values that are given at run time.
    notes
        Unit and description of the parameters that have any.
    launch
        Keyword arguments for ``solve``, with numbers as their texts; None without a launch.
    tree
        The file's nodes with their positions.
    """

    path: str
    name: str
    title: str
    curve: Curve
    kernel: Kernel
    parameters: Mapping[str, str | None]
    notes: Mapping[str, Note]
    launch: Mapping[str, str | int | list[str]] | None
    tree: MapNode = field(repr=False, compare=False)

    def derive(self) -> Model:
        """Derive the closed forms.

        Raises
        ------
        SpecFileError
            If curve, kernel and parameters are not consistent.
        DerivationError
            If a closed form is not real and finite.
        """
        try:
            return derive(self.curve, self.kernel, parameters=self.parameters, title=self.title or None)
        except InputError as error:
            raise self.mistake(str(error)) from None

    def check_solvable(self, model: Model) -> None:
        """Refuse, with all reasons, a file whose motion cannot be computed from it alone.

        Raises
        ------
        SpecFileError
            If there is no launch, a parameter has no value, or the curve has no point at the launch.
        """
        mistakes = Mistakes(self.path)
        if self.launch is None:
            mistakes.add(
                self.tree.mark,
                "launch is missing; solving needs it",
                "add it, as in launch: {lam0: 0.5, v0: 0}",
            )
        for name, value in model.defaults:
            if value is None:
                mark = place_of(self.tree, ("parameters", name))
                what = f"parameters.{name}: is null; solving needs a value"
                mistakes.add(mark, what, f"write one, as in {name}: 1")
        lam0 = None if self.launch is None or model.curve.charted else str(self.launch["lam0"])
        if lam0 is not None and not mistakes and (fault := _refusal_reason(model, lam0)):
            mark = node_at(self.tree, ("launch", "lam0", "value")).mark
            what = f"launch.lam0: {model.parameter.name} = {lam0}: {fault}"
            mistakes.add(mark, what, "launch where the curve and the forces are defined")
        if mistakes:
            raise mistakes.error()

    def mistake(self, message: str, *base: str) -> SpecFileError:
        """Return a message as a mistake of this file, at the place to which it refers.

        Parameters
        ----------
        message
            The message of an error that was caused by something in the file.
        base
            The keys of the section to which it refers, as far as that is known.
        """
        mistakes = Mistakes(self.path)
        mistakes.add(*locate(self.tree, message, base))
        return mistakes.error()


def _refusal_reason(model: Model, lam0: str) -> str:
    """Return the reason why a motion cannot begin at a place; an empty text if it can."""
    values = {sp.Symbol(n, real=True): exact_value(v) for n, v in model.defaults if v is not None}
    values[model.parameter] = exact_value(lam0)
    forms = (("x", model.x), ("z", model.z), ("ds", model.ds), ("the potential", model.potential))
    for label, form in forms:
        if is_real_at(form, values) is False:
            return f"{label} is not a finite real number there"
    return ""
