"""Frames to score, with their poses, and the matching of estimates to them."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.orientation import stored_from_upright
from synfeal.dataset.frame_files import sequence_at
from synfeal.dataset.frame_poses import read_poses, rigid_problems
from synfeal.dataset.images import image_size_and_turn
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.pose_list import KITTI, FrameKey, PoseList
from synfeal.dataset.pose_table import IMAGE, read_pose_table
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.dataset.sequence_listing import (
    POSE,
    Frame,
    SequenceListing,
    frames_of,
    gap_in,
    list_sequences,
    refuse_problems,
)
from synfeal.dataset.sevenscenes import SPLIT_FILES
from synfeal.dataset.split_frames import read_splits, rows_of_frames, table_problems
from synfeal.errors import InputError

Array = NDArray[np.float64]

NAME = re.compile(r"(?:seq-?(\d+)[/_-])?frame-(\d{6,})(?:\D|$)")
TIME_SLACK = 0.25  # share of the time between two frames

log = logging.getLogger("synfeal")
Key = tuple[str, int]  # sequence and number of a frame


UNSPLIT = "all"


@dataclass(frozen=True)
class ScoredFrames:
    """Frames of a split in order, or the poses of a file that stands in place of a data set.

    Attributes:
        split: ``test``, ``train`` or ``all``; ``reference`` of a file of poses.
        names: ``seq-01/frame-000000`` (N); of a file what it calls its poses.
        world_from_cam: Poses (N, 4, 4).
        path: What the bootstrap draws (N,): straight paths of our data sets, else sequences.
        frames: Files (N) of the frames; none of a file of poses.
        gap: Frame that the numbers of the others leave out.
        frame_key: How a file of poses says which frame one is of.
        n_left_out: Frames that are not scored, because nothing was estimated, or asked, of them.
        stored_from_upright: Rotations (N, 4, 4) by which EXIF turns the photographs; None where it
            turns none.
    """

    split: str
    names: tuple[str, ...]
    world_from_cam: Array
    path: NDArray[np.int64]
    frames: tuple[Frame, ...] = ()
    gap: Frame | None = None
    frame_key: FrameKey | None = None
    n_left_out: int = 0
    stored_from_upright: Array | None = None

    @property
    def title(self) -> str:
        """Name of the scored frames, for messages."""
        return self.split if self.frame_key else f"{self.split} split"

    def at(self, chosen: NDArray[np.int64]) -> ScoredFrames:
        """Select frames by index (K,)."""
        turns = self.stored_from_upright
        return replace(
            self,
            names=tuple(self.names[index] for index in chosen),
            world_from_cam=self.world_from_cam[chosen],
            path=self.path[chosen],
            frames=tuple(self.frames[index] for index in chosen) if self.frames else (),
            stored_from_upright=None if turns is None else turns[chosen],
            n_left_out=len(self.names) - len(np.unique(chosen)),
        )


def read_scored_frames(dataset: Path, split: str) -> ScoredFrames:
    """Read the frames of a split, all of which must have rigid poses.

    Photographs with poses, a flat folder of frames or folders ``seq-XX`` that no file splits, are
    scored all together, whatever the split.

    Raises:
        InputError: the split or a pose cannot be read, a file does not say which frame it is of, or
            the table of a split names other frames than there are.
    """
    if _is_unsplit(dataset):
        return _unsplit_photographs(dataset)
    everything = list_sequences(dataset)
    split = _split_with_frames(dataset, split, everything)
    sequences = _of_split(dataset, split, everything)
    refuse_problems(sequences)
    _check_tables(dataset, split, everything)
    frames = tuple(frames_of(sequences))
    poses, unreadable = read_poses(sequences)
    problems = (*unreadable, *rigid_problems(poses))
    missing = [frame for frame in frames if frame not in poses]
    if problems or missing:
        reason = problems[0] if problems else f"{missing[0].path('pose.txt')}: missing"
        raise InputError(f"{reason}; synfeal validate says more")
    for sequence in sequences:
        sequence.files(POSE)  # refuses a pose that has no image where others have one
    matrices = np.array([poses[frame] for frame in frames])
    gap = next((gap for sequence in sequences if (gap := gap_in(sequence))), None)
    return ScoredFrames(
        split=split,
        names=tuple(frame.name for frame in frames),
        world_from_cam=matrices,
        path=_paths(dataset, split, frames),
        frames=frames,
        gap=gap,
    )


def _is_unsplit(dataset: Path) -> bool:
    """Tell whether a folder holds frames, and nothing says which are for training."""
    told = (MANIFEST, *SPLIT_FILES.values())
    if not dataset.is_dir() or any(os.path.lexists(dataset / name) for name in told):
        return False
    return any(dataset.glob("frame-*")) or any(dataset.glob("seq-[0-9]*"))


def _unsplit_photographs(dataset: Path) -> ScoredFrames:
    """Read all photographs of a folder that have a pose."""
    photographs = read_posed_sequence(dataset)
    frames = tuple(_frame_named(dataset, name) for name in photographs.names)
    stems = [frame.sequence.stem for frame in frames]
    path = np.unique(stems, return_inverse=True)[1].astype(np.int64)
    turns = [image_size_and_turn(file)[1] for file in photographs.color]
    rotations = np.array([stored_from_upright(turn) for turn in turns])
    return ScoredFrames(
        split=UNSPLIT,
        names=tuple(frame.name for frame in frames),
        world_from_cam=photographs.world_from_cam,
        path=path,
        frames=frames,
        stored_from_upright=rotations if any(turn.quarters for turn in turns) else None,
    )


def _frame_named(dataset: Path, name: str) -> Frame:
    """Return the frame that ``seq-01/frame-000000`` or ``frame-000000`` names."""
    sequence, _, frame = name.rpartition("/")
    where = sequence_at(dataset / sequence) if sequence else dataset
    return Frame(where, int(frame.removeprefix("frame-")))


def _split_with_frames(dataset: Path, split: str, sequences: list[SequenceListing]) -> str:
    """Return the split to score: of a data set with training frames alone, that.

    So are photographs that were rendered again at their poses (``mode="repeat"``).
    """
    if split != "test":
        return split
    splits, failures = read_splits(dataset, sequences)
    if failures or splits.get("test") or not splits.get("train"):
        return split
    log.warning("%s: has no test frames, so its training frames are scored", dataset)
    return "train"


def _of_split(
    dataset: Path, split: str, sequences: list[SequenceListing]
) -> Sequence[SequenceListing]:
    if split == "all":
        return sequences
    splits, failures = read_splits(dataset, sequences)
    of_split = [failure for failure in failures if SPLIT_FILES[split] in failure]
    if of_split:
        raise InputError(f'{of_split[0]}; correct it, or give `split="all"`')
    if not splits[split]:
        raise InputError(dataset / SPLIT_FILES[split], "lists no sequence")
    return splits[split]


def _check_tables(dataset: Path, split: str, sequences: list[SequenceListing]) -> None:
    """Refuse a data set that lacks a frame its tables name, or has one that they do not."""
    splits, _ = read_splits(dataset, sequences)
    for name in SPLIT_FILES if split == "all" else (split,):
        table = dataset / f"{name}.csv"
        if name in splits and table.is_file():
            problems = table_problems(table, frames_of(splits[name]))
            if problems:
                raise InputError(f"{problems[0]}; synfeal validate says more")


def _paths(dataset: Path, split: str, frames: Sequence[Frame]) -> NDArray[np.int64]:
    table = dataset / f"{split}.csv"
    if table.is_file():
        return read_pose_table(table).path[rows_of_frames(table, frames)]
    stems = [frame.sequence.stem for frame in frames]
    return np.unique(stems, return_inverse=True)[1].astype(np.int64)


def match(
    frames: ScoredFrames, estimates: PoseList, path: Path, rate_hz: float
) -> NDArray[np.int64]:
    """Find each frame's estimate by name, index or time.

    Args:
        frames: Frames (N) to score.
        estimates: Poses of a file.
        path: That file, for messages.
        rate_hz: Frames per second, by which time stamps are turned into frame numbers.

    Returns:
        Rows (N,) of ``estimates``; -1 where there is none.

    Raises:
        InputError: a name says no frame, or not of which sequence; a frame has two estimates; none
            of the scored frames has one.
    """
    keys = _keys(frames, estimates, path, rate_hz)
    _tell_foreign(keys, estimates, path)
    index = {(f.sequence.stem, f.number): i for i, f in enumerate(frames.frames)}
    row = np.full(len(index), -1, dtype=np.int64)
    for estimate, key in enumerate(keys):
        frame = None if key is None else index.get(key)
        if frame is None:
            continue
        if row[frame] >= 0:
            first, second = estimates.places[row[frame]], estimates.places[estimate]
            raise InputError(
                path, f"{frames.names[frame]} has two poses, {first} and {second}", "leave one"
            )
        row[frame] = estimate
    if (row < 0).all():
        raise InputError(
            path,
            f"none of its {len(keys)} poses is of a frame of the {frames.split} split"
            f" ({frames.names[0]}, ...)",
            "is it of this data set, and of this `split`?",
        )
    return row


def _tell_foreign(keys: Sequence[Key | None], estimates: PoseList, path: Path) -> None:
    """Mention names that are of no frame, or refuse them where there are no others."""
    foreign = [row for row, key in enumerate(keys) if key is None]
    if not foreign:
        return
    name, place = estimates.names[foreign[0]], estimates.places[foreign[0]]
    problem = f"'{name[:80]}' names no frame; names hold seq-01/frame-000000"
    if len(foreign) == len(keys):
        raise InputError(f"{path}: {place}", problem)
    log.warning("%s: %s: %s; %d such poses are left out", path, place, problem, len(foreign))


def _keys(
    frames: ScoredFrames, estimates: PoseList, path: Path, rate_hz: float
) -> list[Key] | list[Key | None]:
    """Return sequence and number of each estimate's frame; None where a name is of none."""
    pairs = list(zip(estimates.names, estimates.places, strict=True))
    if estimates.frame_key == "index":
        keys = [_by_index(frames, name, f"{path}: {place}") for name, place in pairs]
        _check_countable(frames, len(set(keys)), path, estimates)
        return keys
    stems = list(dict.fromkeys(frame.sequence.stem for frame in frames.frames))
    find = _by_time if estimates.frame_key == "time" else _by_name
    return [find(name, stems, f"{path}: {place}", rate_hz) for name, place in pairs]


def _check_countable(frames: ScoredFrames, n_named: int, path: Path, estimates: PoseList) -> None:
    """Refuse indices in place of names where they may count other frames than these."""
    remedy = f"give names in a last column {IMAGE} (seq-01/frame-000000.color.png)"
    if estimates.kind == KITTI:
        remedy = "KITTI's format has no names, give another"
    if frames.split == "all":
        raise InputError(path, "its rows count the frames of one split, not of all", remedy)
    if frames.gap is not None:
        raise InputError(
            path,
            f"names no frames, and {frames.gap.name} is missing, so its rows may count others",
            remedy,
        )
    if n_named != len(frames.frames):
        raise InputError(
            path,
            f"has poses of {n_named} frames without their names, but the {frames.split} split has"
            f" {len(frames.frames)}",
            f"is it of this `split`? If so, {remedy}",
        )


def _by_index(frames: ScoredFrames, name: str, where: str) -> Key:
    if not name.isdecimal():
        raise InputError(where, f"frame '{name[:40]}' must be a whole number, 0 or above")
    place = int(name)
    if place >= len(frames.frames):
        raise InputError(
            where,
            f"frame {place} does not exist: the {frames.split} split has {len(frames.frames)}"
            " frames, counted from 0",
        )
    frame = frames.frames[place]
    return frame.sequence.stem, frame.number


def _by_name(name: str, stems: Sequence[str], where: str, _: float) -> Key | None:
    found = list(NAME.finditer(name.replace("\\", "/")))
    if not found:
        return None
    sequence, number = found[-1].groups()
    if sequence is None and len(stems) > 1:
        raise InputError(
            where,
            f"'{name[:80]}' does not say of which sequence, and there are {len(stems)}"
            f" ({stems[0]}, ...)",
            f"write {stems[0]}/{Path(name).name[:40]}",
        )
    return stems[0] if sequence is None else f"seq-{int(sequence):02d}", int(number)


def _by_time(name: str, stems: Sequence[str], where: str, rate_hz: float) -> Key:
    sequence, _, stamp = name.rpartition("/")
    if not sequence and len(stems) > 1:
        raise InputError(
            where,
            f"time stamps do not say of which sequence, and there are {len(stems)}",
            f"give a directory with one file for each: {stems[0]}.txt, ...",
        )
    number = float(stamp) * rate_hz
    if not (abs(number) < 1e15 and abs(number - round(number)) <= TIME_SLACK and number >= 0):
        raise InputError(
            where,
            f"at {stamp} s there is no frame with {rate_hz:g} of them a second",
            "give `rate_hz` (1 where frames are numbered)",
        )
    return sequence or stems[0], round(number)
