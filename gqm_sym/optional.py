"""Packages that only some calls need, and the extra to install if one is missing."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from gqm_sym.errors import SolutionError

P = ParamSpec("P")
T = TypeVar("T")


def require(extra: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Mark a function that imports packages which an extra of this package installs."""

    def marked(call: Callable[P, T]) -> Callable[P, T]:
        @wraps(call)
        def guarded(*arguments: P.args, **options: P.kwargs) -> T:
            try:
                return call(*arguments, **options)
            except ModuleNotFoundError as missing:
                raise SolutionError(
                    f"{extra}: needs {missing.name}, which is not installed; install gqm_sym with its extra [{extra}]"
                ) from None

        return guarded

    return marked
