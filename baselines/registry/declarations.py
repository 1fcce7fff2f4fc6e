"""Find declared methods in the source of this package and of those installed beside it.

A package of one's own names its modules as entry points of the group ``synfeal.methods``; each
module may declare any number of methods::

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
from typing import TypeVar

from baselines.registry.kinds import Kind
from synfeal.errors import InputError

ENTRY_POINTS = "synfeal.methods"
PACKAGE = Path(__file__).parents[1]
NAME = re.compile(r"[a-z][a-z0-9-]*")

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
    for module, source in (*_own(kind.room), *_installed()):
        for declaration in _declarations(module, source):
            if not isinstance(declaration, kind):
                continue
            other = found.get(declaration.name)
            if other is not None:
                raise InputError(
                    f"{declaration.place}: the name '{declaration.name}' is taken by"
                    f" {other.place}; choose another"
                )
            found[declaration.name] = declaration
    return {method.name: method for method in sorted(found.values(), key=_order)}


def _order(method: Kind) -> tuple[int, str]:
    return method.rank, method.name


@cache
def _own(room: str) -> tuple[tuple[str, Path], ...]:
    """List the modules of a folder of this package, each with its source."""
    sources = sorted((PACKAGE / room).rglob("*.py"))
    names = (".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts) for path in sources)
    return tuple(zip(names, sources, strict=True))


@cache
def _installed() -> tuple[tuple[str, Path], ...]:
    """List the modules that installed packages name, each with its source."""
    found = []
    for entry in sorted(entry_points(group=ENTRY_POINTS), key=lambda entry: entry.name):
        try:
            spec = importlib.util.find_spec(entry.module)
        except ModuleNotFoundError:
            spec = None
        if spec is None or spec.origin is None or not spec.origin.endswith(".py"):
            raise InputError(
                f"{entry.module}: the module of the entry point '{entry.name}' of"
                f" {ENTRY_POINTS} is not there; install its package again, or remove it"
            )
        source = Path(spec.origin)
        if not _declarations(entry.module, source):
            raise InputError(
                f"{source}: declares no method, though the entry point '{entry.name}' of"
                f" {ENTRY_POINTS} names it; see docs/adding.md"
            )
        found.append((entry.module, source))
    return tuple(found)


@cache
def _declarations(module: str, source: Path) -> tuple[Kind, ...]:
    """Read the declarations of a module from its source."""
    text = source.read_text(encoding="utf-8")
    if not any(f"@{kind}(" in text or f".{kind}(" in text for kind in _kinds()):
        return ()
    found = []
    for node in ast.parse(text, str(source)).body:
        if not isinstance(node, ast.ClassDef | ast.FunctionDef):
            continue
        for decorator in node.decorator_list:
            declaration = _declaration(decorator, source)
            if declaration is not None:
                found.append(replace(declaration, place=f"{module}:{node.name}"))
    return tuple(found)


def _kinds() -> dict[str, type[Kind]]:
    return {kind.__name__: kind for kind in Kind.__subclasses__()}


def _declaration(decorator: ast.expr, source: Path) -> Kind | None:
    """Build what a decorator declares, or None where it is another decorator."""
    if not isinstance(decorator, ast.Call):
        return None
    called = decorator.func
    name = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
    kind = _kinds().get(name)
    if kind is None:
        return None
    where = f"{source}: line {decorator.lineno}: @{name}"
    try:
        arguments = {str(each.arg): ast.literal_eval(each.value) for each in decorator.keywords}
    except ValueError as error:
        raise InputError(
            f"{where}: arguments must be literals, for they are read without running the module"
        ) from error
    try:
        declaration = kind(**arguments)
    except TypeError as error:  # an argument is missing or unknown
        raise InputError(f"{where}: {str(error).partition('() ')[2]}") from error
    if not NAME.fullmatch(declaration.name):
        raise InputError(
            f"{where}: name: '{declaration.name}' must be lower-case letters, digits and -"
        )
    return declaration
