"""Options of functions as their signature and docstring show them, made from their models."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ForwardRef, TypeVar

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from synfeal.config.shown import Shown, default_text

Function = TypeVar("Function", bound=Callable[..., Any])
OPTIONS = "options"
# The entry of the options in a docstring, which their own entries replace.
ENTRY = re.compile(rf"^(?P<indent> +){OPTIONS}:.*\n(?:(?P=indent) +.*\n)*", re.MULTILINE)
WIDTH = 100


def with_options(keywords: type[Any], *models: type[BaseModel]) -> Callable[[Function], Function]:
    """Show the options that a function takes as ``**options`` in its signature and docstring.

    Args:
        keywords: The ``TypedDict`` of the options, which has their types.
        models: Configurations whose fields they are; with description, unit and default.
    """
    types: Mapping[str, ForwardRef] = keywords.__annotations__
    fields = {name: field for model in models for name, field in model.model_fields.items()}

    def of(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [one for one in signature.parameters.values() if one.name != OPTIONS]
        names = [name for name in types if name not in signature.parameters]
        options = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=fields[name].get_default(call_default_factory=True),
                annotation=types[name].__forward_arg__,
            )
            for name in names
        ]
        shown = signature.replace(parameters=[*own, *options])
        function.__signature__ = shown  # type: ignore[attr-defined]
        if function.__doc__:  # not under python -OO
            function.__doc__ = ENTRY.sub(
                lambda found: "".join(_entries(found["indent"], {n: fields[n] for n in names})),
                function.__doc__,
            )
        return function

    return of


def _entries(indent: str, fields: Mapping[str, FieldInfo]) -> Iterator[str]:
    """Yield the entry of each option under ``Args:``."""
    for name, field in fields.items():
        text = field.description or ""
        shown = next((each for each in field.metadata if isinstance(each, Shown)), Shown())
        default = shown.default or default_text(field)
        entry = f"{name}: {text[0].upper()}{text[1:]}" + (
            f"; default {default}." if default else "."
        )
        entry = re.sub(r"`([^`]+)`", r"``\1``", entry)
        yield (
            textwrap.fill(entry, WIDTH, initial_indent=indent, subsequent_indent=f"{indent}    ")
            + "\n"
        )
