"""Python interface to the commands of Synfeal.

Keywords ``**options`` are the options of ``synfeal collect`` with underscores (``spacing=0.1``,
``yaw=(0, 90)``, ``box=[(x0, x1, y0, y1, z0, z1)]``), with the same bounds and defaults. An
invalid option raises an :class:`synfeal.errors.InputError` that names it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synfeal.collection.run import CollectJob, with_backend
from synfeal.collection.run import collect as run_collection
from synfeal.config.collection import SceneConfig
from synfeal.config.dataset import CameraConfig, DatasetConfig
from synfeal.config.options import SCENE, dataset_config, options_named, render_configs
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.known_camera import camera_of_dataset
from synfeal.dataset.layer_files import read_instances, read_mask, read_normals
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.sequence_listing import (
    COLOR,
    DEPTH,
    MASK,
    NORMAL,
    RIGHT_COLOR,
    RIGHT_DEPTH,
)
from synfeal.dataset.split_frames import SplitFrames, read_split_frames
from synfeal.errors import InputError, read_as
from synfeal.geometry.limits import FARTHEST_M
from synfeal.geometry.poses import moved_right
from synfeal.geometry.rigid import refuse_non_rigid
from synfeal.mesh import load
from synfeal.mesh.ambient import with_ambient_light
from synfeal.mesh.instances import Instance, number_instances
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.triangles import merge_vertices
from synfeal.planning.plan import plan_mesh
from synfeal.planning.repeat import read_poses
from synfeal.records.provenance import generator_of
from synfeal.render import open_renderer
from synfeal.render.base import Depth, Rgb
from synfeal.render.surface import Normals, SurfaceImage, SurfaceTable

if TYPE_CHECKING:
    import pandas as pd

    from synfeal.evaluation.run import Evaluation

AnyPath = str | Path


def load_mesh(path: AnyPath, up_axis: str = "auto", unit_m: float = 1.0) -> TexturedMesh:
    """Load a textured mesh into the world frame: z up, metres.

    Args:
        path: A .glb, .gltf, .obj or .ply file.
        up_axis: Up axis of the file: ``auto``, ``y`` or ``z``.
        unit_m: Metres per unit of the file.
    """
    scene = SceneConfig.model_validate(
        {"source": "mesh", "path": path, "up_axis": up_axis, "unit_m": unit_m}
    )
    return load.load_mesh(Path(path), scene.up_axis, scene.unit_m)


class Renderer:
    """Renderer of unlit images of a mesh; a context manager.

    Keywords: ``camera``, ``width``, ``height``, ``fov``, ``projection``, ``fisheye_k``,
    ``backend``, ``supersampling``, ``background``, ``shade``.
    """

    def __init__(self, mesh: TexturedMesh, **options: Any) -> None:
        camera, render = render_configs(options)
        lit = with_ambient_light(mesh) if render.shade == "ambient" else mesh
        self._mesh, self._opened = mesh, open_renderer(lit, camera, render)
        self.camera: CameraConfig = camera

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Return colours (H, W, 3), uint8, seen from a camera pose (4, 4).

        Raises:
            InputError: It is no rotation and position.
        """
        return self._opened.render(_rigid(world_from_cam))

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Render colours and depth from a camera pose (4, 4).

        Returns:
            Colours (H, W, 3), uint8, and depth (H, W) in metres along the optical axis (along the
            ray with ``projection``), infinite where no surface is seen.

        Raises:
            InputError: It is no rotation and position.
        """
        return self._opened.render_rgbd(_rigid(world_from_cam))

    def render_surface(self, world_from_cam: NDArray[np.float64]) -> SurfaceImage:
        """Render normals and masks from a camera pose (4, 4).

        Returns:
            Unit normals (H, W, 3) in the frame of the camera, which they face, 0 0 0 where no
            surface is seen; numbers (H, W) of the parts of the mesh, counted from 1, 0 for none.

        Raises:
            InputError: It is no rotation and position.
        """
        pose = _rigid(world_from_cam)
        return self._surfaces.look_up(self._opened.render_faces(pose), pose)

    @cached_property
    def _surfaces(self) -> SurfaceTable:
        return SurfaceTable(self._mesh, self.camera, number_instances(self._mesh))

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()


def _rigid(world_from_cam: ArrayLike) -> NDArray[np.float64]:
    """Check a camera's pose (4, 4) and return it as an array."""
    with read_as("world_from_cam", "a pose", ValueError, TypeError):
        pose = np.asarray(world_from_cam, np.float64)
    if pose.shape != (4, 4):
        raise InputError(f"world_from_cam: must be of shape (4, 4), found {pose.shape}")
    if not (np.abs(pose) <= FARTHEST_M).all():  # of NaN as well
        raise InputError("world_from_cam: must hold finite numbers, its position in metres")
    refuse_non_rigid(pose, "world_from_cam")
    return pose


def plan(mesh: AnyPath, frames: int, **options: Any) -> PoseTable:
    """Return the training poses that :func:`collect` would use with the same options."""
    config = _config(mesh, frames, options)
    scene = config.scenes[SCENE]
    loaded = load_mesh(mesh, scene.up_axis, scene.unit_m)
    triangles = merge_vertices(*loaded.merged())
    rng = generator_of(config.seed, "plan", SCENE, "train")
    with options_named():
        return plan_mesh(triangles, str(mesh), scene, config.collection, frames, rng, "train")


def collect(
    mesh: AnyPath,
    out: AnyPath,
    frames: int,
    *,
    workers: int = 1,
    packed: int | None = None,
    **options: Any,
) -> Dataset:
    """Collect a data set, or resume an interrupted one, as ``synfeal collect`` does.

    Args:
        mesh: Mesh file.
        out: Directory of the data set.
        frames: Number of training frames.
        workers: Number of rendering processes.
        packed: Side in pixels of packed frames to write as well; None for none.
        options: Options of ``synfeal collect``.
    """
    config = _config(mesh, frames, options, Path(out))
    with options_named():
        run_collection(CollectJob(with_backend(config), packed, Path(out)), workers)
    return open_dataset(out)


def _config(
    mesh: AnyPath, frames: int, options: dict[str, Any], out: Path | None = None
) -> DatasetConfig:
    return dataset_config({"test_frames": 0, "mesh": mesh, "frames": frames, **options}, out)


@dataclass(frozen=True)
class Split:
    """The frames of a split, in order."""

    poses: PoseTable  # their poses as a table; ``poses.path`` tells which straight path each is on
    images: list[FrameFile]  # files of the colour images; ``read_bytes()`` gives what one holds
    depths: tuple[FrameFile, ...] = ()  # files of the depth images, if there are any
    right: Split | None = None  # the second camera of stereo pairs, if they are
    normals: tuple[FrameFile, ...] = ()  # files of normals, if there are any
    masks: tuple[FrameFile, ...] = ()  # files of masks, if there are any

    def __len__(self) -> int:
        return len(self.poses)

    @property
    def world_from_cam(self) -> NDArray[np.float64]:
        """Return camera poses (N, 4, 4)."""
        return self.poses.world_from_cam

    def depth_m(self, row: int) -> Depth:
        """Read depth (H, W) of a frame in metres, infinite where there is none."""
        return read_depth_m(_file_at(self.depths, row, "depth"))

    def normals_cam(self, row: int) -> Normals:
        """Read unit normals (H, W, 3) in the frame of the camera, 0 0 0 where there is nothing."""
        return read_normals(_file_at(self.normals, row, "normals"))

    def mask(self, row: int) -> NDArray[np.uint16]:
        """Read the numbers (H, W) of instances, 0 where there is nothing."""
        return read_mask(_file_at(self.masks, row, "masks"))


def _file_at(files: tuple[FrameFile, ...], row: int, what: str) -> FrameFile:
    if not files:
        raise InputError(f"{what}: the data set has none; collect it with --{what}")
    return files[row]


@dataclass(frozen=True)
class Dataset:
    """A data set in the format of 7-Scenes."""

    path: Path
    camera: CameraConfig  # that of 7-Scenes if the data set does not record one
    train: Split
    test: Split

    def instances(self) -> Mapping[int, Instance]:
        """Read what the values of masks stand for."""
        return read_instances(self.path)


def open_dataset(path: AnyPath) -> Dataset:
    """Open a data set: read its poses and camera, and list its images without reading them."""
    path = Path(path)
    camera = camera_of_dataset(path, None).config
    train, test = (_split(path, split, camera.stereo_baseline_m) for split in ("train", "test"))
    return Dataset(path, camera, train, test)


def _split(path: Path, split: str, baseline_m: float | None) -> Split:
    listed = read_split_frames(path, split)
    if not listed.frames:
        nothing = np.empty(0, np.int64)
        return Split(PoseTable(nothing, nothing, np.empty((0, 3)), np.empty((0, 4))), [])
    poses = read_poses(path, split) if listed.poses is None else listed.poses
    right = None
    if baseline_m is not None:
        moved = poses.with_poses(moved_right(poses.world_from_cam, baseline_m))
        right = Split(moved, listed.files(RIGHT_COLOR), _layer(listed, RIGHT_DEPTH))
    depths, normals, masks = (_layer(listed, kind) for kind in (DEPTH, NORMAL, MASK))
    return Split(poses, listed.files(COLOR), depths, right, normals, masks)


def _layer(listed: SplitFrames, kind: str) -> tuple[FrameFile, ...]:
    """List the images of one kind; empty where the data set has none at all."""
    there = any(sequence.numbers[kind] for sequence in listed.sequences)
    return tuple(listed.files(kind)) if there else ()


def find_pairs(path: AnyPath, out: AnyPath, **settings: Any) -> pd.DataFrame:
    """Compare the frames of a data set, as ``synfeal pairs`` does, and return the table of pairs.

    Args:
        path: Data set with depth.
        out: Directory to create.
        settings: Fields of :class:`synfeal.pairing.run.PairsJob` and of
            :class:`synfeal.pairing.choose.Choice`: ``among``, ``per_frame`` and so on.
    """
    from synfeal.pairing.choose import Choice
    from synfeal.pairing.run import PairsJob
    from synfeal.pairing.run import find_pairs as find

    bounds = {f.name: settings.pop(f.name) for f in fields(Choice) if f.name in settings}
    return find(PairsJob(Path(path), Path(out), choice=Choice(**bounds), **settings)).table


def validate(path: AnyPath, camera: AnyPath | None = None, every_pair: bool = False) -> list[str]:
    """Check a data set, as ``synfeal validate`` does.

    Args:
        path: The data set.
        camera: Calibration file, for a data set without a manifest or with another camera.
        every_pair: Compare all pairs of frames, not a sample of a large set.

    Returns:
        One line for each failed check, with its first failure; none if nothing is wrong.
    """
    from synfeal.validation.run import error_lines
    from synfeal.validation.run import validate as run_checks

    return error_lines(run_checks(Path(path), Path(camera) if camera else None, every_pair))


def evaluate(path: AnyPath, poses: AnyPath, **settings: Any) -> Evaluation:
    """Score poses against a data set, as ``synfeal evaluate`` does.

    Args:
        path: Data set, or a file of poses as the reference.
        poses: File of the poses to score.
        settings: Fields of :class:`synfeal.evaluation.run.Settings`.
    """
    from synfeal.evaluation.run import Settings
    from synfeal.evaluation.run import evaluate as score

    return score(Path(path), Path(poses), Settings(**settings))
