"""The package of docs/adding.md, as a person installs it."""

import os
import re

from tests import ROOT

PAGE = ROOT / "docs" / "adding.md"
METADATA = "Metadata-Version: 2.1\nName: {}\nVersion: 1.0\n"


def examples():
    """Text of each file of the page, by its name below ``my_methods``."""
    found = re.findall(
        r"`my_methods/(\w+)\.py`:\n\n```python\n(.*?)```", PAGE.read_text(), re.DOTALL
    )
    return dict(found)


def block(before, language):
    """The text of the one code block of the page in a language that follows some words."""
    pattern = rf"{re.escape(before)}[^\n]*\n\n```{language}\n(.*?)```"
    (found,) = re.findall(pattern, PAGE.read_text(), re.DOTALL)
    return found


def install(folder, modules, entries=None, package="my_methods", group="synfeal.methods"):
    """Write modules by name as an installed package; returns the environment that sees it."""
    sources, info = folder / package, folder / f"{package}-1.0.dist-info"
    sources.mkdir()
    info.mkdir()
    (sources / "__init__.py").touch()
    for name, text in modules.items():
        (sources / f"{name}.py").write_text(text)
    (info / "METADATA").write_text(METADATA.format(package))
    if entries is None:
        entries = "".join(f"{name} = {package}.{name}\n" for name in modules)
    (info / "entry_points.txt").write_text(f"[{group}]\n" + entries)
    path = os.pathsep.join([str(folder), str(ROOT), os.environ.get("PYTHONPATH", "")])
    return os.environ | {"PYTHONPATH": path}
