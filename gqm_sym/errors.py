"""Exceptions, one for each kind of error; `InputError` and its subclasses are mistakes in the input.

Every message gives, in this order, the place of the error, the value that was given, and the values that are allowed.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import NoReturn


class GQMError(Exception):
    """The base class of all errors of this package."""


class InputError(GQMError):
    """The input is wrong: an expression, a declaration, a file or a launch."""


class ExpressionError(InputError):
    """Text or a SymPy expression that is not in the grammar of expressions."""


class NumberError(InputError):
    """A value that is not a finite real number where a number is expected."""


class DeclarationError(InputError):
    """A curve, a kernel or a model that is declared inconsistently."""


class ArgumentError(DeclarationError, TypeError):
    """Arguments that a function does not have, or of a type that it cannot use."""


class SpecFileError(InputError):
    """A YAML file with mistakes in it, all of them reported together.

    Parameters
    ----------
    mistakes
        One line each: ``file:line:column: what is there; what would be right``.
    """

    mistakes: tuple[str, ...]

    def __init__(self, mistakes: Iterable[str]) -> None:
        # A single string is one mistake; iterating over its characters would be of no use.
        self.mistakes = (mistakes,) if isinstance(mistakes, str) else tuple(mistakes)
        super().__init__(self.mistakes)

    def __str__(self) -> str:
        return "\n".join(self.mistakes)


class LaunchError(InputError):
    """A launch that is not possible: outside the domain, with a negative speed, or not finite."""


class ParameterError(InputError):
    """A run-time parameter that is missing, unknown or outside its range."""


class HandEditedError(InputError):
    """A generated file that was edited by hand is in the way of a new one."""


class DerivationError(GQMError):
    """The closed forms could not be derived."""


class EmissionError(GQMError):
    """An expression that has no form in an emitted module."""


class BudgetError(GQMError):
    """A stage that was not finished when its time was used up."""


class SolutionError(GQMError):
    """A question about a motion that has no answer, or no finite one."""


class OutdatedModuleError(GQMError):
    """A generated module made for another version of the runtime's interface."""


class NoisyPointsWarning(UserWarning):
    """Surveyed points whose scatter dominates the curvature of the track through them."""


def renamed(old_to_new: Mapping[str, str], owner: str) -> Callable[..., NoReturn]:
    """Return a ``__getattr__`` for a class or a module whose error gives the new name of a renamed attribute.

    Parameters
    ----------
    old_to_new : mapping of str to str
        The old names, each with its new name.
    owner : str
        The owner of the attributes, as it is named in the message ("a motion", "module 'gqm_sym'").

    Returns
    -------
    callable
        A function that takes the arguments of ``__getattr__``, the last of which is the attribute's name, and raises an
        AttributeError.

    Examples
    --------
    >>> class Tank:
    ...     __getattr__ = renamed({"amount": "volume"}, "a tank")
    >>> Tank().amount
    Traceback (most recent call last):
    AttributeError: a tank has no attribute 'amount'; it is called 'volume' now
    """

    def missing(*arguments: object) -> NoReturn:
        name = str(arguments[-1])
        remedy = f"; it is called {old_to_new[name]!r} now" if name in old_to_new else ""
        # Python's traceback would otherwise suggest a name that the object has.
        raise AttributeError(f"{owner} has no attribute {name!r}{remedy}", name=name, obj=arguments[0])

    return missing
