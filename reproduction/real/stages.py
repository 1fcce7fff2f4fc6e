"""Stages of the profile ``real`` that are not commands: parts, prefixes, references, coverage."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from baselines.references.arrays import most_alike
from baselines.references.descriptors import thumbnails
from baselines.references.retrieval import nearest_rows
from reproduction.real.design import SFM
from reproduction.real.labels import (
    gauge_between,
    label_difference,
    motion_of,
    of_depth_camera,
    read_sfm_labels,
    relabelled,
)
from reproduction.real.split import (
    full_name,
    place_frames,
    split_frames,
    spread,
    write_frames,
    write_truth,
)
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import read_image
from synfeal.dataset.known_camera import camera_of_dataset
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.packed import fit_frame
from synfeal.dataset.pose_table import COLUMNS, IMAGE, PoseTable, read_pose_table, write_pose_table
from synfeal.dataset.posed_sequence import PosedFrames, read_posed_sequence
from synfeal.dataset.sevenscenes import SPLIT_FILES, frame_paths, read_split
from synfeal.dataset.world import WORLD, read_scan_record, rigid_motion_of
from synfeal.geometry.poses import inverse, quat_wxyz_of
from synfeal.mesh.load import load_mesh
from synfeal.planning.like import resized
from synfeal.records.files import atomic_directory, read_json, write_json, write_text
from synfeal.records.progress import Progress
from synfeal.records.tables import write_numbers
from synfeal.render.choose import open_renderer
from synfeal.scanning.picture import compare, write_picture

Array = NDArray[np.float64]
POSES = ",".join((IMAGE, *COLUMNS[2:]))
THUMBNAIL_SOURCE_PX = 64
COVER_WIDTH_PX = 80


def write_part(
    sequence: Path,
    sequence_name: str,
    sfm_labels: tuple[Path, ...],
    depth_from_color: tuple[float, ...],
    direction: str,
    labels: str,
    photographs: int | None,
    out_train: Path,
    out_test: Path,
    out_given: Path,
    out_sfm: Path,
    out_difference: Path,
) -> None:
    """Lay out the photographs of a part: those to scan, those to localize, labels of the latter.

    Args:
        sequence: Folder of a scene, or of a sequence.
        sequence_name: What labels call it where it is a single one.
        sfm_labels: Files of labels by SfM; none where there are none.
        depth_from_color: Rotation vector, degrees, and translation, metres, between the cameras.
        direction: Which photographs are which.
        labels: Source of the labels that photographs are written with.
        photographs: How many are to be scanned; None for all.
        out_train: Folder of ``seq-XX`` with photographs to scan.
        out_test: The same, to localize.
        out_given: Poses of the latter as the sequence gives them.
        out_sfm: Poses by SfM in the world of the given ones; those again where there are none.
        out_difference: How far the two are apart, on the photographs to localize.
    """
    train, test = split_frames(sequence, direction)
    train = spread(train, photographs)
    write_truth(test, sequence_name, out_given)
    sfm_train, sfm_test, difference = train, test, {}
    if sfm_labels:
        found = read_sfm_labels(sfm_labels)
        motion = motion_of(depth_from_color)
        sfm_train, sfm_test = (
            _by_sfm(frames, sequence_name, found, motion) for frames in (train, test)
        )
        gauge = gauge_between(sfm_train.world_from_cam, train.world_from_cam)
        difference = label_difference(test.world_from_cam, sfm_test.world_from_cam, gauge)
        sfm_train, sfm_test = (
            replace(frames, world_from_cam=gauge.to_from_other @ frames.world_from_cam)
            for frames in (sfm_train, sfm_test)
        )
    write_truth(sfm_test, sequence_name, out_sfm)
    write_json(out_difference, difference)
    chosen = (sfm_train, sfm_test) if labels == SFM else (train, test)
    for frames, out in zip(chosen, (out_train, out_test), strict=True):
        write_frames(frames, sequence_name, out)


def _by_sfm(
    frames: PosedFrames, sequence_name: str, labels: dict[str, Array], depth_from_color: Array
) -> PosedFrames:
    """Return photographs with labels by SfM, moved to the depth camera."""
    names = [full_name(name, sequence_name) for name in frames.names]
    found = relabelled(frames, names, labels)
    return replace(found, world_from_cam=of_depth_camera(found.world_from_cam, depth_from_color))


def write_prefix(dataset: Path, frames: int, out_dataset: Path) -> None:
    """Make a data set of the first training frames of another; images are links.

    Args:
        dataset: Data set by ``synfeal collect``.
        frames: Number of training frames to keep.
        out_dataset: Folder of the new data set.
    """
    with atomic_directory(out_dataset) as out:
        left, listed = frames, []
        for sequence in read_split(dataset, "train"):
            found = read_posed_sequence(sequence)
            taken = found[: min(left, len(found))]
            if len(taken):
                place_frames(taken, sequence.stem, out)
                listed.append(f"sequence{int(sequence.stem.removeprefix('seq-'))}\n")
            left -= len(taken)
        write_text(out / SPLIT_FILES["train"], "".join(listed))
        write_text(out / SPLIT_FILES["test"], "")
        write_pose_table(out / "train.csv", read_pose_table(dataset / "train.csv").first(frames))
        write_json(out / WORLD, read_json(dataset / WORLD))
        write_json(out / MANIFEST, read_json(dataset / MANIFEST))


def write_references(
    rendered: Path,
    train: Path,
    test: Path,
    truth: Path,
    out_retrieval: Path,
    out_nearest: Path,
    out_mean: Path,
) -> None:
    """Write poses that need no localizer, in the world of the sequence.

    Args:
        rendered: Data set of the scan.
        train: Photographs of the scan.
        test: Photographs to localize.
        truth: Their poses.
        out_retrieval: For each, the pose of the rendered frame that looks most alike, by thumbnail.
        out_nearest: For each, the rendered pose that is nearest to the true one: an oracle.
        out_mean: The mean pose of the photographs of the scan.
    """
    photographs = read_posed_sequence(test)
    images = [str(path) for path in photographs.color]
    motion = rigid_motion_of(read_json(rendered / WORLD), rendered / WORLD)
    poses = motion @ read_pose_table(rendered / "train.csv").world_from_cam
    frames = frame_paths(read_split(rendered, "train"), "color.png")
    vectors = [thumbnails(_small(files)) for files in (frames, list(photographs.color))]
    alike = most_alike(vectors[0], vectors[1], 1)[:, 0]
    _write_poses(out_retrieval, images, poses[alike])
    rows = nearest_rows(_table(poses), read_pose_table(truth))
    _write_poses(out_nearest, images, poses[rows])
    mean = mean_pose(read_posed_sequence(train).world_from_cam)
    _write_poses(out_mean, images, np.broadcast_to(mean, (len(images), 4, 4)))


def mean_pose(world_from_cam: Array) -> Array:
    """Average poses (N, 4, 4): mean position and chordal mean rotation, as one pose (4, 4)."""
    left, _, right = np.linalg.svd(world_from_cam[:, :3, :3].sum(axis=0))
    mean = np.eye(4)
    mean[:3, :3] = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    mean[:3, 3] = world_from_cam[:, :3, 3].mean(axis=0)
    return mean


def _small(files: list[FrameFile]) -> NDArray[np.uint8]:
    side = THUMBNAIL_SOURCE_PX
    return np.stack([fit_frame(read_image(file, "RGB"), side, "whole") for file in files])


def _table(world_from_cam: Array) -> PoseTable:
    count = len(world_from_cam)
    return PoseTable(
        frame=np.arange(count),
        path=np.zeros(count, np.int64),
        position_m=world_from_cam[:, :3, 3],
        quat_wxyz=quat_wxyz_of(world_from_cam),
    )


def _write_poses(out: Path, images: list[str], world_from_cam: Array) -> None:
    values = np.hstack([world_from_cam[:, :3, 3], quat_wxyz_of(world_from_cam)]).tolist()
    write_numbers(out, POSES, [[image, *row] for image, row in zip(images, values, strict=True)])


def write_cover(scan: Path, test: Path, out_cover: Path) -> None:
    """Write what share of each photograph's pixels the scan covers, seen from the true pose.

    Args:
        scan: Mesh by ``synfeal scan``, with its record beside it.
        test: Folder of the photographs to localize.
        out_cover: CSV to write: image and share, 0 to 1.
    """
    photographs = read_posed_sequence(test)
    camera = scan_camera(scan, COVER_WIDTH_PX)
    poses = _in_scan(scan, photographs)
    shares = []
    with (
        open_renderer(load_mesh(scan), camera, RenderConfig()) as renderer,
        Progress(len(poses), "cover") as progress,
    ):
        for pose in poses:
            shares.append(float(np.isfinite(renderer.render_rgbd(pose)[1]).mean()))
            progress.update()
    write_numbers(out_cover, f"{IMAGE},covered", zip(photographs.names, shares, strict=True))


def write_comparison(scan: Path, test: Path, out_picture: Path) -> None:
    """Draw some photographs that were not scanned, renderings from their poses, and both overlaid.

    Args:
        scan: Mesh by ``synfeal scan``, with its record beside it.
        test: Folder of the photographs to localize; up to 8 of them are shown, evenly chosen.
        out_picture: Picture to write.
    """
    photographs = read_posed_sequence(test)
    count = min(8, len(photographs))
    step = len(photographs) // count
    chosen = photographs[:: max(step, 1)]
    camera = scan_camera(scan, None)
    compared = compare(load_mesh(scan), chosen, _in_scan(scan, chosen), camera)
    write_picture(compared, f"{scan.parent.name}: photographs that were not scanned", out_picture)


def scan_camera(scan: Path, width: int | None) -> CameraConfig:
    """Read the camera of the photographs that a scan was made of, for images of some width."""
    camera = camera_of_dataset(scan.parent, scan.with_suffix(".json")).config
    return camera if width is None else resized(camera, width, None)


def _in_scan(scan: Path, photographs: PosedFrames) -> Array:
    record = read_scan_record(scan)
    assert record is not None, f"{scan}: not of synfeal scan"
    return inverse(record.sequence_from_world) @ photographs.world_from_cam
