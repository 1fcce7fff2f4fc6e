"""``synfeal localize`` with a map: photographs in, poses out, or "not localized"."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from statistics import median
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray

from baselines.references.confidence import LEAST_CONFIDENCE
from baselines.references.mapped import StructureMap, read_map
from baselines.references.photographs import Answer, Finder
from baselines.references.redrawn import Redrawn, read_redrawn
from baselines.training.localize import open_picture
from baselines.training.pictures import check_out, find_pictures, refuse_mixed_sizes
from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.pose_table import COLUMNS, IMAGE, SUPPORT
from synfeal.errors import Argument, InputError
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.records.files import writing_to
from synfeal.records.progress import Progress
from synfeal.records.tables import write_frame

Array = NDArray[np.float64]
World = Literal["sequence", "mesh"]

HEADER = (IMAGE, *COLUMNS[2:], *SUPPORT)
FOUND, NOT_FOUND, AMBIGUOUS = "localized", "not localized", "ambiguous"
# So many photographs tell whether their focal length is right.
FEWEST_RATIOS = 5
DECIMALS = 6  # micrometres
PART = 100  # photographs between two lines of progress


class LocalizedInMap(NamedTuple):
    """Result of localizing photographs in a map.

    Attributes:
        n_images: Photographs.
        n_found: Those that were localized.
        n_ambiguous: Those of which several places look alike, which have no pose.
        n_turned: Those that EXIF turns, and their calibration with them.
        inliers: Median number of features that agree with the pose, of those localized; NaN where
            none was.
        focal_ratio: Median over those localized of the focal length that fits best over the one
            given; NaN where few were.
        world: Whose coordinates poses are in, where there are two.
        seconds: Median time for one photograph, all included.
        n_frames: Frames of the map.
        n_points: Features of the map.
    """

    n_images: int
    n_found: int
    n_ambiguous: int
    n_turned: int
    inliers: float
    focal_ratio: float
    world: World | None
    seconds: float
    n_frames: int
    n_points: int


def localize_in_map(
    folder: Path,
    named: Sequence[Path],
    out: Path,
    *,
    camera: PhotographCamera,
    world: World = "sequence",
    least_confidence: float = LEAST_CONFIDENCE,
    refine: Path | None = None,
    seed: int = 0,
) -> LocalizedInMap:
    """Write the pose of each photograph as CSV (columns of ``HEADER``), in the order named.

    Args:
        folder: A map of ``synfeal map``.
        named: Photographs, and directories that stand for theirs.
        out: File to write; it appears when all are done. Where a photograph is not localized, its
            pose is empty.
        camera: Camera of the photographs.
        world: Whose coordinates ``world_from_cam`` is written in, where the place was scanned from
            a sequence that has its own.
        least_confidence: Poses with less are not written.
        refine: Mesh that the map shows, to refine poses on; None leaves them as they are.
        seed: Seed of RANSAC's samples, the same for every photograph.

    Raises:
        InputError: The map, the mesh or a photograph cannot be used, nothing says what a
            photograph's focal length is, or ``out`` cannot be written.
    """
    if not 0 < least_confidence < 1:
        raise InputError(
            Argument("confidence"),
            f"must lie between 0 and 1, found {least_confidence:g}",
            "0.99 is usual",
        )
    place = read_map(folder)
    pictures = find_pictures(named)
    check_out(out, pictures)
    refuse_mixed_sizes(camera, pictures)
    torch.set_num_threads(1)
    taken_s: list[float] = []
    turned: list[Path] = []
    with ExitStack() as opened:
        redrawn = None
        if refine is not None:
            redrawn = opened.enter_context(read_redrawn(place, refine, folder, seed))
        find = partial(_find, Finder(place, seed), redrawn, least_confidence, camera, turned)
        answers = _find_all(find, pictures, taken_s)
    poses = np.array([answer.world_from_cam for answer in answers])
    sure = np.array([a.support.confidence >= least_confidence for a in answers])
    ambiguous = sure & np.array([a.is_ambiguous for a in answers])
    found = sure & ~ambiguous
    if world == "sequence" and place.sequence_from_world is not None:
        poses = place.sequence_from_world @ poses
    status = np.select([found, ambiguous], [FOUND, AMBIGUOUS], default=NOT_FOUND)
    _write(out, pictures, poses, status, answers)
    kept = [answer for answer, good in zip(answers, found, strict=True) if good]
    counts = [answer.support.inliers for answer in kept]
    ratios = np.array([answer.focal_ratio for answer in kept])
    ratios = ratios[np.isfinite(ratios)]
    return LocalizedInMap(
        n_images=len(pictures),
        n_found=int(found.sum()),
        n_ambiguous=int(ambiguous.sum()),
        n_turned=len(turned),
        inliers=float(median(counts)) if counts else float("nan"),
        focal_ratio=float(np.median(ratios)) if len(ratios) >= FEWEST_RATIOS else float("nan"),
        world=None if place.sequence_from_world is None else world,
        seconds=median(taken_s),
        n_frames=len(place),
        n_points=len(place.features.slope),
    )


def _find_all(
    find: Callable[[Path], Answer], pictures: Sequence[Path], taken_s: list[float]
) -> list[Answer]:
    """Answer the photographs in their order, noting how long each took."""
    answers = []
    with Progress(len(pictures), "localize") as progress:
        for index, path in enumerate(pictures, start=1):
            began = time.perf_counter()
            answers.append(find(path))
            taken_s.append(time.perf_counter() - began)
            progress.update()
            if index % PART == 0:
                name = f"photograph {index} of {len(pictures)}"
                progress.part_done(name, PART, sum(taken_s[-PART:]))
    return answers


def _find(
    finder: Finder,
    redrawn: Redrawn | None,
    least_confidence: float,
    camera: PhotographCamera,
    turned: list[Path],
    path: Path,
) -> Answer:
    """Answer one photograph; note it in ``turned`` if its calibration was turned with it."""
    image, turn = open_picture(path)
    calibration = camera.of(image, path, turn)
    if calibration is None:
        raise InputError(
            path,
            "nothing says what its focal length is, which its pose depends on",
            "give the camera's calibration with `camera`, or its focal length in pixels with"
            " `focal_px`",
        )
    if camera.turns_with(image, turn):
        turned.append(path)
    photograph = finder.look_at(image, calibration)
    answer = finder.find(photograph)
    refused = answer.support.confidence < least_confidence or answer.is_ambiguous
    if redrawn is None or refused:
        return answer
    return redrawn.refine(photograph, answer)


def _write(
    out: Path,
    pictures: Sequence[Path],
    poses: Array,
    status: NDArray[np.str_],
    answers: Sequence[Answer],
) -> None:
    found = status == FOUND
    values = np.full((len(poses), 7), np.nan)
    values[found, :3] = poses[found, :3, 3]
    if found.any():
        values[found, 3:] = quat_wxyz_of(poses[found])
    frame = pd.DataFrame(values.round(DECIMALS), columns=list(COLUMNS[2:]))
    frame.insert(0, IMAGE, pd.Series([str(path) for path in pictures], dtype=object))
    status_column, inliers, confidence = SUPPORT
    frame[status_column] = status
    frame[inliers] = [answer.support.inliers for answer in answers]
    frame[confidence] = [round(answer.support.confidence, DECIMALS) for answer in answers]
    with writing_to(out, lambda: "choose another file with `out`"):
        write_frame(out, frame, float_format=None)


def describe_map(place: StructureMap) -> str:
    """Say in a line what a map holds."""
    per_frame = len(place.features.slope) / len(place)
    return f"{len(place)} frames, {len(place.features.slope)} features ({per_frame:.0f} a frame)"
