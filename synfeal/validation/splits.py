"""Training and test: every sequence in exactly one of them, and no frame in both."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from synfeal.dataset.sevenscenes import SPLIT_FILES, read_split
from synfeal.errors import InputError, why
from synfeal.validation.check import Check
from synfeal.validation.frames import Poses
from synfeal.validation.listing import POSE, SequenceListing

Splits = dict[str, list[SequenceListing]]


def read_splits(
    dataset: Path, sequences: Iterable[SequenceListing]
) -> tuple[Splits, tuple[str, ...]]:
    """The sequences of each split that can be read, in order, and what is wrong with the files."""
    by_path = {sequence.path: sequence for sequence in sequences}
    splits: Splits = {}
    failures: list[str] = []
    for split, name in SPLIT_FILES.items():
        try:
            directories = read_split(dataset, split)
        except InputError as error:
            failures.append(str(error))
            continue
        except (OSError, ValueError) as error:
            failures.append(f"{dataset / name}: cannot be read ({why(error)})")
            continue
        failures += [
            f"{dataset / name}: lists {path.name}, which is not there"
            for path in directories
            if path not in by_path
        ]
        splits[split] = [by_path[path] for path in directories if path in by_path]
    return splits, tuple(failures)


def check_splits(
    dataset: Path,
    sequences: Iterable[SequenceListing],
    splits: Mapping[str, list[SequenceListing]],
    unreadable: tuple[str, ...],
) -> Check:
    """Each sequence is in one split, once."""
    uses = {sequence.name: 0 for sequence in sequences}
    for listed in splits.values():
        for sequence in listed:
            uses[sequence.name] += 1
    names = " and ".join(SPLIT_FILES.values())
    failures = [
        f"{dataset / name}: is listed {count} times in {names}, must be listed once"
        for name, count in uses.items()
        if count != 1 and (count > 1 or not unreadable)
    ]
    parts = [
        f"{split} {sum(len(s.frames) for s in listed)} frames" for split, listed in splits.items()
    ]
    return Check("splits", ", ".join(parts) or names, (*unreadable, *failures))


def check_leaks(poses: Poses, splits: Mapping[str, list[SequenceListing]]) -> Check:
    """No test frame is taken from the pose of a training frame."""
    train = {
        poses[frame].tobytes(): frame
        for sequence in splits.get("train", [])
        for frame in sequence.frames
        if frame in poses
    }
    test = [f for sequence in splits.get("test", []) for f in sequence.frames if f in poses]
    if not (train and test):
        return Check("overlap", "not both training and test frames", skipped=True)
    failures = [
        f"{frame.path(POSE)}: is the pose of {train[key].path(POSE)}, a training frame"
        for frame in test
        if (key := poses[frame].tobytes()) in train and train[key] != frame
    ]
    text = f"{len(test)} test poses, none of them a training pose"
    return Check("overlap", text, tuple(failures))
