"""Files of normals and masks, and the table that names the values of masks.

``frame-000000.normal.png``: 8-bit RGB. A unit normal (x, y, z) in the frame of the camera (x right,
y down, z forward), facing the camera, is stored as ``round(127 * n) + 128``, which is 1 to 255;
0 0 0 is where nothing was hit. Rounding turns a normal by 0.39 degrees at most, and normals along
the axes not at all.

``frame-000000.mask.png``: 16-bit grey, the number of an instance; 0 is where nothing was hit.
``masks.json`` names the instances.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import read_image
from synfeal.effects.scene import placed_objects
from synfeal.errors import Argument, InputError, read_as
from synfeal.mesh.instances import Instance, number_instances
from synfeal.mesh.model import TexturedMesh
from synfeal.records.files import read_json, write_json
from synfeal.render.surface import Ids, Normals

MASKS = "masks.json"
SCALE, MIDDLE = 127, 128  # how normals are stored
MOST_IDS = 65535
ENCODING = {
    "normals": "8-bit RGB: x right, y down, z forward of the camera, facing it, as"
    " round(127 * n) + 128; 0 0 0 nothing",
    "masks": f"16-bit: the id of an instance ({MASKS}); 0 nothing",
}


def normal_pixels(normals_cam: Normals) -> NDArray[np.uint8]:
    """Encode unit normals (H, W, 3), 0 0 0 for nothing, as pixels."""
    pixels = np.round(SCALE * normals_cam).astype(np.int16) + MIDDLE
    return np.where(normals_cam.any(axis=-1, keepdims=True), pixels, 0).astype(np.uint8)


def normals_of_pixels(pixels: NDArray[np.uint8]) -> Normals:
    """Decode pixels (H, W, 3) to normals of length 1, or 0 0 0 for nothing."""
    normals = pixels.astype(np.float32) - MIDDLE
    normals[~pixels.any(axis=-1)] = 0.0
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.asarray(normals / np.where(length > 0.0, length, 1.0), np.float32)


def mask_pixels(ids: Ids) -> NDArray[np.uint16]:
    """Encode numbers of instances (H, W) as pixels."""
    return ids.astype(np.uint16)


def read_normals(path: FrameFile) -> Normals:
    """Read unit normals (H, W, 3) in the frame of the camera, 0 0 0 for nothing.

    Raises:
        InputError: The file is missing, damaged, or no 8-bit colour image.
    """
    image = read_image(path)
    if image.mode != "RGB":
        raise InputError(path, f"must be an 8-bit RGB image of normals, not of mode {image.mode}")
    return normals_of_pixels(np.asarray(image))


def read_mask(path: FrameFile) -> NDArray[np.uint16]:
    """Read numbers of instances (H, W), 0 for nothing.

    Raises:
        InputError: The file is missing, damaged, or no 16-bit grey image.
    """
    image = read_image(path)
    if not image.mode.startswith("I"):
        raise InputError(path, f"must be a 16-bit grey image of ids, not of mode {image.mode}")
    return np.asarray(image).astype(np.uint16)


def refuse_many_instances(mesh: TexturedMesh, most_objects: int, name: str) -> None:
    """Check that the numbers of all instances fit into masks.

    Args:
        mesh: What masks are made of.
        most_objects: Objects that stand in it at one time.
        name: The file, for messages.

    Raises:
        InputError: They do not.
    """
    if len(mesh.parts) + most_objects > MOST_IDS:
        raise InputError(
            Argument("masks"),
            f"{name} has {len(mesh.parts)} parts, and 16-bit masks tell {MOST_IDS} apart",
            "join its parts, or leave masks out",
        )


def write_instances(mesh_path: Path, mesh: TexturedMesh, out: Path, path_objects: bool) -> None:
    """Write the table of instances, ``masks.json``.

    Args:
        mesh_path: Mesh of the scene; ``clutter.json`` beside it lists what was placed in it.
        mesh: The same, loaded.
        out: File to write.
        path_objects: Whether other objects stand along each path, which tables of objects number.
    """
    listed = number_instances(mesh, placed_objects(mesh_path)).listed
    record: dict[str, Any] = {"instances": [instance._asdict() for instance in listed]}
    if path_objects:
        record["path_objects"] = {"first_id": len(listed) + 1, "tables": "<split>.objects.csv"}
    write_json(out, record)


class InstanceTable(dict[int, Instance]):
    """Instances by number.

    Attributes:
        first_path_id: Smallest number of objects that differ from path to path, None without them.
    """

    first_path_id: int | None = None

    def knows(self, ids: NDArray[Any]) -> NDArray[np.bool_]:
        """Check which values (N,) of masks stand for something, or for nothing."""
        known = np.isin(ids, [0, *self])
        if self.first_path_id is not None:
            known |= ids >= self.first_path_id
        return known


def read_instances(dataset: Path) -> InstanceTable:
    """Read ``masks.json`` of a data set.

    Raises:
        InputError: It is missing or damaged.
    """
    path, damage = dataset / MASKS, (OSError, ValueError, TypeError, LookupError)
    with read_as(path, "the table of instances", *damage, remedy="; collect the data set again"):
        record = read_json(path)
        table = InstanceTable()
        for row in record["instances"]:
            instance = Instance(**row)
            if type(instance.id) is not int or instance.id in table or instance.id < 1:
                raise ValueError(f"id {instance.id!r} is no number of its own")
            table[instance.id] = instance
        if "path_objects" in record:
            table.first_path_id = int(record["path_objects"]["first_id"])
    return table
