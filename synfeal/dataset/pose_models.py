"""Poses of COLMAP models and of kapture data sets.

Of a COLMAP model only ``images.txt`` or ``images.bin`` is needed, which hold the poses: people keep
these without the points they were found from. Other programs write the text with blanks in names,
or without the second line of each image.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_list import Convention, PoseList
from synfeal.errors import InputError, read_as
from synfeal.records.files import read_text
from synfeal.records.tables import is_number

Array = NDArray[np.float64]
COLMAP = Convention("cam_from_world", "wxyz")
TEXT, BINARY = MODELS = ("images.txt", "images.bin")
TRAJECTORIES, RECORDS = "trajectories.txt", "records_camera.txt"
NOT_UNIT = 0.1  # by which the length of a quaternion may be off, for a line to be one of a pose
MOST_NAME_BYTES = 4096


class NamedPose(NamedTuple):
    """A pose as a model holds it.

    Attributes:
        name: Name of the image.
        quat_wxyz: Four numbers of ``cam_from_world``.
        translation: Three numbers of ``cam_from_world``.
        place: Where it stands, for messages.
        camera: Number of its camera; 0 where the model has none.
    """

    name: str
    quat_wxyz: tuple[float, ...]
    translation: tuple[float, ...]
    place: str
    camera: int = 0


def read_colmap(folder: Path) -> PoseList:
    """Read the poses of a COLMAP model, as text or binary, but not both.

    Raises:
        InputError: It holds both, none, or is damaged.
    """
    both = [name for name in MODELS if (folder / name).is_file()]
    if len(both) > 1:
        raise InputError(folder, "holds images.txt and images.bin", "leave one of them")
    return _estimates("a COLMAP model", colmap_images(folder / both[0]))


def colmap_images(path: Path) -> list[NamedPose]:
    """List the images of a COLMAP model by name.

    The second lines in ``images.txt``, of points, may be there or not: people leave them out by
    mistake, and then COLMAP skips every other image. Its reader of binary files takes any number of
    points that a damaged file claims.

    Args:
        path: ``images.txt`` or ``images.bin``.

    Raises:
        InputError: It is damaged, or has no image with a pose.
    """
    poses = _text_poses(path) if path.name == TEXT else _binary_poses(path)
    if not poses:
        raise InputError(path, "this COLMAP model has no image with a pose")
    return sorted(poses, key=lambda pose: pose.name)


def _estimates(kind: str, poses: list[NamedPose]) -> PoseList:
    return PoseList(
        kind,
        COLMAP,
        tuple(pose.name for pose in poses),
        tuple(pose.place for pose in poses),
        np.array([pose.translation for pose in poses], np.float64),
        np.array([pose.quat_wxyz for pose in poses], np.float64),
    )


def _text_poses(path: Path) -> list[NamedPose]:
    with read_as(path, "a COLMAP model"):
        lines = read_text(path, "utf-8-sig").splitlines()
    found = []
    is_points = False  # whether the second line of an image is due
    for number, line in enumerate(lines, start=1):
        if line.lstrip().startswith("#"):
            continue
        pose = _pose_of_line(line, f"line {number}")
        if pose is not None:
            found.append(pose)
        elif line.strip() and not is_points:
            raise InputError(
                path, f"line {number} is no image: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"
            )
        is_points = pose is not None
    return found


def _pose_of_line(line: str, place: str) -> NamedPose | None:
    """Read the first line of an image; None where it lists points, or nothing."""
    cells = line.split(None, 9)
    if len(cells) < 10 or not all(is_number(cell) for cell in cells[:9]):
        return None
    if not (cells[0].isdecimal() and cells[8].isdecimal()):
        return None
    numbers = [float(cell) for cell in cells[1:8]]
    if not abs(float(np.linalg.norm(numbers[:4])) - 1.0) <= NOT_UNIT:
        return None
    quat_wxyz, translation = tuple(numbers[:4]), tuple(numbers[4:])
    return NamedPose(cells[9].strip(), quat_wxyz, translation, place, int(cells[8]))


def _binary_poses(path: Path) -> list[NamedPose]:
    with (
        read_as(path, "a COLMAP model", struct.error, OSError, ValueError, EOFError),
        path.open("rb") as file,
    ):
        size = path.stat().st_size
        (count,) = _unpacked(file, "<Q")
        if count * struct.calcsize("<I7dIBQ") > size:
            raise ValueError(f"it is too short for {count} images")
        return [_binary_pose(file, size) for _ in range(count)]


def _binary_pose(file: BinaryIO, size: int) -> NamedPose:
    image, *numbers, camera = _unpacked(file, "<I7dI")
    name = bytearray()
    while (byte := file.read(1)) != b"\0":
        if not byte or len(name) > MOST_NAME_BYTES:
            raise EOFError("a name does not end")
        name += byte
    (n_points,) = _unpacked(file, "<Q")
    end = file.tell() + 24 * n_points  # x, y and the point of each
    if end > size:
        raise EOFError(f"the points of image {image} are cut off")
    file.seek(end)
    text = name.decode("utf-8")
    quat_wxyz, translation = tuple(numbers[:4]), tuple(numbers[4:])
    return NamedPose(text, quat_wxyz, translation, f"image {text}", camera)


def _unpacked(file: BinaryIO, layout: str) -> tuple[Any, ...]:
    return struct.unpack(layout, file.read(struct.calcsize(layout)))


def is_kapture(text: str) -> bool:
    """Tell whether a text is kapture's trajectories, by the comments it begins with."""
    head = [line for line in text.splitlines()[:5] if line.startswith("#")]
    return any(re.match(r"#\s*kapture format", line) for line in head) or any(
        re.match(r"#\s*timestamp,\s*device_id,\s*qw", line) for line in head
    )


def read_kapture(path: Path) -> PoseList:
    """Read ``trajectories.txt`` of kapture, with the images that ``records_camera.txt`` names.

    Raises:
        InputError: One of the two is missing or damaged, or they have nothing in common.
    """
    records = path.with_name(RECORDS)
    if path.name == RECORDS:
        raise InputError(path, "names images, not poses", f"give {TRAJECTORIES} beside it")
    if not records.is_file():
        raise InputError(
            path,
            f"is kapture's, whose images {RECORDS} beside it names, which is missing",
            "copy it there",
        )
    images = {(cells[0], cells[1]): cells[2] for _, cells in _kapture_rows(records, 3)}
    poses = []
    for line, cells in _kapture_rows(path, 9):
        name = images.get((cells[0], cells[1]))
        if name is None:
            continue
        numbers = [float(cell) if is_number(cell) else float("nan") for cell in cells[2:]]
        poses.append(NamedPose(name, tuple(numbers[:4]), tuple(numbers[4:]), f"line {line}"))
    if not poses:
        raise InputError(
            path,
            f"none of its times and devices is of an image in {RECORDS}; poses of a rig (rigs.txt)"
            " are not read, give those of its cameras",
        )
    return _estimates("kapture trajectories", poses)


def _kapture_rows(path: Path, n_cells: int) -> Iterator[tuple[int, list[str]]]:
    with read_as(path, "a kapture table"):
        lines = read_text(path, "utf-8-sig").splitlines()
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.startswith("#"):
            continue
        cells = [cell.strip() for cell in line.split(",", n_cells - 1)]
        if len(cells) != n_cells:
            raise InputError(path, f"line {number} has {len(cells)} cells, kapture {n_cells}")
        yield number, cells
