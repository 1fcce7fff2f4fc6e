"""What a collection is asked to make, as its unfinished directory records it."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

import synfeal
from synfeal.config.models import CameraConfig, CollectionConfig, RenderConfig, SceneConfig
from synfeal.dataset.sequences import Sequence, sequences_of
from synfeal.errors import InputError
from synfeal.mesh.model import TexturedMesh

SEQUENCE_FRAMES = 1000  # as in 7-Scenes
LONGEST_NAME = 200  # bytes: of 255, with those that unfinished directories add


@dataclass(frozen=True)
class CollectJob:
    """Everything a collection depends on; ``scene.source`` is ``mesh``.

    ``packed_px`` asks for packed frames of that side as well, ``archived`` for each sequence as
    one ``seq-XX.zip`` in place of a directory.
    """

    scene: SceneConfig
    collection: CollectionConfig
    camera: CameraConfig
    render: RenderConfig
    n_train: int
    n_test: int
    seed: int
    with_depth: bool
    packed_px: int | None
    out: Path
    archived: bool = False

    @property
    def counts(self) -> dict[str, int]:
        """Frames of each split that has any."""
        counts = {"train": self.n_train, "test": self.n_test}
        return {split: count for split, count in counts.items() if count}

    @property
    def sequences(self) -> list[Sequence]:
        """The sequences of the data set."""
        return sequences_of(self.n_train, self.n_test, SEQUENCE_FRAMES)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The files of each frame; a frame is whole when it has them all."""
        return ("color.png", "pose.txt", *(("depth.png",) if self.with_depth else ()))

    def check(self) -> None:
        """Refuse numbers that cannot be collected.

        Raises:
            InputError: no training frames, fewer than no test frames, or packed frames that are
                larger than the camera's.
        """
        if len(os.fsencode(self.out.name)) > LONGEST_NAME:
            raise InputError(f"--out: '{self.out.name[:40]}...' is too long for a name")
        side_px = min(self.camera.width, self.camera.height)
        if self.packed_px is not None and not 0 < self.packed_px < side_px:
            raise InputError(
                f"--packed: {self.packed_px} px must be positive and less than both sides of the"
                f" image ({self.camera.width} x {self.camera.height})"
            )
        if self.n_train < 1 or self.n_test < 0:
            raise InputError(
                f"collect: {self.n_train} training and {self.n_test} test frames asked for;"
                " --frames must be at least 1 and --test-frames at least 0"
            )


def record_of(job: CollectJob, mesh: TexturedMesh) -> dict[str, Any]:
    """All that decides the bytes of the data set, ready for JSON.

    The mesh is recorded by what it holds, so that its file may lie elsewhere on another machine.
    """
    return {
        "synfeal": synfeal.__version__,
        "mesh_sha256": mesh_sha256(mesh),
        "scene": job.scene.model_dump(mode="json", exclude={"sizes", "path", "sha256"}),
        "collection": job.collection.model_dump(mode="json"),
        "camera": job.camera.model_dump(mode="json"),
        "render": job.render.model_dump(mode="json"),
        "frames": job.n_train,
        "test_frames": job.n_test,
        "seed": job.seed,
        "depth": job.with_depth,
        "packed": job.packed_px,
        "archived": job.archived,
    }


def mesh_sha256(mesh: TexturedMesh) -> str:
    """SHA-256 over all parts: geometry, colours and textures, whatever files they came from."""
    digest = hashlib.sha256()
    for part in mesh.parts:
        for field in fields(part):
            value = getattr(part, field.name)
            if isinstance(value, np.ndarray):
                digest.update(f"{field.name} {value.dtype} {value.shape}".encode())
                digest.update(np.ascontiguousarray(value).data)
            else:
                digest.update(f"{field.name} {value!r}".encode())
    return digest.hexdigest()


def differences(found: Mapping[str, Any], asked: Mapping[str, Any]) -> list[str]:
    """What two records disagree on, one phrase each, in the order of ``asked``."""
    before, now = dict(_flat(found)), dict(_flat(asked))
    return [
        f"{key} was {before.get(key)}, is {now.get(key)}"
        for key in {**now, **before}
        if before.get(key) != now.get(key)
    ]


def _flat(record: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Nested keys joined by dots."""
    for key, value in record.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
