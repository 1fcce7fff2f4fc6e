"""A file of poses as the reference in place of a data set, such as stored ground truth.

Poses are paired by what their formats say: by equal names (``seq-01/frame-000000`` however it is
spelled), by times that are nearest to each other, as evo does, or line by line.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_list import FrameKey, PoseList
from synfeal.dataset.poses_in import read_pose_list
from synfeal.errors import InputError
from synfeal.evaluation.frames import NAME, ScoredFrames

Array = NDArray[np.float64]
# Largest difference of two times of one frame: evo's default, ``t_max_diff``.
MOST_APART_S = 0.01


class Clock(NamedTuple):
    """Comparison of an estimate's times with those of a reference.

    Attributes:
        most_apart_s: Largest difference of two times of one pair.
        offset_s: What is added to the times of the estimates, evo's ``t_offset``.
    """

    most_apart_s: float = MOST_APART_S
    offset_s: float = 0.0


SAME_CLOCK = Clock()

SAYS: dict[FrameKey, str] = {
    "name": "names of images",
    "time": "times",
    "index": "no names, only their order",
}


def read_reference(path: Path) -> ScoredFrames:
    """Read the poses of a file as the frames that are scored.

    Args:
        path: Any file that :func:`synfeal.dataset.poses_in.read_pose_list` reads.

    Raises:
        InputError: It cannot be read, has a pose twice, or one that is no rotation and position.
    """
    found = read_pose_list(path)
    world_from_cam = found.world_from_cam(found.convention)
    lost = np.flatnonzero(~np.isfinite(world_from_cam).all(axis=(1, 2)))
    if len(lost):
        raise InputError(
            path,
            f"{found.places[lost[0]]} is no rotation and position ({len(lost)} of"
            f" {len(world_from_cam)} poses); a reference needs a pose on every line",
        )
    names = _keys(found)
    if found.frame_key == "name":
        _refuse_twice(path, found, names)
    if found.frame_key == "time":
        refuse_same_times(path, found)
    return ScoredFrames(
        split="reference",
        names=names,
        world_from_cam=world_from_cam,
        path=_sequences(names),
        frame_key=found.frame_key,
    )


def _keys(found: PoseList) -> tuple[str, ...]:
    """Spell names (N) alike where they say sequence and frame; leave others as they are."""
    if found.frame_key != "name":
        return found.names
    return tuple(map(_spelled, found.names))


def _spelled(name: str) -> str:
    matches = list(NAME.finditer(name.replace("\\", "/")))
    sequence, number = matches[-1].groups() if matches else (None, None)
    return name if sequence is None else f"seq-{int(sequence):02d}/frame-{number}"


def _refuse_twice(path: Path, found: PoseList, names: tuple[str, ...]) -> None:
    first: dict[str, str] = {}
    for name, place in zip(names, found.places, strict=True):
        if name in first:
            raise InputError(
                path, f"'{name[:80]}' has two poses, {first[name]} and {place}", "leave one"
            )
        first[name] = place


def refuse_same_times(path: Path, found: PoseList) -> None:
    """Refuse two poses of one time: nothing says which of them is meant.

    Raises:
        InputError: There are two; the message names both lines.
    """
    first: dict[float, str] = {}
    times_s = _seconds(found.names)
    n_times = len(np.unique(times_s))
    for time_s, name, place in zip(times_s.tolist(), found.names, found.places, strict=True):
        if time_s in first:
            raise InputError(
                path,
                f"the time {name[:40]} has two poses, {first[time_s]} and {place} ({len(times_s)}"
                f" poses at {n_times} times); are two runs in one file, or times rounded? Give"
                " each run a file of its own, and times as they were measured",
            )
        first[time_s] = place


def _sequences(names: tuple[str, ...]) -> NDArray[np.int64]:
    """Return the index (N,) of the folder that each name begins with; 0 where there is none."""
    folders = [name.rpartition("/")[0] for name in names]
    return np.unique(folders, return_inverse=True)[1].astype(np.int64)


def match_reference(
    frames: ScoredFrames, estimates: PoseList, path: Path, clock: Clock = SAME_CLOCK
) -> NDArray[np.int64]:
    """Find the row (N,) of each frame's estimate; -1 where there is none.

    Args:
        frames: Frames of a reference.
        estimates: Poses to score.
        path: Their file, for messages.
        clock: How times are compared.

    Raises:
        InputError: The two cannot be paired, a frame has two estimates, or none has one.
    """
    if estimates.frame_key != frames.frame_key:
        own, other = SAYS[estimates.frame_key], SAYS[frames.frame_key or "name"]
        raise InputError(
            path,
            f"is {estimates.kind}, whose poses have {own}, but those of the reference have {other}",
            "give both in formats that say the same",
        )
    n_frames = len(frames.names)
    if frames.frame_key == "index":
        if len(estimates.names) != n_frames:
            raise InputError(
                path,
                f"has {len(estimates.names)} poses, the reference {n_frames}, and nothing says"
                " which frames they are of; both must have a line for every frame",
            )
        return np.arange(n_frames)
    if frames.frame_key == "time":
        refuse_same_times(path, estimates)
        own_s, other_s = _seconds(frames.names), _seconds(estimates.names) + clock.offset_s
        nearest = _nearest(other_s, own_s)
        apart_s = other_s[nearest] - own_s
        row = np.where(np.abs(apart_s) <= clock.most_apart_s, nearest, -1)
        if len(own_s) == len(other_s):  # then they may well be the same ones in the same order
            apart_s = np.sort(other_s) - np.sort(own_s)
        middle_s = float(np.median(apart_s))
        what = (
            f"within {clock.most_apart_s:g} s of one of the reference ({frames.names[0]} s, ...);"
            f" they are {middle_s:+.3g} s apart (median): give"
            f" `offset_s={-middle_s + clock.offset_s:.3g}` if the two clocks differ, or a larger"
            " `max_difference_s`"
        )
    else:
        keys = _keys(estimates)
        _refuse_twice(path, estimates, keys)
        index = {key: i for i, key in enumerate(keys)}
        row = np.array([index.get(name, -1) for name in frames.names])
        what = f"of an image of the reference ({frames.names[0]}, ...)"
    if (row < 0).all():
        raise InputError(path, f"none of its {len(estimates.names)} poses is {what}")
    return row


def met_in_time(
    frames: ScoredFrames, estimates: PoseList, path: Path, clock: Clock = SAME_CLOCK
) -> tuple[ScoredFrames, NDArray[np.int64]]:
    """Leave out the frames at whose times nothing was estimated.

    A reference has as many poses a second as its sensor gave; nothing says that more of them were
    to be estimated.

    Args:
        frames: Frames of a reference with times.
        estimates: Poses to score.
        path: Their file, for messages.
        clock: How times are compared.

    Returns:
        The frames left, and the row of the estimate of each.

    Raises:
        InputError: The estimates have no times, or none near one of the reference.
    """
    match_reference(frames, estimates, path, clock)
    estimate_s = _seconds(estimates.names) + clock.offset_s
    chosen, row = pairs_in_time(_seconds(frames.names), estimate_s, clock.most_apart_s)
    return frames.at(chosen), row


def _seconds(names: tuple[str, ...]) -> Array:
    return np.array(names, np.float64)


def pairs_in_time(
    reference_s: Array, estimate_s: Array, most_apart_s: float = MOST_APART_S
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pair each time of the shorter series with the nearest one of the longer, as evo does.

    Args:
        reference_s: Seconds (N,), in any order.
        estimate_s: Seconds (M,), in any order.
        most_apart_s: Largest difference of a pair.

    Returns:
        Indices (K,) of the reference, then of the estimate, in the order of the shorter series; an
        entry of the longer one may stand in several pairs.
    """
    if len(estimate_s) > len(reference_s):
        estimate, reference = pairs_in_time(estimate_s, reference_s, most_apart_s)
        return reference, estimate
    nearest = _nearest(reference_s, estimate_s)
    close = np.abs(reference_s[nearest] - estimate_s) <= most_apart_s
    return nearest[close], np.flatnonzero(close)


def _nearest(among_s: Array, times_s: Array) -> NDArray[np.int64]:
    """Return the index (M,) among ``among_s`` (N,) that is nearest to each of ``times_s`` (M,)."""
    order = np.argsort(among_s, kind="stable")
    ordered_s = among_s[order]
    if len(ordered_s) == 1:
        return np.zeros(len(times_s), np.int64)
    after = np.searchsorted(ordered_s, times_s).clip(1, len(ordered_s) - 1)
    before_is_nearer = times_s - ordered_s[after - 1] <= ordered_s[after] - times_s
    return np.asarray(order[after - before_is_nearer])
