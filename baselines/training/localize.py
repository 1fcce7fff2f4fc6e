"""Localization of a person's own pictures with a trained model."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from PIL import Image
from torch import Tensor

from baselines.training.checkpoint import ModelDescription, TrainedLocalizer, read_checkpoint
from baselines.training.device import open_device
from baselines.training.pictures import check_out, find_pictures, refuse_mixed_sizes
from baselines.training.predict import BATCH, DECIMALS, median_ms
from baselines.training.resample import Resampler, same_view
from baselines.training.typicality import OUTSIDE, features_of, typicality
from baselines.training.virtual_views import VirtualViews
from synfeal.camera.calibration import Calibration
from synfeal.camera.orientation import Orientation, Upright, upright
from synfeal.camera.photograph import PhotographCamera, Source
from synfeal.dataset.images import HEIF, decode_image, read_image
from synfeal.dataset.packed import NetworkView, fit_frame
from synfeal.dataset.pose_table import COLUMNS, SEEN
from synfeal.errors import Argument, InputError
from synfeal.geometry.poses import pose_from_quat, quat_wxyz_of
from synfeal.records.files import writing_to
from synfeal.records.progress import Progress
from synfeal.records.tables import write_frame

Array = NDArray[np.float64]
World = Literal["sequence", "mesh"]
# A network guesses a little beyond what it has seen; half a metre is no extrapolation in any room.
LEAST_MARGIN_M = 0.5
# Pairs of virtual rotations: twice as many change errors by less than their seeds do.
DEFAULT_TURNS = 8
MOST_TURNS = 1000
MOST_PIXELS = 2**27  # more than any camera takes

log = logging.getLogger(__name__)

HEADER = ("image", *COLUMNS[2:], *SEEN)


class Localized(NamedTuple):
    """Result of localizing pictures by a trained model.

    Attributes:
        description: Description of the localizer.
        device: Device it ran on, ``cpu`` or ``cuda``.
        n_images: Pictures.
        n_failed: Those whose pose is not finite.
        n_beyond: Those whose pose lies far outside of the training positions.
        n_unlike: Those that are unlike the training frames; None where the model cannot tell.
        n_resampled: Those that were brought to the training camera.
        n_turned: Those of these that EXIF turns, and their calibration with them.
        calibration: Source of the camera of these.
        outside: Largest share of the training view that one of these does not show.
        world: Whose coordinates poses are in, where the two differ.
        read_ms: Median time to read and shrink a picture.
        network_ms: Median time of the network on all views of one picture alone.
        views: Views of each picture that its pose is the mean of.
        images_per_s: Pictures per second in batches, reading included.
    """

    description: ModelDescription
    device: str
    n_images: int
    n_failed: int
    n_beyond: int
    n_unlike: int | None
    n_resampled: int
    n_turned: int
    calibration: Source | None
    outside: float
    world: World | None
    read_ms: float
    network_ms: float
    views: int
    images_per_s: float


def localize(
    model: Path,
    named: Sequence[Path],
    out: Path,
    device: Literal["auto", "cpu", "cuda"],
    *,
    camera: PhotographCamera | None = None,
    world: World = "sequence",
    turns: int = DEFAULT_TURNS,
) -> Localized:
    """Write the pose of each picture as CSV (columns of ``HEADER``), in the order named.

    ``status`` is ``inside`` of what the model has seen, ``outside``, ``unknown`` where the model
    cannot tell, or ``no pose``; ``typicality`` and ``outside_m`` are those of :class:`Familiarity`.

    Args:
        model: Checkpoint.
        named: Pictures, and directories that stand for their pictures.
        out: File to write; it appears when all are done.
        device: Device to run on.
        camera: Camera of the pictures; without one they are taken to show what training frames do.
        world: Whose coordinates ``world_from_cam`` is written in, where the place was scanned from
            a sequence that has its own; else they are those of the training labels. A pose that is
            not finite is written as ``nan``.
        turns: Pairs of virtual rotations that a pose is averaged over; 0: the picture as it is.

    Raises:
        InputError: The model or a picture cannot be used, or ``out`` cannot be written.
    """
    trained = read_checkpoint(model, open_device(device))
    if not 0 <= turns <= MOST_TURNS:
        raise InputError(Argument("turns"), f"must be 0 to {MOST_TURNS}, found {turns}")
    reader = PictureReader(trained.description, camera or PhotographCamera(exif=False), model)
    pictures = find_pictures(named)
    check_out(out, [model, *pictures])
    refuse_mixed_sizes(reader.camera, pictures)
    views = VirtualViews(trained, turns)
    first = _batch(trained, pictures[:1], reader)
    network_ms = median_ms(lambda: views.predict(first))
    reader.read_s.clear()
    began = time.perf_counter()
    position_m, quat_wxyz, features = _predict_all(trained, views, pictures, reader)
    seconds = time.perf_counter() - began
    seen = _seen(trained, position_m, features)
    moved = trained.description.sequence_from_world
    if moved is not None and world == "sequence":
        position_m, quat_wxyz = _moved(np.array(moved), position_m, quat_wxyz)
    good = np.asarray(np.isfinite(position_m).all(axis=1) & np.isfinite(quat_wxyz).all(axis=1))
    _write(out, pictures, np.concatenate([position_m, quat_wxyz], axis=1), good, seen)
    return Localized(
        description=trained.description,
        device=trained.device.type,
        n_images=len(pictures),
        n_failed=int((~good).sum()),
        n_beyond=int(seen.beyond.sum()),
        n_unlike=None if trained.calibration is None else int(seen.unlike.sum()),
        n_resampled=len(reader.resampled),
        n_turned=len(reader.turned),
        calibration=reader.source if reader.resampled else None,
        outside=reader.outside,
        world=None if moved is None else world,
        read_ms=1000 * median(reader.read_s),
        network_ms=network_ms,
        views=views.count,
        images_per_s=len(pictures) / seconds,
    )


class Familiarity(NamedTuple):
    """Distance of answers from what a localizer has seen.

    Attributes:
        typicality: Share (N,) of frames of the place that are at least as unlike those of other
            paths as the picture; ``nan`` where the model cannot tell.
        outside_m: Distance (N,) of positions to the box of the training positions; ``nan`` where
            the model does not say which that is.
        beyond: Positions (N,) that are farther outside of that box than it is wide.
        knows_place: Whether the model was right about places that it had not been shown; None where
            that was not measured.
    """

    typicality: Array
    outside_m: Array
    beyond: NDArray[np.bool_]
    knows_place: bool | None = None

    @property
    def unlike(self) -> NDArray[np.bool_]:
        """Pictures (N,) that are unlike the training frames."""
        return np.asarray(self.typicality <= OUTSIDE)

    def status(self, good: NDArray[np.bool_]) -> NDArray[np.object_]:
        """Fill the column ``status`` (N,) in words; ``good`` (N,) are finite poses.

        A model that is lost in parts of its own place says ``inside`` of nothing: it takes pictures
        of those for what it knows.
        """
        told_apart = np.isfinite(self.typicality) & (self.knows_place is not False)
        told = [~good, self.unlike | self.beyond, told_apart]
        words = np.select(told, ["no pose", "outside", "inside"], default="unknown")
        return words.astype(object)


def _seen(trained: TrainedLocalizer, position_m: Array, features: Tensor | None) -> Familiarity:
    """Compare pictures and answers with what was learned from.

    Args:
        trained: Localizer.
        position_m: Its answers (N, 3) in the world of the training labels.
        features: Features of the pictures (N, F); None where the model has no calibration.
    """
    unknown, calibration = np.full(len(position_m), np.nan), trained.calibration
    typical = unknown
    if calibration is not None and features is not None:
        typical = typicality(calibration, features).round(DECIMALS)
    score = trained.description.unseen
    knows_place = None if score is None else score.knows_place
    if trained.description.bounds_m is None:
        return Familiarity(typical, unknown, np.zeros(len(position_m), bool), knows_place)
    low, high = np.array(trained.description.bounds_m)
    excess_m = np.maximum(np.maximum(low - position_m, position_m - high), 0.0)
    beyond = excess_m > np.maximum(high - low, LEAST_MARGIN_M)
    outside_m = np.linalg.norm(excess_m, axis=1).round(DECIMALS)
    return Familiarity(typical, outside_m, np.asarray(beyond.any(axis=1)), knows_place)


def _moved(sequence_from_world: Array, position_m: Array, quat_wxyz: Array) -> tuple[Array, Array]:
    """Move positions (N, 3) and quaternions (N, 4) to the sequence's world; NaN stays NaN."""
    position_m = position_m @ sequence_from_world[:3, :3].T + sequence_from_world[:3, 3]
    moved = np.full_like(quat_wxyz, np.nan)
    known = np.isfinite(quat_wxyz).all(axis=1)
    if known.any():
        pose = pose_from_quat(np.zeros((int(known.sum()), 3)), quat_wxyz[known])
        moved[known] = quat_wxyz_of(sequence_from_world @ pose)
    return position_m.round(DECIMALS), moved.round(DECIMALS)


def _predict_all(
    trained: TrainedLocalizer,
    views: VirtualViews,
    pictures: Sequence[Path],
    reader: PictureReader,
) -> tuple[Array, Array, Tensor | None]:
    """Predict in batches, as a test set is predicted in.

    Returns:
        Positions (N, 3), quaternions (N, 4), and features (N, F) of the pictures; no features where
        the model has no calibration to compare them with.
    """
    poses, features = [], []
    with Progress(len(pictures), "localize") as progress:
        for start in range(0, len(pictures), BATCH):
            began = time.perf_counter()
            batch = pictures[start : start + BATCH]
            images = _batch(trained, batch, reader)
            poses.append(views.predict(images))
            if trained.calibration is not None:
                normalised = trained.statistics.normalise(images)
                features.append(features_of(trained.network, normalised))
            progress.update(len(batch))
            if len(pictures) > BATCH:
                name = f"picture {start + len(batch)} of {len(pictures)}"
                progress.part_done(name, len(batch), time.perf_counter() - began)
    position_m, quat_wxyz = zip(*poses, strict=True)
    return (
        np.concatenate(position_m),
        np.concatenate(quat_wxyz),
        torch.cat(features) if features else None,
    )


def _batch(trained: TrainedLocalizer, pictures: Sequence[Path], reader: PictureReader) -> Tensor:
    """Read pictures as (B, 3, px, px) uint8, channels last."""
    frames = np.stack([reader(path) for path in pictures])
    return torch.from_numpy(frames).to(trained.device).permute(0, 3, 1, 2)


def _write(
    out: Path, pictures: Sequence[Path], poses: Array, good: NDArray[np.bool_], seen: Familiarity
) -> None:
    """Write numbers with enough digits to read back the same values; names as the bytes they are.

    Args:
        out: File to write.
        pictures: The pictures (N).
        poses: Positions and quaternions (N, 7).
        good: Poses (N,) that are finite.
        seen: Their distance from what the model has seen.
    """
    frame = pd.DataFrame(poses, columns=list(COLUMNS[2:]))
    frame.insert(0, HEADER[0], pd.Series([str(path) for path in pictures], dtype=object))
    further = seen.status(good), seen.typicality, seen.outside_m
    frame = frame.assign(**dict(zip(SEEN, further, strict=True)))
    with writing_to(out, lambda: "choose another file with `out`"):
        write_frame(out, frame, float_format=None, na_rep="nan")


FORMATS = ("PNG", "JPEG", HEIF)
LEAVE_OUT = "; leave it out or repair it"
# A longer picture has no square with as much to see as a training frame has.
MAX_ASPECT = 20


def read_picture(path: Path, input_px: int, view: NetworkView = "square") -> NDArray[np.uint8]:
    """Read a picture that shows what training frames do.

    Args:
        path: PNG, JPEG or HEIC.
        input_px: Side of the network's image.
        view: Part of the picture that it shows.

    Returns:
        Pixels (input_px, input_px, 3), made by the function that packs training frames.

    Raises:
        InputError: As :func:`open_picture`.
    """
    return fit_frame(open_picture(path).image, input_px, view)


def open_picture(path: Path) -> Upright:
    """Read a picture as RGB, turned upright by its EXIF orientation.

    So are photographs that are packed for training. Grey, palette and CMYK become RGB; an alpha
    channel is left out.

    Raises:
        InputError: The file is damaged, is no picture of eight bits per channel, or is too long for
            a square to be cut out.
    """
    image = read_image(path, "RGB", formats=FORMATS, most_pixels=MOST_PIXELS, remedy=LEAVE_OUT)
    return _upright(image, path)


def decode_picture(content: bytes, name: object, most_pixels: int = MOST_PIXELS) -> Upright:
    """Decode a picture as :func:`open_picture` does.

    Args:
        content: Bytes of a PNG or JPEG.
        name: Its name in messages.
        most_pixels: Largest width times height.

    Raises:
        InputError: It is damaged or too large, or is no picture of eight bits per channel.
    """
    image = decode_image(content, name, "RGB", formats=FORMATS, most_pixels=most_pixels)
    return _upright(image, name)


def _upright(image: Image.Image, name: object) -> Upright:
    if max(image.size) > MAX_ASPECT * min(image.size):
        raise InputError(
            name,
            f"is {image.width} x {image.height} pixels, too long for a square to be cut"
            f" out{LEAVE_OUT}",
        )
    return upright(image)


class PictureReader:
    """Reads pictures as the network is to see them.

    Args:
        description: Description of the localizer, with the camera of its training frames.
        camera: Camera of the pictures.
        model: The checkpoint, for messages.

    Attributes:
        read_s: Seconds that each picture took.
        resampled: Pictures that were brought to the training camera.
        turned: Those of them that EXIF turns, and their calibration with them.
        outside: Largest share of the training view that one of these does not show.
        source: Source of the camera of pictures; None where there is none.

    Raises:
        InputError: A calibration is given for a model that does not know its own camera.
    """

    def __init__(
        self, description: ModelDescription, camera: PhotographCamera, model: Path
    ) -> None:
        self._network, self._target = description.network, description.camera
        self.camera = camera
        self.source = camera.source
        if self._target is None and camera.source in ("file", "focal"):
            raise InputError(
                model,
                "does not say which camera its training frames are of, so pictures cannot be"
                " brought to it",
                "leave the calibration out, or train on a data set of synfeal collect",
            )
        self._resamplers: dict[Calibration, Resampler | None] = {}
        self.read_s: list[float] = []
        self.resampled: set[Path] = set()
        self.turned: set[Path] = set()
        self.outside = 0.0

    def __call__(self, path: Path) -> NDArray[np.uint8]:
        """Read a picture as pixels (input_px, input_px, 3)."""
        began = time.perf_counter()
        image = self._brought(*open_picture(path), path)
        pixels = fit_frame(image, self._network.input_px, self._network.view)
        self.read_s.append(time.perf_counter() - began)
        return pixels

    def _brought(self, image: Image.Image, turn: Orientation, path: Path) -> Image.Image:
        """Resample the picture to the training camera, where both cameras are known."""
        known = None if self._target is None else self.camera.of(image, path, turn)
        if known is None or self._target is None:
            return image
        self.resampled.add(path)
        if self.camera.turns_with(image, turn):
            self.turned.add(path)
        if known not in self._resamplers:
            same = same_view(known, self._target)
            self._resamplers[known] = None if same else Resampler(known, self._target)
        resampler = self._resamplers[known]
        if resampler is None:
            return image
        self.outside = max(self.outside, resampler.outside)
        return resampler(image)
