"""Write the reference of commands and functions from the parser and the packages themselves."""

from __future__ import annotations

import argparse
import importlib
import inspect
import pkgutil
import shutil
import sys
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path
from types import ModuleType

import baselines
import synfeal
from synfeal.cli.parser import all_commands, build_parser

Pages = dict[str, str]  # text by path below the reference


def write_pages(folder: Path) -> None:
    """Write all pages of the reference, and remove those of what is no longer there.

    A page whose text is the same is left alone, and Sphinx does not read it again.
    """
    pages = command_pages() | function_pages() | module_pages()
    for old in folder.rglob("*.rst"):
        if old.relative_to(folder).as_posix() not in pages:
            old.unlink()
    for name, text in pages.items():
        path = folder / name
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")


def command_parsers() -> dict[str, argparse.ArgumentParser]:
    """Return the parser of each command, in the order of ``synfeal --help``."""
    parser = build_parser(all_commands())
    [commands] = [
        action for action in parser._actions if isinstance(action, argparse._SubParsersAction)
    ]
    return dict(commands.choices)


def command_pages() -> Pages:
    """Make a page for each command, and their list."""
    summaries = {command.name: command.summary for command in all_commands()}
    parsers = command_parsers()
    pages = {f"commands/{name}.rst": command_page(name, parsers[name]) for name in parsers}
    rows = ((f":doc:`synfeal {name} <commands/{name}>`", summaries[name]) for name in parsers)
    text = "Every command with all its options, as ``--help`` prints them."
    pages["commands.rst"] = index_page("Commands", text, rows, (f"commands/{n}" for n in parsers))
    return pages


def command_page(name: str, parser: argparse.ArgumentParser) -> str:
    """Describe a command: what it does, an example, how it is called, and its options."""
    example = (parser.epilog or "").removeprefix("example: ")
    lines = [*heading(f"synfeal {name}"), parser.description or "", ""]
    lines += code("console", example)
    # At the width of a page, whatever terminal builds it.
    parser.formatter_class = lambda prog: argparse.HelpFormatter(prog, width=88)
    lines += code("text", parser.format_usage().removeprefix("usage: ").replace("\n       ", "\n"))
    for action in parser._actions:
        if not isinstance(action, argparse._HelpAction):
            lines += option_entry(action)
    return "\n".join(lines) + "\n"


def option_entry(action: argparse.Action) -> list[str]:
    """Describe an option or argument as an entry of a definition list."""
    values = value_names(action)
    flags = action.option_strings or [values]
    shown = [f"{flag} {values}".strip() if action.option_strings else flag for flag in flags]
    required = " *(required)*" if action.option_strings and action.required else ""
    return [", ".join(f"``{each}``" for each in shown) + required, f"   {plain(action.help)}", ""]


def value_names(action: argparse.Action) -> str:
    """Name the values that an option takes, as its usage does."""
    if action.nargs == 0:
        return ""
    names = action.metavar
    if names is None and action.choices is not None:
        names = "{" + ",".join(map(str, action.choices)) + "}"
    if names is None:
        names = action.dest.upper() if action.option_strings else action.dest
    if isinstance(names, tuple):
        return " ".join(names)
    if isinstance(action.nargs, int):
        return " ".join([names] * action.nargs)
    return {"+": f"{names} [{names} ...]", "*": f"[{names} ...]", "?": f"[{names}]"}.get(
        str(action.nargs), names
    )


def function_pages() -> Pages:
    """Make a page for each name that ``import synfeal`` gives, and their list."""
    pages = {}
    rows = []
    for name in synfeal.__all__:
        thing = getattr(synfeal, name)
        kind = "autoclass" if inspect.isclass(thing) else "autofunction"
        members = ["   :members:", "   :inherited-members: object"] * inspect.isclass(thing)
        body = [*heading(f"synfeal.{name}"), f".. {kind}:: synfeal.{name}", *members, ""]
        pages[f"api/synfeal.{name}.rst"] = "\n".join(body)
        rows.append((f":doc:`synfeal.{name} <api/synfeal.{name}>`", first_line(thing)))
    text = "What ``import synfeal`` gives: the commands, and the objects they work with."
    entries = (f"api/synfeal.{name}" for name in synfeal.__all__)
    pages["api.rst"] = index_page("Python", text, rows, entries)
    return pages


def module_pages() -> Pages:
    """Make a page for each sub-package of ``synfeal`` and ``baselines``, and their lists.

    These pages stand in no table of contents, which every page would repeat beside its text.
    """
    pages = {}
    for package in (synfeal, baselines):
        rows = []
        groups = groupby(public_modules(package), key=lambda module: module.__name__.split(".")[1])
        for part, modules in groups:
            name = f"{package.__name__}.{part}"
            members = list(modules)
            pages[f"modules/{name}.rst"] = module_page(name, members)
            names = sorted({each for module in members for each in defined(module)})
            listed = ", ".join(f"``{each}``" for each in names)
            rows.append((f":doc:`{name} <modules/{name}>`", f"{summary_of(name)} {listed}"))
        title = f"Modules of {package.__name__}"
        text = "Every public function and class, by package."
        pages[f"{package.__name__}.rst"] = index_page(title, text, rows, ())
    return pages


def summary_of(name: str) -> str:
    """Return the first sentence of a package or module."""
    return first_line(importlib.import_module(name))


def module_page(name: str, modules: list[ModuleType]) -> str:
    """Describe what the modules of a package define, but for underscored names."""
    lines = [":orphan:", "", *heading(name)]
    for module in modules:
        if len(modules) > 1:
            lines += [module.__name__, "-" * len(module.__name__), ""]
        lines += [f".. automodule:: {module.__name__}"]
        lines += [f"   :members: {', '.join(defined(module))}", ""]
    return "\n".join(lines)


def public_modules(package: ModuleType) -> Iterator[ModuleType]:
    """Import and yield the modules that define public functions or classes, by name."""
    found = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    skipped = {"hatch_build", "__main__"}
    for name in sorted(module.name for module in found):
        if name.rpartition(".")[2] not in skipped and any(
            defined(module := importlib.import_module(name))
        ):
            yield module


def defined(module: ModuleType) -> Iterator[str]:
    """Yield the public functions and classes that a module itself defines."""
    for name, thing in vars(module).items():
        public = not name.startswith("_") and (inspect.isfunction(thing) or inspect.isclass(thing))
        if public and thing.__module__ == module.__name__:
            yield name


def index_page(
    title: str, text: str, rows: Iterable[tuple[str, str]], entries: Iterable[str]
) -> str:
    """Make a table of links with a line for each, and a hidden table of contents of entries."""
    lines = [*heading(title), text, "", ".. list-table::", "   :widths: 40 60", ""]
    for link, summary in rows:
        lines += [f"   * - {link}", f"     - {summary}"]
    listed = [f"   {entry}" for entry in entries]
    if listed:
        lines += ["", ".. toctree::", "   :hidden:", "", *listed]
    lines.append("")
    return "\n".join(lines)


def heading(title: str) -> list[str]:
    """Underline a title."""
    return [title, "=" * len(title), ""]


def code(language: str, text: str) -> list[str]:
    """Indent a block of code."""
    lines = text.strip().splitlines()
    return [f".. code-block:: {language}", "", *(f"   {line}" for line in lines), ""]


def plain(text: str | None) -> str:
    """Escape what reStructuredText would read as markup, but for ``code``."""
    parts = (text or "").replace("%%", "%").split("`")
    escaped = [part.replace("\\", "\\\\").replace("*", "\\*").replace("|", "\\|") for part in parts]
    escaped = [part.replace("_", "\\_") for part in escaped]
    return "".join(
        f"``{original}``" if number % 2 else text
        for number, (text, original) in enumerate(zip(escaped, parts, strict=True))
    )


def first_line(thing: object) -> str:
    """Return the first sentence of a docstring, on one line."""
    paragraph = (inspect.getdoc(thing) or "").partition("\n\n")[0]
    return " ".join(paragraph.split()).replace("::", ":")


if __name__ == "__main__":
    shutil.rmtree(sys.argv[1], ignore_errors=True)
    write_pages(Path(sys.argv[1]))
