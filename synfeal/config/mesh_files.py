"""The files a configuration asks for, before anything is built on them."""

from __future__ import annotations

import os
import stat
from collections.abc import Mapping
from pathlib import Path

from synfeal.config.collection import SceneConfig
from synfeal.errors import InputError

DOCUMENTATION = "config/scenes/README.md"


def check_mesh_files(scenes: Mapping[str, SceneConfig]) -> None:
    """Check that the file of every scene with ``source: mesh`` is there.

    Raises:
        InputError: naming the first that is not, its configuration key and the documentation.
    """
    for name, scene in scenes.items():
        if scene.source == "mesh" and scene.path is not None:
            check_mesh_file(scene.path, f"scenes.{name}.path")


def check_mesh_file(path: Path, field: str) -> None:
    """Check that the mesh file named by a configuration key, ``field``, is there.

    Raises:
        InputError: it is not.
    """
    try:
        mode = path.stat().st_mode
    except OSError as error:
        missing = isinstance(error, FileNotFoundError | NotADirectoryError)
        why = "does not exist" if missing else f"cannot be read ({error.strerror})"
        raise InputError(
            f"{field}: {path} {why}; put the mesh there or change the path (see {DOCUMENTATION})"
        ) from None
    if not stat.S_ISREG(mode):
        kind = "a directory" if stat.S_ISDIR(mode) else "no plain file"
        raise InputError(f"{field}: {path} is {kind}; name the mesh file itself")


def check_results(root: Path) -> None:
    """Check that results can lie in the directory ``root``, which need not exist.

    Raises:
        InputError: it or a directory above it is a file.
    """
    try:
        place = next(path for path in (root, *root.parents) if os.path.lexists(path))
    except OSError as error:
        raise InputError(f"results: {root}: {error.strerror}; choose another directory") from None
    if not place.is_dir():
        raise InputError(f"results: {place} is not a directory; choose another one")
