"""The format of the 7-Scenes data set: ``seq-XX/frame-XXXXXX.{color.png,depth.png,pose.txt}``.

Depth is along the optical axis, 16-bit PNG in millimetres, 65535 where nothing is; poses are
``world_from_cam`` as four rows of four numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.config.models import CameraConfig
from synfeal.dataset.directories import atomic_directory
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.sequences import Sequence
from synfeal.errors import InputError
from synfeal.files import atomic_path
from synfeal.mesh.load import load_mesh
from synfeal.render import open_renderer
from synfeal.render.base import Renderer

INVALID_MM = 65535
PNG_LEVEL = 1  # larger levels take several times as long and save a few per cent
SPLIT_FILES = {"train": "TrainSplit.txt", "test": "TestSplit.txt"}


def render_sequence(
    mesh_path: Path, camera: CameraConfig, poses: PoseTable, out_dir: Path, with_depth: bool
) -> None:
    """Render every pose of the table into a new directory, which appears when it is complete.

    Frames are numbered from 0 inside the sequence. ``mesh_path`` is a mesh in the world frame, as
    :func:`synfeal.mesh.save.save_glb` writes it.

    Raises:
        InputError: the mesh cannot be read, or ``out_dir`` is not empty.
    """
    with open_renderer(load_mesh(mesh_path), camera) as renderer:
        write_sequence(renderer, poses, out_dir, with_depth)


def write_sequence(
    renderer: Renderer,
    poses: PoseTable,
    out_dir: Path,
    with_depth: bool,
    on_frame: Callable[[], object] = lambda: None,
) -> None:
    """Render every pose of the table; ``on_frame`` is called after each frame."""
    with atomic_directory(out_dir) as directory:
        for index, world_from_cam in enumerate(poses.world_from_cam):
            stem = directory / f"frame-{index:06d}"
            if with_depth:
                rgb, depth_m = renderer.render_rgbd(world_from_cam)
                write_depth(stem.with_suffix(".depth.png"), depth_m)
            else:
                rgb = renderer.render(world_from_cam)
            Image.fromarray(rgb).save(stem.with_suffix(".color.png"), compress_level=PNG_LEVEL)
            write_pose(stem.with_suffix(".pose.txt"), world_from_cam)
            on_frame()


def write_depth(path: Path, depth_m: NDArray[np.float32]) -> None:
    """Depth (H, W) in metres as 16-bit PNG; beyond 65.534 m or infinite is stored as invalid."""
    depth_mm = np.minimum(np.round(np.asarray(depth_m, np.float64) * 1000.0), INVALID_MM)
    Image.fromarray(depth_mm.astype(np.uint16)).save(path, compress_level=PNG_LEVEL)


def read_depth_m(path: Path) -> NDArray[np.float32]:
    """Depth (H, W) in metres along the optical axis, inf where it is invalid.

    Raises:
        InputError: the file is no 16-bit image.
    """
    try:
        depth_mm = np.asarray(Image.open(path))
    except (OSError, SyntaxError) as error:
        raise InputError(f"{path}: cannot be read as a depth image ({error})") from None
    if depth_mm.ndim != 2 or depth_mm.dtype == np.uint8:
        raise InputError(f"{path}: must be a 16-bit grey image, millimetres")
    depth_m = (depth_mm / 1000.0).astype(np.float32)
    return np.where(depth_mm >= INVALID_MM, np.float32(np.inf), depth_m)


def write_pose(path: Path, world_from_cam: NDArray[np.float64]) -> None:
    """A pose (4, 4) as four tab-separated rows, exact to about 1e-10."""
    np.savetxt(path, world_from_cam, fmt="%.10e", delimiter="\t")


def read_pose(path: Path) -> NDArray[np.float64]:
    """A pose (4, 4).

    Raises:
        InputError: the file does not hold sixteen finite numbers in four rows.
    """
    try:
        rows = [line.split() for line in path.read_text().splitlines() if line]
        pose = np.array(rows, np.float64)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as a pose ({error})") from None
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        raise InputError(f"{path}: a pose is four rows of four finite numbers")
    return pose


def frame_paths(sequence_dirs: Iterable[Path], kind: str) -> list[Path]:
    """Files of one kind (``color.png``, ``depth.png`` or ``pose.txt``) in frame order.

    Raises:
        InputError: a sequence has no such file.
    """
    paths: list[Path] = []
    for directory in sequence_dirs:
        found = sorted(Path(directory).glob(f"frame-*.{kind}"))
        if not found:
            raise InputError(f"{directory}: holds no frame-XXXXXX.{kind}; render it again")
        paths += found
    return paths


def write_splits(dataset_dir: Path, sequences: Iterable[Sequence]) -> None:
    """``TrainSplit.txt`` and ``TestSplit.txt``: one line ``sequence1`` for each ``seq-01``."""
    sequences = list(sequences)
    for split, name in SPLIT_FILES.items():
        lines = [f"sequence{s.number}\n" for s in sequences if s.split == split]
        with atomic_path(dataset_dir / name) as temporary:
            temporary.write_text("".join(lines), encoding="utf-8")


def read_split(dataset_dir: Path, split: str) -> list[Path]:
    """Directories of the sequences of a split, in order.

    Raises:
        InputError: the split file is missing or holds a line that names no sequence.
    """
    path = dataset_dir / SPLIT_FILES[split]
    if not path.is_file():
        raise InputError(f"{path}: missing; a 7-Scenes data set has one")
    lines = path.read_text(encoding="utf-8").split()
    numbers = [line.removeprefix("sequence") for line in lines]
    bad = [line for line, number in zip(lines, numbers, strict=True) if not number.isdecimal()]
    if bad:
        raise InputError(f"{path}: '{bad[0]}' names no sequence; lines look like 'sequence1'")
    return [dataset_dir / f"seq-{int(number):02d}" for number in numbers]
