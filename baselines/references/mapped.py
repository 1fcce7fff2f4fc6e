"""A map of a place: features of posed frames with their depth, and descriptors for retrieval.

Depth is that of the frames where they have any, or triangulated (triangulated.py).

``synfeal map`` writes it, ``synfeal localize`` finds photographs in it (photographs.py). Nothing is
trained but the vocabulary of DenseVLAD. A map is a folder of plain files::

    map.json        format, camera, worlds, what it was built from
    frames.csv      poses of the frames, world_from_cam, with their names
    features.npz    features of the frames and their depth
    retrieval.npz   DenseVLAD of the frames, and its vocabulary
    repeats.npz     where frames look the same as others elsewhere (earlier maps have none)
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image
from pydantic import ValidationError

from baselines.references.arrays import Vectors, read_arrays, write_arrays
from baselines.references.descriptors import CHUNK, Vlad
from baselines.references.features import Features
from baselines.references.local_features import CONTRAST, MAX_FEATURES, LocalFeatures, Sift
from baselines.references.map_frames import MapFrames, MeshFile
from baselines.references.repeats import PosedFeatures, Repeats, find_repeats
from baselines.references.single_thread import single_thread
from baselines.references.triangulated import triangulated
from synfeal.camera.calibration import Calibration
from synfeal.camera.projection import normalised_of_pixels
from synfeal.config.dataset import CameraConfig
from synfeal.config.load import describe
from synfeal.config.types import Strict
from synfeal.dataset.depth_agreement import check_depth
from synfeal.dataset.packed import fit_frame
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.dataset.world import KEY, rigid_motion_of
from synfeal.errors import InputError, read_as
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.records.files import (
    atomic_directory,
    file_sha256,
    read_json,
    refuse_existing,
    refuse_inside,
    refuse_unwritable,
    write_json,
    writing_to,
)
from synfeal.records.progress import Progress
from synfeal.records.provenance import provenance
from synfeal.records.tables import read_records

Array = NDArray[np.float64]

FORMAT, VERSION = "synfeal map", 1
RECORD, FRAMES, FEATURES, RETRIEVAL = "map.json", "frames.csv", "features.npz", "retrieval.npz"
REPEATS = "repeats.npz"
# Whether the frames of a map are photographs; maps of earlier versions do not say.
PHOTOGRAPHS = "photographs"
VIEW_PX = 64  # side of what retrieval sees of a frame, squeezed into a square
FEWEST_FEATURES = 100  # in a map; fewer cannot find a photograph
REMEDY = "make the map again with synfeal map"


class Shown(Strict):
    """Frames of a map, as ``map.json`` describes them; earlier versions did not note the mesh."""

    camera: CameraConfig
    mesh_file: MeshFile | None = None


@dataclass(frozen=True)
class StructureMap:
    """A place as posed frames with features that have depth.

    Attributes:
        names: Names of the frames.
        world_from_cam: Their poses (N, 4, 4).
        camera: Camera of the frames.
        features: Features with depth.
        vectors: Unit vectors (N, D) to retrieve frames by.
        vlad: Describes a photograph by such a vector.
        sequence_from_world: Rigid motion (4, 4) to the world of the scanned sequence, if any.
        mesh_file: How the mesh that the frames were rendered of is to be read.
        record: Further entries of ``map.json``.
        repeats: Where frames look the same as others elsewhere; none where that was not searched.
    """

    names: tuple[str, ...]
    world_from_cam: Array
    camera: CameraConfig
    features: Features
    vectors: Vectors
    vlad: Vlad
    sequence_from_world: Array | None
    mesh_file: MeshFile
    record: dict[str, Any]
    repeats: Repeats = field(default_factory=Repeats.none)

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def point_m(self) -> Array:
        """Positions (K, 3) of the features in the world, metres."""
        return self.features.points_in_world_m(self.world_from_cam)

    @cached_property
    def quat_wxyz(self) -> Array:
        """Rotations of the frames (N, 4)."""
        return quat_wxyz_of(self.world_from_cam)


@single_thread()
def build_map(frames: MapFrames, out: Path, seed: int = 0) -> StructureMap:
    """Build a map of posed frames, and write it.

    Args:
        frames: The frames.
        out: Folder to write, which must not exist.
        seed: Seed of the vocabulary.

    Raises:
        InputError: An image cannot be read, depth and poses do not fit together, there are too few
            features, or ``out`` exists.
    """
    refuse_existing(out)
    refuse_inside(out, frames.source)
    refuse_unwritable(out)
    if frames.has_depth:
        check_depth(frames.posed_depth)
    began = time.perf_counter()
    features, views = read_frames(frames, Sift())
    _refuse_few(features, frames)
    vlad = Vlad.learn(views, seed)
    vectors = vlad.describe(views)
    if not frames.has_depth:
        focal_px = float(frames.camera.intrinsics[0])
        features = triangulated(features, frames.world_from_cam, vectors, focal_px)
    _refuse_few(features, frames)
    mapped_s = time.perf_counter() - began
    repeats = find_repeats(
        PosedFeatures(
            world_from_cam=frames.world_from_cam,
            camera=frames.camera,
            features=features,
            point_m=features.points_in_world_m(frames.world_from_cam),
            vectors=vectors,
        ),
        seed,
    )
    record = {
        "format": FORMAT,
        "version": VERSION,
        "frames": len(frames),
        "features": len(features.slope),
        "source": str(frames.source),
        PHOTOGRAPHS: frames.are_photographs,
        "rgbd_camera": frames.rgbd.record,
        "max_features": MAX_FEATURES,
        "contrast": CONTRAST,
        "seconds": round(mapped_s, 1),
        "look_alikes": len(repeats.frame),
        "repeats_seconds": round(time.perf_counter() - began - mapped_s, 1),
        "provenance": provenance(seed, "none"),
    }
    made = replace(map_of(frames, features, vectors, vlad), record=record, repeats=repeats)
    with writing_to(out, lambda: "choose another folder with `out`"):
        write_map(made, out)
    return made


def map_of(frames: MapFrames, features: Features, vectors: Vectors, vlad: Vlad) -> StructureMap:
    """Put a map together from what was found in its frames; look-alikes are not searched.

    Args:
        frames: The frames.
        features: Their local features.
        vectors: Their vectors (N, D) for retrieval.
        vlad: What these were computed by.
    """
    return StructureMap(
        names=frames.names,
        world_from_cam=frames.world_from_cam,
        camera=frames.camera,
        features=features,
        vectors=vectors,
        vlad=vlad,
        sequence_from_world=frames.sequence_from_world,
        mesh_file=frames.mesh_file,
        record={},
    )


def _refuse_few(features: Features, frames: MapFrames) -> None:
    """Refuse a map that cannot find a photograph."""
    if len(features.slope) >= FEWEST_FEATURES:
        return
    question = "is it dark, or without texture?"
    if not frames.has_depth:
        question = "is it dark, without texture, or does each photograph show something else?"
    raise InputError(
        frames.source,
        f"only {len(features.slope)} features with depth in {len(frames)} frames, a map needs"
        f" {FEWEST_FEATURES}; {question}",
    )


def read_frames(frames: MapFrames, kind: LocalFeatures) -> tuple[Features, NDArray[np.uint8]]:
    """Read the frames of a map.

    Args:
        frames: The frames.
        kind: Finds their local features.

    Returns:
        Features, with depth if frames have it, and views (N, 64, 64, 3) for retrieval.

    Raises:
        InputError: An image cannot be read.
    """
    views = np.empty((len(frames), VIEW_PX, VIEW_PX, 3), np.uint8)
    found = []
    with Progress(len(frames), "map") as progress:
        began = time.perf_counter()
        for index in range(len(frames)):
            image = frames.read_color(index)
            views[index] = fit_frame(Image.fromarray(image), VIEW_PX, "whole")
            grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
            pixel, descriptor = kind.detect(grey)
            slope = normalised_of_pixels(frames.camera, pixel)
            depth_m = np.zeros(len(slope))  # until it is triangulated
            if frames.has_depth:
                depth_m = frames.depth_at(frames.read_depth_m(index), slope)
            good = np.isfinite(depth_m) & np.isfinite(slope).all(axis=1)
            found.append((slope[good], depth_m[good], descriptor[good]))
            progress.update()
            if (index + 1) % CHUNK == 0:
                name = f"frame {index + 1} of {len(frames)}"
                progress.part_done(name, CHUNK, time.perf_counter() - began)
                began = time.perf_counter()
    slope, depth, descriptors = (np.concatenate(part) for part in zip(*found, strict=True))
    start = np.cumsum([0, *(len(part[1]) for part in found)]).astype(np.int64)
    return Features(start, slope, depth, descriptors), views


def write_map(made: StructureMap, out: Path) -> None:
    """Write a map; the folder appears when it is whole."""
    count = np.arange(len(made))
    pose = made.world_from_cam
    table = PoseTable(count, 0 * count, pose[:, :3, 3], quat_wxyz_of(pose))
    with atomic_directory(out) as folder:
        write_pose_table(folder / FRAMES, table, list(made.names))
        made.features.write(folder / FEATURES)
        vlad = made.vlad
        write_arrays(
            folder / RETRIEVAL,
            {
                "vectors": made.vectors,
                "words": vlad.words.numpy(),
                "mean": vlad.mean,
                "axes": vlad.axes,
            },
        )
        made.repeats.write(folder / REPEATS)
        sequence = made.sequence_from_world
        written = (FRAMES, FEATURES, RETRIEVAL, REPEATS)
        record = {
            **made.record,
            "camera": made.camera.record,
            "mesh_file": made.mesh_file.model_dump(),
            KEY: None if sequence is None else sequence.tolist(),
            "sha256": {name: file_sha256(folder / name) for name in written},
        }
        write_json(folder / RECORD, record)


def read_map(folder: Path) -> StructureMap:
    """Read a map.

    Raises:
        InputError: It is no map, of a later version, or damaged.
    """
    record, shown, sequence_from_world = _read_record(folder)
    table = read_pose_table(folder / FRAMES)
    names = tuple(row["image"] for _, row in read_records(folder / FRAMES, ("image",), REMEDY))
    features = Features.read(folder / FEATURES)
    stored = read_arrays(folder / RETRIEVAL, ("vectors", "words", "mean", "axes"))
    _check_shapes(folder, len(table), features, stored)
    repeats = _read_repeats(folder / REPEATS, len(table))
    return StructureMap(
        names=names,
        world_from_cam=table.world_from_cam,
        camera=shown.camera,
        features=features,
        vectors=stored["vectors"],
        vlad=Vlad(torch.from_numpy(stored["words"]), stored["mean"], stored["axes"]),
        sequence_from_world=sequence_from_world,
        mesh_file=shown.mesh_file or MeshFile(),
        record=record,
        repeats=repeats,
    )


def photographs_camera(folder: Path) -> Calibration | None:
    """Return the camera that took the frames of a map; None where they are renderings.

    Raises:
        InputError: It is no map.
    """
    record, shown, _ = _read_record(folder)
    return Calibration.of_camera(shown.camera) if record.get(PHOTOGRAPHS) is True else None


def _read_record(folder: Path) -> tuple[dict[str, Any], Shown, Array | None]:
    path = folder / RECORD
    if not path.is_file():
        raise InputError(folder, f"holds no {RECORD}", "give the folder that synfeal map wrote")
    with read_as(path, "the record of a map", remedy=f"; {REMEDY}"):
        record = read_json(path)
        if not isinstance(record, dict) or record.get("format") != FORMAT:
            raise ValueError(f"its format is not '{FORMAT}'")
    if record.get("version") != VERSION:
        raise InputError(
            path, f"version: {record.get('version')!r} is not read, only {VERSION}", REMEDY
        )
    try:
        shown = Shown.model_validate({key: record.get(key) for key in Shown.model_fields})
    except ValidationError as error:
        raise InputError(path, describe(error), REMEDY) from error
    sequence_from_world = None if record.get(KEY) is None else rigid_motion_of(record, path)
    return record, shown, sequence_from_world


def _read_repeats(path: Path, n_frames: int) -> Repeats:
    """Read the repeats of a map; none where it is of a version that did not search them."""
    if not path.is_file():
        return Repeats.none()
    repeats = Repeats.read(path)
    if not repeats.fits(n_frames):
        raise InputError(path, f"is not of the frames of {FRAMES}", REMEDY)
    return repeats


def _check_shapes(
    folder: Path, n_frames: int, features: Features, stored: dict[str, NDArray[Any]]
) -> None:
    """Refuse files that are not of one map."""
    starts = features.start
    count = len(features.slope)
    whole = (
        starts.shape == (n_frames + 1,)
        and starts[0] == 0
        and starts[-1] == count
        and bool((np.diff(starts) >= 0).all())
        and features.slope.shape == (count, 2)
        and features.depth_m.shape == (count,)
        and features.descriptor.shape == (count, 128)
    )
    if not whole:
        raise InputError(folder / FEATURES, f"is not of the frames of {FRAMES}", REMEDY)
    words, mean, axes = stored["words"], stored["mean"], stored["axes"]
    fits = (
        words.ndim == 2
        and words.shape[1] == 128
        and mean.shape == (words.size,)
        and axes.ndim == 2
        and len(axes) == words.size
        and stored["vectors"].shape == (n_frames, axes.shape[1])
    )
    if not fits:
        raise InputError(folder / RETRIEVAL, f"is not of the frames of {FRAMES}", REMEDY)
