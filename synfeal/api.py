"""Python interface to the commands of Synfeal: one function each, with the same words.

A name in Python ends in its unit, which a flag leaves out: ``spacing_m=0.1`` is ``--spacing 0.1``.
What cannot be used raises an :class:`synfeal.errors.InputError` that names it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synfeal.camera.projection import Projection
from synfeal.collection.run import collect as run_collection
from synfeal.collection.run import plan_training
from synfeal.collection.settings import collect_config
from synfeal.config.collect import CollectConfig, LikeConfig, PlaceConfig, ViewConfig, checked
from synfeal.config.collection import ClutterConfig, Mode, UpAxis
from synfeal.config.dataset import Backend, CameraConfig, Detail, Shade
from synfeal.config.described import with_options
from synfeal.config.effects import EffectsConfig
from synfeal.config.renamed import renamed, warn_renamed
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import read_rgb
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
from synfeal.errors import Argument, InputError, read_as
from synfeal.geometry.limits import FARTHEST_M
from synfeal.geometry.poses import moved_right
from synfeal.geometry.rigid import refuse_non_rigid
from synfeal.mesh import load
from synfeal.mesh.ambient import with_ambient_light
from synfeal.mesh.instances import Instance, number_instances
from synfeal.mesh.model import TexturedMesh
from synfeal.planning.repeat import read_poses
from synfeal.records.files import read_json
from synfeal.render import open_renderer
from synfeal.render.base import Depth, Rgb
from synfeal.render.surface import Normals, SurfaceImage, SurfaceTable

if TYPE_CHECKING:
    import pandas as pd

    from synfeal.captures.unpack import Unpacked
    from synfeal.dataset.poses_in import FormatName
    from synfeal.evaluation.run import Evaluation
    from synfeal.geometry.axes import PosesAre
    from synfeal.pairing.run import Among
    from synfeal.scanning.camera import CameraOptions
    from synfeal.scanning.run import Scan

AnyPath = str | Path
Bounds = tuple[float, float]
# Keywords of the version before, by what they are called now.
EARLIER = {
    "spacing": "spacing_m",
    "roll": "roll_deg",
    "pitch": "pitch_deg",
    "yaw": "yaw_deg",
    "min_view_distance": "min_view_distance_m",
    "min_clearance": "min_clearance_m",
    "min_path": "min_path_m",
    "fov": "fov_deg",
    "stereo": "stereo_m",
    "background": "background_rgb",
    "packed": "packed_px",
    "workers": "cores",
}


class ViewOptions(TypedDict, total=False):
    """Fields of :class:`synfeal.config.collect.ViewConfig`, which has bounds and defaults."""

    camera: AnyPath | CameraConfig | None
    projection: Projection | None
    fisheye_k: tuple[float, float, float, float] | None
    width: int | None
    height: int | None
    fov_deg: float | None
    backend: Backend
    supersampling: int
    shade: Shade | None
    background_rgb: tuple[int, int, int]


class CollectOptions(ViewOptions, total=False):
    """Fields of :class:`synfeal.config.collect.CollectConfig`, and those of ``LikeConfig``."""

    box: Sequence[tuple[float, float, float, float, float, float]]
    up_axis: UpAxis
    unit_m: float
    test_frames: int
    depth: bool
    depth_scale: float | None
    far_m: float | None
    normals: bool
    masks: bool
    seed: int
    spacing_m: float
    roll_deg: Bounds
    pitch_deg: Bounds
    yaw_deg: Bounds
    min_view_distance_m: float
    min_seen: float | None
    min_clearance_m: float | None
    min_path_m: float
    test_paths: int | None
    mode: Mode
    poses: AnyPath | None
    around_m: float | None
    around_turn_deg: float | None
    stereo_m: float | None
    detail: Detail
    effects: AnyPath | Mapping[str, Any] | EffectsConfig | None
    clutter: AnyPath | Mapping[str, Any] | ClutterConfig | None
    sequence_frames: int
    archive: bool
    packed_px: int | None
    like: AnyPath | None
    like_range: tuple[int, int] | None
    margin_m: float | None
    angle_margin_deg: float | None


def unpack(
    capture: AnyPath,
    out: AnyPath,
    *,
    format: str | None = None,  # noqa: A002 (the word of the command)
    stride: int = 1,
) -> Unpacked:
    """Turn a capture of a phone, a sensor or another program into a posed sequence.

    Args:
        capture: Folder or file of a capture, in any of the formats of ``docs/captures.md``.
        out: Folder to create.
        format: Format of the capture, where its files fit several; None to find it from them.
        stride: Take every such frame.

    Returns:
        The sequence, which :func:`scan`, ``map`` and ``collect(like=...)`` read, and what was left
        out of it.

    Raises:
        InputError: The capture cannot be read, or ``out`` is not empty.
    """
    from synfeal.captures.formats import read_capture
    from synfeal.captures.unpack import unpack as write
    from synfeal.records.progress import Progress

    if stride < 1:
        raise InputError(Argument("stride"), f"must be at least 1, found {stride}")
    read = read_capture(Path(capture), format)
    with Progress(-(-len(read) // stride), "unpacked") as progress:
        return write(read, Path(out), stride=stride, on_frame=progress.update)


def load_mesh(path: AnyPath, up_axis: UpAxis = "auto", unit_m: float = 1.0) -> TexturedMesh:
    """Load a textured mesh into the world frame: z up, metres.

    Args:
        path: A .glb, .gltf, .obj or .ply file.
        up_axis: Up axis of the file: ``auto``, ``y`` or ``z``.
        unit_m: Metres per unit of the file.
    """
    place = checked(PlaceConfig, {"mesh": path, "up_axis": up_axis, "unit_m": unit_m})
    return load.load_mesh(place.mesh, place.up_axis, place.unit_m)


class Renderer:
    """Renderer of unlit images of a mesh; a context manager."""

    @with_options(ViewOptions, ViewConfig)
    @renamed(**EARLIER)
    def __init__(self, mesh: TexturedMesh, **options: Unpack[ViewOptions]) -> None:
        """Open a renderer.

        Args:
            mesh: What is drawn.
            options: Camera and drawing, with the bounds and defaults of
                :class:`synfeal.config.collect.ViewConfig`.
        """
        settings = checked(ViewConfig, options)
        lit = with_ambient_light(mesh) if settings.shade == "ambient" else mesh
        self._mesh, self._opened = mesh, open_renderer(lit, settings.view, settings.render)
        self.camera: CameraConfig = settings.view

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
        raise InputError(Argument("world_from_cam"), f"must be of shape (4, 4), found {pose.shape}")
    if not (np.abs(pose) <= FARTHEST_M).all():  # of NaN as well
        raise InputError(
            Argument("world_from_cam"), "must hold finite numbers, its position in metres"
        )
    refuse_non_rigid(pose, "world_from_cam")
    return pose


@with_options(CollectOptions, CollectConfig, LikeConfig)
@renamed(**EARLIER)
def plan(mesh: AnyPath, frames: int, **options: Unpack[CollectOptions]) -> PoseTable:
    """Return the training poses that :func:`collect` would use with the same options.

    Args:
        mesh: Mesh file.
        frames: Number of poses.
        options: Options of :func:`collect`.
    """
    return plan_training(collect_config({"mesh": mesh, "frames": frames, **options})[0])


@with_options(CollectOptions, CollectConfig, LikeConfig)
@renamed(**EARLIER)
def collect(
    mesh: AnyPath, out: AnyPath, frames: int, *, cores: int = 1, **options: Unpack[CollectOptions]
) -> Dataset:
    """Collect a data set, or resume an interrupted one.

    Args:
        mesh: Mesh file.
        out: Directory of the data set.
        frames: Number of training frames.
        cores: Number of rendering processes.
        options: Fields of :class:`synfeal.config.collect.CollectConfig`, with its bounds and
            defaults, and of :class:`synfeal.config.collect.LikeConfig`.

    Raises:
        InputError: An option, the mesh or the directory cannot be used.
    """
    config, _ = collect_config({"mesh": mesh, "frames": frames, **options})
    run_collection(config, Path(out), cores)
    return open_dataset(out)


def inspect(
    mesh: AnyPath,
    out: AnyPath | None = None,
    *,
    box: Sequence[tuple[float, float, float, float, float, float]] = (),
    up_axis: UpAxis = "auto",
    unit_m: float | None = None,
    format: str | None = None,  # noqa: A002 (the word of the command)
) -> dict[str, Any]:
    """Show what a mesh is and where cameras can be in it, or what a capture holds.

    Args:
        mesh: Mesh file, or a capture in any format of :mod:`synfeal.captures`.
        out: Directory for numbers, picture and page; None for ``<name of the mesh>-inspect``.
        box: Where camera centres may be, metres; none: the mesh's bounds.
        up_axis: Up axis of the file: ``auto``, ``y`` or ``z``.
        unit_m: Metres per unit of the file; None to find one that makes a room of the mesh.
        format: Format of a capture; None finds out.

    Returns:
        The numbers, as in ``inspect.json``; ``collect`` holds a suggested command, if there is one.
        Of a capture, as in ``capture-inspect.json``.

    Raises:
        InputError: The mesh or capture cannot be used, or a capture is given what goes with a mesh.
    """
    from synfeal.captures.formats import may_be_capture
    from synfeal.inspection.captured import inspect_capture
    from synfeal.inspection.run import OUTPUTS, inspect_mesh

    if format is not None or may_be_capture(Path(mesh)):
        for name, value in (("box", box), ("unit_m", unit_m)):
            if value:
                raise InputError(
                    Argument(name), f"is of meshes, and {mesh} is none", "leave it out"
                )
        folder = Path(f"{Path(mesh).resolve().stem}-inspect") if out is None else Path(out)
        return inspect_capture(Path(mesh), folder, format)

    place = checked(PlaceConfig, {"mesh": mesh, "box": box, "up_axis": up_axis, "unit_m": unit_m})
    folder = Path(f"{place.mesh.stem}-inspect") if out is None else Path(out)
    inspect_mesh(place.scene, folder, unit_m is not None)
    found: dict[str, Any] = read_json(folder / OUTPUTS[0])
    return found


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

    def rgb(self, row: int) -> Rgb:
        """Read the colours (H, W, 3), uint8, of a frame."""
        return read_rgb(self.images[row])

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
        raise InputError(what, "the data set has none", f"collect it with `{what}=True`")
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


@renamed(every="stride", camera_file="camera")
def pairs(
    dataset: AnyPath,
    out: AnyPath | None = None,
    *,
    among: Among = "each",
    stride: int = 1,
    min_overlap: float = 0.1,
    max_overlap: float = 1.0,
    per_frame: int | None = None,
    tolerance: float = 0.01,
    grid: tuple[int, int] = (32, 24),
    flow: bool = False,
    camera: AnyPath | None = None,
) -> pd.DataFrame:
    """Find the pairs of frames that see the same surfaces, and return their table.

    Args:
        dataset: Data set with depth.
        out: Directory to create; None for ``<dataset>-pairs`` beside the data set.
        among: Frames to pair: within ``each`` split, in ``train`` or ``test`` alone, or ``all``
            with all.
        stride: Take every such frame of each sequence.
        min_overlap: Least overlap of a pair, 0 to 1.
        max_overlap: Greatest overlap of a pair, 0 to 1.
        per_frame: Keep only this many pairs per frame, by overlap; None for all.
        tolerance: Largest relative difference of depth at which a point counts as visible.
        grid: Columns and rows of a frame's points that are looked up in the others.
        flow: Write optical flow of each pair, both ways.
        camera: Calibration file, in place of the camera of the manifest.
    """
    from synfeal.pairing.choose import Choice
    from synfeal.pairing.run import PairsJob, find_pairs

    whole = Path(dataset).resolve()
    job = PairsJob(
        dataset=Path(dataset),
        out=whole.with_name(f"{whole.name}-pairs") if out is None else Path(out),
        among=among,
        choice=Choice(min_overlap, max_overlap, per_frame),
        every=stride,
        tolerance=tolerance,
        grid=grid,
        flow=flow,
        camera_file=None if camera is None else Path(camera),
    )
    return find_pairs(job).table


def find_pairs(path: AnyPath, out: AnyPath, **settings: Any) -> pd.DataFrame:
    """Call :func:`pairs` by the name it had in the version before."""
    warn_renamed("find_pairs", "pairs")
    table: pd.DataFrame = pairs(path, out, **settings)
    return table


@renamed(path="dataset")
def validate(
    dataset: AnyPath, *, camera: AnyPath | None = None, every_pair: bool = False
) -> list[str]:
    """Check files, poses, splits, hashes and geometry of a data set.

    Args:
        dataset: The data set.
        camera: Calibration file, for a data set without a manifest or with another camera.
        every_pair: Compare all pairs of frames, not a sample of a large set.

    Returns:
        One line for each failed check, with its first failure; none if nothing is wrong.
    """
    from synfeal.validation.run import error_lines
    from synfeal.validation.run import validate as run_checks

    return error_lines(run_checks(Path(dataset), Path(camera) if camera else None, every_pair))


@renamed(path="dataset", file_format="format")
def evaluate(
    dataset: AnyPath,
    poses: AnyPath,
    *,
    out: AnyPath | None = None,
    format: FormatName | None = None,  # noqa: A002 (the word of the command)
    split: Literal["test", "train", "all"] = "test",
    align: Literal["none", "se3", "sim3"] = "none",
    labels: AnyPath | None = None,
    convention: str | None = None,
    rate_hz: float | None = None,
    max_difference_s: float = 0.01,
    offset_s: float = 0.0,
    camera: AnyPath | None = None,
) -> Evaluation:
    """Score poses of any common format against a data set.

    Args:
        dataset: Data set, or a capture or a file of poses as the reference.
        poses: File of the poses to score.
        out: Directory for ``scores.csv``, ``errors.csv`` and ``errors.png``; None to write none.
        format: Format of the poses; None to recognise it by their content.
        split: Frames to score.
        align: Transformation that first aligns all poses, as a whole, to those of the data set.
        labels: Second reference poses, in any format.
        convention: Direction and order of the poses, such as ``cam_from_world-wxyz``; None for that
            of their format.
        rate_hz: With TUM and EuRoC: frames per second; None for 30.
        max_difference_s: Between two files of poses: largest difference of two times of a pair.
        offset_s: Between two files of poses: what is added to the times of ``poses``.
        camera: Calibration file, in place of the camera of the manifest.
    """
    from synfeal.evaluation.run import Settings
    from synfeal.evaluation.run import evaluate as score
    from synfeal.evaluation.text import FILES, write_files
    from synfeal.records.files import refuse_foreign

    if out is not None:
        refuse_foreign(Path(out), FILES, "an evaluation")
    settings = Settings(
        split=split,
        align=align,
        convention=convention,
        rate_hz=rate_hz,
        labels=None if labels is None else Path(labels),
        camera=None if camera is None else Path(camera),
        file_format=format,
        most_apart_s=max_difference_s,
        offset_s=offset_s,
    )
    found = score(Path(dataset), Path(poses), settings)
    if out is not None:
        write_files([Path(out) / name for name in FILES], f"{poses} on {dataset}", found)
    return found


def export(
    dataset: AnyPath,
    out: AnyPath,
    *,
    to: str,
    copy: bool = False,
    camera: AnyPath | None = None,
) -> int:
    """Write a data set in the format of another program.

    Args:
        dataset: The data set.
        out: Directory to create.
        to: Format: ``ace``, ``colmap``, ``hloc``, ``mstransformer``, ``nerfstudio``, ``rosbag`` or
            ``tum``.
        copy: Copy colour images instead of linking to them.
        camera: Calibration file, in place of the camera of the manifest.

    Returns:
        The number of frames.
    """
    from synfeal.exporting.run import export as write

    return write(Path(dataset), to, Path(out), copy, None if camera is None else Path(camera))


def preview(
    datasets: AnyPath | Sequence[AnyPath],
    out: AnyPath | None = None,
    *,
    frames: int = 120,
    fps: float = 12.0,
    split: Literal["train", "test"] = "train",
    show: Sequence[str] = ("color",),
) -> int:
    """Write a GIF or MP4 of the first frames of data sets, side by side.

    Args:
        datasets: One data set or several.
        out: GIF or MP4 to write; None for ``preview.gif`` in the first data set.
        frames: Number of frames to show, from the first.
        fps: Frames per second, at most 50.
        split: Split to show.
        show: Layers to show side by side: ``color``, ``depth``, ``normals``, ``masks``, ``right``,
            ``right-depth``.

    Returns:
        The number of frames shown.
    """
    from synfeal.dataset.preview import write_preview

    several = [datasets] if isinstance(datasets, str | Path) else list(datasets)
    folders = [Path(each) for each in several]
    file = folders[0] / "preview.gif" if out is None else Path(out)
    return write_preview(folders, file, frames, fps, split, show)


def scan(
    sequence: AnyPath,
    out: AnyPath,
    *,
    preset: str | None = None,
    color_camera: AnyPath | None = None,
    depth_camera: AnyPath | None = None,
    color_focal_px: float | None = None,
    depth_focal_px: float | None = None,
    depth_from_color: tuple[float, float, float, float, float, float] | None = None,
    depth_scale: float | None = None,
    convention: PosesAre = "world_from_cam",
    range: tuple[int, int] | None = None,  # noqa: A002 (the word of the command)
    stride: int = 2,
    voxel_m: float = 0.01,
    max_depth_m: float = 4.0,
    min_piece_m2: float = 0.02,
    gravity: tuple[float, float, float] | None = None,
    keep_axes: bool = False,
    keep_calibration: bool = False,
) -> Scan:
    """Fuse posed RGB-D frames into one upright mesh, z up, in metres.

    Args:
        sequence: 7-Scenes frames, a folder of ``seq-01``, ..., or a TUM RGB-D sequence.
        out: ``.glb`` to write; ``.json`` and ``.png`` come beside it.
        preset: Known calibrations of colour and depth, such as ``7scenes``.
        color_camera: Calibration of the photographs.
        depth_camera: Calibration of the depth images; None for that of colour.
        color_focal_px: Focal length in place of a file.
        depth_focal_px: The same for depth.
        depth_from_color: Transform from the colour to the depth camera: rotation vector, degrees,
            and translation, metres.
        depth_scale: Stored value of a depth of 1 m.
        convention: Direction of the poses, or ``opengl`` for ``world_from_cam`` of cameras that
            look along -z, y up.
        range: First frame and one past the last; None for all.
        stride: Fuse every such frame.
        voxel_m: Edge of a voxel.
        max_depth_m: Depth beyond is ignored.
        min_piece_m2: Loose pieces with less surface are dropped.
        gravity: Direction of gravity in the world of the poses; None to find it from the scene.
        keep_axes: Keep the axes of the poses' world.
        keep_calibration: Use the calibration of the photographs as given, without fitting it.

    Raises:
        InputError: The sequence cannot be used, or two arguments contradict each other.
    """
    from synfeal.scanning.run import ScanJob
    from synfeal.scanning.run import scan as fuse

    if gravity is not None and keep_axes:
        raise InputError(Argument("keep_axes"), "contradicts gravity", "leave one of the two out")
    start, stop = range or (0, None)
    job = ScanJob(
        sequence=Path(sequence),
        out=Path(out),
        cameras=rgbd_cameras(
            preset,
            color_camera,
            depth_camera,
            color_focal_px,
            depth_focal_px,
            depth_from_color,
            depth_scale,
        ),
        start=start,
        stop=stop,
        stride=stride,
        voxel_m=voxel_m,
        max_depth_m=max_depth_m,
        min_piece_m2=min_piece_m2,
        poses_are=convention,
        gravity=gravity or ("keep" if keep_axes else "find"),
        keep_calibration=keep_calibration,
    )
    return fuse(job)


def rgbd_cameras(
    preset: str | None,
    color_camera: AnyPath | None,
    depth_camera: AnyPath | None,
    color_focal_px: float | None,
    depth_focal_px: float | None,
    depth_from_color: tuple[float, float, float, float, float, float] | None,
    depth_scale: float | None,
) -> CameraOptions:
    """Gather what is known of the cameras of RGB-D frames; see :func:`scan` for the arguments."""
    from synfeal.scanning.camera import CameraOptions

    return CameraOptions(
        preset=preset,
        color_camera=None if color_camera is None else Path(color_camera),
        depth_camera=None if depth_camera is None else Path(depth_camera),
        color_focal_px=color_focal_px,
        depth_focal_px=depth_focal_px,
        depth_from_color=depth_from_color,
        depth_units_per_m=depth_scale,
    )
