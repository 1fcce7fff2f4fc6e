"""Find what is declared in the source of these packages and of those installed beside them.

A package of one's own names its modules as entry points of the group that the kind names, such as
``synfeal.methods``; each module may declare any number of them::

    [project.entry-points."synfeal.methods"]
    direct = "my_package.direct"
"""

from __future__ import annotations

import ast
import importlib.util
import re
from dataclasses import replace
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import TypeGuard, TypeVar

from baselines.registry.kinds import Kind
from synfeal.errors import InputError

K = TypeVar("K", bound=Kind)


def declared(kind: type[K]) -> dict[str, K]:
    """Find all methods of a kind.

    Args:
        kind: Class of the declarations.

    Returns:
        Declarations by name, in the order of their ranks, then of their names.

    Raises:
        InputError: An installed module cannot be found or declares nothing, an argument is no
            literal, or a name is not allowed or taken.
    """
    found: dict[str, K] = {}
    for module, source in (*_own(kind.room), *_installed(kind.entry_points)):
        for declaration in _declarations(module, source, kind.__name__):
            if not isinstance(declaration, kind):
                continue
            other = found.get(declaration.name)
            if other is not None:
                raise InputError(
                    declaration.place,
                    f"the name '{declaration.name}' is taken by {other.place}",
                    "choose another",
                )
            found[declaration.name] = declaration
    return {method.name: method for method in sorted(found.values(), key=_order)}


def _order(method: Kind) -> tuple[int, str]:
    return method.rank, method.name


@cache
def _own(room: str) -> tuple[tuple[str, Path], ...]:
    """List the modules of a package, each with its source."""
    spec = importlib.util.find_spec(room)
    folders = spec.submodule_search_locations if spec else None
    found = []
    for folder in map(Path, folders or ()):
        for source in sorted(folder.rglob("*.py")):
            parts = source.relative_to(folder).with_suffix("").parts
            found.append((".".join([room, *parts]), source))
    return tuple(found)


@cache
def _installed(group: str) -> tuple[tuple[str, Path], ...]:
    """List the modules that installed packages name in a group, each with its source."""
    found = []
    kinds = [name for name, kind in _kinds().items() if kind.entry_points == group]
    for entry in sorted(entry_points(group=group), key=lambda entry: entry.name):
        try:
            spec = importlib.util.find_spec(entry.module)
        except ModuleNotFoundError:
            spec = None
        if spec is None or spec.origin is None or not spec.origin.endswith(".py"):
            raise InputError(
                entry.module,
                f"the module of the entry point '{entry.name}' of {group} is not there",
                "install its package again, or remove it",
            )
        source = Path(spec.origin)
        if not any(_declarations(entry.module, source, kind) for kind in kinds):
            raise InputError(
                source,
                f"declares nothing, though the entry point '{entry.name}' of {group} names it",
                "see docs/adding.md",
            )
        found.append((entry.module, source))
    return tuple(found)


@cache
def _declarations(module: str, source: Path, name: str) -> tuple[Kind, ...]:
    """Read the declarations of the kind with a name from the source of a module."""
    text, kind = source.read_text(encoding="utf-8"), _kinds()[name]
    if f"@{name}(" not in text and f".{name}(" not in text:
        return ()
    found = []
    for node in ast.parse(text, str(source)).body:
        if not isinstance(node, ast.ClassDef | ast.FunctionDef):
            continue
        for decorator in node.decorator_list:
            if _is_call_of(decorator, name):
                declaration = _declaration(decorator, source, kind)
                found.append(replace(declaration, place=f"{module}:{node.name}"))
    return tuple(found)


def _kinds() -> dict[str, type[Kind]]:
    return {kind.__name__: kind for kind in Kind.__subclasses__()}


def _is_call_of(decorator: ast.expr, name: str) -> TypeGuard[ast.Call]:
    """Tell whether a decorator calls what has this name, in whichever module."""
    if not isinstance(decorator, ast.Call):
        return False
    called = decorator.func
    return name == (called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", ""))


def _declaration(decorator: ast.Call, source: Path, kind: type[Kind]) -> Kind:
    """Build what a decorator declares."""
    where = f"{source}: line {decorator.lineno}: @{kind.__name__}"
    try:
        arguments = {str(each.arg): ast.literal_eval(each.value) for each in decorator.keywords}
    except ValueError as error:
        raise InputError(
            where, "arguments must be literals, for they are read without running the module"
        ) from error
    try:
        declaration = kind(**arguments)
    except TypeError as error:  # an argument is missing or unknown
        raise InputError(where, str(error).partition("() ")[2]) from error
    pattern, allowed = kind.names
    if not re.fullmatch(pattern, declaration.name):
        raise InputError(where, f"name: '{declaration.name}' must be {allowed}")
    return declaration
