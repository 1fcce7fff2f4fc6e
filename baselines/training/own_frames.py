"""Frames of a person's own data sets, packed for training.

A data set is one that ``synfeal collect`` wrote, of which the training split is learned from and
the test split scored, or a sequence of photographs with poses (see
:mod:`synfeal.dataset.posed_sequence`). Several are joined:
all poses are taken to the world of the first, and photographs of a known camera to that of the
rendered frames.
"""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from baselines.config.learning import NetworkConfig
from baselines.training.checkpoint import FrameCamera
from baselines.training.resample import Resampler, same_view
from synfeal.camera.calibration import Calibration
from synfeal.camera.orientation import (
    Orientation,
    Upright,
    stored_from_upright,
    turned,
    upright,
)
from synfeal.camera.photograph import PhotographCamera
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import MILLIMETRES
from synfeal.dataset.depth_agreement import check_depth
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import image_size, read_image
from synfeal.dataset.known_camera import camera_of_dataset
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.packed import fit_frame, new_packed
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.dataset.posed_sequence import PosedFrames, is_tum, read_posed_sequence
from synfeal.dataset.sevenscenes import SPLIT_FILES, Split, read_split
from synfeal.dataset.world import read_sequence_from_world
from synfeal.errors import Argument, InputError, read_as
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.records.files import file_sha256, read_json, write_json
from synfeal.records.progress import Progress
from synfeal.scanning.camera import TUM_UNITS_PER_M, RgbdCamera, posed_depth

log = logging.getLogger(__name__)

Array = NDArray[np.float64]
# Photographs have no paths: a sequence is cut into so many blocks of neighbours, which are held out
# or learned from as a whole.
BLOCKS = 10
READERS = 4  # threads; files are decoded outside of Python's lock


@dataclass(frozen=True)
class FrameRange:
    """Frames ``start`` to ``stop`` (exclusive) of a sequence of photographs, from 0."""

    start: int
    stop: int

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.stop:
            raise InputError(
                Argument("range"),
                f"{self.start} {self.stop} holds no frame",
                "give the first frame, from 0, and one past the last",
            )


@dataclass(frozen=True)
class OwnFrames:
    """Training frames of one data set.

    Attributes:
        folder: Folder of the data set.
        color: Image of each frame.
        depth: Depth image of each frame; None where a frame has none.
        world_from_cam: Poses (N, 4, 4) in the data set's own world.
        path: Index (N,) of the path of each frame, from 0: what is held out as a whole.
        camera: Perspective camera of the frames, where the data set says so; None for photographs.
        wide: Camera that the data set says, where it is a fisheye or a panorama.
        is_rendered: Whether they are the training split of a data set of ``synfeal collect``.
        sequence_from_world: Motion (4, 4) to the world of the sequence scanned, where it differs.
        scene: Name of the place: by the manifest, else that of the folder.
    """

    folder: Path
    color: tuple[FrameFile, ...]
    depth: tuple[FrameFile | None, ...]
    world_from_cam: Array
    path: NDArray[np.int64]
    camera: FrameCamera | None
    wide: CameraConfig | None
    is_rendered: bool
    sequence_from_world: Array | None
    scene: str

    def __len__(self) -> int:
        return len(self.color)

    def sha256(self) -> str:
        """Hash of all that is learned from them: images, poses, paths, camera and world."""
        total = hashlib.sha256()
        with ThreadPoolExecutor(READERS) as readers:
            for image in readers.map(_sha256, self.color):
                total.update(image)
        for values in (self.world_from_cam, self.path, self.sequence_from_world):
            total.update(b"" if values is None else values.tobytes())
        total.update(repr((self.camera, self.wide)).encode())
        return total.hexdigest()

    def spread(self, most: int) -> OwnFrames:
        """Take at most so many of the frames, evenly spread."""
        if len(self) <= most:
            return self
        chosen = np.linspace(0, len(self) - 1, most).round().astype(int)
        return replace(
            self,
            color=tuple(self.color[i] for i in chosen),
            depth=tuple(self.depth[i] for i in chosen),
            world_from_cam=self.world_from_cam[chosen],
            path=self.path[chosen],
        )


@dataclass(frozen=True)
class PackedFrames:
    """Packed frames and poses that a training run reads.

    Attributes:
        frames: Packed frames, with a record beside them that names their camera.
        labels: Pose table.
        sequence_from_world: Motion (4, 4) from the world of the labels to that of the sequence.
        camera: Camera of the frames before they were made smaller; None where it is not known.
        n_paths: Paths that may be held out.
    """

    frames: Path
    labels: Path
    sequence_from_world: Array | None
    camera: FrameCamera | None
    n_paths: int


def _sha256(file: FrameFile) -> bytes:
    with read_as(file, "an image", OSError):
        return hashlib.sha256(file.read_bytes()).digest()


def read_test_frames(folder: Path) -> OwnFrames | None:
    """Find the test frames of a data set; None where it has none.

    Raises:
        InputError: A file is missing or damaged.
    """
    if not (folder / SPLIT_FILES["test"]).is_file():
        return None
    sequences = read_split(folder, "test")
    missing = [path for path in sequences if not path.exists()]
    if missing:
        log.warning("%s: is not there, so the test split is not scored", missing[0])
    return read_own_frames(folder, (), "test") if sequences and not missing else None


def read_own_frames(
    folder: Path, ranges: Sequence[FrameRange], split: Split = "train"
) -> OwnFrames:
    """Find the frames of a data set; images are not opened.

    Args:
        folder: Data set of ``synfeal collect``, or a sequence of photographs.
        ranges: Frames to take of photographs; none: all.
        split: Split to take, where there are splits.

    Raises:
        InputError: There are no such frames, or a file is missing or damaged.
    """
    has_split = os.path.lexists(folder / SPLIT_FILES[split])
    rendered = os.path.lexists(folder / MANIFEST)
    if has_split:
        sequences = [read_posed_sequence(path) for path in read_split(folder, split)]
        if not sequences:
            raise InputError(
                folder / SPLIT_FILES[split], "names no sequence", "collect training frames"
            )
    if rendered and has_split:
        parts, path = sequences, _paths_of_table(folder, sum(map(len, sequences)), split)
    elif has_split:
        parts = [part for whole in sequences for part in _ranges_of(folder, whole, ranges)]
        path = None
    else:
        slices = [slice(r.start, r.stop) for r in ranges] or [slice(None)]
        parts, path = [read_posed_sequence(folder, chosen) for chosen in slices], None
    camera = camera_of_dataset(folder, None).config if rendered else None
    wide = None if camera is None or camera.projection is None else camera
    return OwnFrames(
        folder=folder,
        color=tuple(file for part in parts for file in part.color),
        depth=tuple(file for part in parts for file in part.depth),
        world_from_cam=np.concatenate([part.world_from_cam for part in parts]),
        path=_blocks(parts) if path is None else path,
        camera=None if camera is None or wide else _frame_camera(camera),
        wide=wide,
        is_rendered=rendered and has_split,
        sequence_from_world=read_sequence_from_world(folder),
        scene=_scene_of(folder),
    )


def check_posed_depth(own: OwnFrames, photographs: PhotographCamera) -> None:
    """Refuse poses that contradict the depth of their frames.

    Nothing is compared where there is no depth, or its camera is not known.

    Args:
        own: Frames of a data set.
        photographs: Camera of photographs, which is that of depth where depth is registered to it.

    Raises:
        InputError: Depth and poses do not fit together; the message says what was meant.
    """
    depth = [file for file in own.depth if file is not None]
    if len(depth) < len(own) or own.wide is not None:
        return
    known: CameraConfig | None = None
    if own.camera is not None:
        known = CameraConfig.model_validate(own.camera.model_dump())
    else:
        image, turn = upright(read_image(own.color[0]))
        given = photographs.of(image, own.color[0], turn)
        if given is not None:  # depth and poses are of the stored pixels
            known = CameraConfig.model_validate(asdict(turned(given, turn.back)))
    if known is None or image_size(depth[0]) != (known.width, known.height):
        return
    units_per_m = TUM_UNITS_PER_M if is_tum(own.folder) else MILLIMETRES
    rgbd = RgbdCamera(known, known, np.eye(4), units_per_m)
    frames = PosedFrames(
        names=tuple(map(str, own.color)),
        color=own.color,
        depth=own.depth,
        world_from_cam=own.world_from_cam,
    )
    check_depth(posed_depth(frames, rgbd, options=frozenset()))


def _ranges_of(
    folder: Path, whole: PosedFrames, ranges: Sequence[FrameRange]
) -> Iterator[PosedFrames]:
    """Yield parts of one sequence of a split; all of it without ranges."""
    if not ranges:
        yield whole
    for chosen in ranges:
        part = whole[chosen.start : chosen.stop]
        if not len(part):
            raise InputError(
                folder,
                f"a sequence has {len(whole)} frames, none of them in"
                f" `range=({chosen.start}, {chosen.stop})`",
            )
        yield part


def _paths_of_table(folder: Path, n_frames: int, split: Split) -> NDArray[np.int64] | None:
    """Read the path of each frame from the table of a split; None where there is none."""
    table = folder / f"{split}.csv"
    if not table.is_file():
        return None
    path = read_pose_table(table).path
    if len(path) != n_frames:
        raise InputError(
            table,
            f"has {len(path)} rows, but the sequences of the split hold {n_frames} frames",
            "run synfeal validate",
        )
    return path


def _blocks(parts: Sequence[PosedFrames]) -> NDArray[np.int64]:
    """Number blocks of neighbours over all parts, in place of paths."""
    found, first = [], 0
    for part in parts:
        count = min(BLOCKS, len(part))
        found.append(first + np.arange(len(part)) * count // len(part))
        first += count
    return np.concatenate(found)


def _scene_of(folder: Path) -> str:
    """Name the place that a data set shows."""
    manifest = folder / MANIFEST
    scene = read_json(manifest).get("scene") if manifest.is_file() else None
    name = scene.get("name") if isinstance(scene, dict) else None
    return str(name or folder.resolve().name)


def _frame_camera(camera: CameraConfig) -> FrameCamera:
    """Return what packed frames keep of a perspective camera."""
    fx, fy, cx, cy = camera.intrinsics
    return FrameCamera(
        width=camera.width,
        height=camera.height,
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        distortion=camera.distortion,
    )


def pack_own_frames(
    sets: Sequence[OwnFrames], photographs: PhotographCamera, network: NetworkConfig, out: Path
) -> PackedFrames:
    """Write ``frames.npy`` and ``labels.csv`` of one or more data sets.

    And ``frames.json``, where the camera of all is known.

    Photographs are turned upright as EXIF says, and their poses with them: so are those that will
    be localized.

    Args:
        sets: Data sets; the first decides which world the labels are in.
        photographs: Camera of those that do not name one.
        network: Side of the packed images, and what of a frame they show.
        out: Directory to write to.

    Raises:
        InputError: An image cannot be used, or the data sets do not fit together.
    """
    made = PackedFrames(
        frames=out / "frames.npy",
        labels=out / "labels.csv",
        sequence_from_world=sets[0].sequence_from_world,
        camera=_target_camera(sets, photographs),
        n_paths=sum(len(np.unique(own.path)) for own in sets),
    )
    _pack(made, sets, photographs, network)
    return made


def pack_test_frames(
    sets: Sequence[OwnFrames],
    photographs: PhotographCamera,
    network: NetworkConfig,
    out: Path,
    learned: PackedFrames,
) -> PackedFrames:
    """Write ``test_frames.npy`` and ``test_labels.csv`` as the frames learned from are packed.

    Args:
        sets: Test frames of data sets.
        photographs: Camera of those that do not name one.
        network: Side of the packed images, and what of a frame they show.
        out: Directory to write to.
        learned: Training frames, whose camera and world these are brought to.

    Raises:
        InputError: An image cannot be used.
    """
    frames, labels = out / "test_frames.npy", out / "test_labels.csv"
    made = replace(learned, frames=frames, labels=labels)
    _pack(made, sets, photographs, network)
    return made


def _pack(
    made: PackedFrames,
    sets: Sequence[OwnFrames],
    photographs: PhotographCamera,
    network: NetworkConfig,
) -> None:
    """Write the files of packed frames."""
    jobs = [(own, file) for own in sets for file in own.color]
    resamplers: dict[Calibration, Resampler | None] = {}

    def pixels(job: tuple[OwnFrames, FrameFile]) -> tuple[NDArray[np.uint8], Orientation]:
        own, file = job
        image, turn = read_image(file, "RGB"), Orientation.UPRIGHT
        camera = own.camera or own.wide
        if camera is None:
            photograph = image, turn = upright(image)
            image = _resampled(photograph, file, photographs, made.camera, resamplers)
        elif image.size != (camera.width, camera.height):
            raise InputError(
                file,
                f"is of {image.width}x{image.height} pixels, {own.folder / MANIFEST} says"
                f" {camera.width}x{camera.height}",
                "collect the data set again",
            )
        return fit_frame(image, network.input_px, network.view), turn

    turns: list[Orientation] = []
    with (
        new_packed(made.frames, len(jobs), network.input_px) as packed,
        Progress(len(jobs), "pack") as progress,
        ThreadPoolExecutor(READERS) as readers,
    ):
        try:
            for index, (small, turn) in enumerate(readers.map(pixels, jobs)):
                packed[index] = small
                turns.append(turn)
                progress.update()
        finally:
            readers.shutdown(cancel_futures=True)
    write_pose_table(made.labels, _joined(_turned_upright(sets, turns), made.sequence_from_world))
    _write_record(made.frames, made.camera)


def _target_camera(sets: Sequence[OwnFrames], photographs: PhotographCamera) -> FrameCamera | None:
    """Choose the camera that all frames are brought to: that of rendered frames, if any.

    None for a fisheye or panorama: a network learns from those as they are; nothing is turned or
    resampled.
    """
    for own in sets:
        if own.wide is not None:
            _refuse_beside(own, own.wide, sets)
            return None
    cameras = {own.camera: own for own in sets if own.camera is not None}
    if len(cameras) > 1:
        first, second = list(cameras.values())[:2]
        raise InputError(
            second.folder / MANIFEST,
            f"camera: is another than that of {first.folder}",
            "collect both with one camera, or train on one of them",
        )
    if cameras:
        return next(iter(cameras))
    image, turn = upright(read_image(sets[0].color[0]))
    known = photographs.of(image, sets[0].color[0], turn)
    if known is None:
        return None
    return FrameCamera(
        width=known.width, height=known.height, fx=known.fx, fy=known.fy, cx=known.cx, cy=known.cy
    )


def _refuse_beside(own: OwnFrames, camera: CameraConfig, sets: Sequence[OwnFrames]) -> None:
    """Refuse frames of another camera beside those of a fisheye or panorama."""
    for other in sets:
        if other.wide != camera:
            raise InputError(
                own.folder / MANIFEST,
                f"camera: is {camera.projection}, and frames of {other.folder} cannot be brought"
                " to it",
                "train on one of them",
            )


def _turned_upright(sets: Sequence[OwnFrames], turns: Sequence[Orientation]) -> list[OwnFrames]:
    """Turn the poses of all sets as their photographs were turned."""
    done, first = [], 0
    for own in sets:
        turn = np.array([stored_from_upright(t) for t in turns[first : first + len(own)]])
        done.append(replace(own, world_from_cam=own.world_from_cam @ turn))
        first += len(own)
    return done


def _resampled(
    photograph: Upright,
    file: FrameFile,
    photographs: PhotographCamera,
    target: FrameCamera | None,
    resamplers: dict[Calibration, Resampler | None],
) -> Image.Image:
    """Resample a photograph to ``target``; leave it where one of the two cameras is unknown."""
    image, turn = photograph
    known = None if target is None else photographs.of(image, file, turn)
    if known is None or target is None:
        return image
    if known not in resamplers:
        resamplers[known] = None if same_view(known, target) else Resampler(known, target)
    resampler = resamplers[known]
    return image if resampler is None else resampler(image)


def _joined(sets: Sequence[OwnFrames], sequence_from_common: Array | None) -> PoseTable:
    """Join all frames in one world, numbering their paths consecutively.

    Photographs are in the world of their sequence, rendered frames in that of the mesh.

    Args:
        sets: Frames.
        sequence_from_common: Motion (4, 4) from the common world to that of the sequence.
    """
    poses, paths, first = [], [], 0
    for own in sets:
        poses.append(_in_world(own, sequence_from_common))
        known, index = np.unique(own.path, return_inverse=True)
        paths.append(first + index)
        first += len(known)
    world_from_cam = np.concatenate(poses)
    return PoseTable(
        frame=np.arange(len(world_from_cam)),
        path=np.concatenate(paths),
        position_m=world_from_cam[:, :3, 3].copy(),
        quat_wxyz=quat_wxyz_of(world_from_cam),
    )


def _in_world(own: OwnFrames, sequence_from_common: Array | None) -> Array:
    """Return the poses (N, 4, 4) of a data set in another world than its own, or in that."""
    if _same_motion(own.sequence_from_world, sequence_from_common):
        return own.world_from_cam  # to the last bit
    sequence_from_own, common = (
        np.eye(4) if motion is None else motion
        for motion in (own.sequence_from_world, sequence_from_common)
    )
    return np.asarray(np.linalg.inv(common) @ sequence_from_own @ own.world_from_cam)


def _same_motion(one: Array | None, other: Array | None) -> bool:
    return one is other or (one is not None and other is not None and np.array_equal(one, other))


def _write_record(frames: Path, camera: FrameCamera | None) -> None:
    """Say beside packed frames which camera they are of; without one there is no record."""
    record = frames.with_suffix(".json")
    record.unlink(missing_ok=True)
    if camera is not None:
        write_json(record, {"camera": camera.model_dump(), "sha256": file_sha256(frames)})
