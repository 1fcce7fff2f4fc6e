"""Named arrays in one file, and classes that consist of them."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Self

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


class Stored:
    """A dataclass whose fields are arrays, kept as a file of them."""

    def write(self, path: Path) -> None:
        """Write the fields by their names."""
        write_arrays(path, {field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]

    @classmethod
    def read(cls, path: Path) -> Self:
        """What :meth:`write` wrote.

        Raises:
            InputError: the file cannot be read.
        """
        return cls(**read_arrays(path, [field.name for field in fields(cls)]))  # type: ignore[arg-type]
