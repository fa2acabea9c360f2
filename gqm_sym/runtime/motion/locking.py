"""A lock for objects that compute answers on request and keep them, while many threads may request them."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from threading import RLock
from typing import Any, Concatenate, Generic, ParamSpec, Self, TypeVar, cast, overload

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


class computed_once(Generic[T, R]):
    """A property that is computed when it is first needed, and then kept in its object's dictionary.

    It is for methods that run under the object's own lock. `functools.cached_property` has a lock in Python 3.11 that
    all objects of a class share, so that threads with different motions would wait for each other.
    """

    def __init__(self, compute: Callable[[T], R]) -> None:
        self._compute = compute
        self.__doc__ = compute.__doc__

    def __set_name__(self, owner: type[T], name: str) -> None:
        """Note the name of the property."""
        self._name = name

    @overload
    def __get__(self, owner: None, kind: type[T]) -> Self: ...

    @overload
    def __get__(self, owner: T, kind: type[T]) -> R: ...

    def __get__(self, owner: T | None, kind: type[T]) -> Self | R:
        """Compute the property; Python reads it from the dictionary afterwards."""
        if owner is None:
            return self
        found = owner.__dict__[self._name] = self._compute(owner)
        return found


def lock_of(owner: Any) -> AbstractContextManager[Any]:
    """Return the lock of an object, which the thread that holds it may take again.

    The lock is made when it is first needed. All threads get the same one, because a dictionary sets a default in a
    single step.
    """
    attributes = owner.__dict__
    lock: AbstractContextManager[Any] | None = attributes.get("_lock")
    return attributes.setdefault("_lock", RLock()) if lock is None else lock


def locked(method: Callable[Concatenate[T, P], R]) -> Callable[Concatenate[T, P], R]:
    """Return a method that holds its object's lock while it runs, so that no other thread sees incomplete results."""

    @wraps(method)
    def one_at_a_time(self: T, *args: P.args, **keywords: P.kwargs) -> R:
        with lock_of(self):
            return method(self, *args, **keywords)

    return cast(Callable[Concatenate[T, P], R], one_at_a_time)


def kept(method: Callable[[T], R]) -> Callable[[T], R]:
    """Return a method without arguments that runs once for each object, under its lock; its answer is kept."""
    name = method.__qualname__  # a method that it overrides has another one

    @wraps(method)
    def known_or_found(self: T) -> R:
        attributes = self.__dict__
        if name not in attributes:
            with lock_of(self):
                if name not in attributes:
                    attributes[name] = method(self)
        found: R = attributes[name]
        return found

    return known_or_found
