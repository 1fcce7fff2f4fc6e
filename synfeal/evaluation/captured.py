"""A capture as the reference: photographs by the names or times that its device gave them.

Only photographs that a file of poses names are scored: what was kept aside to be localized is a
part of the capture, and nothing was asked of the rest.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray

from synfeal.captures.capture import Capture
from synfeal.captures.formats import read_capture
from synfeal.dataset.pose_list import PoseList
from synfeal.errors import InputError
from synfeal.evaluation.frames import ScoredFrames

SHOWN = 3  # names in a message

log = logging.getLogger("synfeal")


def captured_frames(path: Path, estimates: PoseList, poses: Path) -> ScoredFrames:
    """Read the photographs of a capture that poses are of.

    Args:
        path: The capture.
        estimates: What is scored.
        poses: Its file, for messages.

    Returns:
        The photographs, called as ``estimates`` calls them, or by their times.

    Raises:
        InputError: The capture cannot be read, the poses say neither name nor time, or they are of
            other photographs.
    """
    capture = read_capture(path)
    if estimates.frame_key == "time":
        return _by_time(capture)
    if estimates.frame_key != "name":
        raise InputError(
            poses,
            f"is {estimates.kind}, which does not say which photographs its poses are of",
            "give names of photographs, or times",
        )
    row = rows_of_names(estimates.names, [_file_name(capture, i) for i in range(len(capture))])
    known = np.flatnonzero(row >= 0)
    if not len(known):
        raise InputError(
            poses,
            f"none of its {len(row)} poses is of a photograph of {path}"
            f" ({capture.frames[0].name}, ...)",
            "is it of another capture?",
        )
    if len(known) < len(row):
        other = [estimates.names[index] for index in np.flatnonzero(row < 0)]
        log.warning(
            "%s: %d of its %d photographs are not in %s and are not scored (%s)",
            poses,
            len(other),
            len(row),
            path,
            ", ".join(other[:SHOWN]) + ", ..." * (len(other) > SHOWN),
        )
    return ScoredFrames(
        split="reference",
        names=tuple(estimates.names[index] for index in known),
        world_from_cam=capture.world_from_cam[row[known]],
        path=np.zeros(len(known), np.int64),
        frame_key="name",
        n_left_out=len(capture) - len(np.unique(row[known])),
    )


def _by_time(capture: Capture) -> ScoredFrames:
    times = [frame.time_s for frame in capture.frames]
    if any(time_s is None for time_s in times):
        raise InputError(capture.path, "has no times", "score poses that name its photographs")
    return ScoredFrames(
        split="reference",
        names=tuple(f"{time_s:.9f}" for time_s in times),
        world_from_cam=capture.world_from_cam,
        path=np.zeros(len(times), np.int64),
        frame_key="time",
    )


def _file_name(capture: Capture, index: int) -> str:
    """Return the path of a photograph, or its name where it has no file of its own."""
    frame = capture.frames[index]
    return str(frame.color_file or frame.name)


def rows_of_names(names: Sequence[str], known: Sequence[str]) -> NDArray[np.int64]:
    """Find the photograph that each name means: the one whose path ends most like it.

    Args:
        names: Names (N) or paths of photographs as somebody wrote them.
        known: Paths (M) of the photographs.

    Returns:
        Index (N,) among ``known``; -1 where the last parts differ, or several end alike.
    """
    by_last: defaultdict[str, list[int]] = defaultdict(list)
    parts = [PurePosixPath(path.replace("\\", "/")).parts for path in known]
    for index, own in enumerate(parts):
        for last in {own[-1], PurePosixPath(own[-1]).stem}:
            by_last[last].append(index)
    found = []
    for name in names:
        asked = PurePosixPath(name.replace("\\", "/")).parts
        among = by_last.get(asked[-1], []) if asked else []
        alike = [_common_end(asked, parts[index]) for index in among]
        best = [i for i, n in zip(among, alike, strict=True) if n == max(alike)]
        found.append(best[0] if len(best) == 1 else -1)
    return np.array(found, np.int64)


def _common_end(first: Sequence[str], second: Sequence[str]) -> int:
    """Count the parts, from the last, in which two paths agree."""
    count = 0
    for one, other in zip(reversed(first), reversed(second), strict=False):
        if one != other:
            break
        count += 1
    return count
