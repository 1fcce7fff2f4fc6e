"""``synfeal evaluate`` as a function: anyone's poses against a data set."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.captures.formats import is_capture
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.known_camera import camera_of_dataset
from synfeal.dataset.pose_list import Convention, PoseList, named_convention
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.poses_in import FormatName, read_pose_list
from synfeal.dataset.sequence_listing import DEPTH
from synfeal.errors import Argument, InputError, why
from synfeal.evaluation.bootstrap import FEWEST_PATHS
from synfeal.evaluation.captured import captured_frames
from synfeal.evaluation.coverage import Coverage, coverage
from synfeal.evaluation.estimates import checked_convention
from synfeal.evaluation.frames import UNSPLIT, ScoredFrames, match, read_scored_frames
from synfeal.evaluation.metrics import MEANS, ORIENTATION, POSITION, Metrics, pose_errors, summary
from synfeal.evaluation.reference import (
    MOST_APART_S,
    Clock,
    match_reference,
    met_in_time,
    read_reference,
)
from synfeal.evaluation.reprojection import dcre, dcre_summary, depth_of_images
from synfeal.geometry.limits import FARTHEST_M
from synfeal.geometry.poses import pose_error, quat_wxyz_of, umeyama_sim3
from synfeal.records.progress import Progress

log = logging.getLogger("synfeal")
Array = NDArray[np.float64]
Align = Literal["none", "se3", "sim3"]

# Endings of the names of errors against the data set's poses and against the second yardstick.
DATASET, LABELS = "", "_labels"
DEFAULT_RATE_HZ = 30.0
# Captures in this layout are read as data sets, splits and all.
DATASET_FORMAT = "7scenes"


class Settings(NamedTuple):
    """Choices a person has when poses are scored."""

    split: str = "test"  # ``test``, ``train`` or ``all``
    align: Align = "none"  # whether estimates are first moved onto the yardstick, as a whole
    # a key of ``CONVENTIONS``, or ``opengl``; None takes the format's and checks it
    convention: str | None = None
    rate_hz: float | None = None  # frames a second of time stamps; None is DEFAULT_RATE_HZ
    labels: Path | None = None  # poses of the same frames as a second yardstick
    camera: Path | None = None  # calibration file, for the DCRE
    file_format: FormatName | None = None  # None recognises it by what the file holds
    # between two files with times: largest difference of those of one pair, and what is added to
    # the times of the estimates
    most_apart_s: float = MOST_APART_S
    offset_s: float = 0.0


@dataclass(frozen=True)
class Evaluation:
    """Errors, scores and the frames and poses they are of."""

    frames: ScoredFrames  # what was scored
    estimates: PoseList  # what was read
    convention: Convention  # as which its poses were taken
    row: NDArray[np.int64]  # (N,) which estimate is of each frame, -1 where none is
    rotations: NDArray[np.bool_]  # (N,) frames whose estimate is a rotation
    # (N,) of all frames by name, infinite where there is no pose: ``position_m``,
    # ``orientation_deg``, ``dcre``, and the same ending in ``_labels``
    errors: dict[str, Array]
    metrics: Metrics  # medians, means, recalls, with limits where there are enough paths
    scales: dict[str, float]  # by ending, the scale of the alignment
    # of ``position_m`` and ``orientation_deg``, and the same ending in ``_labels``: how stated
    # radii fit the errors of the frames that have both; empty where none are stated
    coverage: dict[str, list[Coverage]]

    @property
    def ends(self) -> tuple[str, ...]:
        """Endings of the yardsticks there are."""
        return tuple(self.scales)


def evaluate(dataset: Path, poses: Path, settings: Settings) -> Evaluation:
    """Score poses.

    Args:
        dataset: Data set, or a capture or a file of poses as the reference.
        poses: What is scored.
        settings: What a person may choose.

    Raises:
        InputError: One of the files cannot be used.
    """
    if settings.rate_hz is not None and not 0 < settings.rate_hz < np.inf:
        raise InputError(
            Argument("rate_hz"), f"must be above 0 frames a second, found {settings.rate_hz:g}"
        )
    if not 0 < settings.most_apart_s < np.inf:
        raise InputError(
            Argument("max_difference_s"),
            f"must be above 0 seconds, found {settings.most_apart_s:g}",
        )
    if not np.isfinite(settings.offset_s):
        raise InputError(Argument("offset_s"), f"must be finite, found {settings.offset_s:g}")
    of_capture = is_capture(dataset, besides=(DATASET_FORMAT,))
    frames = None if of_capture else _scored(dataset, settings)
    estimates = read_pose_list(poses, settings.file_format)
    if frames is None:
        _refuse_settings_of_datasets(dataset, settings)
        frames = captured_frames(dataset, estimates, poses)
    _refuse_useless(dataset, poses, frames, estimates, settings)
    if frames.frame_key == "time":
        clock = Clock(settings.most_apart_s, settings.offset_s)
        frames, row = met_in_time(frames, estimates, poses, clock)
    else:
        row = _matched(frames, estimates, poses, settings)
        if frames.split == UNSPLIT and estimates.names_all_asked:
            # Some of the photographs were kept aside, and nothing was asked of the others.
            frames, row = frames.at(np.flatnonzero(row >= 0)), row[row >= 0]
    frames = _turned_as_estimated(frames, estimates, row, settings)
    convention, predicted = _taken(poses, frames, estimates, row, settings, settings.convention)
    yardsticks = {DATASET: frames.world_from_cam}
    if settings.labels:
        yardsticks[LABELS] = _labels(settings.labels, frames, settings)
    camera, depth_m = _camera_and_depth(dataset, frames, settings)
    errors: dict[str, Array] = {}
    scales: dict[str, float] = {}
    for end, reference in yardsticks.items():
        moved, scales[end] = aligned(predicted, reference, settings.align, poses)
        answers, truth = _table(moved, frames), _table(reference, frames)
        errors |= {f"{name}{end}": values for name, values in pose_errors(answers, truth).items()}
        if camera is not None and depth_m is not None:
            errors[f"dcre{end}"] = dcre(answers, truth, depth_m, camera)
    rotations = np.asarray(np.isfinite(predicted).all(axis=(1, 2)))
    if not rotations.any():
        if not (row >= 0).any() or np.isnan(estimates.translation[row[row >= 0]]).all():
            raise InputError(poses, "holds no pose of these frames, none of them was localized")
        raise InputError(poses, "none of its poses is a rotation and a position")
    return Evaluation(
        frames=frames,
        estimates=estimates,
        convention=convention,
        row=row,
        rotations=rotations,
        errors=errors,
        metrics=_metrics(errors, yardsticks, frames),
        scales=scales,
        coverage=_coverage(poses, estimates, row, errors, scales),
    )


def _coverage(
    path: Path,
    estimates: PoseList,
    row: NDArray[np.int64],
    errors: Mapping[str, Array],
    scales: Mapping[str, float],
) -> dict[str, list[Coverage]]:
    """Compare errors with the radii that the file states, if it states any."""
    if estimates.stated is None:
        return {}
    bad = np.flatnonzero((estimates.stated <= 0).any(axis=1))
    if len(bad):
        raise InputError(
            path,
            f"{estimates.places[bad[0]]}: states an error of"
            f" {estimates.stated[bad[0]].min():g}, which must be above 0",
            "leave it empty where it is not known",
        )
    stated = np.where((row >= 0)[:, None], estimates.stated[row], np.nan)
    found = {}
    for end, scale in scales.items():
        for name, radius in ((POSITION, scale * stated[:, :2]), (ORIENTATION, stated[:, 2:])):
            error = errors[name + end]
            both = np.isfinite(radius).all(axis=1) & np.isfinite(error)
            if both.any():
                found[name + end] = coverage(error[both], *radius[both].T)
    return found


def _refuse_useless(
    dataset: Path, path: Path, frames: ScoredFrames, estimates: PoseList, settings: Settings
) -> None:
    """Refuse a rate where nothing has times, and an order of quaternions where there are none."""
    if settings.rate_hz is not None:
        if frames.frame_key is not None:
            raise InputError(
                Argument("rate_hz"), f"{dataset} is a file of poses, not of frames", "leave it out"
            )
        if estimates.frame_key != "time" and settings.labels is None:
            raise InputError(
                Argument("rate_hz"), f"{path} is {estimates.kind}, without times", "leave it out"
            )
    if frames.frame_key != "time":
        for name, given in (
            ("max_difference_s", settings.most_apart_s != MOST_APART_S),
            ("offset_s", settings.offset_s != 0.0),
        ):
            if given:
                raise InputError(
                    Argument(name),
                    f"is between the times of two files, and {dataset} has none",
                    "leave it out",
                )
    order = estimates.convention.order
    asked = named_convention(settings.convention, estimates.convention).order
    if estimates.of_matrices and asked != order:
        raise InputError(
            Argument("convention"),
            f"{path} is {estimates.kind}, of matrices, which have no order of quaternions",
            f"end it in {order}",
        )


def _scored(dataset: Path, settings: Settings) -> ScoredFrames:
    """Read the frames of a data set, or of a file of poses."""
    if not dataset.is_file() or dataset.suffix == ".zip":
        return read_scored_frames(dataset, settings.split)
    _refuse_settings_of_datasets(dataset, settings)
    return read_reference(dataset)


def _refuse_settings_of_datasets(reference: Path, settings: Settings) -> None:
    """Refuse what a file of poses or a capture has no use for."""
    for name, given in (("split", settings.split != "test"), ("camera", settings.camera)):
        if given:
            raise InputError(
                Argument(name), f"goes with data sets, and {reference} is none", "leave it out"
            )


def _matched(
    frames: ScoredFrames, estimates: PoseList, path: Path, settings: Settings
) -> NDArray[np.int64]:
    """Find the row (N,) of each frame's estimate; -1 where there is none."""
    if frames.frame_key is not None:
        return match_reference(frames, estimates, path)
    if settings.rate_hz is None and estimates.counts_seconds:
        raise InputError(
            path,
            "its times are 0, 1, 2, ...",
            "give `rate_hz=1` if they number the frames, or the frames a second of the data set",
        )
    return match(frames, estimates, path, settings.rate_hz or DEFAULT_RATE_HZ)


def _turned_as_estimated(
    frames: ScoredFrames, estimates: PoseList, row: NDArray[np.int64], settings: Settings
) -> ScoredFrames:
    """Turn the poses of photographs that EXIF turns, if the estimates are of upright ones.

    The poses of a data set are of the pixels as they are stored. ``synfeal localize`` answers for
    the upright photograph, COLMAP for the stored one; the two are 90 degrees or more apart.
    """
    if frames.stored_from_upright is None:
        return frames
    convention = named_convention(settings.convention, estimates.convention)
    answers = estimates.world_from_cam(convention)[row]
    upright = frames.world_from_cam @ frames.stored_from_upright
    turned = np.abs(frames.stored_from_upright - np.eye(4)).max(axis=(1, 2)) > 0
    compared = turned & (row >= 0) & np.isfinite(answers).all(axis=(1, 2))
    if not compared.any():
        return frames
    errors = [
        float(np.median(pose_error(answers[compared], poses[compared])[1]))
        for poses in (frames.world_from_cam, upright)
    ]
    is_upright = errors[1] < errors[0]
    log.warning(
        "EXIF turns %d of %d photographs; the estimates fit the poses of %s",
        int(turned.sum()),
        len(turned),
        "upright photographs, so those of the data set are turned with them"
        if is_upright
        else "the pixels as they are stored, and are scored against those",
    )
    return replace(frames, world_from_cam=upright) if is_upright else frames


def _camera_and_depth(
    dataset: Path, frames: ScoredFrames, settings: Settings
) -> tuple[CameraConfig | None, Array | None]:
    """Read camera and depth for the reprojection error; a file of poses has neither."""
    if frames.frame_key is not None:
        return None, None
    known = camera_of_dataset(dataset, settings.camera)
    # Of an unpacked capture depth has a camera of its own, in which points are projected then.
    camera = known.config if known.assumed else known.depth
    return camera, _depth(frames, camera)


def _taken(
    path: Path,
    frames: ScoredFrames,
    estimates: PoseList,
    row: NDArray[np.int64],
    settings: Settings,
    convention: str | None,
) -> tuple[Convention, Array]:
    """Choose the convention of the estimates; return it with the frames' poses (N, 4, 4).

    Poses are NaN where there is no estimate.
    """
    with np.errstate(invalid="ignore"):
        far = (np.abs(estimates.translation) > FARTHEST_M) & np.isfinite(estimates.translation)
    if far.any():
        bad = int(np.argmax(far.any(axis=1)))
        raise InputError(
            path,
            f"{estimates.places[bad]}: a position of"
            f" {np.abs(estimates.translation[bad]).max():.3g} m is no place",
            "leave the line out",
        )
    there = row >= 0
    if not convention and settings.align == "none":
        checked_convention(path, estimates, row[there], frames.world_from_cam[there])
    taken = named_convention(convention, estimates.convention)
    poses = estimates.world_from_cam(taken)[row]
    poses[~there] = np.nan
    return taken, poses


def _labels(path: Path, frames: ScoredFrames, settings: Settings) -> Array:
    """Read poses (N, 4, 4) of a second yardstick, which must have every frame."""
    estimates = read_pose_list(path)
    row = _matched(frames, estimates, path, settings)
    _, poses = _taken(path, frames, estimates, row, settings, None)
    lost = np.flatnonzero(~np.isfinite(poses).all(axis=(1, 2)))
    if len(lost):
        raise InputError(
            path,
            f"has no pose of {frames.names[lost[0]]} ({len(lost)} of {len(poses)} frames); labels"
            " need one for every frame",
        )
    return poses


def aligned(poses: Array, reference: Array, align: Align, path: Path) -> tuple[Array, float]:
    """Move poses as a whole onto a reference, as evo does.

    Least squares over the positions of the frames that have a pose (Umeyama, PAMI 1991).

    Args:
        poses: Poses ``world_from_cam`` (N, 4, 4), NaN where there is none.
        reference: Poses (N, 4, 4) of the same frames.
        align: Which motion is allowed: none, rigid, or rigid with scale.
        path: File of the poses, for messages.

    Returns:
        The moved poses (N, 4, 4), and the scale.

    Raises:
        InputError: positions do not determine the motion.
    """
    if align == "none":
        return poses, 1.0
    there = np.isfinite(poses).all(axis=(1, 2))
    try:
        scale, rotation, translation = umeyama_sim3(
            poses[there, :3, 3], reference[there, :3, 3], with_scale=align == "sim3"
        )
    except ValueError as error:
        raise InputError(
            path, f"cannot be aligned ({why(error)})", 'give `align="none"`'
        ) from error
    moved = poses.copy()
    moved[:, :3, :3] = rotation @ poses[:, :3, :3]
    moved[:, :3, 3] = scale * poses[:, :3, 3] @ rotation.T + translation
    return moved, scale


def _table(poses: Array, frames: ScoredFrames) -> PoseTable:
    good = np.isfinite(poses).all(axis=(1, 2))
    quat = np.full((len(poses), 4), np.nan)
    quat[good] = quat_wxyz_of(poses[good])
    return PoseTable(np.arange(len(poses)), frames.path, poses[:, :3, 3], quat)


def _depth(frames: ScoredFrames, camera: CameraConfig) -> Array | None:
    """Read depth (N, 48) of the frames' cells; None where a frame has no depth image."""
    paths = [frame.path(DEPTH) for frame in frames.frames]
    if not all(path.is_file() for path in paths):
        return None
    found = []
    with Progress(len(paths), "depth") as progress:
        for depth_m in depth_of_images(paths, camera):
            found.append(depth_m)
            progress.update()
    return np.stack(found)


def _metrics(errors: Mapping[str, Array], ends: Iterable[str], frames: ScoredFrames) -> Metrics:
    """Compute medians and recalls of all frames; mean, RMSE and maximum of those with a pose."""
    metrics = summary({k: v for k, v in errors.items() if "dcre" not in k}, frames.path)
    for end in ends:
        if f"dcre{end}" in errors:
            metrics |= dcre_summary(errors[f"dcre{end}"], frames.path, end)
    if len(np.unique(frames.path)) < FEWEST_PATHS:
        metrics = {k: v for k, v in metrics.items() if not k.endswith(("_low", "_high"))}
    for end in ends:
        for name in (POSITION, ORIENTATION):
            values = errors[name + end]
            there = values[np.isfinite(values)]
            metrics |= {
                f"{MEANS[name]}{end}": float(there.mean()),
                f"{name}_rmse{end}": float(np.sqrt((there**2).mean())),
                f"{name}_max{end}": float(there.max()),
            }
    return metrics
