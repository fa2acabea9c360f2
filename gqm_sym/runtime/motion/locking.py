"""A lock for objects that compute answers on request and keep them, while many threads may request them."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from threading import RLock
from typing import Any, Concatenate, ParamSpec, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


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
