"""Errors that poses state: what their inliers say, scaled by a trial of the map.

The covariance of a pose (:mod:`baselines.references.pose_covariance`) says which poses are more
exact than others, and nearly how exact. What it does not know, such as how far wrong the points of
the map are, and how often a pose is off by more than its inliers let see, is measured: frames of
the map are shown to it under another light, lens and sensor, as photographs of a place that has not
their frames, and the error of each pose is divided by its spread. Of these ratios the quantiles of
68 and of 95 % are the factors between spreads and stated radii. They are taken one rank higher than
in the sample itself, so that a new pose of the same kind lies within the radius with that
probability at least, whatever the distribution (split conformal prediction: Papadopoulos et al.,
ECML 2002; Lei et al., JASA 2018).

The trial knows the errors of matching in the map, not those of the capture that it was built from.
Photographs of known pose, which the capture of a place has, are therefore a second trial, and the
wider of both radii is stated. These photographs are few, those of one stretch of the walk are off
alike, and their poses are wrong like those of the photographs beside them, which the scan was
coloured by. So their factors are tolerance limits (Wilks, Annals of Mathematical Statistics 1941),
which hold the share of new poses with 90 % confidence and not only on average.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Literal, NamedTuple, Self

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image
from pydantic import ValidationError, model_validator
from scipy.special import bdtr

from baselines.references.confidence import LEAST_CONFIDENCE
from baselines.references.map_frames import MapFrames
from baselines.references.mapped import RECORD, StructureMap
from baselines.references.photographs import Finder
from baselines.references.pose_covariance import Spread
from baselines.references.single_thread import single_thread
from baselines.training.photometric import PhotometricRandomisation
from synfeal.camera.calibration import Calibration
from synfeal.config.effects import NoiseConfig
from synfeal.config.load import describe
from synfeal.config.photometric import BlurConfig, PhotometricConfig
from synfeal.config.types import NonNegative, Positive, Strict
from synfeal.errors import InputError, read_as
from synfeal.evaluation.coverage import SD_LEVEL, WIDE_LEVEL, Coverage, coverage
from synfeal.evaluation.metrics import ORIENTATION, POSITION
from synfeal.geometry.poses import pose_error
from synfeal.records.files import file_sha256, read_json, write_json
from synfeal.records.progress import Progress

Array = NDArray[np.float64]

FILE = "trial.json"
TRIED = 100  # frames of the map
# Frames before and after one that is tried, as a share of all: those of one path or of one stretch
# of a sequence were taken side by side, and are left out with it.
LEFT_OUT = 0.02
# Poses found. With fewer than 19, no rank holds 95 % of new ones.
FEWEST = 24
# With which radii that photographs of a capture widen hold at least the share that they state.
CONFIDENCE = 0.9
# Times the median ratio of error and spread: beyond, a pose is of another place that looks alike.
# No radius holds those, and a limit near the largest ratio must not be theirs.
OF_ANOTHER_PLACE = 10.0
# Times the largest spread that was tried: of poses beyond, nothing is known.
BEYOND = 2.0
# Ranges of a photograph as large as the map's frames; those of training are for images of 64
# pixels.
PHOTOGRAPHIC = PhotometricConfig(
    blur=BlurConfig(sigma=0.005), noise=NoiseConfig(full_well_e=5000.0, read_e=5.0)
)


class Stated(NamedTuple):
    """Radii that a pose states, in the order of the columns ``STATED``.

    Attributes:
        position_sd_m: Holds the error of the position with 68 %.
        position_95_m: Holds it with 95 %.
        orientation_sd_deg: Holds the error of the orientation with 68 %.
        orientation_95_deg: Holds it with 95 %.
    """

    position_sd_m: float
    position_95_m: float
    orientation_sd_deg: float
    orientation_95_deg: float


class Poses(Strict):
    """Poses that a map found of pictures of known pose.

    Attributes:
        position_m: Error of each pose found.
        position_spread_m: What its inliers say of that error.
        orientation_deg: Error of each pose found.
        orientation_spread_deg: What its inliers say of that error.
    """

    position_m: tuple[NonNegative, ...]
    position_spread_m: tuple[Positive, ...]
    orientation_deg: tuple[NonNegative, ...]
    orientation_spread_deg: tuple[Positive, ...]

    @model_validator(mode="after")
    def _one_row_each(self) -> Self:
        columns = (
            self.position_m,
            self.position_spread_m,
            self.orientation_deg,
            self.orientation_spread_deg,
        )
        if len({len(column) for column in columns}) > 1:
            raise ValueError("its columns are not of one length")
        return self


class Trial(Poses):
    """Content of ``trial.json``: frames that were shown to a map, and the poses that it found.

    Attributes:
        format: Kind of the file.
        version: Of its layout.
        map_sha256: Hash of the ``map.json`` that was tried.
        seed: Of light, lens and sensor.
        tried: Frames shown, localized or not.
        photographs: Poses of photographs of the capture; None where there are none.
    """

    format: Literal["synfeal trial of a map"] = "synfeal trial of a map"
    version: Literal[1] = 1
    map_sha256: str
    seed: int
    tried: int
    photographs: Poses | None = None


class ErrorScale:
    """Turns spreads into stated radii.

    Args:
        trial: Trial of the map, of at least ``FEWEST`` poses.
    """

    def __init__(self, trial: Trial) -> None:
        # What the trial's frames alone say of the photographs that are the second trial has to hold
        # for these, whatever their spread.
        self._farthest = Spread(math.inf, math.inf)
        self._position = np.array(_factors(trial.position_m, trial.position_spread_m))
        self._orientation = np.array(_factors(trial.orientation_deg, trial.orientation_spread_deg))
        seen = trial.photographs
        if seen is not None and len(seen.position_m) >= FEWEST:
            position = _sure_factors(seen.position_m, seen.position_spread_m)
            orientation = _sure_factors(seen.orientation_deg, seen.orientation_spread_deg)
            self._position = np.maximum(self._position, position)
            self._orientation = np.maximum(self._orientation, orientation)
            self._farthest = _farthest((trial, seen))

    def knows(self, spread: Spread) -> bool:
        """Tell whether poses about as uncertain as this were tried.

        Others rest on fewer or nearer matches than any that the place's photographs have: they may
        be of what it does not show, and match things that only look alike.
        """
        return all(own <= most for own, most in zip(spread, self._farthest, strict=True))

    def stated(self, spread: Spread) -> Stated:
        """Return the radii of a pose of this spread."""
        position_m = (spread.position_m * self._position).tolist()
        orientation_deg = (spread.orientation_deg * self._orientation).tolist()
        return Stated(*position_m, *orientation_deg)

    def spreads(self, stated: Array) -> tuple[Array, Array]:
        """Return the spreads (N,) of position and orientation of poses that state radii (N, 4)."""
        return stated[:, 1] / self._position[1], stated[:, 3] / self._orientation[1]


def _farthest(tried: tuple[Poses, ...]) -> Spread:
    """Find the largest spread about which poses that were tried say something."""
    columns = [
        [(one.position_m, one.position_spread_m) for one in tried],
        [(one.orientation_deg, one.orientation_spread_deg) for one in tried],
    ]
    largest = []
    for pairs in columns:
        of_this_place = []
        for errors, spreads in pairs:
            spread = np.array(spreads)
            ratio = np.array(errors) / spread
            of_this_place.append(spread[ratio <= OF_ANOTHER_PLACE * np.median(ratio)].max())
        largest.append(BEYOND * max(of_this_place))
    return Spread(*largest)


def _factors(errors: tuple[float, ...], spreads: tuple[float, ...]) -> list[float]:
    """Compute the ratios (2,) of error to spread that hold 68 and 95 % of new poses."""
    ratios = np.sort(np.array(errors) / np.array(spreads))
    ranks = (math.ceil((len(ratios) + 1) * level) for level in (SD_LEVEL, WIDE_LEVEL))
    return [float(ratios[min(rank, len(ratios)) - 1]) for rank in ranks]


def _sure_factors(errors: tuple[float, ...], spreads: tuple[float, ...]) -> Array:
    """Compute ratios (2,) that hold 68 and 95 % of new poses with ``CONFIDENCE``.

    Where there are too few poses for that, the largest ratio of a pose of this place stands in.
    """
    ratios = np.sort(np.array(errors) / np.array(spreads))
    ratios = ratios[ratios <= OF_ANOTHER_PLACE * np.median(ratios)]
    count = len(ratios)
    # The r-th of n ratios holds less than a share p if at least r of n lie within it.
    ranks = np.arange(1, count + 1)
    limits = []
    for level in (SD_LEVEL, WIDE_LEVEL):
        is_sure = bdtr(ranks - 1, count, level) >= CONFIDENCE
        limits.append(ratios[np.argmax(is_sure)] if is_sure.any() else ratios[-1])
    return np.maximum(limits, _factors(errors, spreads))


def held_out_coverage(trial: Trial) -> dict[str, list[Coverage]]:
    """Judge errors that half of a map's frames state by the factors of the other half.

    Returns:
        Coverage of ``position_m`` and of ``orientation_deg``; nothing where a half has too few.
    """
    alone = trial.model_copy(update={"photographs": None})
    return _coverage_by_halves(
        trial, lambda others: ErrorScale(alone.model_copy(update=dict(others)))
    )


def photographs_coverage(trial: Trial) -> dict[str, list[Coverage]]:
    """Judge the radii that photographs of a capture state, if the other half of them widens these.

    Returns:
        Coverage of ``position_m`` and of ``orientation_deg``; nothing where a half has too few.
    """
    if trial.photographs is None:
        return {}
    return _coverage_by_halves(
        trial.photographs,
        lambda others: ErrorScale(trial.model_copy(update={"photographs": others})),
    )


def _coverage_by_halves(
    poses: Poses, scale_of: Callable[[Poses], ErrorScale]
) -> dict[str, list[Coverage]]:
    """Judge the radii of every second pose by the scale that the others make."""
    if len(poses.position_m) < 2 * FEWEST:
        return {}
    stated = np.empty((len(poses.position_m), 4))
    for half in (0, 1):
        others = Poses(**{name: getattr(poses, name)[1 - half :: 2] for name in Poses.model_fields})
        scale = scale_of(others)
        stated[half::2] = [scale.stated(spread) for spread in _spreads(poses)[half::2]]
    return {
        POSITION: coverage(np.array(poses.position_m), *stated.T[:2]),
        ORIENTATION: coverage(np.array(poses.orientation_deg), *stated.T[2:]),
    }


def usual_radius_m(trial: Trial) -> float | None:
    """Return the 95 % radius of the position that most of what was tried states, the median.

    Of the photographs of a capture, if there are; None where too few poses were found.
    """
    if len(trial.position_m) < FEWEST:
        return None
    scale = ErrorScale(trial)
    radii_m = [
        scale.stated(spread).position_95_m for spread in _spreads(trial.photographs or trial)
    ]
    return float(np.median(radii_m)) if radii_m else None


def _spreads(poses: Poses) -> list[Spread]:
    pairs = zip(poses.position_spread_m, poses.orientation_spread_deg, strict=True)
    return [Spread(*pair) for pair in pairs]


def read_scale(folder: Path) -> ErrorScale | None:
    """Read the scale of a map's errors.

    Args:
        folder: The map.

    Returns:
        The scale; None where the map was not tried (earlier versions did not), was changed since,
        or found too few of the frames that it was shown.

    Raises:
        InputError: The file is damaged.
    """
    if not (folder / FILE).is_file():
        return None
    trial = read_trial(folder)
    changed = trial.map_sha256 != file_sha256(folder / RECORD)
    return None if changed or len(trial.position_m) < FEWEST else ErrorScale(trial)


def read_trial(folder: Path) -> Trial:
    """Read the trial of a map.

    Args:
        folder: The map.

    Raises:
        InputError: The file is damaged.
    """
    path = folder / FILE
    remedy = "delete it, and make it again by synfeal build or synfeal map"
    with read_as(path, "the trial of a map", remedy=f"; {remedy}"):
        values = read_json(path)
    try:
        return Trial.model_validate(values)
    except ValidationError as error:
        raise InputError(path, describe(error), remedy) from error


def write_trial(place: StructureMap, frames: MapFrames, folder: Path, seed: int = 0) -> Trial:
    """Try a map on its own frames, and write ``trial.json`` into its folder.

    Args:
        place: The map.
        frames: Its frames.
        folder: Where it lies.
        seed: Of light, lens and sensor, and of RANSAC's samples.
    """
    trial = try_map(place, frames, file_sha256(folder / RECORD), seed)
    write_json(folder / FILE, trial.model_dump(mode="json"))
    return trial


def add_photographs(folder: Path, error_m: Array, error_deg: Array, stated: Array) -> None:
    """Add photographs of known pose to the trial of a map, if it states errors.

    Args:
        folder: The map.
        error_m: Errors (N,) of the positions of those that were localized.
        error_deg: Errors (N,) of their orientations.
        stated: Radii (N, 4) that they state, columns of ``STATED``.
    """
    scale = read_scale(folder)
    if scale is None or not len(stated):
        return
    spread_m, spread_deg = scale.spreads(stated)
    photographs = Poses(
        position_m=error_m.tolist(),
        position_spread_m=spread_m.tolist(),
        orientation_deg=error_deg.tolist(),
        orientation_spread_deg=spread_deg.tolist(),
    )
    trial = read_trial(folder).model_copy(update={"photographs": photographs})
    write_json(folder / FILE, trial.model_dump(mode="json"))


@single_thread()
def try_map(place: StructureMap, frames: MapFrames, map_sha256: str, seed: int) -> Trial:
    """Show frames of a map to the rest of it, under another light, lens and sensor.

    Args:
        place: The map.
        frames: Its frames.
        map_sha256: Hash that the map is known by.
        seed: Of light, lens and sensor, and of RANSAC's samples.
    """
    finder = Finder(place, seed)
    randomise = PhotometricRandomisation(PHOTOGRAPHIC, seed)
    calibration = Calibration.of_camera(place.camera)
    every = np.arange(len(place))
    found: list[tuple[float, ...]] = []
    tried = np.unique(np.linspace(0, len(place) - 1, TRIED).round().astype(np.int64))
    if len(tried) < FEWEST:  # too few poses would be found, whatever they were
        tried = tried[:0]
    with Progress(len(tried), "tried") as progress:
        for row in tried:
            image = photographed(frames.read_color(int(row)), randomise)
            photograph = finder.look_at(Image.fromarray(image), calibration)
            among = every[np.abs(every - row) > LEFT_OUT * len(place)]
            answer = finder.find(photograph, among)
            sure = answer.support.confidence >= LEAST_CONFIDENCE and not answer.is_ambiguous
            spread = answer.spread
            if sure and spread is not None and math.isfinite(sum(spread)):
                error_m, error_rad = pose_error(answer.world_from_cam, place.world_from_cam[row])
                error_deg = float(np.degrees(error_rad))
                found.append((float(error_m), spread.position_m, error_deg, spread.orientation_deg))
            progress.update()
    columns = np.array(found, np.float64).reshape(-1, 4).T.tolist()
    return Trial(
        map_sha256=map_sha256,
        seed=seed,
        tried=len(tried),
        position_m=columns[0],
        position_spread_m=columns[1],
        orientation_deg=columns[2],
        orientation_spread_deg=columns[3],
    )


def photographed(
    image: NDArray[np.uint8], randomise: PhotometricRandomisation
) -> NDArray[np.uint8]:
    """Show an image (H, W, 3) under another light, lens and sensor.

    What is randomised are squares, so the shorter side is continued as in a mirror.
    """
    height, width = image.shape[:2]
    side = max(height, width)
    square = np.pad(image, ((0, side - height), (0, side - width), (0, 0)), mode="symmetric")
    shown = randomise(torch.from_numpy(square).permute(2, 0, 1)[None])[0]
    levels = shown[:, :height, :width].permute(1, 2, 0).round().to(torch.uint8)
    return np.ascontiguousarray(levels.numpy())
