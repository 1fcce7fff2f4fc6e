"""Named arrays in one file."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError, why
from synfeal.files import atomic_path

Arrays = dict[str, NDArray[Any]]


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays as an uncompressed ``.npz``."""
    with atomic_path(path) as temporary:
        np.savez(temporary, allow_pickle=False, **arrays)


def read_arrays(path: Path, names: Iterable[str]) -> Arrays:
    """The arrays of these names.

    Raises:
        InputError: the file cannot be read or lacks one of them.
    """
    try:
        # A file that it opens itself, np.load leaves open where it is damaged.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            return {name: stored[name] for name in names}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path}: cannot be read as arrays ({why(error)}); make it again"
        ) from None
