"""Keywords of the version before, which are taken for one version more."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def renamed(**names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Take earlier names of keywords, with a warning.

    Args:
        names: Names of today by those before.
    """

    def of(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def call(*args: P.args, **keywords: P.kwargs) -> R:
            for name in names.keys() & keywords.keys():
                warn_renamed(f"{name}=", f"{names[name]}=")
                keywords[names[name]] = keywords.pop(name)
            return function(*args, **keywords)

        return call

    return of


def warn_renamed(before: str, now: str) -> None:
    """Warn that the caller of the calling function uses a name that goes with the next version."""
    warnings.warn(f"{before} is called {now} now", DeprecationWarning, stacklevel=3)
