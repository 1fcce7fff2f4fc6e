"""Are normals and masks what they say they are, and of what depth shows?

Normals are compared with those of the surfaces that depth makes, by their means over cells of the
image: depth in millimetres is too coarse to give a normal for each pixel, and on a scanned mesh
those of neighbouring triangles differ by tens of degrees. Swapped, flipped or turned axes, normals
of the world, and those of another view differ in the means, too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import cell_directions
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.images import read_rgb
from synfeal.dataset.layer_files import (
    MASKS,
    MIDDLE,
    SCALE,
    InstanceTable,
    normals_of_pixels,
    read_instances,
    read_mask,
)
from synfeal.dataset.sequence_listing import DEPTH, MASK, NORMAL, Frame, SequenceListing
from synfeal.errors import InputError
from synfeal.validation.check import PNG, Check

MOST_COMPARED = 60  # frames whose normals are compared with depth
COLUMNS, ROWS = 16, 12  # cells of an image
MOST_DEG = 10.0  # median over the cells of a frame
LENGTH_SLACK = 0.02  # rounding makes stored normals up to 0.007 longer or shorter
MOST_APART = 0.01  # share of the pixels where layers and depth differ in whether there is anything
FACING = 0.02  # cosine to the ray from which a normal points away from the camera

Array = NDArray[np.float64]


def check_layers(
    dataset: Path,
    sequences: Sequence[SequenceListing],
    camera: CameraConfig | None,
    on_frame: Callable[[], object],
) -> list[Check]:
    """Check normals and masks; no check of what a data set does not have.

    Args:
        dataset: Its directory.
        sequences: Its sequences.
        camera: Its camera, None where that is not known.
        on_frame: Called for each frame that is read.
    """
    with_normals, with_masks, with_depth = (
        [Frame(s.path, number) for s in sequences for number in sorted(s.numbers[kind])]
        for kind in (NORMAL, MASK, DEPTH)
    )
    known = set(with_depth)
    checks = []
    if with_normals:
        comparable = [frame for frame in with_normals if frame in known]
        checks.append(_check_normals(with_normals, comparable, camera, on_frame))
    if with_masks:
        checks.append(_check_masks(dataset, with_masks, known, camera, on_frame))
    return checks


def _check_normals(
    frames: Sequence[Frame],
    with_depth: Sequence[Frame],
    camera: CameraConfig | None,
    on_frame: Callable[[], object],
) -> Check:
    """Check that normals are unit vectors that face the camera and agree with depth."""
    failures: list[str] = []
    worst_deg, n_compared = 0.0, 0
    step = max(1, -(-len(with_depth) // MOST_COMPARED))
    compared = set(with_depth[::step])
    rays = None if camera is None else cell_directions(camera, camera.width, camera.height)
    for frame in frames:
        on_frame()
        path = frame.path(NORMAL)
        try:
            pixels = read_rgb(path, formats=PNG)
        except InputError as error:
            failures.append(str(error))
            continue
        known = pixels.any(axis=-1)
        length = np.linalg.norm((pixels[known].astype(np.float64) - MIDDLE) / SCALE, axis=-1)
        if (np.abs(length - 1.0) > LENGTH_SLACK).any():
            failures.append(f"{path}: holds normals that are not of length 1")
            continue
        if rays is None or camera is None:
            continue
        if pixels.shape[:2] != rays.shape[:2]:
            failures.append(f"{path}: is not {camera.width} x {camera.height}")
            continue
        normals = normals_of_pixels(pixels).astype(np.float64)
        lengths = np.linalg.norm(rays, axis=-1)
        away = np.einsum("hwi,hwi->hw", normals, rays) > FACING * lengths
        if away.mean() > MOST_APART:
            failures.append(f"{path}: {away.mean():.0%} of its normals point away from the camera")
            continue
        if frame in compared:
            angle_deg = _angle_to_depth_deg(normals, frame, rays)
            if angle_deg is None:
                continue
            n_compared += 1
            worst_deg = max(worst_deg, angle_deg)
            if angle_deg > MOST_DEG:
                failures.append(
                    f"{path}: is {angle_deg:.0f} degrees off the surfaces of its depth image, bound"
                    f" {MOST_DEG:g}; normals are in the frame of the camera: x right, y down, z"
                    " forward"
                )
    text = f"of {len(frames)} frames"
    if n_compared:
        text += f"; of {n_compared} against depth, worst {worst_deg:.1f} deg (bound {MOST_DEG:g})"
    return Check("normals", text, tuple(failures))


def _angle_to_depth_deg(normals: Array, frame: Frame, rays: Array) -> float | None:
    """Return the median angle between normals of cells and of depth; None if little is seen."""
    try:
        depth_m = read_depth_m(frame.path(DEPTH), nothing=np.nan)
    except InputError:
        return None  # the check of images says so
    if depth_m.shape != normals.shape[:2]:
        return None
    points = depth_m[..., None] * rays
    reach = max(1, depth_m.shape[1] // 80)  # differences over many pixels drown the rounding
    along_x = points[reach:-reach, 2 * reach :] - points[reach:-reach, : -2 * reach]
    along_y = points[2 * reach :, reach:-reach] - points[: -2 * reach, reach:-reach]
    of_depth = np.cross(along_y, along_x)
    of_depth /= np.maximum(np.linalg.norm(of_depth, axis=-1, keepdims=True), 1e-12)
    stored = normals[reach:-reach, reach:-reach].copy()
    missing = ~np.isfinite(of_depth).all(axis=-1) | ~stored.any(axis=-1)
    of_depth[missing], stored[missing] = 0.0, 0.0
    cells = [_cell_sums(each) for each in (of_depth, stored)]
    # In a cell of several surfaces, and of edges between them, the means say little.
    per_cell = stored.shape[0] * stored.shape[1] / (COLUMNS * ROWS)
    lengths = [np.linalg.norm(each, axis=-1) for each in cells]
    plain = np.minimum(*lengths) > 0.7 * per_cell
    if np.count_nonzero(plain) < 10:
        return None
    cosine = np.einsum("ni,ni->n", cells[0][plain], cells[1][plain])
    cosine /= lengths[0][plain] * lengths[1][plain]
    return float(np.degrees(np.median(np.arccos(np.clip(cosine, -1.0, 1.0)))))


def _cell_sums(vectors: Array) -> Array:
    """Sum vectors (H, W, 3) over the cells of an image: (12 * 16, 3)."""
    rows = np.linspace(0, vectors.shape[0], ROWS + 1).astype(int)[:-1]
    columns = np.linspace(0, vectors.shape[1], COLUMNS + 1).astype(int)[:-1]
    sums = np.add.reduceat(np.add.reduceat(vectors, rows, axis=0), columns, axis=1)
    return np.asarray(sums.reshape(-1, 3))


def _check_masks(
    dataset: Path,
    frames: Sequence[Frame],
    with_depth: set[Frame],
    camera: CameraConfig | None,
    on_frame: Callable[[], object],
) -> Check:
    """Check that the table knows all ids, and that nothing is masked where depth shows nothing."""
    try:
        table = read_instances(dataset)
    except InputError as error:
        return Check("masks", f"no {MASKS}", (str(error),))
    failures: list[str] = []
    seen: set[int] = set()
    for frame in frames:
        on_frame()
        try:
            failures += _mask_failures(frame, table, frame in with_depth, camera, seen)
        except InputError as error:
            failures.append(str(error))
    return Check("masks", f"of {len(frames)} frames, {len(seen)} instances seen", tuple(failures))


def _mask_failures(
    frame: Frame,
    table: InstanceTable,
    has_depth: bool,
    camera: CameraConfig | None,
    seen: set[int],
) -> list[str]:
    """List faults of one mask; adds the ids that it shows to ``seen``."""
    path = frame.path(MASK)
    ids = read_mask(path)
    if camera is not None and ids.shape != (camera.height, camera.width):
        return [f"{path}: is not {camera.width} x {camera.height}"]
    found = np.unique(ids)
    seen.update(found[found > 0].tolist())
    unknown = found[~table.knows(found)]
    if len(unknown):
        return [f"{path}: shows instance {unknown[0]}, which {MASKS} does not list"]
    if has_depth:
        depth_m = read_depth_m(frame.path(DEPTH))
        if depth_m.shape == ids.shape:
            apart = float(np.mean((ids == 0) != np.isinf(depth_m)))
            if apart > MOST_APART:
                return [
                    f"{path}: differs from the depth image in where there is anything, in"
                    f" {apart:.0%} of the pixels"
                ]
    return []
