"""Dense correspondence reprojection error (DCRE): how far a wrong pose moves the picture.

Wald et al., "Beyond Controlled Environments: 3D Camera Re-Localization in Changing Indoor Scenes",
ECCV 2020, and the evaluation of their RIO10 benchmark: the points that a frame shows are projected
by the estimated pose; the error of a pixel is the distance to where it was, as a share of the
image's diagonal and 1 at most; the frame's is the mean over its pixels. Unlike RIO10, a point
behind the estimated camera counts as 1: the projection formula would put it into the image.

Instead of every pixel, the middles of 8 x 6 equal cells are looked at. On 200 frames of the Large
Room that changes a frame's DCRE by 0.6 % (median), at errors of 1 cm as of 50 cm.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import (
    cell_centres_px,
    cell_directions,
    pixel_offset,
    pixels_of_points,
)
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError, read_as
from synfeal.evaluation.bootstrap import medians
from synfeal.evaluation.metrics import Metrics, draws, is_pose, means, with_limits
from synfeal.geometry.poses import relative
from synfeal.records.files import atomic_path

if TYPE_CHECKING:
    from synfeal.mesh.rays import RayCaster

Array = NDArray[np.float64]

CELLS = (8, 6)  # columns, rows
# RIO10 prints the share of frames with a DCRE below these.
DCRE_BOUNDS = (0.05, 0.15)
BLOCK = 2000  # frames at once: bounds memory
OTHER_CAMERA = "; give the camera of these images with `camera`"


def _directions(camera: CameraConfig) -> Array:
    """Return the points (48, 3) at depth 1 that the cells' middles show.

    Where a fisheye shows nothing, a direction in which nothing is looked for: depth there is none.
    """
    return np.nan_to_num(cell_directions(camera, *CELLS).reshape(-1, 3), nan=1.0)


def cell_depth_m(caster: RayCaster, camera: CameraConfig, world_from_cam: Array) -> Array:
    """Cast rays from poses (N, 4, 4) to the cells: depth (N, 48), metres, ``inf`` for nothing."""
    direction = _directions(camera)
    length = np.linalg.norm(direction, axis=1)
    parts = []
    for poses in np.array_split(world_from_cam, -(-len(world_from_cam) // BLOCK)):
        rays = np.einsum("nij,kj->nki", poses[:, :3, :3], direction)
        starts = np.broadcast_to(poses[:, None, :3, 3], rays.shape)
        hit_m = caster.first_hit_m(starts.reshape(-1, 3), rays.reshape(-1, 3))
        parts.append(hit_m.reshape(len(poses), -1) / length)
    return np.concatenate(parts)


def dcre(predicted: PoseTable, reference: PoseTable, depth_m: Array, camera: CameraConfig) -> Array:
    """Compute the dense correspondence reprojection error of predictions.

    Args:
        predicted: Poses to score.
        reference: Labels or true poses of the same frames, row by row.
        depth_m: Depth (N, 48) of the frames' cells, metres, from :func:`cell_depth_m`.
        camera: The frames' camera.

    Returns:
        Errors (N,) as shares of the image's diagonal; infinite where a prediction is no pose, NaN
        where a frame shows nothing.
    """
    errors = np.full(len(predicted), np.inf)
    good = np.flatnonzero(is_pose(predicted))
    for rows in np.array_split(good, -(-len(good) // BLOCK) or 1):
        estimate, true = (table.at(rows).world_from_cam for table in (predicted, reference))
        errors[rows] = _moved(relative(estimate, true), depth_m[rows], camera)
    return errors


def dcre_summary(errors: Array, path: NDArray[np.int64], end: str = "") -> Metrics:
    """Compute the median of DCREs and the shares below :data:`DCRE_BOUNDS`, with limits.

    Args:
        errors: DCRE (N,) of each frame; NaN where a frame shows nothing, which is left out.
        path: Index (N,) of each frame's path: the bootstrap draws whole paths.
        end: Ending of the names in the result, which says what the errors are against.

    Returns:
        Metrics such as ``dcre``, ``dcre_low`` and ``dcre_high``; none if no frame shows anything.
    """
    seen = ~np.isnan(errors)
    if not seen.any():
        return {}
    errors, (place, counts) = errors[seen], draws(path[seen])
    found = {f"dcre{end}": medians(errors, place, counts)}
    for bound in DCRE_BOUNDS:
        below = (errors < bound).astype(np.float64)
        found[f"dcre_below_{bound:g}{end}"] = means(below, place, counts)
    return with_limits(found)


def _moved(estimate_from_reference: Array, depth_m: Array, camera: CameraConfig) -> Array:
    """Average over the cells how far (N,) they move, as shares of the diagonal."""
    seen = np.isfinite(depth_m)
    points = _directions(camera) * np.where(seen, depth_m, 1.0)[..., None]
    points = np.einsum("nij,nkj->nki", estimate_from_reference[:, :3, :3], points)
    points += estimate_from_reference[:, None, :3, 3]
    cells = cell_centres_px(camera, *CELLS).reshape(-1, 2)
    offset = pixel_offset(camera, cells, pixels_of_points(camera, points))
    share = np.linalg.norm(offset, axis=-1) / np.hypot(camera.width, camera.height)
    share = np.fmin(share, 1.0)  # 1 where the camera cannot show the point
    with np.errstate(invalid="ignore"):
        return np.asarray((share * seen).sum(axis=1) / seen.sum(axis=1))


def write_cell_depth(path: Path, depth_m: Array) -> None:
    """Write depths (N, 48) in whole millimetres, 0 where there is none."""
    depth_mm = np.where(np.isfinite(depth_m), np.round(depth_m * 1000), 0).clip(0, 65535)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.save(file, depth_mm.astype(np.uint16))


def read_cell_depth(path: Path, n_frames: int) -> Array:
    """Read depths (n_frames, 48) of the first frames of a file; ``inf`` where nothing is.

    Raises:
        InputError: The file cannot be read, holds something else, or fewer frames.
    """
    with read_as(path, "depths", OSError, ValueError, EOFError, remedy="; make it again"):
        # A map is refused where the header claims more than the file holds; an array is not.
        depth_mm = np.load(path, mmap_mode="r", allow_pickle=False)
    if depth_mm.dtype != np.uint16 or depth_mm.shape[1:] != (CELLS[0] * CELLS[1],):
        raise InputError(path, f"does not hold depths of {CELLS[0]} x {CELLS[1]} cells")
    if len(depth_mm) < n_frames:
        raise InputError(
            path, f"holds {len(depth_mm)} frames, {n_frames} are needed", "make it again"
        )
    depth_mm = depth_mm[:n_frames]
    return np.where(depth_mm > 0, depth_mm / 1000.0, np.inf)


def depth_of_images(paths: Iterable[FrameFile], camera: CameraConfig) -> Iterator[Array]:
    """Yield depths (48,) at the centres of the cells from depth images of the camera's size."""
    column, row = cell_centres_px(camera, *CELLS).reshape(-1, 2).astype(int).T
    for path in paths:
        depth_m = read_depth_m(path, size=(camera.width, camera.height), remedy=OTHER_CAMERA)
        yield depth_m[row, column].astype(np.float64)


def write_scene_depth(collision: Path, plan: Path, camera: CameraConfig, out_depth: Path) -> None:
    """Write the depth of a collision mesh at the cells of planned frames."""
    # Scoring does without them.
    from synfeal.mesh.rays import RayCaster
    from synfeal.mesh.triangles import load_collision_mesh

    caster = RayCaster(*load_collision_mesh(collision))
    poses = read_pose_table(plan).world_from_cam
    write_cell_depth(out_depth, cell_depth_m(caster, camera, poses))
