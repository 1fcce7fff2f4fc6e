"""Named arrays in one file, and classes made of them."""

from __future__ import annotations

import errno
import math
import os
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import IO, Any, Self

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError, why
from synfeal.records.files import atomic_path

# np.savez writes the second for headers beyond 64 KB only.
HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}

Vectors = NDArray[np.float32]
Described = dict[str, tuple[Vectors, Vectors]]


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays as an uncompressed ``.npz``.

    Raises:
        OSError: The file cannot be written.
    """
    with atomic_path(path) as temporary:
        try:
            np.savez(temporary, allow_pickle=False, **arrays)
        except (OSError, ValueError) as error:
            # On a full disk NumPy names no reason, and zipfile then fails to end the member.
            cause = error if isinstance(error, OSError) else error.__context__
            if not isinstance(cause, OSError):
                raise
            number = cause.errno or errno.ENOSPC
            raise OSError(number, os.strerror(number), str(path)) from error


def read_arrays(path: Path, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """Read the arrays of these names.

    Raises:
        InputError: the file cannot be read or lacks one of them.
    """
    try:
        # A file that it opens itself, np.load leaves open where it is damaged.
        with path.open("rb") as file:
            _check_claims(file)
            with np.load(file, allow_pickle=False) as stored:
                return {name: stored[name] for name in names}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(
            path, f"cannot be read as arrays ({why(error)})", "make it again"
        ) from error


def _check_claims(file: IO[bytes]) -> None:
    """Check that members are as large as the file says, and their arrays no larger.

    Raises:
        ValueError: One claims more, for which NumPy would take the memory first.
    """
    with zipfile.ZipFile(file) as members:
        for info in members.infolist():
            if info.file_size != info.compress_size:
                raise ValueError(f"{info.filename} is compressed")
            with members.open(info) as member:
                version = np.lib.format.read_magic(member)
                read_header = HEADERS[version]
                shape, _, dtype = read_header(member)
                if math.prod(shape) * dtype.itemsize > info.file_size:
                    raise ValueError(f"{info.filename} claims an array of {shape}")
    file.seek(0)


class Stored:
    """A dataclass whose fields are arrays, kept as a file of them."""

    def write(self, path: Path) -> None:
        """Write the fields by their names."""
        write_arrays(path, {field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read what :meth:`write` wrote.

        Raises:
            InputError: the file cannot be read.
        """
        return cls(**read_arrays(path, [field.name for field in fields(cls)]))  # type: ignore[arg-type]


@dataclass(frozen=True)
class ByFrame(Stored):
    """Arrays whose rows belong to frames, one frame after the other.

    Attributes:
        start: First row (N + 1,) of each frame; the last entry is the number of rows.
    """

    start: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.start) - 1

    def of(self, frame: int) -> slice:
        """Return the rows that belong to a frame."""
        return slice(int(self.start[frame]), int(self.start[frame + 1]))


THUMBNAIL, VLAD = "thumbnail", "vlad"
QUERIES = 500  # looked up at a time


def read_described(path: Path, n_train: int, n_test: int, test: str = "test") -> Described:
    """Read the global descriptors of the first frames of each split.

    Smaller data sets are prefixes of larger ones, so one file serves all sizes.

    Args:
        path: File of descriptors.
        n_train: Number of training frames to read.
        n_test: Number of test frames to read.
        test: Name of the test frames, where the file holds several renderings of the same poses.

    Returns:
        Unit vectors (n_train, D) and (n_test, D), by the name of the descriptor.

    Raises:
        InputError: the file cannot be read.
    """
    names = (THUMBNAIL, VLAD)
    stored = read_arrays(path, [f"{name}_{split}" for name in names for split in ("train", test)])
    return {n: (stored[f"{n}_train"][:n_train], stored[f"{n}_{test}"][:n_test]) for n in names}


def most_alike(train: Vectors, test: Vectors, count: int) -> NDArray[np.int64]:
    """Find for each test vector the training vectors that are most alike.

    Args:
        train: Unit vectors (M, D).
        test: Unit vectors (N, D).
        count: Number of training vectors to find; all where there are fewer.

    Returns:
        Rows of ``train`` (N, count), the most alike first.
    """
    count = min(count, len(train))
    found = []
    for start in range(0, len(test), QUERIES):
        alike = test[start : start + QUERIES] @ train.T
        best = np.argpartition(-alike, count - 1, axis=1)[:, :count]
        order = np.argsort(-np.take_along_axis(alike, best, axis=1), axis=1, kind="stable")
        found.append(np.take_along_axis(best, order, axis=1))
    return np.concatenate(found).astype(np.int64)
