"""Transform from a data set's world to that of the sequence it was scanned from.

A scan stands upright (z up), the sequence it was fused from seldom does. ``world.json`` at the root
of a data set holds the rigid motion between the two, so that poses found in the one are comparable
with poses known in the other::

    {"sequence_from_world": [[...], [...], [...], [0, 0, 0, 1]]}
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError, read_as
from synfeal.geometry.rigid import is_rigid
from synfeal.records.files import read_json, write_json

WORLD = "world.json"
KEY = "sequence_from_world"


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
            f"{path}: {KEY} must be four rows of four numbers, a rotation and a translation above"
            " 0 0 0 1; make the scan or the data set again"
        )
    return matrix


def write_sequence_from_world(folder: Path, sequence_from_world: NDArray[np.float64]) -> None:
    """Write ``world.json`` of a data set.

    Args:
        folder: Root of the data set.
        sequence_from_world: Rigid motion (4, 4) from the data set's world to the sequence's.
    """
    write_json(folder / WORLD, {KEY: np.asarray(sequence_from_world, np.float64).tolist()})


def read_scan_record(mesh: Path) -> dict[str, Any] | None:
    """Read what ``synfeal scan`` wrote beside a mesh.

    Args:
        mesh: ``scan.glb``; the record is ``scan.json``.

    Returns:
        The record, with a rigid ``sequence_from_world``; None where the mesh is from elsewhere.

    Raises:
        InputError: The record's ``sequence_from_world`` is no rigid motion.
    """
    path = mesh.with_suffix(".json")
    try:
        record = read_json(path)
    except (OSError, ValueError):
        return None  # none, or a file of somebody else's
    if not isinstance(record, dict) or KEY not in record:
        return None
    rigid_motion_of(record, path)
    return record
