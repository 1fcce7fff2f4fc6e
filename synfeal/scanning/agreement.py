"""Do depth and poses agree? Asked before anything is fused, in a second.

Points that one frame measured are moved into the others by the poses. Where another frame measured
depth too, the two agree, or the point lies behind what the other sees, which proves nothing, or
before it: then the other has looked through it, and something is wrong. The number is the share of
agreeing points among those that agree or are looked through. It is about 0.95 for a real Kinect
sequence with poses from fusing it, below 0.5 where the unit of depth is wrong by a factor of two or
more, and 0.2 where poses are taken in the wrong direction; so the mistakes people make are tried,
and the one that explains the images is named.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import normalised_of_pixels, pixels_of_normalised
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.posed_sequence import PosedFrames
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse
from synfeal.scanning.camera import RgbdCamera
from synfeal.scanning.consistency import spread
from synfeal.scanning.reading import Depth, read_depth_m

Array = NDArray[np.float64]
N_FRAMES, N_POINTS = 24, 300  # frames that are compared, each with each, and points of each
TOLERANCE = 0.03  # of depth, within which two measurements agree
FOCAL_TOLERANCE = 0.015  # the same, for comparing focal lengths
MIN_COMPARED = 300  # points that another frame must have measured, for anything to be said
GOOD, CLEARLY = 0.7, 0.15  # share that is not doubted; by how much a better explanation is better
# What a person may have meant: units that depth is stored in.
UNITS_PER_M = (1.0, 100.0, 1000.0, 4000.0, 5000.0, 10_000.0)
FOCAL_FACTORS = np.linspace(0.8, 1.2, 21)


@dataclass(frozen=True)
class Sample:
    """Depth images of some frames, and points measured in them.

    Attributes:
        depth_m: (H, W) of each frame in the given unit, 0 where nothing was measured.
        pixel: (P, 2) of each frame.
        point_depth_m: (P,) of each frame, at these pixels.
        world_from_depth: Poses (N, 4, 4) of the depth camera as they are given.
    """

    depth_m: tuple[Depth, ...]
    pixel: tuple[Array, ...]
    point_depth_m: tuple[Array, ...]
    world_from_depth: Array


def sample_of(frames: PosedFrames, camera: RgbdCamera) -> Sample:
    """Read some depth images, evenly spread over the sequence."""
    rng = np.random.default_rng(0)
    size = (camera.depth.width, camera.depth.height)
    depths, pixels, values, index = [], [], [], []
    for number in spread(len(frames), N_FRAMES):
        file = frames.depth[number]
        assert file is not None
        depth_m = read_depth_m(file, camera.depth_units_per_m, size)
        known = np.flatnonzero(depth_m > 0)
        if not len(known):
            continue
        chosen = rng.choice(known, N_POINTS)
        row, column = np.divmod(chosen, camera.depth.width)
        depths.append(depth_m)
        pixels.append(np.stack([column, row], axis=1) + 0.5)
        values.append(depth_m.reshape(-1)[chosen].astype(np.float64))
        index.append(number)
    poses = frames.world_from_cam[index].reshape(-1, 4, 4) @ inverse(camera.depth_from_color)
    return Sample(tuple(depths), tuple(pixels), tuple(values), poses)


def agreement(
    sample: Sample,
    camera: CameraConfig,
    scale: float = 1.0,
    inverted: bool = False,
    tolerance: float = TOLERANCE,
) -> float:
    """Measure which share of points other frames confirm, of those they confirm or look through.

    Args:
        sample: Of depth images.
        camera: Of depth.
        scale: Factor on all depths.
        inverted: Take the poses in the other direction.
        tolerance: Relative difference of depth that counts as agreement.

    Returns:
        0 to 1; NaN where too few points fall on what another frame measured.
    """
    poses = inverse(sample.world_from_depth) if inverted else sample.world_from_depth
    world = []
    for pixel, depth, pose in zip(sample.pixel, sample.point_depth_m, poses, strict=True):
        rays = np.column_stack([normalised_of_pixels(camera, pixel), np.ones(len(pixel))])
        world.append(rays * (scale * depth)[:, None] @ pose[:3, :3].T + pose[:3, 3])
    owner = np.repeat(np.arange(len(world)), [len(points) for points in world])
    points = np.concatenate(world) if world else np.empty((0, 3))
    agreeing = looked_through = compared = 0
    for number, (depth_m, pose) in enumerate(zip(sample.depth_m, poses, strict=True)):
        local = (points[owner != number] - pose[:3, 3]) @ pose[:3, :3]
        local = local[local[:, 2] > 0.05 * min(scale, 1.0)]
        pixel = pixels_of_normalised(camera, local[:, :2] / local[:, 2:])
        with np.errstate(invalid="ignore"):
            inside = ((pixel >= 0) & (pixel < [camera.width, camera.height])).all(axis=1)
        column, row = pixel[inside].astype(np.int64).T
        measured = scale * depth_m[row, column].astype(np.float64)
        known = measured > 0
        off = local[inside][known, 2] / measured[known] - 1.0
        agreeing += int((np.abs(off) < tolerance).sum())
        looked_through += int((off <= -tolerance).sum())
        compared += len(off)
    if compared < MIN_COMPARED:
        return float("nan")
    return agreeing / max(1, agreeing + looked_through)


@dataclass(frozen=True)
class DepthAgreement:
    """Agreement of depth images with poses.

    Attributes:
        share: See :func:`agreement`; NaN where the frames do not overlap.
        best_focal_px: Focal length of the depth camera at which they agree best.
    """

    share: float
    best_focal_px: float


def check_depth(frames: PosedFrames, camera: RgbdCamera) -> DepthAgreement:
    """Refuse depth and poses that do not belong together.

    Raises:
        InputError: They agree much better when depth is of another unit or poses are of the other
            direction, which is named; or they agree in no way.
    """
    sample = sample_of(frames, camera)
    if not len(sample.depth_m):
        raise InputError(f"{frames.depth[0]}: measures nothing, and neither do other depth images")
    share = agreement(sample, camera.depth)
    if np.isnan(share) or share < GOOD:
        _blame(sample, camera, share, str(frames.depth[0]))
    return DepthAgreement(share, _best_focal_px(sample, camera.depth))


def _blame(sample: Sample, camera: RgbdCamera, share: float, where: str) -> None:
    """Name what explains depth and poses better than what was given, if anything does."""
    given = 0.0 if np.isnan(share) else share
    tried: dict[str, float] = {}
    for inverted in (False, True):
        for units in dict.fromkeys((camera.depth_units_per_m, *UNITS_PER_M)):
            changes = []
            if inverted:
                changes.append("the poses are cam_from_world: give --poses-are cam_from_world")
            if units != camera.depth_units_per_m:
                changes.append(f"a metre is stored as {units:g}: give --depth-scale {units:g}")
            if changes:
                scale = camera.depth_units_per_m / units
                value = agreement(sample, camera.depth, scale, inverted)
                tried[" and ".join(changes)] = 0.0 if np.isnan(value) else value
    better = max(tried, key=lambda name: tried[name])
    if tried[better] >= max(0.5, given + CLEARLY):
        raise InputError(
            f"{where}: depth and poses do not fit together ({given:.0%} of what frames measure is"
            f" where others see it), but they do ({tried[better]:.0%}) if {better}"
        )
    if given < 0.5 and not np.isnan(share):
        raise InputError(
            f"{where}: depth and poses do not fit together: {given:.0%} of what frames measure is"
            " where others see it; check --depth-camera or --preset, --depth-scale, and that the"
            " poses are of these frames"
        )


def _best_focal_px(sample: Sample, camera: CameraConfig) -> float:
    """Find the focal length (px, along x) of the depth camera with which frames agree best."""
    values = [
        agreement(sample, _zoomed(camera, float(factor)), tolerance=FOCAL_TOLERANCE)
        for factor in FOCAL_FACTORS
    ]
    filled = np.nan_to_num(values, nan=0.0)
    best = int(filled.argmax())
    factor = float(FOCAL_FACTORS[best])
    if 0 < best < len(filled) - 1:
        left, middle, right = filled[best - 1 : best + 2]
        bend = left - 2.0 * middle + right
        if bend < 0:  # the top of the parabola through the three
            factor += 0.5 * (left - right) / bend * float(FOCAL_FACTORS[1] - FOCAL_FACTORS[0])
    return float(camera.intrinsics.fx * factor)


def _zoomed(camera: CameraConfig, factor: float) -> CameraConfig:
    fx, fy, _, _ = camera.intrinsics
    return replace_focal_lengths(camera, fx * factor, fy * factor)


def replace_focal_lengths(camera: CameraConfig, fx: float, fy: float) -> CameraConfig:
    """Return the camera with other focal lengths, pixels."""
    _, _, cx, cy = camera.intrinsics
    return camera.model_copy(update={"fx": fx, "fy": fy, "cx": cx, "cy": cy})
