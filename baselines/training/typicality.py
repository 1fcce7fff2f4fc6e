"""Typicality of pictures: how unlike a localizer's training frames they are.

A pose regressor answers to any picture. What it has learned from lies together in the space of its
features, though, so a picture of another place is told by its distance to the nearest training
frame: the cosine distance between mean-pooled features of the backbone's last maps.

How large such a distance is for a picture of the right place is learned from the frames themselves,
each compared with those of other paths: the typicality of a picture is the share of them, the
picture itself counted among them, that are at least as far from the frames they are compared with.
So of further pictures of the place 5 % have a typicality of 0.05 or less, whatever the distances
are. Held-out frames alone would not do where they are of two or three paths: paths differ more than
their frames do, and pictures of further paths would be called foreign by the dozen.

Nearest neighbours in feature space: Sun et al., "Out-of-distribution detection with deep nearest
neighbors" (ICML 2022). Calibration: conformal p-values, Bates et al., "Testing for outliers with
conformal p-values" (Annals of Statistics, 2023).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from baselines.localizers.base import Localizer
from baselines.training.data import ImageStatistics, LabelledFrames
from baselines.training.photometric import PhotometricRandomisation

Array = NDArray[np.float64]
# Training frames that stand for all of them: twice as many double what they take in the file.
MOST_FRAMES = 2000
# Of fewer frames no share of 5 % can be told.
FEWEST_FRAMES = 20
BATCH = 100
# Pictures of this typicality or less are called outside; so are 5 % of further ones of the place.
OUTSIDE = 0.05


class Calibration(NamedTuple):
    """Features that a localizer has seen, and distances of new frames of the same place to them.

    Attributes:
        features: Features (M, F) of training frames, unit length, float16.
        distance: Distances (Q,) to the nearest of these, rising, float32: of themselves to those of
            other paths, and of held-out frames.
    """

    features: Tensor
    distance: Tensor


def calibrate(
    localizer: Localizer,
    statistics: ImageStatistics,
    learned: LabelledFrames,
    held_out: LabelledFrames | None,
    randomise: PhotometricRandomisation | None,
) -> Calibration | None:
    """Measure how far frames are from the training frames of other paths.

    Args:
        localizer: Trained network; it is in evaluation mode afterwards.
        statistics: Statistics of the images that it was trained on.
        learned: Frames it was trained on.
        held_out: Frames of paths that were not learned from, if any.
        randomise: Light, lens and sensor that training frames were shown under: both kinds of
            frames are shown so, lest a photograph is found unusual for being one.

    Returns:
        The calibration; None where there are too few frames or one path, or the training diverged.
    """
    few = _spread(len(learned), MOST_FRAMES)
    path = learned.path[few.numpy()]
    if len(few) < FEWEST_FRAMES or len(np.unique(path)) < 2:
        return None
    localizer.eval()
    features = _features(localizer, statistics, learned, few, randomise).half()
    distances = [nearest_distance(features, features, (path, path))]
    if held_out is not None:
        every = _spread(len(held_out), len(held_out))
        further = _features(localizer, statistics, held_out, every, randomise)
        distances.append(nearest_distance(further, features))
    distance = torch.cat(distances)
    if not (features.isfinite().all() and distance.isfinite().all()):
        return None
    return Calibration(features, distance.sort().values)


def _spread(count: int, most: int) -> Tensor:
    """Return at most so many indices, evenly spread over ``count``."""
    return torch.linspace(0, count - 1, min(count, most), dtype=torch.float64).round().long()


def _features(
    localizer: Localizer,
    statistics: ImageStatistics,
    frames: LabelledFrames,
    chosen: Tensor,
    randomise: PhotometricRandomisation | None,
) -> Tensor:
    """Compute features (B, F) of the frames with these indices (B,), on the processor."""
    features = []
    for some in torch.split(chosen, BATCH):
        images = frames.batch(some.to(frames.rows.device)).images
        shown = images if randomise is None else randomise(images)
        features.append(features_of(localizer, statistics.normalise(shown)))
    return torch.cat(features)


@torch.inference_mode()
def features_of(localizer: Localizer, images: Tensor) -> Tensor:
    """Average the backbone's last maps over the image.

    Args:
        localizer: In evaluation mode.
        images: Normalised (B, 3, H, W), on its device.

    Returns:
        Features (B, F) of unit length, on the processor.
    """
    maps = localizer.backbone(images)
    last: Tensor = maps if isinstance(maps, Tensor) else maps[-1]
    pooled = last.flatten(start_dim=2).mean(2) if last.dim() > 2 else last
    return nn.functional.normalize(pooled.float(), dim=1).cpu()


Paths = NDArray[np.int64]


def nearest_distance(
    features: Tensor, seen: Tensor, paths: tuple[Paths, Paths] | None = None
) -> Tensor:
    """Compute the cosine distance (B,) to the nearest of other frames.

    Args:
        features: Features of frames (B, F), unit length.
        seen: Features of the others (M, F), unit length.
        paths: Path of each of both (B,), (M,): those of one path are not compared; None
            to compare all.
    """
    seen = seen.float()
    nearest = []
    for rows in torch.split(torch.arange(len(features)), BATCH):
        cosine = features[rows].float() @ seen.T
        if paths is not None:
            same = paths[0][rows.numpy(), None] == paths[1]
            cosine[torch.from_numpy(same)] = -torch.inf
        nearest.append(1 - cosine.amax(1))
    return torch.cat(nearest)


def typicality(calibration: Calibration, features: Tensor) -> Array:
    """Rate pictures by the share (B,) of known frames at least as far from those of other paths.

    Args:
        calibration: Calibration of the localizer.
        features: Features of pictures (B, F), unit length.

    Returns:
        Between 1 / (Q + 1), for what is farther than all Q frames, and 1; ``nan`` where features
        are not finite.
    """
    distance = nearest_distance(features, calibration.features)
    n_frames = len(calibration.distance)
    n_nearer = torch.searchsorted(calibration.distance, distance.contiguous())
    share = (n_frames - n_nearer + 1).double() / (n_frames + 1)
    return np.where(distance.isfinite().numpy(), share.numpy(), np.nan)
