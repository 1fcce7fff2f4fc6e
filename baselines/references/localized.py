"""``synfeal localize`` with a map: photographs in, poses out, or "not localized"."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
import pandas as pd

from baselines.references.confidence import LEAST_CONFIDENCE, check_confidence
from baselines.references.map_localizer import (
    AMBIGUOUS,
    FOUND,
    HEADER,
    Located,
    MapLocalizer,
    World,
)
from baselines.references.mapped import StructureMap, read_map
from baselines.references.redrawn import read_redrawn
from baselines.references.single_thread import single_thread
from baselines.references.stated_errors import read_scale
from baselines.training.localize import open_picture
from baselines.training.pictures import check_out, find_pictures, refuse_mixed_sizes
from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.pose_table import IMAGE
from synfeal.records.files import writing_to
from synfeal.records.progress import Progress
from synfeal.records.tables import write_frame

# So many photographs tell whether their focal length is right.
FEWEST_RATIOS = 5
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
        states_errors: True where the map was tried, so that poses state their errors.
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
    states_errors: bool


@single_thread()
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
    check_confidence(least_confidence)
    place = read_map(folder)
    scale = read_scale(folder)
    pictures = find_pictures(named)
    check_out(out, pictures)
    refuse_mixed_sizes(camera, pictures)
    taken_s: list[float] = []
    with ExitStack() as opened:
        refiner = None
        if refine is not None:
            refiner = opened.enter_context(read_redrawn(place, refine, folder, seed)).refine
        localizer = MapLocalizer(
            place,
            world=world,
            least_confidence=least_confidence,
            refine=refiner,
            scale=scale,
            seed=seed,
        )

        def locate(path: Path) -> Located:
            return localizer.locate(*open_picture(path), path, camera)

        located = _locate_all(locate, pictures, taken_s)
    _write(out, pictures, located)
    found = [each.answer for each in located if each.status == FOUND]
    counts = [answer.support.inliers for answer in found]
    ratios = np.array([answer.focal_ratio for answer in found])
    ratios = ratios[np.isfinite(ratios)]
    return LocalizedInMap(
        n_images=len(pictures),
        n_found=len(found),
        n_ambiguous=sum(each.status == AMBIGUOUS for each in located),
        n_turned=sum(each.is_turned for each in located),
        inliers=float(median(counts)) if counts else float("nan"),
        focal_ratio=float(np.median(ratios)) if len(ratios) >= FEWEST_RATIOS else float("nan"),
        world=localizer.world,
        seconds=median(taken_s),
        n_frames=len(place),
        n_points=len(place.features.slope),
        states_errors=scale is not None,
    )


def _locate_all(
    locate: Callable[[Path], Located], pictures: Sequence[Path], taken_s: list[float]
) -> list[Located]:
    """Locate the photographs in their order, noting how long each took."""
    located = []
    with Progress(len(pictures), "localize") as progress:
        for index, path in enumerate(pictures, start=1):
            began = time.perf_counter()
            located.append(locate(path))
            taken_s.append(time.perf_counter() - began)
            progress.update()
            if index % PART == 0:
                name = f"photograph {index} of {len(pictures)}"
                progress.part_done(name, PART, sum(taken_s[-PART:]))
    return located


def _write(out: Path, pictures: Sequence[Path], located: Sequence[Located]) -> None:
    frame = pd.DataFrame([each.row for each in located], columns=list(HEADER[1:]))
    frame.insert(0, IMAGE, pd.Series([str(path) for path in pictures], dtype=object))
    with writing_to(out, lambda: "choose another file with `out`"):
        write_frame(out, frame, float_format=None)


def describe_map(place: StructureMap) -> str:
    """Say in a line what a map holds."""
    per_frame = len(place.features.slope) / len(place)
    return f"{len(place)} frames, {len(place.features.slope)} features ({per_frame:.0f} a frame)"
