"""The last step of a collection: what is made of all frames together."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

from synfeal.dataset.archive import archive_of, sequence_at, write_archive
from synfeal.dataset.collect_job import CollectJob
from synfeal.dataset.contact_sheet import write_contact_sheet
from synfeal.dataset.manifest import write_manifest
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sequences import Sequence
from synfeal.dataset.sevenscenes import frame_paths, pose_text, write_splits
from synfeal.dataset.shards import Piece
from synfeal.errors import InputError


def complete(data: Path, job: CollectJob) -> None:
    """Write split files, packed frames, contact sheet and manifest beside the frames.

    Raises:
        InputError: a frame is not the one that was planned.
    """
    if job.archived:
        archive_whole(data, job.sequences, job.kinds)
    check_poses(data, job.sequences)
    write_splits(data, job.sequences)
    if job.packed_px is not None:
        for split in job.counts:
            sequences = [sequence_at(data / s.name) for s in job.sequences if s.split == split]
            pack_frames(sequences, job.packed_px, data / f"{split}.npy")
    sequences = [sequence_at(data / sequence.name) for sequence in job.sequences]
    write_contact_sheet(frame_paths(sequences, "color.png"), data / "preview.png")
    write_manifest(data, job.sequences, job.camera, _origin(job))


def archive_whole(data: Path, sequences: Iterable[Sequence], kinds: tuple[str, ...]) -> None:
    """Replace the directories of sequences that have all their frames by archives.

    Killed between the two, the archive stands beside what is left of the directory: the next call
    removes that.
    """
    for sequence in sequences:
        directory = data / sequence.name
        archive = archive_of(directory)
        if not archive.is_file() and not Piece(sequence, 0, len(sequence)).missing(data, kinds):
            write_archive(directory, archive)
        if archive.is_file():
            shutil.rmtree(directory, ignore_errors=True)


def check_poses(data: Path, sequences: list[Sequence]) -> None:
    """Whether every frame has the pose the plan gives it; frames of two plans must not mix.

    Raises:
        InputError: names the first file that differs.
    """
    plans = {s.split: read_pose_table(data / f"{s.split}.csv") for s in sequences}
    for sequence in sequences:
        poses = plans[sequence.split].between(sequence.start, sequence.stop).world_from_cam
        at = sequence_at(data / sequence.name)
        paths = frame_paths([at], "pose.txt")
        for path, world_from_cam in zip(paths, poses, strict=True):
            if path.read_bytes() != pose_text(world_from_cam).encode():
                raise InputError(
                    f"{path}: is not the pose in {sequence.split}.csv; delete {at} and"
                    " run the same command again (shards of other machines start from a copy of"
                    " one plan)"
                )


def _origin(job: CollectJob) -> dict[str, object]:
    """Where the data set comes from, for the manifest."""
    return {
        "scene": job.scene.model_dump(mode="json", exclude={"sizes"}),
        "collection": job.collection.model_dump(mode="json"),
        "render": job.render.model_dump(mode="json"),
        "seed": job.seed,
    }
