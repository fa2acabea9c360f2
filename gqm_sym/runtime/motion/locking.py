"""One answer at a time: a motion computes answers on request and keeps them, and many threads may request them."""

from collections.abc import Callable
from functools import wraps
from threading import RLock
from typing import Concatenate, ParamSpec, Protocol, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")


class Lock:
    """A lock that the thread which holds it may take again; a copy of it, or what is read from its pickle, is new."""

    __slots__ = ("_lock",)

    def __init__(self) -> None:
        self._lock = RLock()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def __reduce__(self) -> tuple[type["Lock"], tuple[()]]:
        return Lock, ()


class HasLock(Protocol):
    """An object with a lock ``_lock``."""

    _lock: Lock


L = TypeVar("L", bound=HasLock)


def locked(method: Callable[Concatenate[L, P], R]) -> Callable[Concatenate[L, P], R]:
    """Let a method run while its object's lock is held, so that no other thread sees what is half computed."""

    @wraps(method)
    def one_at_a_time(self: L, *args: P.args, **keywords: P.kwargs) -> R:
        with self._lock:
            return method(self, *args, **keywords)

    return cast(Callable[Concatenate[L, P], R], one_at_a_time)
