"""Frames that a map is built from: rendered ones of a data set, or photographs with poses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import pixels_of_normalised
from synfeal.config.dataset import CameraConfig
from synfeal.config.types import Positive, Strict
from synfeal.dataset.depth import Depth
from synfeal.dataset.depth_agreement import PosedDepth
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import image_size
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.posed_sequence import PosedFrames, is_tum, read_posed_sequence
from synfeal.dataset.sevenscenes import read_split
from synfeal.dataset.world import read_sequence_from_world
from synfeal.errors import Argument, InputError
from synfeal.geometry.axes import PosesAre, meant_poses
from synfeal.mesh.load import UpAxis
from synfeal.records.files import read_json
from synfeal.scanning.camera import CameraOptions, RgbdCamera, posed_depth, rgbd_camera

Array = NDArray[np.float64]

# Steps in which the depth of a colour pixel is found where the depth camera stands beside.
STEPS = 4


class MeshFile(Strict):
    """Options by which a file becomes a mesh in metres, z up."""

    up_axis: UpAxis = "auto"
    unit_m: Positive = 1.0


@dataclass(frozen=True)
class MapFrames:
    """Frames with poses, with depth or without, and the cameras that took them.

    Attributes:
        source: Folder they were read from.
        names: One for each frame.
        color: Colour images (N).
        depth: Depth images (N); none where features are to be triangulated.
        world_from_cam: Poses (N, 4, 4) of the colour camera.
        rgbd: Cameras of colour and depth.
        sequence_from_world: Rigid motion (4, 4) to the world of the sequence that the place was
            scanned from; None where the world of the frames is the only one known.
        mesh_file: How the mesh that they were rendered of is to be read.
        are_photographs: True where a camera took them, so that it may have taken others, too.
    """

    source: Path
    names: tuple[str, ...]
    color: tuple[FrameFile, ...]
    depth: tuple[FrameFile, ...]
    world_from_cam: Array
    rgbd: RgbdCamera
    sequence_from_world: Array | None
    mesh_file: MeshFile
    are_photographs: bool

    def __len__(self) -> int:
        return len(self.names)

    @property
    def has_depth(self) -> bool:
        """True where every frame has a depth image."""
        return len(self.depth) == len(self.names)

    @property
    def posed_depth(self) -> PosedDepth:
        """Depth and poses, to be checked against each other."""
        frames = PosedFrames(self.names, self.color, self.depth, self.world_from_cam)
        return posed_depth(frames, self.rgbd, options=frozenset({"convention", "depth_scale"}))

    @property
    def camera(self) -> CameraConfig:
        """Camera of the colour images."""
        return self.rgbd.color

    def read_color(self, index: int) -> NDArray[np.uint8]:
        """Read a colour image (H, W, 3).

        Raises:
            InputError: It cannot be read or is of another size than its camera.
        """
        return self.rgbd.read_color(self.color[index])

    def read_depth_m(self, index: int) -> Depth:
        """Read a depth image (H, W) in metres, 0 where nothing was measured.

        Raises:
            InputError: It cannot be read or is of another size than its camera.
        """
        return self.rgbd.read_depth_m(self.depth[index])

    def depth_at(self, depth_m: Depth, slope: Array) -> Array:
        """Look up how far away things are that the colour camera sees.

        Where the depth camera stands beside the colour camera, the pixel to look at depends on the
        depth that is looked for; a few steps from the median depth settle it.

        Args:
            depth_m: Depth image (H, W), 0 where nothing was measured.
            slope: x / z and y / z (n, 2) of rays of the colour camera.

        Returns:
            Depth (n,) along the optical axis of the colour camera, inf where there is none or the
            depth camera does not see that far to the side.
        """
        ray = np.column_stack([slope, np.ones(len(slope))])
        turn, shift = self.rgbd.depth_from_color[:3, :3], self.rgbd.depth_from_color[:3, 3]
        aside = bool((self.rgbd.depth_from_color != np.eye(4)).any())
        measured = depth_m[depth_m > 0]
        found = np.full(len(ray), float(np.median(measured)) if len(measured) else 1.0)
        turned = ray @ turn.T
        for _ in range(STEPS if aside else 1):
            point = found[:, None] * turned + shift
            seen = depth_along(depth_m, self.rgbd.depth, point[:, :2] / point[:, 2:])
            # Depth along the depth camera's axis is linear in depth along the colour camera's.
            step = (seen - shift[2]) / turned[:, 2]
            found = np.where(np.isfinite(step), step, found)
        return np.where(np.isfinite(seen) & (found > 0), found, np.inf)


def depth_along(depth_m: Depth, camera: CameraConfig, slope: Array) -> Array:
    """Look up the depth (n,) of the pixels that rays go through.

    Args:
        depth_m: Depth image (H, W); 0 or inf where there is none.
        camera: Its camera.
        slope: x / z and y / z (n, 2) of the rays.

    Returns:
        Depth (n,), inf where there is none.
    """
    pixel = pixels_of_normalised(camera, slope)
    height, width = depth_m.shape
    inside = np.asarray(((pixel >= 0) & (pixel < [width, height])).all(axis=1))
    column, row = np.where(inside[:, None], pixel, 0).astype(int).T
    values = depth_m[row, column]
    return np.where(inside & (values > 0), values, np.inf)


@dataclass(frozen=True)
class FrameChoice:
    """Frames of a folder that become a map.

    Attributes:
        start: First frame.
        stop: One after the last; None for all that follow.
        every: Take one frame of so many.
        most: Largest number of frames; of more, this many spread evenly are taken.
    """

    start: int = 0
    stop: int | None = None
    every: int = 1
    most: int = 1000

    def __post_init__(self) -> None:
        stop = self.start + 1 if self.stop is None else self.stop
        if not 0 <= self.start < stop:
            raise InputError(
                Argument("range"), f"needs 0 <= START < STOP, found {self.start} {stop}"
            )
        for name, value in (("stride", self.every), ("most", self.most)):
            if value < 1:
                raise InputError(Argument(name), f"must be at least 1, found {value}")

    def rows(self, count: int) -> NDArray[np.int64]:
        """Choose among ``count`` frames that lie between ``start`` and ``stop``."""
        rows = np.arange(0, count, self.every)
        if len(rows) > self.most:
            rows = rows[np.linspace(0, len(rows) - 1, self.most).round().astype(int)]
        return rows


def read_map_frames(
    folder: Path,
    choice: FrameChoice,
    cameras: CameraOptions,
    poses_are: PosesAre = "world_from_cam",
) -> MapFrames:
    """Read which frames a folder has, and their cameras; of images only the first are opened.

    Args:
        folder: A data set of ``synfeal collect`` with depth, of which training frames are taken, or
            a posed sequence of photographs, with depth or without.
        choice: Choice among the frames.
        cameras: Cameras given beside what the data set says.
        poses_are: Convention of the poses.

    Raises:
        InputError: There is no such folder, a frame lacks a file, or a calibration cannot be used.
    """
    frames = slice(choice.start, choice.stop)
    rendered = (folder / MANIFEST).is_file()
    found = _training_frames(folder, frames) if rendered else read_posed_sequence(folder, frames)
    if rendered and not found.has_depth:
        raise InputError(
            folder,
            "has no depth images, which put features into space",
            "collect it with `depth=True`",
        )
    rows = choice.rows(len(found))
    color = [found.color[row] for row in rows]
    depth = [file for row in rows if (file := found.depth[row]) is not None]
    rgbd = rgbd_camera(
        options=cameras,
        sequence=folder,
        color_size=image_size(color[0]),
        depth_size=image_size(depth[0] if depth else color[0]),
        is_tum=is_tum(folder),
    )
    return MapFrames(
        source=folder,
        names=tuple(found.names[row] for row in rows),
        color=tuple(color),
        depth=tuple(depth),
        world_from_cam=meant_poses(found.world_from_cam[rows], poses_are),
        rgbd=rgbd,
        sequence_from_world=read_sequence_from_world(folder) if rendered else np.eye(4),
        mesh_file=_mesh_file(folder / MANIFEST) if rendered else MeshFile(),
        are_photographs=not rendered,
    )


def _mesh_file(manifest: Path) -> MeshFile:
    """Read from its manifest how the mesh of a data set is to be loaded."""
    scene = read_json(manifest).get("scene", {})
    return MeshFile.model_validate({k: scene[k] for k in MeshFile.model_fields if k in scene})


def _training_frames(folder: Path, frames: slice) -> PosedFrames:
    """Select training frames of a data set."""
    sequences = read_split(folder, "train")
    if not sequences:
        raise InputError(folder, "has no training frames to make a map of")
    parts = [(sequence.stem, read_posed_sequence(sequence)) for sequence in sequences]
    every = PosedFrames(
        names=tuple(f"{stem}/{name}" for stem, part in parts for name in part.names),
        color=tuple(file for _, part in parts for file in part.color),
        depth=tuple(file for _, part in parts for file in part.depth),
        world_from_cam=np.concatenate([part.world_from_cam for _, part in parts]),
    )
    chosen = every[frames]
    if not len(chosen):
        raise InputError(folder, f"has {len(every)} training frames, none of them in `range`")
    return chosen
