"""Measure the difference of two label sets of the same real frames, and how long it lasts.

    python -m benchmarks.label_differences results/benchmarks/label_differences.csv --poses pgt

compares the labels of 7-Scenes and 12-Scenes by depth tracking with those by structure from motion
(Brachmann et al., "On the Limits of Pseudo Ground Truth in Visual Camera Re-Localization", ICCV
2021; github.com/tsattler/visloc_pseudo_gt_limitations, folder ``pgt``). The table holds numbers and
no poses, whose licences are not ours. A row for each scene and each part of the difference that is
taken off first:

- ``nothing``: the files as they are;
- ``worlds``: a rigid motion of the whole scene, for a world as such is nobody's error (the mean
  rotation of all cameras, then the shift);
- ``worlds and cameras``: the constant motion between depth and colour camera as well, by the
  calibration of ``config/real.yaml``. 7-Scenes alone has labels of two cameras.
"""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from baselines.labels.alignment import fit
from reproduction.real.labels import motion_of, of_depth_camera
from synfeal.config.load import read_yaml
from synfeal.dataset.poses_in import read_pose_list
from synfeal.geometry.poses import position_error_m
from synfeal.records.tables import write_frame

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
CALIBRATION = Path("config/real.yaml")
TWO_CAMERAS = "7scenes"
LAGS = (1, 5, 25, 100)  # frames
NUMBER = re.compile(r"frame-(\d+)")


def read_scene(folder: Path, scene: str) -> dict[str, Array]:
    """Read ``world_from_cam`` (4, 4) of all frames of a scene, by name."""
    found: dict[str, Array] = {}
    for split in ("train", "test"):
        estimates = read_pose_list(folder / f"{scene}_{split}.txt")
        poses = estimates.world_from_cam(estimates.convention)
        found |= zip(estimates.names, poses, strict=True)
    return found


def difference(poses: Array, reference: Array) -> tuple[Array, Array]:
    """Return displacements (N, 3), metres, and rotation vectors (N, 3), radians, in the world.

    Args:
        poses: ``world_from_cam`` (N, 4, 4).
        reference: ``world_from_cam`` (N, 4, 4) of the same frames.
    """
    turned = poses[:, :3, :3] @ np.swapaxes(reference[:, :3, :3], 1, 2)
    rotvec_rad = Rotation.from_matrix(turned).as_rotvec()
    return poses[:, :3, 3] - reference[:, :3, 3], np.asarray(rotvec_rad, dtype=np.float64)


def frames_apart(
    sequence: NDArray[np.str_], number: NDArray[np.int64], lag: int
) -> tuple[Rows, Rows]:
    """Find pairs of frames of one sequence that are so many frames apart.

    Args:
        sequence: Name of the sequence of each frame (N,).
        number: Number of the frame in it (N,); some may be missing.
        lag: Frames from the first of a pair to the second.

    Returns:
        Places of the first frames, and of the second.
    """
    place = {key: row for row, key in enumerate(zip(sequence, number, strict=True))}
    pairs = [(row, place.get((name, count + lag))) for (name, count), row in place.items()]
    found = [(row, other) for row, other in pairs if other is not None]
    first, second = np.array(found, dtype=np.int64).reshape(-1, 2).T
    return first, second


def correlation(vectors: Array, first: Rows, second: Rows) -> float:
    """Correlate vectors (N, 3) around zero, all components together.

    Around zero and not around their mean, which would take off what a whole scene has in common.

    Args:
        vectors: Errors of all frames.
        first: Places of frames (M,).
        second: Places of the frames that they are compared with (M,).

    Returns:
        From -1 to 1; not a number where no frames are so far apart.
    """
    if not len(first):
        return math.nan
    a, b = vectors[first], vectors[second]
    return float((a * b).sum() / np.sqrt((a * a).sum() * (b * b).sum()))


def rows_of_scene(folder: Path, dataset: str, scene: str, camera: Array) -> Iterator[Any]:
    """Measure a scene, a row for each part of the difference that is taken off.

    Args:
        folder: Folder with ``sfm`` and ``dslam``.
        dataset: Folder of the scene in both.
        scene: Its name.
        camera: ``depth_from_color`` (4, 4).
    """
    by_images, by_depth = (
        read_scene(folder / source / dataset, scene) for source in ("sfm", "dslam")
    )
    names = sorted(by_images.keys() & by_depth.keys())
    given, reference = (np.array([of[n] for n in names]) for of in (by_images, by_depth))
    sequence = np.array([name.rpartition("/")[0] for name in names])
    number = np.array([int(NUMBER.findall(name)[-1]) for name in names])
    pairs = {lag: frames_apart(sequence, number, lag) for lag in LAGS}
    before, after = (reference[rows, :3, 3] for rows in pairs[25])
    moved_m = position_error_m(after, before)
    taken_off = {"nothing": given, "worlds": fit(given, reference, "rigid").place(given)}
    if dataset == TWO_CAMERAS:
        of_depth = of_depth_camera(given, camera)
        taken_off["worlds and cameras"] = fit(of_depth, reference, "rigid").place(of_depth)
    for removed, poses in taken_off.items():
        shift_m, rotvec_rad = difference(poses, reference)
        row: dict[str, Any] = {"dataset": dataset, "scene": scene, "removed": removed}
        row |= {"frames": len(names), "moved_m_in_25_frames": np.median(moved_m)}
        row["position_m"] = np.median(np.linalg.norm(shift_m, axis=1))
        row["orientation_deg"] = np.degrees(np.median(np.linalg.norm(rotvec_rad, axis=1)))
        for name, vectors in (("position", shift_m), ("orientation", rotvec_rad)):
            for lag in LAGS:
                row[f"{name}_correlation_{lag}"] = correlation(vectors, *pairs[lag])
        yield row


def main() -> None:
    """Measure every scene of both data sets and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--poses", type=Path, required=True, help="folder with sfm and dslam")
    args = parser.parse_args()
    camera = motion_of(read_yaml(CALIBRATION)["depth_from_color"])
    rows: list[Any] = []
    for dataset in ("7scenes", "12scenes"):
        for path in sorted((args.poses / "sfm" / dataset).glob("*_train.txt")):
            scene = path.stem.removesuffix("_train")
            rows += rows_of_scene(args.poses, dataset, scene, camera)
    write_frame(args.table, pd.DataFrame(rows), "%.4g")


if __name__ == "__main__":
    main()
