"""Pictures that a person names, and the file that their poses are written to."""

from __future__ import annotations

import logging
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import HEIF_REMEDY, HEIF_SUFFIXES, image_size, reads_heif
from synfeal.dataset.sequence_listing import DEPTH, MASK, NORMAL, RIGHT_COLOR, RIGHT_DEPTH
from synfeal.errors import Argument, InputError
from synfeal.records.files import refuse_unwritable

SUFFIXES = (".png", ".jpg", ".jpeg", *HEIF_SUFFIXES)
# Pictures of other programs, which people expect to be read.
RAW_SUFFIXES = (".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2")
OTHER_SUFFIXES = (".webp", ".tif", ".tiff", ".bmp", ".gif", ".avif", ".jxl", ".jp2", *RAW_SUFFIXES)
# Images of a frame beside the one that its pose is of.
LAYERS = (DEPTH, NORMAL, MASK, RIGHT_COLOR, RIGHT_DEPTH)

log = logging.getLogger(__name__)


def find_pictures(named: Iterable[Path]) -> list[Path]:
    """List the files named and, in place of a directory, the pictures in it, sorted by name.

    Of a 7-Scenes sequence these are the colour images of the left camera. Pictures in a directory
    that are left out, because they cannot be read or lie in folders of it, are mentioned.

    Raises:
        InputError: Something named is not there, or a directory holds no picture.
    """
    found: list[Path] = []
    for path in named:
        if not (path.is_dir() or path.is_file()):
            raise InputError(path, "there is no such picture or directory")
        found += _in(path) if path.is_dir() else [path]
    return found


def _in(directory: Path) -> list[Path]:
    try:
        entries = sorted(directory.iterdir())
    except OSError as error:
        raise InputError(directory, f"cannot be listed ({error.strerror})") from error
    if any(directory.glob("seq-[0-9]*")):
        raise InputError(directory, "is a data set", f"name its sequences, {directory}/seq-01")
    files = [path for path in entries if path.is_file()]
    found = [path for path in files if _is_picture(path)]
    heif = [path for path in found if path.suffix.lower() in HEIF_SUFFIXES]
    if heif and not reads_heif():
        which = f"{len(heif)} of {len(found)} photographs are HEIC ({heif[0].name}, ...)"
        if len(heif) == len(found):
            raise InputError(directory, f"{which}, which needs pillow-heif: {HEIF_REMEDY}")
        log.warning("%s: %s and left out: %s", directory, which, HEIF_REMEDY)
        found = [path for path in found if path not in heif]
    left_out = _left_out(files, [path for path in entries if path.is_dir()])
    if not found:
        problem = "; ".join((f"holds no {', '.join(SUFFIXES)}", *left_out))
        raise InputError(directory, problem, "name another directory")
    for problem in left_out:
        log.warning("%s: %s", directory, problem)
    return found


def _is_picture(path: Path) -> bool:
    name = path.name.lower()
    is_layer = any(name.endswith(f".{kind}") for kind in LAYERS)
    return name.endswith(SUFFIXES) and not name.startswith(".") and not is_layer


def _left_out(files: Sequence[Path], folders: Sequence[Path]) -> list[str]:
    """Say which pictures of a directory are not among those that are found."""
    said = []
    others = Counter(path.suffix.lower() for path in files if path.suffix.lower() in OTHER_SUFFIXES)
    if others:
        counts = ", ".join(f"{count} {suffix}" for suffix, count in sorted(others.items()))
        said.append(f"{counts} left out, which are not read: convert them to PNG or JPEG")
    right = sum(path.name.lower().endswith(f".{RIGHT_COLOR}") for path in files)
    if right:
        said.append(f"{right} images of right cameras left out: name them one by one if meant")
    inner = [folder.name for folder in folders if _holds_pictures(folder)]
    if inner:
        names = f"'{inner[0]}'" if len(inner) == 1 else f"'{inner[0]}' and {len(inner) - 1} more"
        said.append(f"pictures in its folders are left out ({names}): name those folders, too")
    return said


def _holds_pictures(folder: Path) -> bool:
    if folder.name.startswith("."):
        return False
    try:
        return any(_is_picture(path) for path in folder.iterdir())
    except OSError:  # somebody else's
        return False


def refuse_mixed_sizes(camera: PhotographCamera, pictures: Iterable[FrameFile]) -> None:
    """Refuse one focal length in pixels for photographs of several sizes.

    Photographs held upright and lying have the same.

    Raises:
        InputError: Two photographs have different sizes, or one cannot be read.
    """
    if camera.source != "focal":
        return
    first: tuple[FrameFile, list[int]] | None = None
    for path in pictures:
        size = sorted(image_size(path), reverse=True)
        first = first or (path, size)
        if size != first[1]:
            raise InputError(
                Argument("focal_px"),
                f"{camera.focal_px:g} pixels is of one size of photographs, and {first[0]} has"
                f" {first[1][0]} x {first[1][1]} pixels, {path} {size[0]} x {size[1]}",
                "take those of each size alone, with their own focal length, or give a calibration"
                " as `camera`, which is scaled",
            )


def check_out(out: Path, inputs: Sequence[Path]) -> None:
    """Refuse a file for poses that cannot be written, or would be written over.

    Raises:
        InputError: It is a directory, one of the inputs, exists already, or cannot be written.
    """
    if out.is_dir():
        raise InputError(out, "is a directory", "name a file with `out`")
    if out.is_file() and any(path.exists() and out.samefile(path) for path in inputs):
        raise InputError(out, "is one of the inputs", "choose another file with `out`")
    refuse_unwritable(out)
    if os.path.exists(out):  # noqa: PTH110 (a link that leads nowhere can be written through)
        raise InputError(out, "exists", "delete it or choose another file with `out`")
