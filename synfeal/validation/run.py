"""All checks of a data set, in the order in which they make sense, and the report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from synfeal.errors import InputError
from synfeal.validation.camera import KnownCamera, camera_of_dataset
from synfeal.validation.consistency import check_consistency
from synfeal.validation.frames import Poses, check_images, check_names, kinds_of, read_poses
from synfeal.validation.listing import DEPTH, Check, SequenceListing, frames_of, list_sequences
from synfeal.validation.manifest import check_manifest, check_splits, read_splits
from synfeal.validation.poses import (
    check_leaks,
    check_rigid,
    check_tables,
    choose_pairs,
    rigid_bound,
    rigid_poses,
)


def validate(dataset: Path, camera_file: Path | None, every_pair: bool) -> list[Check]:
    """Check a data set; what is wrong with it is in the checks.

    A calibration file is for a data set without a manifest, or with another camera; ``every_pair``
    compares all pairs, not a sample of a large set.

    Raises:
        InputError: there is no data set, or ``camera_file`` cannot be read.
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
    bound = rigid_bound(dataset)
    with tqdm(
        total=2 * n_frames, unit="frame", desc="validate", leave=False, disable=None
    ) as progress:
        checks = [
            check_names(sequences),
            *check_images(sequences, size, progress.update),
            check_rigid(poses, pose_failures, bound),
            check_tables(dataset, poses, splits),
            check_splits(dataset, sequences, splits, split_failures),
            check_leaks(poses, splits),
            check_manifest(dataset, sequences, splits, progress.update),
        ]
    if camera is None:
        return [*checks, Check("camera", "unknown", camera_failures)]
    return checks + _geometry(sequences, rigid_poses(poses, bound), camera, every_pair)


def _geometry(
    sequences: Sequence[SequenceListing], rigid: Poses, camera: KnownCamera, every_pair: bool
) -> list[Check]:
    """The checks that need depth, the camera and rigid poses."""
    if DEPTH not in kinds_of(sequences):
        return [Check("pairs", "no depth images: frames cannot be compared", skipped=True)]
    pairs = choose_pairs(sequences, rigid, every_pair)
    if not pairs:
        return [Check("pairs", "no two frames of a sequence to compare", skipped=True)]
    with tqdm(total=len(pairs), unit="pair", desc="compare", leave=False, disable=None) as progress:
        return check_consistency(pairs, rigid, camera, progress.update)


def report(dataset: Path, checks: Sequence[Check]) -> str:
    """One line for each check: name, verdict, what was checked."""
    width = max(len(check.name) for check in checks)
    lines = [f"{check.name:<{width}}  {check.verdict:<11}  {check.text}" for check in checks]
    return "\n".join([f"{dataset}", *lines]) + "\n"


def error_lines(checks: Sequence[Check]) -> list[str]:
    """One line for each check that failed: its first failure, and how many more there are."""
    return [
        f"{check.name}: {check.failures[0]}"
        + f" (and {len(check.failures) - 1} more)" * (len(check.failures) > 1)
        for check in checks
        if check.failures
    ]
