"""The arguments of public functions: they are passed by name, their types are checked, and errors name a remedy.

Python's own errors say that a function takes no positional arguments; these say what to write instead.
"""

import difflib
import inspect
from collections.abc import Callable, Iterable, Mapping, Set
from functools import wraps
from itertools import islice
from os import PathLike, fspath
from pathlib import Path
from types import FunctionType
from typing import Any, ParamSpec, TypeVar

from gqm_sym.errors import ArgumentError, DeclarationError

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

_BY_NAME = inspect.Parameter.KEYWORD_ONLY
_BY_PLACE = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
# In names with fewer letters than this, one of two letters may be wrong.
MIN_LENGTH = 4
# The largest number of items in an argument, so that endless iterators are refused.
MAX_ITEMS = 2_000_000
# A longer text is not taken for the name of a file.
MAX_PATH = 4096
# Arguments that callers of a method do not pass.
_OWN = frozenset({"cls", "self"})


def checked(called: str, also: Iterable[str] = ()) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return a decorator that refuses arguments which a function does not have, and names the remedy.

    Parameters
    ----------
    called
        The function's name as a user writes it: ``Gravity``, ``Curve.graph``.
    also
        Further names that the function takes as keywords.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)

        @wraps(function)
        def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
            _check(called, signature, tuple(also), args, kwargs)
            return function(*args, **kwargs)

        return wrapper

    return decorate


class ChecksArguments:
    """A base of classes whose public methods refuse arguments that they do not have, with the remedy.

    The arguments are checked only when Python has refused them, so that a call takes hardly longer.
    """

    # The name of an instance in messages, which subclasses set.
    _called = ""

    def __init_subclass__(cls) -> None:
        """Wrap the public methods that a subclass defines."""
        super().__init_subclass__()
        for name, method in list(vars(cls).items()):
            if isinstance(method, FunctionType) and not name.startswith("_"):
                setattr(cls, name, _checked_when_refused(f"{cls._called}.{name}", method))


def _checked_when_refused(called: str, method: Callable[P, R]) -> Callable[P, R]:
    """Return a method that explains the TypeError of a call with wrong arguments."""

    @wraps(method)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return method(*args, **kwargs)
        except TypeError:
            _check(called, inspect.signature(method), (), args, kwargs)
            raise

    return wrapper


def _check(
    called: str, signature: inspect.Signature, also: tuple[str, ...], args: tuple[Any, ...], kwargs: Mapping[str, Any]
) -> None:
    """Refuse arguments that a function does not have."""
    try:
        signature.bind(*args, **kwargs)
    except TypeError:
        raise ArgumentError(_reason(called, signature, also, args, kwargs)) from None


def _reason(
    called: str, signature: inspect.Signature, also: tuple[str, ...], args: tuple[Any, ...], kwargs: Mapping[str, Any]
) -> str:
    """Say what is wrong with a call, and what would be right."""
    own = [parameter for name, parameter in signature.parameters.items() if name in _OWN]
    parameters = [parameter for name, parameter in signature.parameters.items() if name not in _OWN]
    by_place = [parameter.name for parameter in parameters if parameter.kind in _BY_PLACE]
    by_name = [*also, *(parameter.name for parameter in parameters if parameter.kind == _BY_NAME)]
    given, names = args[len(own) :], [*by_place, *by_name]
    if strangers := [name for name in kwargs if name not in names]:
        return unknown_argument(called, strangers[0], names)
    if len(given) > len(by_place):
        free = [name for name in by_name if name not in kwargs]
        surplus = [f"{name}={short(value)}" for name, value in zip(free, given[len(by_place) :], strict=False)]
        placed = [short(value) for value in given[: len(by_place)]]
        # A curve or a force goes to an argument of its own kind, and not to the first one that is free.
        is_own = any(type(value).__module__.startswith("gqm_sym.") for value in given[len(by_place) :])
        written = f"write {called}({', '.join([*placed, *surplus])})"
        remedy = written if surplus and not is_own else f"it takes {', '.join(names)}"
        what = "arguments by name only" if not by_place else f"only {' and '.join(by_place)} without a name"
        return f"{called}: takes {what}, got {short(given[len(by_place)])} without one; {remedy}"
    twice = [name for name in by_place[: len(given)] if name in kwargs]
    if twice:
        return f"{called}: {twice[0]!r} is given twice; give it once"
    known = {*by_place[: len(given)], *kwargs}
    needed = [p.name for p in parameters if p.default is p.empty and p.name in names and p.name not in known]
    return f"{called}: {' and '.join(map(repr, needed))} must be given; it takes {', '.join(names)}"


def unknown_argument(called: str, name: str, names: Iterable[str], what: str = "argument") -> str:
    """Return a message that says that there is no argument of this name, suggests a similar one, and lists all."""
    listed = list(names)
    return f"{called}: there is no {what} {short(name)}; {_hint(name, listed)}it takes {', '.join(listed) or 'none'}"


def _hint(name: str, listed: Iterable[str]) -> str:
    """Return the known name that was probably meant, as the beginning of a sentence; an empty text if none is
    similar.
    """
    near = nearest(name, listed)
    return f"did you mean {near!r}? " if near else ""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that a user may have meant, ignoring case; None if none is similar."""
    by_lower = {one.lower(): one for one in known}
    cutoff = 0.5 if len(name) < MIN_LENGTH else 0.6
    near = difflib.get_close_matches(name.lower(), list(by_lower), n=1, cutoff=cutoff)
    return by_lower[near[0]] if near else None


def not_given(name: str) -> str:
    """Return the remedy for a parameter without a value."""
    return f"{name}: has no default and was not given; pass {name}=..."


def launch_arguments(
    called: str, defaults: Mapping[str, Any], lam0: Any, v0: Any, parameters: Mapping[str, Any]
) -> dict[str, Any]:
    """Return launch and parameters by name, for a function of a module with these defaults.

    Raises
    ------
    ArgumentError
        If a name is no parameter, or if a parameter without default was not given.
    """
    if unknown := sorted(set(parameters) - set(defaults)):
        raise ArgumentError(unknown_argument(called, unknown[0], ("lam0", "v0", *defaults)))
    if unset := [name for name, value in defaults.items() if value is None and name not in parameters]:
        raise ArgumentError(not_given(unset[0]))
    return {"lam0": lam0, "v0": v0, **parameters}


def short(value: object) -> str:
    """Return a value as it is shown in a message: on one line, and not too long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


def several(given: Any, *, where: str, what: str) -> tuple[Any, ...]:
    """Return the items of an argument that must be an ordered sequence: not a text, a mapping or a set.

    Parameters
    ----------
    given
        The argument.
    where, what
        The name of the argument, and a description of what it must be, for the message.
    """
    if not isinstance(given, str | bytes | Mapping | Set):
        try:
            items = tuple(islice(given, MAX_ITEMS + 1))
        except TypeError:
            items = None
        if items is not None and len(items) <= MAX_ITEMS:
            return items
    raise DeclarationError(f"{where}: must be {what}, got {short(given)}")


def mapping(given: Any, *, where: str, example: str) -> Mapping[str, Any]:
    """Return a mapping of values by names; an empty one if nothing was given."""
    if given is None or (isinstance(given, Mapping) and all(isinstance(name, str) for name in given)):
        return given or {}
    raise DeclarationError(f"{where}: must be a dict of names and values, as {example}, got {short(given)}")


def compiled_model(module: Any, *, where: str) -> Any:
    """Return the compiled model of a generated module."""
    model = getattr(module, "MODEL", None)
    if not (hasattr(model, "solve") and callable(getattr(module, "sweep", None))):
        raise ArgumentError(
            f"{where}: module: must be a generated module, built by gqm.build or imported, got {short(module)}"
        )
    return model


def names(given: Any, *, where: str) -> tuple[str, ...]:
    """Return names; a single name may be given without a list."""
    what = "names, as in ('a', 'b')"
    listed = (given,) if isinstance(given, str) else several(given, where=where, what=what)
    for name in listed:
        if not isinstance(name, str):
            raise DeclarationError(f"{where}: must be {what}, got {short(name)} among them")
    return listed


def file_path(given: Any, *, where: str) -> Path:
    """Return the path of a file that is given as text or as a `pathlib.Path`."""
    text = fspath(given) if isinstance(given, str | PathLike) else None
    if isinstance(text, str) and len(text) <= MAX_PATH:
        return Path(text)
    raise ArgumentError(f"{where}: must be the path of a file, as text or a pathlib.Path, got {short(given)}")


def one_line(given: Any, *, where: str) -> str:
    """Return a text that describes the object."""
    if not isinstance(given, str):
        raise DeclarationError(f"{where}: must be text, got {short(given)}")
    return given


def flag(given: Any, *, where: str) -> bool:
    """Return True or False, and refuse anything else."""
    if not isinstance(given, bool):
        raise DeclarationError(f"{where}: must be True or False, got {short(given)}")
    return given


def one_of(given: Any, known: tuple[str, ...], *, where: str) -> str:
    """Return an argument that must be one of several words."""
    if not (isinstance(given, str) and given in known):
        hint = _hint(given, known) if isinstance(given, str) else ""
        raise DeclarationError(f"{where}: {hint}must be one of {', '.join(known)}, got {short(given)}")
    return given


def instance(given: Any, kind: type[T], *, where: str, what: str) -> T:
    """Return an argument that must be an instance of a class, or raise an error that says what it should be."""
    if isinstance(given, kind):
        return given
    name = getattr(given, "__name__", getattr(given, "name", "it"))
    remedy = f"; call it first, as in {name}()" if callable(given) else ""
    raise ArgumentError(f"{where}: must be {what}, got {short(given)}{remedy}")
