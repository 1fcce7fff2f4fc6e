"""The package of docs/adding.md, as a person installs it."""

import os
import re

from tests import ROOT

PAGE = ROOT / "docs" / "adding.md"
METADATA = "Metadata-Version: 2.1\nName: my-methods\nVersion: 1.0\n"


def examples():
    """Text of each file of the page, by its name below ``my_methods``."""
    found = re.findall(
        r"`my_methods/(\w+)\.py`:\n\n```python\n(.*?)```", PAGE.read_text(), re.DOTALL
    )
    return dict(found)


def install(folder, modules, entries=None):
    """Write modules by name as an installed package; returns the environment that sees it."""
    package, info = folder / "my_methods", folder / "my_methods-1.0.dist-info"
    package.mkdir()
    info.mkdir()
    (package / "__init__.py").touch()
    for name, text in modules.items():
        (package / f"{name}.py").write_text(text)
    (info / "METADATA").write_text(METADATA)
    if entries is None:
        entries = "".join(f"{name} = my_methods.{name}\n" for name in modules)
    (info / "entry_points.txt").write_text("[synfeal.methods]\n" + entries)
    path = os.pathsep.join([str(folder), str(ROOT), os.environ.get("PYTHONPATH", "")])
    return os.environ | {"PYTHONPATH": path}
