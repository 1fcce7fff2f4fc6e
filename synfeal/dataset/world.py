"""Transform from a data set's world to that of the sequence it was scanned from.

A scan stands upright (z up), the sequence it was fused from seldom does. ``world.json`` at the root
of a data set holds the rigid motion between the two, so that poses found in the one are comparable
with poses known in the other::

    {"sequence_from_world": [[...], [...], [...], [0, 0, 0, 1]]}

The data set takes it from the scan, which holds it in its own file and in ``scan.json``.
"""

from __future__ import annotations

import logging
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError, read_as
from synfeal.geometry.rigid import is_rigid
from synfeal.mesh.gltf import glb_extras
from synfeal.records.files import file_sha256, read_json, write_json

WORLD = "world.json"
KEY = "sequence_from_world"
SCAN = "synfeal_scan"  # among the extras of a scan's glTF
MESH_SHA256 = "mesh_sha256"

log = logging.getLogger("synfeal")


def read_sequence_from_world(folder: Path) -> NDArray[np.float64] | None:
    """Read how the sequence's world follows from that of a data set.

    Args:
        folder: Root of the data set.

    Returns:
        ``sequence_from_world`` (4, 4), or None where the data set has no ``world.json``.

    Raises:
        InputError: The file holds no rigid motion.
    """
    path = folder / WORLD
    if not os.path.lexists(path):
        return None
    with read_as(path, "JSON"):
        record = read_json(path)
    return rigid_motion_of(record, path)


def rigid_motion_of(record: Any, path: Path) -> NDArray[np.float64]:
    """Take ``sequence_from_world`` (4, 4) from what a file holds.

    Args:
        record: Parsed JSON.
        path: The file, for messages.

    Raises:
        InputError: It is missing or not a rigid motion.
    """
    try:
        matrix = np.array(record[KEY], dtype=np.float64)
    except (KeyError, TypeError, ValueError):
        matrix = np.empty(0)
    if not is_rigid(matrix):
        raise InputError(
            path,
            f"{KEY} must be four rows of four numbers, a rotation and a translation above 0 0 0 1",
            "make the scan or the data set again",
        )
    return matrix


def write_sequence_from_world(folder: Path, sequence_from_world: NDArray[np.float64]) -> None:
    """Write ``world.json`` of a data set.

    Args:
        folder: Root of the data set.
        sequence_from_world: Rigid motion (4, 4) from the data set's world to the sequence's.
    """
    write_json(folder / WORLD, {KEY: np.asarray(sequence_from_world, np.float64).tolist()})


@dataclass(frozen=True)
class ScanRecord:
    """Notes of ``synfeal scan`` about a mesh.

    Attributes:
        source: File that the record stands in, for messages.
        values: The record, as ``scan.json`` has it.
    """

    source: Path
    values: dict[str, Any]

    @property
    def sequence_from_world(self) -> NDArray[np.float64]:
        """Rigid motion (4, 4) from the world of the mesh to that of the sequence.

        Raises:
            InputError: It is no rigid motion.
        """
        return rigid_motion_of(self.values, self.source)


def read_scan_record(mesh: Path) -> ScanRecord | None:
    """Read what ``synfeal scan`` noted of a mesh, whatever the mesh is called now.

    The record stands in the mesh itself. Scans of earlier versions, and those that another program
    has saved anew, have it in ``scan.json`` beside ``scan.glb`` alone.

    Args:
        mesh: ``scan.glb``, renamed, copied, or a link to it.

    Returns:
        The record, with a rigid ``sequence_from_world``; None where the mesh is from elsewhere.

    Raises:
        InputError: The record's ``sequence_from_world`` is no rigid motion.
    """
    inside = glb_extras(mesh).get(SCAN)
    is_inside = isinstance(inside, dict) and KEY in inside
    found = ScanRecord(mesh, inside or {}) if is_inside else _record_beside(mesh)
    if found is not None:
        _ = found.sequence_from_world  # refused here, not where it is used
    return found


def _record_beside(mesh: Path) -> ScanRecord | None:
    """Read the JSON file of the same name as a mesh, or as the mesh that a link leads to."""
    for path in dict.fromkeys((mesh, Path(os.path.realpath(mesh)))):
        beside = path.with_suffix(".json")
        try:
            values = read_json(beside)
        except (OSError, ValueError):
            continue  # none, or a file of somebody else's
        if isinstance(values, dict) and KEY in values:
            _warn_of_another(mesh, beside, values)
            return ScanRecord(beside, values)
    return None


def _warn_of_another(mesh: Path, beside: Path, values: dict[str, Any]) -> None:
    """Say where a mesh is not the one that the record beside it was written with."""
    written = values.get(MESH_SHA256)
    if written is None or not mesh.is_file() or written == file_sha256(mesh):
        return
    log.warning(
        "%s: is not the mesh that %s was written with; its world is taken to be that one, which is"
        " right of a scan that was only edited; delete the .json if it is of another scan",
        mesh,
        beside.name,
    )
