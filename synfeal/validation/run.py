"""All checks of a data set, in the order in which they make sense, and the report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.depth_agreement import PosedDepth, compare_depth
from synfeal.dataset.frame_poses import Poses, read_poses
from synfeal.dataset.known_camera import KnownCamera, camera_of_dataset
from synfeal.dataset.sequence_listing import (
    DEPTH,
    MASK,
    NORMAL,
    RIGHT_COLOR,
    RIGHT_DEPTH,
    SequenceListing,
    frames_of,
    kinds_of,
    list_sequences,
)
from synfeal.dataset.split_frames import read_splits
from synfeal.errors import InputError
from synfeal.records.progress import Progress
from synfeal.validation.check import Check
from synfeal.validation.consistency import check_consistency, check_stereo
from synfeal.validation.frames import check_images, check_names
from synfeal.validation.layers import check_layers
from synfeal.validation.manifest import check_manifest, check_splits, has_headlight
from synfeal.validation.poses import (
    check_leaks,
    check_rigid,
    check_tables,
    choose_pairs,
    rigid_poses,
)

STEREO_PAIRS = 100  # pairs of a large set that are compared


def validate(dataset: Path, camera_file: Path | None, every_pair: bool) -> list[Check]:
    """Run all checks of a data set and return what each found.

    Args:
        dataset: The data set.
        camera_file: Calibration file, for a data set without a manifest or with another camera;
            None for the manifest's camera, or that of 7-Scenes where there is no manifest.
        every_pair: Compare all pairs of frames, not a sample of a large set.

    Raises:
        InputError: There is no data set, or ``camera_file`` cannot be read.
    """
    sequences = list_sequences(dataset)
    camera: KnownCamera | None = None
    camera_failures: tuple[str, ...] = ()
    try:
        camera = camera_of_dataset(dataset, camera_file)
    except InputError as error:  # a manifest that is damaged is a finding, a wrong option is not
        if camera_file is not None:
            raise
        camera_failures = (str(error),)
    splits, split_failures = read_splits(dataset, sequences)
    n_frames = len(frames_of(sequences))
    size = None if camera is None or camera.assumed else camera.config
    poses, pose_failures = read_poses(sequences)
    n_layers = len({NORMAL, MASK} & set(kinds_of(sequences)))
    with Progress((2 + n_layers) * n_frames, "validate") as progress:
        checks = [
            check_names(sequences),
            *check_images(sequences, size, progress.update),
            *check_layers(dataset, sequences, size, progress.update),
            check_rigid(poses, pose_failures),
            check_tables(dataset, poses, splits),
            check_splits(dataset, sequences, splits, split_failures),
            check_leaks(poses, splits),
            check_manifest(dataset, sequences, splits, progress.update),
        ]
    if camera is None:
        return [*checks, Check("camera", "unknown", camera_failures)]
    rigid = rigid_poses(poses)
    geometry = _geometry(sequences, rigid, camera, every_pair)
    if has_headlight(dataset):
        geometry = [_unjudged(c) if c.name in OF_COLORS else c for c in geometry]
    return [*checks, *geometry, *_stereo(sequences, rigid, camera, every_pair)]


OF_COLORS = ("colours", "alignment")


def _unjudged(check: Check) -> Check:
    """Say what was found, not judged: one surface looks different from different places."""
    why = "not judged, the lamp moves with the camera"
    return Check(check.name, f"{check.text}; {why}", skipped=True)


def _stereo(
    sequences: Sequence[SequenceListing], poses: Poses, camera: KnownCamera, every_pair: bool
) -> list[Check]:
    """Check the right images of stereo pairs; nothing where there are none and none are due."""
    kinds = kinds_of(sequences)
    baseline_m = camera.config.stereo_baseline_m
    if baseline_m is None and RIGHT_COLOR not in kinds:
        return []
    if baseline_m is None:
        failure = f"{camera.source}: camera: says no stereo_baseline_m, but there are right images"
        return [Check("stereo", "how far apart the pairs are is not known", (failure,))]
    if RIGHT_COLOR not in kinds:
        first = frames_of(sequences)[0].path(RIGHT_COLOR)
        return [Check("stereo", "no right images", (f"{first}: missing, as are all others",))]
    if DEPTH not in kinds or RIGHT_DEPTH not in kinds:
        return [Check("stereo", "no depth images: pairs cannot be compared", skipped=True)]
    frames = list(poses)
    step = 1 if every_pair else max(1, len(frames) // STEREO_PAIRS)
    chosen = frames[::step]
    with Progress(len(chosen), "stereo", unit="pair") as progress:
        return [check_stereo(chosen, poses, camera, progress.update)]


def _geometry(
    sequences: Sequence[SequenceListing], rigid: Poses, camera: KnownCamera, every_pair: bool
) -> list[Check]:
    """Run the checks that need depth, the camera and rigid poses."""
    if DEPTH not in kinds_of(sequences):
        return [Check("pairs", "no depth images: frames cannot be compared", skipped=True)]
    pairs = choose_pairs(sequences, rigid, every_pair)
    if not pairs:
        return [Check("pairs", "no two frames of a sequence to compare", skipped=True)]
    checks = [_convention(rigid, camera)] if camera.depth.projection is None else []
    with Progress(len(pairs), "compare", unit="pair") as progress:
        return checks + check_consistency(pairs, rigid, camera, progress.update)


def _convention(rigid: Poses, camera: KnownCamera) -> Check:
    """Compare depth and poses of frames from all over the set, and name what was meant."""
    frames = tuple(rigid)
    size = (camera.depth.width, camera.depth.height)

    def read_m(index: int) -> NDArray[np.float32]:
        return read_depth_m(frames[index].path(DEPTH), nothing=0.0, size=size)

    try:
        found = compare_depth(
            PosedDepth(
                files=[frame.path(DEPTH) for frame in frames],
                read_m=read_m,
                world_from_cam=np.array([rigid[frame] for frame in frames]),
                camera=camera.depth,
                depth_from_cam=np.eye(4),
            )
        )
    except InputError:  # an image is damaged, which another check tells
        return Check("convention", "a depth image cannot be read", skipped=True)
    if np.isnan(found.share) and found.problem is None:
        return Check("convention", "frames do not see the same things", skipped=True)
    text = f"{found.share:.0%} of what frames measure is where others see it"
    failures = () if found.problem is None else (found.problem,)
    if camera.assumed:
        said = f"{text}; not judged, the camera is assumed"
        return Check("convention", said, skipped=True)
    return Check("convention", text, failures)


def report(dataset: Path, checks: Sequence[Check]) -> str:
    """Format one line per check: name, verdict, what was checked."""
    width = max(len(check.name) for check in checks)
    lines = [f"{check.name:<{width}}  {check.verdict:<11}  {check.text}" for check in checks]
    return "\n".join([f"{dataset}", *lines]) + "\n"


def error_lines(checks: Sequence[Check]) -> list[str]:
    """Format one line per failed check: its first failure, and how many more there are."""
    return [
        f"{check.name}: {check.failures[0]}"
        + f" (and {len(check.failures) - 1} more)" * (len(check.failures) > 1)
        for check in checks
        if check.failures
    ]
