"""Read what ``torch.save`` wrote, and tell a damaged file from a fault of ours."""

from __future__ import annotations

import pickle
import struct
import warnings
import zipfile
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from baselines.localizers.memory import is_out_of_memory
from synfeal.dataset.frame_files import ARCHIVE_DAMAGE

# Raised by ``torch.load`` for files that are damaged or of another kind (found by flipping bytes).
# ``AttributeError`` is not among them: a fault in this program keeps its traceback.
DAMAGE = (
    pickle.UnpicklingError,
    AssertionError,
    EOFError,
    LookupError,
    RuntimeError,
    TypeError,
    ValueError,
    struct.error,
)


def load_saved(path: Path, device: torch.device | str = "cpu") -> Any:
    """Load tensors and plain values; code in the file is not run.

    Args:
        path: File that ``torch.save`` wrote.
        device: Device of the tensors.

    Raises:
        ValueError: The file is damaged, of another kind, or holds more than plain values.
        OSError: The file cannot be read.
        RuntimeError: Memory is used up; see
            :func:`~baselines.localizers.memory.memory_errors`.
    """
    _check_parts(path)
    try:
        with warnings.catch_warnings():
            # Damage may look like another protocol of pickle, which torch warns of first.
            warnings.filterwarnings("ignore", "Detected pickle protocol")
            return torch.load(path, map_location=device, weights_only=True)
    except DAMAGE as error:
        if is_out_of_memory(error):
            raise
        # What torch says advises to load the file unsafely.
        raise ValueError("torch did not save it, or as code") from error


def checked_state(value: object) -> dict[str, Tensor]:
    """Return tensors by name, as they are.

    Raises:
        ValueError: The value is something else.
    """
    if not isinstance(value, dict):
        raise ValueError("it holds no tensors by name")
    for name, tensor in value.items():
        if not (isinstance(name, str) and isinstance(tensor, Tensor)):
            raise ValueError("it holds no tensors by name")
    return value


def _check_parts(path: Path) -> None:
    """Compare each part of the file with its checksum, which ``torch.load`` passes over.

    A changed size would otherwise ask for any amount of memory. Files in torch's old format, which
    is no zip archive, have no checksums.

    Raises:
        ValueError: A part is damaged.
        OSError: The file cannot be read.
    """
    if not zipfile.is_zipfile(path):
        return
    try:
        with zipfile.ZipFile(path) as archive:
            damaged = archive.testzip()
    except (*ARCHIVE_DAMAGE, struct.error) as error:
        raise ValueError("it is damaged") from error
    if damaged is not None:
        raise ValueError(f"its part {damaged} is damaged")
