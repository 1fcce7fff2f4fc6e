"""Formats of captures: which there are, and which one a folder is in.

A format is one module with a :class:`CaptureFormat`. Those of other packages are found by their
entry points in the group ``synfeal.captures``, whose objects are :class:`CaptureFormat` as well.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Collection
from importlib.metadata import entry_points
from pathlib import Path
from typing import NamedTuple

from synfeal.captures.capture import Capture
from synfeal.dataset.images import HEIF_SUFFIXES
from synfeal.errors import Argument, InputError

GROUP = "synfeal.captures"
PICTURES = (".png", ".jpg", ".jpeg", *HEIF_SUFFIXES, ".ppm", ".tif", ".tiff")
MOST_NAMED = 3  # folders of pictures, in a message
OWN = (
    "tum",
    "seven_scenes",
    "twelve_scenes",
    "scannet",
    "transforms",
    "record3d",
    "stray_scanner",
    "polycam",
    "scanner_app",
    "arkitscenes",
    "colmap",
)


class CaptureFormat(NamedTuple):
    """A format of captures.

    Attributes:
        name: As it is given to ``--format``.
        title: Device or program that writes it.
        marks: Files by which it is known, for messages.
        source: Where the format is described.
        is_at: Tells whether a path is a capture of this format; opens no image.
        read: Reads it. Images are left for later.
    """

    name: str
    title: str
    marks: str
    source: str
    is_at: Callable[[Path], bool]
    read: Callable[[Path], Capture]


def capture_formats() -> dict[str, CaptureFormat]:
    """Return all formats by name: those of this package, then those of installed packages.

    Raises:
        InputError: Two have the same name, or an entry point does not load.
    """
    found = {}
    for module in OWN:
        own: CaptureFormat = importlib.import_module(f"synfeal.captures.{module}").FORMAT
        found[own.name] = own
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        try:
            other = entry.load()
        except (ImportError, AttributeError) as error:
            raise InputError(
                f"entry point {entry.name} of {GROUP}",
                f"does not load ({error})",
                "install its package again, or remove it",
            ) from error
        if not isinstance(other, CaptureFormat):
            raise InputError(
                f"entry point {entry.name} of {GROUP}",
                f"{entry.value} is no CaptureFormat",
                "name one after a colon, as in my_captures.cart:FORMAT",
            )
        if other.name in found:
            raise InputError(
                f"entry point {entry.name} of {GROUP}", f"a format {other.name} is there already"
            )
        found[other.name] = other
    return found


def is_capture(path: Path, besides: Collection[str] = ()) -> bool:
    """Tell whether a path is a capture in one of the formats, not counting some by name."""
    if not path.exists():
        return False
    return any(one.is_at(path) for one in capture_formats().values() if one.name not in besides)


def may_be_capture(path: Path) -> bool:
    """Tell whether a path that may be a mesh is a capture, or holds pictures that may be one."""
    return is_capture(path) or bool(_held(path))


def format_of(path: Path) -> CaptureFormat:
    """Find out which format a capture is in.

    Raises:
        InputError: It is in none, or in several.
    """
    if not path.exists():
        raise InputError(path, "is not there", "give the folder or file of a capture")
    formats = capture_formats()
    fitting = [one for one in formats.values() if one.is_at(path)]
    if not fitting:
        marks = "; ".join(f"{one.title}: {one.marks}" for one in formats.values())
        raise InputError(path, f"{_held(path)}is no capture that is known. {marks}")
    if len(fitting) > 1:
        names = " or ".join(one.name for one in fitting)
        raise InputError(path, f"may be a capture of {names}", "say which with `format`")
    return fitting[0]


def _held(path: Path) -> str:
    """Say that a folder holds pictures without the poses that make a capture of them."""
    if not path.is_dir():
        return ""
    try:
        folders = [path, *sorted(inner for inner in path.iterdir() if inner.is_dir())]
    except OSError:
        return ""  # not to be looked into
    counts = {folder: _pictures(folder) for folder in folders}
    found = [f"{n} in {folder.name}" for folder, n in counts.items() if n > 1]
    if not found:
        return ""
    return (
        f"holds pictures ({', '.join(found[:MOST_NAMED])}), but nothing known with their poses:"
        " estimate them first, for example with COLMAP, and give its model beside the pictures. It "
    )


def _pictures(folder: Path) -> int:
    try:
        return sum(file.suffix.lower() in PICTURES for file in folder.iterdir())
    except OSError:
        return 0  # not to be looked into


def read_capture(path: Path, name: str | None = None) -> Capture:
    """Read a capture.

    Args:
        path: Folder or file.
        name: Name of its format; None finds out.

    Raises:
        InputError: It is in no format that is known, or cannot be used as it is.
    """
    if name is None:
        return format_of(path).read(path)
    formats = capture_formats()
    if name not in formats:
        raise InputError(Argument("format"), f"{name} is none of {', '.join(formats)}")
    if not path.exists():
        raise InputError(path, "is not there", "give the folder or file of a capture")
    return formats[name].read(path)
