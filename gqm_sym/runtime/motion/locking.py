"""One answer at a time: a motion computes answers on request and keeps them, and many threads may request them."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from threading import RLock
from typing import Any, Concatenate, ParamSpec, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


def lock_of(owner: Any) -> AbstractContextManager[Any]:
    """The lock of an object, which the thread that holds it may take again.

    It is made when it is first needed, because most launches of many are asked one question only, or none. All threads
    get the same lock, because a dictionary sets a default in one step.
    """
    attributes = owner.__dict__
    lock: AbstractContextManager[Any] | None = attributes.get("_lock")
    return attributes.setdefault("_lock", RLock()) if lock is None else lock


def locked(method: Callable[Concatenate[T, P], R]) -> Callable[Concatenate[T, P], R]:
    """Let a method run while its object's lock is held, so that no other thread sees what is half computed."""

    @wraps(method)
    def one_at_a_time(self: T, *args: P.args, **keywords: P.kwargs) -> R:
        with lock_of(self):
            return method(self, *args, **keywords)

    return cast(Callable[Concatenate[T, P], R], one_at_a_time)
