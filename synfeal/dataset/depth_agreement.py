"""Do depth and poses agree? Asked in a second before posed depth is used for anything.

Points that one frame measured are moved into the others by the poses. Where another frame measured
depth too, the two agree, or the point lies behind what the other sees, which proves nothing, or
before it: then the other has looked through it, and something is wrong. The number is the share of
agreeing points among those that agree or are looked through. It is about 0.95 for a real Kinect
sequence with poses from fusing it, below 0.5 where the unit of depth is wrong by a factor of two or
more, and 0.2 where poses are taken in the wrong direction; so the mistakes people make are tried,
and the one that explains the images is named.
"""

from __future__ import annotations

import itertools
import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import normalised_of_pixels, pixels_of_normalised
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
from synfeal.geometry.axes import DESCRIPTIONS, CameraAxes, with_our_axes
from synfeal.geometry.poses import inverse, pose_matrix, quat_wxyz_of
from synfeal.geometry.rotations import matrix_from_quat_wxyz

log = logging.getLogger("synfeal")

Array = NDArray[np.float64]
Depth = NDArray[np.float32]
N_FRAMES, N_POINTS = 24, 300  # frames that are compared, each with each, and points of each
FRAMES_TRIED, POINTS_TRIED = 14, 100  # the same, where another reading is tried
TOLERANCE = 0.03  # relative difference of depths that agree
FOCAL_TOLERANCE = 0.015  # the same, for comparing focal lengths
MIN_FRAMES = 4  # two or three may be strange to each other without being wrong
MIN_COMPARED = 300  # points that another frame must have measured, for anything to be said
# Of them this share must agree for an explanation to be one: where nearly all is said to be hidden,
# little speaks against anything.
MIN_AGREEING = 0.1
MIN_JUDGED = 0.01  # share of them that must not be hidden, for anything to be said
GOOD, CLEARLY = 0.85, 0.15  # share that is not doubted; by how much a better explanation is better
BAD = 0.5  # share below which nothing can be made of the frames
# What a person may have meant: units that depth is stored in, and positions are written in.
UNITS_PER_M = (100.0, 1000.0, 4000.0, 5000.0, 10_000.0)
POSITION_UNITS = {1000.0: "millimetres", 100.0: "centimetres"}
WHOLE_METRES_PER_M = 1.0
# Depth below is rather of another unit than of a scene.
LEAST_USUAL_M = 0.05
FOCAL_FACTORS = np.linspace(0.8, 1.2, 21)


def spread(total: int, count: int) -> list[int]:
    """Return at most ``count`` indices below ``total``, evenly spread."""
    count = min(count, total)
    return [index * total // count for index in range(count)]


@dataclass(frozen=True)
class PosedDepth:
    """Depth images with poses, as a command is about to use them.

    Attributes:
        files: Name of each of the N depth images, for messages.
        read_m: Reads an image (H, W) by its index: metres, 0 or inf where nothing was measured.
        world_from_cam: Poses (N, 4, 4) of the colour camera.
        camera: Perspective camera of the depth images.
        depth_from_cam: Rigid motion (4, 4) from the colour camera to that of depth.
        units_per_m: What a depth of one metre is stored as.
        options: Options by which the command takes other poses or units: ``convention``,
            ``--depth-scale``.
    """

    files: Sequence[object]
    read_m: Callable[[int], Depth]
    world_from_cam: Array
    camera: CameraConfig
    depth_from_cam: Array
    units_per_m: float = 1000.0
    options: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Sample:
    """Depth images of some frames, and points measured in them.

    Attributes:
        depth_m: (H, W) of each frame in the given unit, 0 where nothing was measured.
        pixel: (P, 2) of each frame.
        point_depth_m: (P,) of each frame, at these pixels.
        world_from_cam: Poses (N, 4, 4) of the colour camera as they are given.
        cam_from_depth: Rigid motion (4, 4) from the camera of depth to that of colour.
    """

    depth_m: tuple[Depth, ...]
    pixel: tuple[Array, ...]
    point_depth_m: tuple[Array, ...]
    world_from_cam: Array
    cam_from_depth: Array

    def thinned(self) -> Sample:
        """Return some of its frames with some points of each, for a quick answer."""
        kept = spread(len(self.depth_m), FRAMES_TRIED)
        return replace(
            self,
            depth_m=tuple(self.depth_m[i] for i in kept),
            pixel=tuple(self.pixel[i][:POINTS_TRIED] for i in kept),
            point_depth_m=tuple(self.point_depth_m[i][:POINTS_TRIED] for i in kept),
            world_from_cam=self.world_from_cam[kept],
        )


def sample_of(posed: PosedDepth) -> Sample:
    """Read some depth images, evenly spread over the sequence."""
    rng = np.random.default_rng(0)
    depths, pixels, values, index = [], [], [], []
    for number in spread(len(posed.files), N_FRAMES):
        depth_m = np.nan_to_num(posed.read_m(number), nan=0.0, posinf=0.0, neginf=0.0)
        known = np.flatnonzero(depth_m > 0)
        if not len(known):
            continue
        chosen = rng.choice(known, N_POINTS)
        row, column = np.divmod(chosen, posed.camera.width)
        depths.append(depth_m)
        pixels.append(np.stack([column, row], axis=1) + 0.5)
        values.append(depth_m.reshape(-1)[chosen].astype(np.float64))
        index.append(number)
    return Sample(
        depth_m=tuple(depths),
        pixel=tuple(pixels),
        point_depth_m=tuple(values),
        world_from_cam=posed.world_from_cam[index].reshape(-1, 4, 4),
        cam_from_depth=inverse(posed.depth_from_cam),
    )


class Agreement(NamedTuple):
    """Agreement of depth and poses.

    Attributes:
        share: Share of points that other frames confirm, of those they confirm or look through; NaN
            where too few points fall on what another frame measured, or all of them are hidden.
        confirmed: Share of confirmed points among all that fall on what another frame measured.
    """

    share: float
    confirmed: float

    @property
    def explains(self) -> float:
        """The share, 0 where it rests on too little."""
        return self.share if self.confirmed >= MIN_AGREEING else 0.0  # not of NaN


def agreement(
    sample: Sample,
    camera: CameraConfig,
    world_from_cam: Array | None = None,
    scale: float = 1.0,
    tolerance: float = TOLERANCE,
) -> Agreement:
    """Measure which share of points other frames confirm.

    Args:
        sample: Sample of the depth images.
        camera: Camera of the depth images.
        world_from_cam: Poses (N, 4, 4) in place of the sample's.
        scale: Factor on all depths.
        tolerance: Relative difference of depth that counts as agreement.
    """
    poses = sample.world_from_cam if world_from_cam is None else world_from_cam
    poses = poses @ sample.cam_from_depth
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
    judged = agreeing + looked_through
    if compared < MIN_COMPARED or judged < MIN_JUDGED * compared:
        return Agreement(float("nan"), float("nan"))
    return Agreement(agreeing / judged, agreeing / compared)


Change = tuple[str, Callable[[Array], Array]]


def _rolled(places: int) -> Callable[[Array], Array]:
    """Return a function that takes quaternions' numbers in another order."""

    def change(pose: Array) -> Array:
        rotation = matrix_from_quat_wxyz(np.roll(quat_wxyz_of(pose), places, axis=-1))
        return pose_matrix(rotation, pose[..., :3, 3])

    return change


def _transposed(pose: Array) -> Array:
    return pose_matrix(np.swapaxes(pose[..., :3, :3], -1, -2), pose[..., :3, 3])


def _mirrored(pose: Array) -> Array:
    """Return left-handed poses, whose y points up, as right-handed ones of our camera."""
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    return np.asarray(mirror @ pose @ mirror)


def _axes_of(axes: CameraAxes) -> Callable[[Array], Array]:
    return lambda pose: with_our_axes(pose, axes)


def _readings(options: frozenset[str]) -> tuple[tuple[Change, ...], ...]:
    """List other ways to read poses, one group for each thing that may be meant otherwise."""
    can_choose = "convention" in options
    inverted = "the poses are cam_from_world: " + (
        'give `convention="cam_from_world"`' if can_choose else "invert each of them"
    )
    opengl = f"the camera's axes are {DESCRIPTIONS['opengl']}: " + (
        'give `convention="opengl"`'
        if can_choose
        else "multiply each pose by diag(1, -1, -1, 1) from the right"
    )
    ros = f"the poses are of a body ({DESCRIPTIONS['ros']}): give those of its camera"
    left = "the poses are left-handed, y up, as in Unity: flip y of world and camera"
    order = "the quaternions' numbers are in the order {}: write them in the order {}"
    xyzw, wxyz = "qx qy qz qw", "qw qx qy qz"
    return (
        (
            (order.format(xyzw, wxyz), _rolled(1)),
            (order.format(wxyz, xyzw), _rolled(-1)),
            ("the rotations are transposed: transpose their 3x3 part", _transposed),
        ),
        ((inverted, inverse),),
        ((opengl, _axes_of("opengl")), (ros, _axes_of("ros")), (left, _mirrored)),
    )


def _scales(posed: PosedDepth, sample: Sample) -> dict[str, float]:
    """Name factors by which depths may be wrong, relative to positions."""
    usual = float(np.median(np.concatenate(sample.point_depth_m))) >= LEAST_USUAL_M
    units = UNITS_PER_M if usual else (WHOLE_METRES_PER_M, *UNITS_PER_M)
    remedy = "give `depth_scale={0:g}`" if "depth_scale" in posed.options else "store {1}"
    found = {
        f"a metre of depth is stored as {value:g}: "
        + remedy.format(value, "it in millimetres"): posed.units_per_m / value
        for value in units
        if value != posed.units_per_m
    }
    if usual:
        for factor, name in POSITION_UNITS.items():
            found[f"positions are in {name}: divide them by {factor:g}"] = factor
    return found


class Explanation(NamedTuple):
    """Another reading of depth and poses: what to do, and the share of agreement it has."""

    remedy: str
    share: float


def explanation(posed: PosedDepth, sample: Sample) -> Explanation:
    """Find the other reading of poses and depth that explains the images best.

    Of readings that explain them, one with the fewest changes.
    """
    scales = _scales(posed, sample)
    sample = sample.thinned()
    best = Explanation("", 0.0)
    for n_changes in (1, 2):
        for changes, scale_name in _combinations(posed.options, scales, n_changes):
            poses = sample.world_from_cam
            for _, change in changes:
                poses = change(poses)
            scale = scales.get(scale_name, 1.0)
            share = agreement(sample, posed.camera, poses, scale).explains
            if share > best.share:
                names = [name for name, _ in changes] + [scale_name] * bool(scale_name)
                best = Explanation(", and ".join(names), share)
        if best.share >= GOOD:
            break
    return best


def _combinations(
    options: frozenset[str], scales: dict[str, float], n_changes: int
) -> Iterator[tuple[tuple[Change, ...], str]]:
    """Yield sets of so many changes, at most one of each group, and the name of a scale or ""."""
    for with_scale in (False, True):
        n_poses = n_changes - with_scale
        # Of two changes an option makes only one.
        groups = _readings(options if n_poses == 1 else frozenset())
        for some in itertools.combinations(groups, n_poses):
            for changes in itertools.product(*some):
                for name in scales if with_scale else [""]:
                    yield changes, name


@dataclass(frozen=True)
class DepthAgreement:
    """Agreement of depth images with poses.

    Attributes:
        share: See :class:`Agreement`; NaN where the frames do not overlap.
        problem: What is wrong and what to do, with the file; None where nothing is.
        sample: What was compared.
    """

    share: float
    problem: str | None
    sample: Sample


def compare_depth(posed: PosedDepth) -> DepthAgreement:
    """Compare frames with each other, and find what is wrong where they do not agree."""
    sample = sample_of(posed)
    first = str(posed.files[0])
    if not len(sample.depth_m):
        problem = f"{first}: measures nothing, and neither do other depth images"
        return DepthAgreement(float("nan"), problem, sample)
    if len(sample.depth_m) < MIN_FRAMES:
        return DepthAgreement(float("nan"), None, sample)
    given = agreement(sample, posed.camera)
    doubted = not given.explains >= GOOD  # true of NaN
    return DepthAgreement(
        share=given.share,
        problem=_problem(posed, sample, given, first) if doubted else None,
        sample=sample,
    )


def _problem(posed: PosedDepth, sample: Sample, given: Agreement, where: str) -> str | None:
    """Name what explains depth and poses better than what was given, if anything does."""
    share = 0.0 if np.isnan(given.share) else given.share
    better = explanation(posed, sample)
    if better.share >= max(BAD, share + CLEARLY):
        return (
            f"{where}: depth and poses do not fit together ({share:.0%} of what frames measure is"
            f" where others see it), but they do ({better.share:.0%}) if {better.remedy}"
        )
    if share < BAD and not np.isnan(given.share):
        return (
            f"{where}: depth and poses do not fit together: {share:.0%} of what frames measure is"
            " where others see it; check the camera of depth, its unit, and that the poses are of"
            " these frames"
        )
    return None


def check_depth(posed: PosedDepth) -> DepthAgreement:
    """Refuse depth and poses that do not belong together.

    Raises:
        InputError: They agree much better when depth or poses are read in another way, which is
            named; or they agree in no way.
    """
    found = compare_depth(posed)
    if found.problem is not None:
        raise InputError(found.problem)
    return found


def best_focal_px(sample: Sample, camera: CameraConfig) -> float:
    """Find the focal length (px, along x) of the depth camera with which frames agree best."""
    values = [
        agreement(sample, zoomed(camera, float(factor)), tolerance=FOCAL_TOLERANCE).share
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


def zoomed(camera: CameraConfig, factor: float) -> CameraConfig:
    """Return the camera with other focal lengths."""
    fx, fy, _, _ = camera.intrinsics
    return camera.model_copy(update={"fx": fx * factor, "fy": fy * factor})
