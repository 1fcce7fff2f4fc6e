"""Checks of the manifest and the split files against the sequences."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

from synfeal.dataset.finish import sequence_sha256
from synfeal.dataset.manifest import MANIFEST, read_manifest
from synfeal.dataset.sequence_listing import SequenceListing
from synfeal.dataset.sevenscenes import SPLIT_FILES
from synfeal.dataset.split_frames import split_problems
from synfeal.errors import InputError, why
from synfeal.validation.check import Check


def check_manifest(
    dataset: Path,
    sequences: Iterable[SequenceListing],
    splits: Mapping[str, list[SequenceListing]],
    on_frame: Callable[[], object],
) -> Check:
    """Check that the manifest's statements about each sequence are true.

    Args:
        dataset: The data set.
        sequences: All of its sequences.
        splits: Sequences by split, see :func:`read_splits`.
        on_frame: Called for each frame of the sequences that the manifest lists.
    """
    path = dataset / MANIFEST
    if not path.exists():
        return Check("manifest", f"no {MANIFEST}: nothing says what was written", skipped=True)
    listings = {sequence.name: sequence for sequence in sequences}
    split_of = {s.name: split for split, listed in splits.items() for s in listed}
    try:
        manifest = read_manifest(dataset)
        entries = {
            str(entry["name"]): (str(entry["split"]), int(entry["frames"]), str(entry["sha256"]))
            for entry in manifest["sequences"]
        }
    except InputError as error:
        return Check("manifest", "unreadable", (str(error),))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        problem = f"{path}: sequences: each needs name, split, frames and sha256 ({why(error)})"
        return Check("manifest", "unreadable", (problem,))
    failures = [f"{path}: does not list {name}" for name in listings if name not in entries]
    for name, entry in entries.items():
        if name not in listings:
            failures.append(f"{path}: lists {name}, which is not there")
        else:
            failures += _differences(path, listings[name], entry, split_of.get(name))
            for _ in listings[name].frames:
                on_frame()
    said = manifest.get("frames")
    for split in SPLIT_FILES:
        count = sum(frames for name, frames, _ in entries.values() if name == split)
        if not isinstance(said, dict) or said.get(split) != count:
            failures.append(f"{path}: frames: {split} must be {count}, the sum over its sequences")
    text = f"{len(entries)} sequences: frames, splits and SHA-256 of the files"
    return Check("manifest", text, tuple(failures))


def _differences(
    path: Path, listing: SequenceListing, entry: tuple[str, int, str], split: str | None
) -> Iterator[str]:
    said_split, frames, sha256 = entry
    if len(listing.frames) != frames:
        yield f"{listing.path}: {len(listing.frames)} frames, {path.name} says {frames}"
    if split is not None and split != said_split:
        yield f"{listing.path}: is in {split}, {path.name} says {said_split}"
    try:
        if sequence_sha256(listing.path) != sha256:
            yield f"{listing.path}: differs from what was written ({path.name}: sha256)"
    except OSError as error:
        yield f"{listing.path}: cannot be read ({why(error)})"


def has_headlight(dataset: Path) -> bool:
    """Check whether the manifest, if there is one, says that a lamp moved with the camera."""
    if not (dataset / MANIFEST).exists():
        return False
    try:
        render = read_manifest(dataset).get("render")
    except InputError:  # the check of the manifest says so
        return False
    return isinstance(render, dict) and render.get("shade") == "headlight"


def check_splits(
    dataset: Path,
    sequences: Iterable[SequenceListing],
    splits: Mapping[str, list[SequenceListing]],
    unreadable: tuple[str, ...],
) -> Check:
    """Check that each sequence is in one split, once.

    Args:
        dataset: The data set.
        sequences: All of its sequences.
        splits: Sequences by split, see :func:`read_splits`.
        unreadable: What is wrong with the files that list the splits, see :func:`read_splits`. If
            anything is, a sequence may be in no split.
    """
    names = " and ".join(SPLIT_FILES.values())
    failures = split_problems(dataset, sequences, splits, unreadable)
    parts = [
        f"{split} {sum(len(s.frames) for s in listed)} frames" for split, listed in splits.items()
    ]
    return Check("splits", ", ".join(parts) or names, failures)
