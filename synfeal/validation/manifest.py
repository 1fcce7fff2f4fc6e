"""The manifest: hashes of sequences, their frames and splits; and which camera took the frames."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from synfeal.config.dataset import CameraConfig
from synfeal.config.load import describe
from synfeal.dataset.finish import MANIFEST, sequence_sha256
from synfeal.errors import InputError, why
from synfeal.files import read_json
from synfeal.validation.listing import Check, SequenceListing


def check_manifest(
    dataset: Path,
    sequences: Iterable[SequenceListing],
    splits: Mapping[str, list[SequenceListing]],
    on_frame: Callable[[], object],
) -> Check:
    """What the manifest says of each sequence is so."""
    path = dataset / MANIFEST
    if not path.exists():
        return Check("manifest", f"no {MANIFEST}: nothing says what was written", skipped=True)
    listings = {sequence.name: sequence for sequence in sequences}
    split_of = {s.name: split for split, listed in splits.items() for s in listed}
    try:
        manifest = read_manifest(dataset)
        entries = _entries(manifest)
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
    failures += _wrong_counts(path, manifest, entries)
    text = f"{len(entries)} sequences: frames, splits and SHA-256 of the files"
    return Check("manifest", text, tuple(failures))


def _entries(manifest: Mapping[str, Any]) -> dict[str, tuple[str, int, str]]:
    """Split, number of frames and hash of each sequence by name."""
    return {
        str(entry["name"]): (str(entry["split"]), int(entry["frames"]), str(entry["sha256"]))
        for entry in manifest["sequences"]
    }


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


def _wrong_counts(
    path: Path, manifest: Mapping[str, Any], entries: Mapping[str, tuple[str, int, str]]
) -> Iterator[str]:
    said = manifest.get("frames")
    for split in ("train", "test"):
        count = sum(frames for name, frames, _ in entries.values() if name == split)
        if not isinstance(said, dict) or said.get(split) != count:
            yield f"{path}: frames: {split} must be {count}, the sum over its sequences"


# Depth and colour of 7-Scenes come from a Kinect; its authors give this for both.
SEVEN_SCENES = CameraConfig(width=640, height=480, fx=585.0, fy=585.0, cx=320.0, cy=240.0)


@dataclass(frozen=True)
class KnownCamera:
    """A camera and where it is known from."""

    config: CameraConfig  # its intrinsics and distortion
    source: str  # for the report
    assumed: bool = False  # nothing says that this is the camera


def camera_of_dataset(dataset: Path, camera_file: Path | None) -> KnownCamera:
    """The camera of a data set; a calibration file goes before the manifest."""
    if camera_file is not None:
        from synfeal.camera.calibration import read_calibration

        return KnownCamera(
            _config(camera_file, asdict(read_calibration(camera_file))), str(camera_file)
        )
    path = dataset / MANIFEST
    if not path.exists():
        return KnownCamera(SEVEN_SCENES, "assumed: that of 7-Scenes", assumed=True)
    return KnownCamera(_config(path, read_manifest(dataset).get("camera")), MANIFEST)


def _config(path: Path, values: object) -> CameraConfig:
    try:
        return CameraConfig.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{path}: camera: {describe(error, CameraConfig)}") from None


def read_manifest(dataset: Path) -> dict[str, Any]:
    """The manifest as it stands.

    Raises:
        InputError: it cannot be read as a JSON object.
    """
    path = dataset / MANIFEST
    try:
        manifest = read_json(path)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as a manifest ({why(error)})") from None
    if not isinstance(manifest, dict):
        raise InputError(f"{path}: cannot be read as a manifest (no JSON object)")
    return manifest
