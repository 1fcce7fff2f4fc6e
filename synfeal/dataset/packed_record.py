"""What packed frames are, in a file beside them: enough to know them apart and to check a copy."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.dataset.manifest import camera_record, versions
from synfeal.dataset.packed import View, read_packed
from synfeal.errors import InputError, why
from synfeal.files import read_json, write_json

FORMATS: dict[View, str] = {
    "square": "uint8 (N, S, S, 3); short side resized to S + 1 px, then centre crop",
    "whole": "uint8 (N, S, S, 3); the whole frame resized to S x S px",
}


def write_packed_record(
    frames: Path,
    shards: Sequence[Path],
    plan: Path,
    camera: CameraConfig,
    render: RenderConfig,
    view: View = "square",
) -> None:
    """Write ``<frames>.json`` in place of ``.npy``.

    Args:
        frames: packed frames.
        shards: records of the parts they were joined from, in order.
        plan: pose table of the frames.
        camera: what they were rendered through, before they were made smaller.
        render: how they were rendered.
        view: what of a frame was packed.

    Raises:
        InputError: frames or the record of a shard cannot be read.
    """
    packed = read_packed(frames)
    record = {
        "format": FORMATS[view],
        "frames": len(packed),
        "input_px": packed.shape[1],
        "camera": camera_record(camera),
        "render": render.model_dump(mode="json"),
        "plan_sha256": file_sha256(plan),
        "sha256": file_sha256(frames),
        "shards": [{"name": path.stem, **_read_shard(path)} for path in shards],
        "versions": versions(),
    }
    write_json(frames.with_suffix(".json"), record)


def _read_shard(path: Path) -> dict[str, object]:
    try:
        record = read_json(path)
        frames, backend = record["frames"], record["backend"]
        if type(frames) is not int or type(backend) is not str:
            raise ValueError("frames must be a whole number, backend a name")
        return {"frames": frames, "backend": backend}
    except (OSError, ValueError, TypeError, LookupError) as error:
        raise InputError(
            f"{path}: cannot be read as the record of a shard ({why(error)}); render it again"
        ) from None


def file_sha256(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
