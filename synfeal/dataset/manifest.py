"""What a data set is made of: enough to check a copy and to know the camera without the config."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import synfeal
from synfeal.config.models import CameraConfig
from synfeal.dataset.archive import frame_file, sequence_at, sequence_names
from synfeal.dataset.sevenscenes import Sequence
from synfeal.files import write_json

MANIFEST = "manifest.json"
LIBRARIES = ("deflate", "numpy", "pillow", "pyrender", "trimesh")


def write_manifest(
    dataset_dir: Path, sequences: Iterable[Sequence], camera: CameraConfig, extra: Mapping[str, Any]
) -> None:
    """Write ``manifest.json``: camera, frame counts, hash of each sequence, versions, ``extra``."""
    sequences, record = list(sequences), camera_record(camera)
    if camera.fx is not None:  # which replaced the field of view
        del record["horizontal_fov_deg"]
    manifest = {
        "format": "7-Scenes; depth along the optical axis, millimetres, 65535 invalid",
        "camera": record,
        "frames": {
            split: sum(len(s) for s in sequences if s.split == split) for split in ("train", "test")
        },
        "sequences": [
            {
                "name": sequence.name,
                "split": sequence.split,
                "frames": len(sequence),
                "sha256": sequence_sha256(sequence_at(dataset_dir / sequence.name)),
            }
            for sequence in sequences
        ],
        "versions": versions(),
        **extra,
    }
    write_json(dataset_dir / MANIFEST, manifest)


def camera_record(camera: CameraConfig) -> dict[str, Any]:
    """A camera with its intrinsics, ready for JSON."""
    return {**camera.model_dump(mode="json"), **camera.intrinsics._asdict()}


def versions() -> dict[str, str]:
    """The versions that decide what frames look like."""
    found = {"synfeal": synfeal.__version__}
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):  # not every renderer has to be installed
            found[name] = version(name)
    return found


def sequence_sha256(sequence: Path) -> str:
    """SHA-256 over the names and contents of the frames, in order of name; archived or not."""
    digest = hashlib.sha256()
    for name in sequence_names(sequence):
        if name.startswith("frame-"):
            content = hashlib.sha256(frame_file(sequence, name).read_bytes()).hexdigest()
            digest.update(f"{content}  {name}\n".encode())
    return digest.hexdigest()
