"""The poses of an earlier data set once more: the simulator's mode ``repeat``."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.pose_table import PoseTable, check_places, read_pose_table
from synfeal.dataset.poses_in import read_trajectory
from synfeal.dataset.sequence_listing import POSE, list_sequence
from synfeal.dataset.sevenscenes import SPLIT_FILES, read_pose, read_split
from synfeal.errors import InputError
from synfeal.geometry.axes import DESCRIPTIONS
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.geometry.rigid import refuse_non_rigid
from synfeal.geometry.rotations import canonical_quat_wxyz, matrix_from_quat_wxyz

MOSTLY = 0.9  # share of the cameras

log = logging.getLogger("synfeal")


def repeated_poses(
    source: Path, split: str, n_frames: int, mesh_bounds_m: NDArray[np.float64]
) -> PoseTable:
    """Read the first poses of a split of an earlier data set.

    Logs a warning if some lie outside the mesh.

    Args:
        source: Whatever :func:`read_poses` reads.
        split: ``train`` or ``test``.
        n_frames: Number of poses.
        mesh_bounds_m: Lower and upper corner (2, 3) of the mesh, world, metres.

    Raises:
        InputError: The source has fewer poses.
    """
    table = read_poses(source, split)
    if len(table) < n_frames:
        raise InputError(source, f"holds {len(table)} {split} poses; {n_frames} are asked for")
    table = table.first(n_frames)
    _warn_of_heads(source, table)
    lower, upper = mesh_bounds_m
    inside = ((table.position_m >= lower) & (table.position_m <= upper)).all(axis=1)
    if not inside.all():
        where = ", ".join(f"{value:.2f}" for value in table.position_m[np.argmin(inside)])
        log.warning(
            "%s: %d of %d poses lie outside the mesh, the first at (%s) m; check `unit_m` and"
            " `up_axis`",
            source,
            np.sum(~inside),
            n_frames,
            where,
        )
    return table


def _warn_of_heads(source: Path, table: PoseTable) -> None:
    """Warn where nearly all cameras stand on their heads, as OpenGL's do if taken as ours."""
    upside_down = matrix_from_quat_wxyz(table.quat_wxyz)[:, 2, 1] > 0  # y of the camera, down
    if np.mean(upside_down) >= MOSTLY:
        log.warning(
            "%s: %d of %d cameras stand on their heads; if their axes are %s, multiply each pose by"
            " diag(1, -1, -1, 1) from the right",
            source,
            np.sum(upside_down),
            len(table),
            DESCRIPTIONS["opengl"],
        )


def read_poses(source: Path, split: str) -> PoseTable:
    """Read poses ``world_from_cam`` of a split (``train`` or ``test``), numbered from 0.

    ``source`` is a data set of :mod:`synfeal.collection.run`, a 7-Scenes data set, a directory
    of its frames (``frame-XXXXXX.pose.txt``), a pose table (``.csv``) or a trajectory in the
    format of the TUM benchmark (``.txt``). The last three hold one list of poses, which is the
    training split. Each sequence and each trajectory is one path, where no table says otherwise.

    Raises:
        InputError: ``source`` is nothing of these, or has no such split.
    """
    if (source / f"{split}.csv").is_file():
        return read_pose_table(source / f"{split}.csv")
    if (source / SPLIT_FILES[split]).is_file():
        return _read_frames(read_split(source, split), source)
    if split != "train":
        raise InputError(
            source,
            "holds one list of poses, which is for training frames; for others name a directory"
            " with train.csv and test.csv, or with TrainSplit.txt and TestSplit.txt",
        )
    if source.is_dir():
        return _read_frames([source], source)
    if source.suffix == ".csv":
        return _read_table(source)
    if source.suffix == ".txt":
        return _read_tum(source)
    raise InputError(source, "must be a directory, a .csv pose table or a .txt TUM trajectory")


def _read_table(path: Path) -> PoseTable:
    """Read a pose table of one's own, numbered anew: nothing is paired with its rows."""
    table = read_pose_table(path, any_frames=True)
    check_places(table.position_m, path, np.arange(len(table)) + 2)
    return PoseTable(np.arange(len(table)), table.path, table.position_m, table.quat_wxyz)


def _read_frames(directories: list[Path], source: Path) -> PoseTable:
    """Read the poses of 7-Scenes sequences, each a path."""
    if not directories:
        raise InputError(source, "the list of its sequences is empty")
    files = [list_sequence(directory).files(POSE) for directory in directories]
    for directory, sequence in zip(directories, files, strict=True):
        if not sequence:
            raise InputError(directory, f"holds no frame-XXXXXX.{POSE}", "render it again")
    poses = np.array([_rigid(path) for sequence in files for path in sequence])
    path = np.repeat(np.arange(len(files)), [len(sequence) for sequence in files])
    return PoseTable(np.arange(len(poses)), path, poses[:, :3, 3].copy(), quat_wxyz_of(poses))


def _rigid(path: FrameFile) -> NDArray[np.float64]:
    """Read a pose (4, 4) that is a rotation and a translation."""
    pose = read_pose(path)
    refuse_non_rigid(pose, path)
    return pose


def _read_tum(path: Path) -> PoseTable:
    """Read a TUM trajectory, all of it one path."""
    found = read_trajectory(path)
    index = np.arange(len(found))
    return PoseTable(
        index, np.zeros_like(index), found.position_m, canonical_quat_wxyz(found.quat_wxyz)
    )
