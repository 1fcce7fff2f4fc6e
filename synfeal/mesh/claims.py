"""Sizes stated in a mesh file, checked before memory is taken for them.

A few bytes of a header can ask for gigabytes: values that are stored nowhere, parts drawn a
thousand times, textures of one colour and enormous size.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from synfeal.errors import InputError
from synfeal.geometry.limits import FARTHEST_M
from synfeal.mesh.gltf import Json, listed
from synfeal.mesh.model import MeshPart, TexturedMesh

ITEM_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # by componentType
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# Values that glTF takes as 0 because nothing is stored: bases of morph targets, little else.
MOST_UNSTORED_BYTES = 2**28
SHORTEST_M = 1e-3  # length of a mesh; vertices 0.01 mm apart are merged
MOST_FACES = 10**8  # all instances together; they take 5 GB


def check_accessors(path: Path, header: Json) -> None:
    """Check that the values of a glTF are stored, but for a few.

    Args:
        path: The file, for the message.
        header: Its JSON, with everything decoded.

    Raises:
        InputError: It claims more values than it holds.
    """
    unstored = 0
    for index, accessor in enumerate(listed(header, "accessors")):
        count = accessor["count"]
        row = ITEM_BYTES[accessor["componentType"]] * WIDTHS[accessor["type"]]
        if "bufferView" not in accessor:
            unstored += abs(count) * row
            continue
        view = header["bufferViews"][accessor["bufferView"]]
        stride = view.get("byteStride", row)
        reach = accessor.get("byteOffset", 0) + (count - 1) * stride + row
        if not (count >= 0 and stride >= row and reach <= view["byteLength"]):
            raise InputError(
                path,
                f"accessor {index} claims {count} values, more than its buffer view holds",
                "export it again",
            )
    if unstored > MOST_UNSTORED_BYTES:
        raise InputError(
            path,
            f"claims {unstored / 1000000000.0:.1f} GB of values that it does not store",
            "export it again without morph targets",
        )


def check_extent(path: Path, part: MeshPart) -> None:
    """Check that no vertex of a part is so far away that nothing else could be told apart.

    Raises:
        InputError: One is.
    """
    farthest_m = float(np.abs(part.vertices_m).max(initial=0.0))
    if FARTHEST_M < farthest_m < np.inf:  # what is not finite is said elsewhere
        raise InputError(
            path,
            f"part '{part.name}' has a vertex {farthest_m:.3g} m from the origin",
            "remove it, or give the unit of the file with `unit_m`",
        )


def check_size(path: Path, mesh: TexturedMesh) -> None:
    """Check that a mesh is larger than what is taken for one point.

    Raises:
        InputError: It is smaller.
    """
    longest_m = float(np.ptp(mesh.bounds_m, axis=0).max())
    if longest_m < SHORTEST_M:
        raise InputError(
            path, f"is {longest_m:.3g} m long", "give the unit of the file with `unit_m`"
        )


def check_instances(path: Path, n_faces: int) -> None:
    """Check that all parts of a file together have a number of faces that memory can hold.

    Raises:
        InputError: They have more.
    """
    if n_faces > MOST_FACES:
        raise InputError(
            path,
            f"draws {n_faces} faces, its instances counted; at most {MOST_FACES} are read."
            " Simplify it, or export fewer copies",
        )


def check_textures(path: Path, n_pixels: int) -> None:
    """Check that the decoded textures of a file fit the memory of this machine.

    Raises:
        InputError: They do not.
    """
    needed, there = 4 * n_pixels, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > there:
        raise InputError(
            path,
            f"its textures take {needed / 1000000000.0:.1f} GB when decoded, this machine has"
            f" {there / 1000000000.0:.1f} GB",
            "make them smaller",
        )
