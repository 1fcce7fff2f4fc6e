"""Declaration of commands and their options, by hand or from the fields of a configuration."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from synfeal.cli.wording import in_flags
from synfeal.config.flags import UNITS, flag_of
from synfeal.config.shown import Shown, default_text

log = logging.getLogger("synfeal")

# Flag, and its arguments of argparse.
Option = tuple[str, dict[str, Any]]
Action = Callable[[argparse.Namespace], None]
# From arguments as an earlier version took them to those of today; None where they are no such.
Rewriting = Callable[[Sequence[str]], Sequence[str] | None]


class Command(NamedTuple):
    """One sub-command of ``synfeal``, with what its own help and that of ``synfeal`` say.

    Attributes:
        name: Its name, and that of the function of :mod:`synfeal` that does the same.
        summary: For the list of commands.
        description: For its own help.
        example: A command line.
        options: Its options.
        action: What it does; imports what it needs when it is called, so that ``--help`` is quick.
        function: ``module:name`` of the function that does the same from Python, if there is one.
        was: Earlier flags, each with that of today; an empty one stands for an argument.
        rewriting: Recognises command lines of an earlier version that had another name.
    """

    name: str
    summary: str
    description: str
    example: str
    options: tuple[Option, ...]
    action: Action
    function: str | None = None
    was: Mapping[str, str] = {}
    rewriting: Rewriting | None = None

    def __call__(self, arguments: argparse.Namespace) -> None:
        """Carry it out."""
        self.action(arguments)

    @property
    def flags(self) -> dict[str, str]:
        """Flags of its options by their names in Python; of one without a flag, its place."""
        return {
            destination(flag, details): flag
            if flag.startswith("-")
            else str(details.get("metavar", flag.upper()))
            for flag, details in self.options
        }


def option(flag: str, text: str, **details: Any) -> Option:
    """Define a flag, or a positional argument, and its help; ``details`` go to argparse."""
    return flag, {"help": text, **details}


def command(
    summary: str,
    example: str,
    *options: Option,
    function: str | None = None,
    was: Mapping[str, str] | None = None,
    rewriting: Rewriting | None = None,
) -> Callable[[Action], Command]:
    """Make a command of a function, whose name and docstring become its name and description."""

    def of(action: Action) -> Command:
        description = " ".join((action.__doc__ or "").split())
        name = action.__name__
        return Command(
            name, summary, description, example, options, action, function, was or {}, rewriting
        )

    return of


def destination(flag: str, details: Mapping[str, Any]) -> str:
    """Return the name that an option has in Python."""
    return str(details.get("dest", flag.lstrip("-").replace("-", "_")))


def options_of(model: type[BaseModel], *, positional: str | None = None) -> Iterator[Option]:
    """Make an option of each field of a configuration, the required ones first.

    Args:
        model: The configuration.
        positional: Field that is an argument without a flag, if one is.
    """
    fields = sorted(model.model_fields.items(), key=lambda item: not item[1].is_required())
    for name, field in fields:
        details = _details(name, field)
        if name == positional:
            del details["required"], details["dest"]
            yield name, {**details, "metavar": name.upper()}
        else:
            yield flag_of(name), details


def _details(name: str, field: FieldInfo) -> dict[str, Any]:
    """Return the arguments of argparse for a field."""
    shown = next((each for each in field.metadata if isinstance(each, Shown)), Shown())
    kind = _plain(field.annotation)
    text = in_flags(field.description or "", flag_of)
    default = in_flags(shown.default or default_text(field), flag_of)
    details: dict[str, Any] = {"dest": name, "help": f"{text} ({default})" if default else text}
    if field.is_required():
        details["required"] = True
    if kind is bool:
        return {**details, "action": "store_true", "default": None}
    values = get_args(kind)
    if get_origin(kind) is Literal:
        return {**details, "choices": values}
    if get_origin(kind) is tuple:
        if values[-1] is Ellipsis:
            details["action"], values = "append", get_args(_plain(values[0]))
        details |= {"type": _plain(values[0]), "nargs": len(values)}
        return details | ({"metavar": shown.values} if shown.values else {})
    unit = UNITS.get(name.rpartition("_")[2])
    usual = "FILE" if kind is Path else "N" if kind is int else None
    metavar = shown.values[0] if shown.values else unit or usual
    details["type"] = kind if kind in (int, float, str, Path) else Path
    return details | (
        {"metavar": metavar} if metavar else {"metavar": "FILE"} if details["type"] is Path else {}
    )


def _plain(annotation: Any) -> Any:
    """Return a type without its bounds and without None."""
    if get_origin(annotation) is Annotated:
        return _plain(get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType):
        some = [each for each in get_args(annotation) if each is not NoneType]
        return _plain(some[0])
    return annotation


def given(arguments: argparse.Namespace, *models: type[BaseModel]) -> dict[str, Any]:
    """Return the fields of some configurations that were given as options."""
    names = [name for model in models for name in model.model_fields]
    return {name: getattr(arguments, name) for name in names}


def keywords(arguments: argparse.Namespace, command: Command) -> dict[str, Any]:
    """Return the options that were given as keywords of the function that does the same."""
    found: dict[str, Any] = {}
    for flag, details in command.options:
        value = getattr(arguments, destination(flag, details))
        if value is not None:
            several = isinstance(value, list) and details.get("action") != "append"
            found[destination(flag, details)] = tuple(value) if several else value
    return found


def in_words_of_today(typed: Sequence[str], commands: Iterable[Command]) -> list[str]:
    """Replace flags of the version before by those of today, and warn of each.

    Flags may be written with their unit, too, as in Python: that is no reason to warn.
    """
    commands = tuple(commands)
    for each in commands:
        rewritten = each.rewriting(typed) if each.rewriting else None
        if rewritten is not None:
            log.warning("synfeal %s is called %s now", typed[0], each.name)
            typed = rewritten
            break
    chosen = next((each for each in commands if typed and each.name == typed[0]), None)
    if chosen is None:
        return list(typed)
    units = {
        f"--{destination(flag, details).replace('_', '-')}": flag
        for flag, details in chosen.options
        if flag.startswith("--")
    }
    found: list[str] = []
    for place, argument in enumerate(typed):
        flag, equals, value = argument.partition("=")
        if "--" in typed[:place] or not flag.startswith("--"):
            found.append(argument)
        elif flag in chosen.was:
            present = chosen.was[flag]
            log.warning(
                "%s is called %s now" if present else "%s: leave the flag out%s",
                flag,
                present,
            )
            found += [f"{present}{equals}{value}"] if present else [value] if equals else []
        else:
            found.append(f"{units.get(flag, flag)}{equals}{value}")
    return found


def numbers_apart(arguments: Sequence[str], options: Sequence[Option]) -> Iterator[str]:
    """Yield arguments so that argparse reads negative numbers of all forms, and ``--box=0 1 ...``.

    It takes ``-1e0`` for an option; a blank before it makes it a value.
    """
    several = {flag for flag, details in options if isinstance(details.get("nargs"), int)}
    for argument in arguments:
        flag, equals, value = argument.partition("=")
        parts = [flag, *value.split()] if equals and flag in several else [argument]
        yield from (f" {part}" if _is_negative(part) else part for part in parts)


def _is_negative(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return text.startswith("-")
