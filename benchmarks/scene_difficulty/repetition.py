"""How often the most similar view of a scene is a view from somewhere else.

A frame is compared with frames of other paths, since its neighbours on its own path look alike
anyway. The number of mutual nearest descriptors that pass the ratio test in both directions says
how similar two frames are; geometry is left out, as a localizer that takes one wall for another
leaves it out. When the most similar frame was taken far away, the scene repeats itself there - or
nothing nearer was sampled, which is why frames with a near candidate are counted separately.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from tqdm import tqdm

from benchmarks.scene_difficulty.features import Features
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_error
from synfeal.report.tables import Value

MAX_FEATURES = 300
RATIO = 0.8  # COLMAP's
FAR_M = 2.0
NEAR_M, NEAR_DEG = 1.0, 30.0
FRAME_COLUMNS = ("frame", "path", "best_frame", "matches", "distance_m", "angle_deg", "has_near")

# Frames that one is compared with at a time: the similarities stay in the cache.
_CHUNK = 8


@dataclass(frozen=True)
class BestMatch:
    """The most similar candidate of every frame.

    Attributes:
        index: (N,) its index; the first of several that are as similar.
        matches: (N,) matching descriptors; where there are none, ``index`` means nothing.
        distance_m: (N,) between the two cameras.
        angle_deg: (N,) between their orientations.
        has_near: (N,) whether some candidate was within ``NEAR_M`` and ``NEAR_DEG``.
    """

    index: NDArray[np.int64]
    matches: NDArray[np.int64]
    distance_m: NDArray[np.float64]
    angle_deg: NDArray[np.float64]
    has_near: NDArray[np.bool_]


def count_matches(features: Sequence[Features], threads: int) -> NDArray[np.int64]:
    """Mutual nearest descriptors of all pairs (N, N), symmetric, zero on the diagonal."""
    torch.set_num_threads(threads)
    descriptor = _stacked(features)
    count = np.zeros((len(features), len(features)), np.int64)
    for i in tqdm(range(len(features)), desc="match"):
        for start in range(i + 1, len(features), _CHUNK):
            chunk = slice(start, start + _CHUNK)
            found = _mutual(descriptor[i], descriptor[chunk]).numpy()
            count[i, chunk] = count[chunk, i] = found
    return count


def best_matches(count: NDArray[np.int64], poses: PoseTable) -> BestMatch:
    """The candidate of another path with the most matches, for each of N frames."""
    candidate = poses.path[:, None] != poses.path[None, :]
    world_from_cam = poses.world_from_cam
    distance_m, angle_rad = pose_error(world_from_cam[:, None], world_from_cam[None, :])
    angle_deg = np.degrees(angle_rad)
    similarity = np.where(candidate, count, -1)
    index = similarity.argmax(axis=1)
    frames = np.arange(len(poses))
    near = candidate & (distance_m <= NEAR_M) & (angle_deg <= NEAR_DEG)
    return BestMatch(
        index,
        similarity[frames, index].clip(min=0),
        distance_m[frames, index],
        angle_deg[frames, index],
        near.any(axis=1),
    )


def repetition_rows(poses: PoseTable, best: BestMatch) -> list[dict[str, Value]]:
    """One row per frame."""
    return [
        {
            "frame": int(poses.frame[k]),
            "path": int(poses.path[k]),
            "best_frame": int(poses.frame[best.index[k]]) if best.matches[k] else None,
            "matches": int(best.matches[k]),
            "distance_m": float(best.distance_m[k]) if best.matches[k] else None,
            "angle_deg": float(best.angle_deg[k]) if best.matches[k] else None,
            "has_near": int(best.has_near[k]),
        }
        for k in range(len(poses))
    ]


def repetition_summary(scene: str, best: BestMatch) -> dict[str, Value]:
    """Shares of the frames with a match, and of those among them with a near candidate."""
    matched = best.matches > 0
    far = best.distance_m > FAR_M
    near = matched & best.has_near
    return {
        "scene": scene,
        "frames": len(best.index),
        "frames_without_match": int((~matched).sum()),
        "matches_median": float(np.median(best.matches)),
        "far_m": FAR_M,
        "far_share": _share(far, matched),
        "frames_with_near": int(near.sum()),
        "near_m": NEAR_M,
        "near_deg": NEAR_DEG,
        "far_share_with_near": _share(far, near),
    }


def _share(what: NDArray[np.bool_], among: NDArray[np.bool_]) -> float | None:
    return float(what[among].mean()) if among.any() else None


def _stacked(features: Sequence[Features]) -> torch.Tensor:
    """Unit descriptors (N, K, 128), filled up with zeros where a frame has fewer than K."""
    size = max(2, *(len(found) for found in features))
    descriptor = np.zeros((len(features), size, 128), np.float32)
    for k, found in enumerate(features):
        raw = found.descriptor.astype(np.float32)
        descriptor[k, : len(found)] = raw / np.linalg.norm(raw, axis=1, keepdims=True)
    return torch.from_numpy(descriptor)


def _mutual(query: torch.Tensor, others: torch.Tensor) -> torch.Tensor:
    """Matches (J,) of descriptors (K, 128) with those of J frames (J, K, 128), K >= 2.

    Zeros are at right angles to everything: never nearer than a descriptor, since those have no
    negative elements, and never matched themselves, since all are equally far from them.
    """
    cosine = others @ query.T  # (J, K others, K query)
    back, back_good = _nearest(cosine)
    there, there_good = _nearest(cosine.transpose(1, 2).contiguous())
    returns = torch.arange(len(query)) == back.gather(1, there)
    return (returns & there_good & back_good.gather(1, there)).sum(dim=1)


def _nearest(cosine: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Index of the nearest along the last axis, and whether it passes the ratio test."""
    first, index = cosine.max(dim=-1)
    rest = cosine.scatter(-1, index[..., None], -1.0).amax(dim=-1)
    return index, 1 - first < RATIO**2 * (1 - rest)  # squared distances are 2 - 2 cosine
