"""Pairs of frames of one sequence compared by reprojection, and what they show of each frame.

Bounds hold for rendered frames; ``tests/synfeal/test_validate.py`` has faultless sets that pass.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from statistics import median_low

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from synfeal.camera.projection import horizontal_fov_rad, normalised_of_pixels, pixels_of_normalised
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import MILLIMETRES, read_depth_m
from synfeal.dataset.frame_poses import Poses
from synfeal.dataset.images import read_rgb
from synfeal.dataset.known_camera import KnownCamera
from synfeal.dataset.sequence_listing import COLOR, DEPTH, RIGHT_COLOR, RIGHT_DEPTH, Frame
from synfeal.errors import InputError
from synfeal.geometry.poses import moved_right, pose_error
from synfeal.validation.camera import Lens, lens_of
from synfeal.validation.check import PNG, Check
from synfeal.validation.poses import GAPS
from synfeal.validation.reprojection import ComparedFrame, Residual, camera_normal, compare

GRID_PIXELS = 5000  # pixels of each frame that are moved to the other one
MIN_OVERLAP = 0.2
# Frames that moved and turned by less must share most of what they see, in any scene.
SMALL_STEP_M = 0.3
SMALL_TURN = 0.25  # share of the field of view
# From much nearer or farther, a texture is drawn at another level of detail.
COLOR_OVERLAP = 0.6
VIEWS_BYTES = 2**29  # decoded frames that are kept; a pixel takes 13 bytes
CAMERA_PAIRS = 200  # from which the camera is judged, evenly spread over more

LUMA = np.array([0.299, 0.587, 0.114], np.float32)
# What is moved to see how the depths follow: principal point, pixels, and log of the focal length.
DELTA = np.array([0.25, 0.25, 0.002])
CAMERA_BOUNDS = np.array([0.25, 0.25, 0.005])
MIN_INFORMATION = 400.0  # the standard error of a correction is then a twentieth of its bound


@dataclass(frozen=True)
class Measure:
    """One residual with its bound: what it tells apart, and how it is printed."""

    name: str
    field: str
    bound: float
    unit: str
    what: str
    min_overlap: float = MIN_OVERLAP


TIMES = " times what rounding and slant explain"
MEASURES = (
    Measure("depth", "depth", 1.0, TIMES, "median difference in depth"),
    Measure("surfaces", "in_front", 0.05, "", "share of points in front of what is seen"),
    Measure("colours", "grey", 15.0, " grey levels", "median difference in grey", COLOR_OVERLAP),
    Measure("alignment", "shift_px", 0.12, " px", "shift that explains the grey", COLOR_OVERLAP),
)


def measures_of(lens: Lens) -> tuple[Measure, ...]:
    """Return the measures, described as they are taken through a lens."""
    if lens.share == 0.5:
        return MEASURES
    depth, *others = MEASURES
    return (replace(depth, what=f"difference in depth of {lens.share:.0%} of the points"), *others)


@dataclass(frozen=True)
class Pair:
    """Two frames of a sequence and their residual, None where they share too little."""

    a: Frame
    b: Frame
    residual: Residual | None


def check_consistency(
    pairs: Iterable[tuple[Frame, Frame]],
    poses: Poses,
    camera: KnownCamera,
    on_pair: Callable[[], object],
) -> list[Check]:
    """Compare pairs of frames: check their overlap, each measure and the camera.

    Args:
        pairs: Pairs of frames of one sequence.
        poses: Poses of all of these frames.
        camera: Camera of the frames. If it is assumed, checks report what they find as skipped.
        on_pair: Called after each pair.
    """
    config = camera.depth
    step = max(1, round(math.sqrt(config.width * config.height / GRID_PIXELS)))
    lens = lens_of(config, step)
    has_intrinsics = config.projection != "equirectangular"
    moves = np.diag(DELTA).tolist() if has_intrinsics else []
    moved = [lens_of(config, step, tuple(row)) for row in moves]
    n_views = max(GAPS[-1] + 2, VIEWS_BYTES // (13 * config.width * config.height))
    view = lru_cache(n_views)(lambda frame: _view(frame, poses[frame], camera))
    pairs, compared = list(pairs), list[Pair]()
    every = max(1, math.ceil(len(pairs) / CAMERA_PAIRS))
    system = np.zeros((len(DELTA), len(DELTA) + 1))
    for a, b in pairs:
        view_a, view_b, residual = view(a), view(b), None
        if view_a and view_b:
            residual = compare(view_a, view_b, lens)
            if residual and residual.overlap < MIN_OVERLAP:
                residual = None
            is_judged = bool(moved) and len(compared) % every == 0
            if is_judged and residual and not residual.hidden:
                system += camera_normal(view_a, view_b, lens, moved, DELTA)
        compared.append(Pair(a, b, residual))
        on_pair()
    checks = [_overlap_check(compared, poses, config)]
    checks += [measure_check(measure, compared) for measure in measures_of(lens)]
    if has_intrinsics:
        checks.append(_camera_check(system, camera))
    if not camera.assumed:
        return checks
    why = "not judged, the camera is assumed"
    return [Check(check.name, f"{check.text}; {why}", skipped=True) for check in checks]


def check_stereo(
    frames: Sequence[Frame],
    poses: Poses,
    camera: KnownCamera,
    on_frame: Callable[[], object],
) -> Check:
    """Compare the two images of stereo pairs as any two frames are.

    Args:
        frames: Frames to look at.
        poses: Poses of the left camera.
        camera: The camera, which says how far apart the two are.
        on_frame: Called for each frame.
    """
    baseline_m = camera.config.stereo_baseline_m
    assert baseline_m is not None
    config = camera.config
    lens = lens_of(config, max(1, round(math.sqrt(config.width * config.height / GRID_PIXELS))))
    worst = {measure.field: 0.0 for measure in MEASURES}
    failures = []
    n_compared = 0
    for frame in frames:
        on_frame()
        left = _view(frame, poses[frame], camera)
        moved = moved_right(poses[frame], baseline_m)
        right = _view(frame, moved, camera, color=RIGHT_COLOR, depth=RIGHT_DEPTH)
        residual = compare(left, right, lens) if left and right else None
        if residual is None or residual.hidden:
            continue
        n_compared += 1
        for measure in measures_of(lens):
            value = getattr(residual, measure.field)
            if residual.overlap < measure.min_overlap or not math.isfinite(value):
                continue
            worst[measure.field] = max(worst[measure.field], value)
            if value > measure.bound:
                failures.append(
                    f"{frame.path(RIGHT_COLOR)}: {measure.what} from the left image is"
                    f" {value:.2g}{measure.unit}, bound {measure.bound:g}; is the pair"
                    f" {baseline_m:g} m apart?"
                )
    # An edge may hide from one of two right images what the other sees.
    wrong = tuple(failures) if 2 * len({f.partition(":")[0] for f in failures}) > n_compared else ()
    said = f"depth {worst['depth']:.2g}, shift {worst['shift_px']:.2g} px at worst"
    return Check("stereo", f"{n_compared} pairs {baseline_m:g} m apart, {said}", wrong)


def _view(
    frame: Frame,
    world_from_cam: NDArray[np.float64],
    camera: KnownCamera,
    color: str = COLOR,
    depth: str = DEPTH,
) -> ComparedFrame | None:
    """Read a frame; None if it is unreadable or of another size, as other checks report.

    Colours are those of the pixels of depth, whichever camera took them.
    """
    try:
        depth_m = read_depth_m(frame.path(depth))
        grey = read_rgb(frame.path(color), formats=PNG).astype(np.float32) @ LUMA
    except InputError:
        return None
    if grey.shape != (camera.config.height, camera.config.width):
        return None
    if depth_m.shape != (camera.depth.height, camera.depth.width):
        return None
    if camera.of_depth is not None:
        grey = _registered(grey, camera.config, camera.of_depth)
    unit_m = 1.0 / (camera.depth.depth_units_per_m or MILLIMETRES)
    return ComparedFrame(world_from_cam, depth_m, grey, unit_m)


def _registered(
    grey: NDArray[np.float32], color: CameraConfig, depth: CameraConfig
) -> NDArray[np.float32]:
    """Resample an image (H, W) of the colour camera to a depth camera in the same place."""
    column, row = np.meshgrid(np.arange(depth.width) + 0.5, np.arange(depth.height) + 0.5)
    pixel = pixels_of_normalised(color, normalised_of_pixels(depth, np.stack([column, row], -1)))
    places = pixel[..., ::-1].transpose(2, 0, 1) - 0.5  # rows and columns, the first at 0
    resampled: NDArray[np.float32] = map_coordinates(grey, places, order=1, mode="nearest")
    return resampled


def _overlap_check(pairs: list[Pair], poses: Poses, camera: CameraConfig) -> Check:
    """Check that most pairs see the same surfaces; otherwise nothing below means anything.

    That is, frames that hardly moved must see each other's points at all, and of frames that have
    them in their views most must not have all of them hidden behind what they see.
    """
    seen = [pair for pair in pairs if pair.residual]
    hidden = [pair for pair in seen if pair.residual and pair.residual.hidden]
    text = (
        f"{len(seen) - len(hidden)} of {len(pairs)} pairs of frames see {MIN_OVERLAP:.0%} of each"
        " other's view"
    )
    near = [pair for pair in pairs if _are_neighbours(pair, poses, camera)]
    lost = [pair for pair in near if pair.residual is None]
    failures: tuple[str, ...] = ()
    if 2 * len(lost) > len(near):
        failures = (
            f"{lost[0].a.path(DEPTH)}: puts next to nothing into the view of a frame near it, and"
            f" so do {len(lost) - 1} others of {len(near)}",
        )
    elif 2 * len(hidden) > len(seen):
        failures = (
            f"{hidden[0].a.path(DEPTH)}: all of it is hidden in frame {hidden[0].b.number}, and so"
            f" it is in {len(hidden) - 1} others of {len(seen)} pairs; is depth in the units"
            " that the manifest says (millimetres, or camera.depth_units_per_m)?",
        )
    return Check("pairs", text, failures)


def _are_neighbours(pair: Pair, poses: Poses, camera: CameraConfig) -> bool:
    step_m, turn_rad = pose_error(poses[pair.a], poses[pair.b])
    view_rad = horizontal_fov_rad(camera)
    return bool(step_m <= SMALL_STEP_M and turn_rad <= SMALL_TURN * view_rad)


def measure_check(measure: Measure, pairs: list[Pair]) -> Check:
    """Check that each frame agrees with most of those it is compared with."""
    values = [
        (pair, value)
        for pair in pairs
        if pair.residual and pair.residual.overlap >= measure.min_overlap
        if math.isfinite(value := getattr(pair.residual, measure.field))
    ]
    if not values:
        return Check(measure.name, "no pair of frames shows it", skipped=True)
    by_frame = defaultdict(list)
    for pair, value in values:
        by_frame[pair.a].append(value)
        by_frame[pair.b].append(value)
    # Beyond the bound where more than half of its pairs are: a wrong frame disagrees with most
    # others, and one pair of right ones can disagree alone, where an edge hides from one of them
    # what the other sees.
    frames = {frame: median_low(of_frame) for frame, of_frame in by_frame.items()}
    worst = f"worst of {len(frames)} frames {max(frames.values()):.2g}{measure.unit}"
    bound = f"(bound {measure.bound:g}{measure.unit})"
    text = f"{measure.what}, {worst} by the median of its pairs {bound}"
    wrong = [
        (pair, value)
        for pair, value in values
        if value > measure.bound < max(frames[pair.a], frames[pair.b])
    ]
    return Check(measure.name, text, (_blame(measure, wrong, len(values)),) if wrong else ())


def _blame(measure: Measure, wrong: list[tuple[Pair, float]], total: int) -> str:
    """Name the frame that is in the most wrong pairs, the earliest of several."""
    counts = Counter(frame for pair, _ in wrong for frame in (pair.a, pair.b))
    frame = min(counts, key=lambda f: (-counts[f], f.sequence.name, f.number))
    pair, value = max((p for p in wrong if frame in (p[0].a, p[0].b)), key=lambda p: p[1])
    other = pair.b if frame == pair.a else pair.a
    kind = DEPTH if measure.field in ("depth", "in_front") else COLOR
    return (
        f"{frame.path(kind)}: {measure.what} from frame {other.number} is {value:.2g}{measure.unit}"
        f", bound {measure.bound:g}; {len(wrong)} of {total} pairs are beyond it,"
        f" {counts[frame]} of them with this frame"
    )


def _camera_check(system: NDArray[np.float64], camera: KnownCamera) -> Check:
    """Find the change of the camera that would make depths agree best; none for the right one."""
    normal = system[:, :-1]
    # A bound's worth of change must move the depths noticeably, against what may differ.
    weakest = np.linalg.eigvalsh(normal * np.outer(CAMERA_BOUNDS, CAMERA_BOUNDS))[0]
    if weakest < MIN_INFORMATION:
        return Check("camera", "these pairs do not show it: they hardly turn", skipped=True)
    change = np.linalg.solve(normal, system[:, -1])
    said = f"principal point ({change[0]:+.2f}, {change[1]:+.2f}) px, focal length {change[2]:+.2%}"
    bounds = f"{CAMERA_BOUNDS[0]:g} px, {CAMERA_BOUNDS[2]:.1%}"
    text = f"correction that fits depth best: {said} (bounds {bounds})"
    fits = (np.abs(change) <= CAMERA_BOUNDS).all()
    failure = f"{camera.source}: camera: depth fits best with {said}; bounds {bounds}"
    return Check("camera", text, () if fits else (failure,))
