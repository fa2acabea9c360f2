"""A lock for objects that compute answers on request and keep them, while many threads may request them."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")


class HasLock(Protocol):
    """An object whose lock ``_lock`` may be taken again by the thread that holds it."""

    _lock: AbstractContextManager[Any]


L = TypeVar("L", bound=HasLock)


def locked(method: Callable[Concatenate[L, P], R]) -> Callable[Concatenate[L, P], R]:
    """Return a method that holds its object's lock while it runs, so that no other thread sees incomplete results."""

    @wraps(method)
    def one_at_a_time(self: L, *args: P.args, **keywords: P.kwargs) -> R:
        with self._lock:
            return method(self, *args, **keywords)

    return cast(Callable[Concatenate[L, P], R], one_at_a_time)
