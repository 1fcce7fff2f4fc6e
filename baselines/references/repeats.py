"""Repeats of a place: where its frames look the same as frames that were taken elsewhere.

Equal doors, windows and desks give a photograph poses in many places. Retrieval names some of them,
those whose frames look most alike, and may leave out the right one. When a map is built, its frames
are therefore matched with those that look like them and were taken elsewhere. Their true poses are
known, so matches of things that both see can be left out, and a pose on the rest is a look-alike:
a rigid motion of the world from what a frame shows to where the same is seen again. A photograph
that is found near that frame may as well have been taken where the motion leads.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.references.arrays import Stored, Vectors
from baselines.references.confidence import LEAST_CONFIDENCE, support_of
from baselines.references.correspondences import mutual_matches
from baselines.references.features import Features
from baselines.references.structure import missed_px, pinhole, supported_pose
from synfeal.config.dataset import CameraConfig
from synfeal.geometry.poses import inverse, pose_error
from synfeal.records.progress import Progress

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

SEARCHED = 200  # frames whose look-alikes are searched
LOOKED_AT = 8  # frames that look like one of them
# Frames nearer to each other than this see the same things; of a path, one is matched.
NEAR_M, NEAR_RAD = 0.5, np.radians(20.0)
RATIO = 0.85
MAX_ERROR_PX = 6.0  # in the map's frames; poses of a scan contradict each other by some pixels
SAME_PX = 20.0  # matches that the true pose misses by less are of one thing
FEWEST = 30  # features that a look-alike explains
NEAREST = 5  # frames searched, near a pose, whose look-alikes are asked for
# How many metres a radian counts in "nearest": turning by 30 degrees changes what is seen about as
# much as a step of a metre does.
METRES_PER_RADIAN = 2.0


@dataclass(frozen=True)
class Repeats(Stored):
    """R look-alikes of frames of a map.

    Attributes:
        searched: Frames (S,) whose look-alikes were searched.
        frame: The frame (R,) that each look-alike is of.
        elsewhere_from_here: Rigid motions (R, 4, 4) of the world from what the frame shows to where
            the same is seen again.
        inliers: Features (R,) of the frame that it explains.
    """

    searched: Rows
    frame: Rows
    elsewhere_from_here: Array
    inliers: Rows

    @classmethod
    def none(cls) -> Repeats:
        """Return those of a map that was not searched."""
        no_row = np.empty(0, np.int64)
        return cls(no_row, no_row, np.empty((0, 4, 4)), no_row)

    def fits(self, n_frames: int) -> bool:
        """Tell whether the arrays fit each other and a map of so many frames."""
        count = len(self.frame)
        rows = np.concatenate([self.searched.ravel(), self.frame.ravel()])
        return (
            self.searched.ndim == self.frame.ndim == 1
            and self.elsewhere_from_here.shape == (count, 4, 4)
            and self.inliers.shape == (count,)
            and bool(((rows >= 0) & (rows < n_frames)).all())
        )

    def look_alikes(self, world_from_cam: Array, frames: Array) -> Array:
        """List the poses that a pose may be mistaken for, those with most support first.

        Args:
            world_from_cam: Pose (4, 4).
            frames: Poses (N, 4, 4) of the frames of the map.

        Returns:
            Poses (P, 4, 4).
        """
        distance_m, angle_rad = pose_error(frames[self.searched], world_from_cam)
        order = np.argsort(distance_m + METRES_PER_RADIAN * angle_rad, kind="stable")
        nearest = self.searched[order[:NEAREST]]
        row = np.flatnonzero(np.isin(self.frame, nearest))
        row = row[np.argsort(-self.inliers[row], kind="stable")]
        return np.asarray(self.elsewhere_from_here[row] @ world_from_cam)


class PosedFeatures(NamedTuple):
    """Frames of a map with their features.

    Attributes:
        world_from_cam: Their poses (N, 4, 4).
        camera: Their camera.
        features: Their features (K).
        point_m: Positions (K, 3) of the features in the world.
        vectors: Unit vectors (N, D) to retrieve frames by.
    """

    world_from_cam: Array
    camera: CameraConfig
    features: Features
    point_m: Array
    vectors: Vectors


def find_repeats(shown: PosedFeatures, seed: int = 0) -> Repeats:
    """Search the look-alikes of up to ``SEARCHED`` frames of a map, evenly spread.

    Args:
        shown: The frames.
        seed: Seed of RANSAC's samples.
    """
    count = len(shown.world_from_cam)
    searched = np.unique(np.linspace(0, count - 1, SEARCHED).round().astype(np.int64))
    frame, motions, inliers = [], [], []
    with Progress(len(searched), "repeats") as progress:
        for row in searched.tolist():
            for other in _alike_elsewhere(shown, row):
                found = _look_alike(shown, row, other, seed)
                if found is not None:
                    pose, explained = found
                    frame.append(row)
                    motions.append(pose @ inverse(shown.world_from_cam[row]))
                    inliers.append(explained)
            progress.update()
    return Repeats(
        searched=searched,
        frame=np.array(frame, np.int64),
        elsewhere_from_here=np.array(motions, np.float64).reshape(-1, 4, 4),
        inliers=np.array(inliers, np.int64),
    )


def _alike_elsewhere(shown: PosedFeatures, row: int) -> list[int]:
    """List frames that look most like one, none near it or near another of the list."""
    alike = shown.vectors @ shown.vectors[row]
    free = ~_near(shown.world_from_cam, shown.world_from_cam[row])
    chosen: list[int] = []
    while free.any() and len(chosen) < LOOKED_AT:
        best = int(np.argmax(np.where(free, alike, -np.inf)))
        chosen.append(best)
        free &= ~_near(shown.world_from_cam, shown.world_from_cam[best])
    return chosen


def _look_alike(shown: PosedFeatures, row: int, other: int, seed: int) -> tuple[Array, int] | None:
    """Find the pose (4, 4) of a frame in another one, by what is not the same in both.

    Returns:
        The pose, and the features that it explains; None where too little speaks for it.
    """
    features, camera = shown.features, shown.camera
    own, match = mutual_matches(features.roots(row), features.roots(other), RATIO)
    focal_px = np.array(camera.intrinsics[:2])
    pixel = features.slope[features.of(row)][own] * focal_px
    point_m = shown.point_m[features.of(other)][match]
    is_other = missed_px(pixel, point_m, shown.world_from_cam[row], focal_px) >= SAME_PX
    if is_other.sum() < FEWEST:
        return None
    pixel, point_m = pixel[is_other], point_m[is_other]
    found = supported_pose(pixel, point_m, pinhole(camera), seed, MAX_ERROR_PX)
    if found is None:
        return None
    support = support_of(
        pixel=pixel,
        own=own[is_other],
        inlier=found.inlier,
        size=(camera.width, camera.height),
        max_error_px=MAX_ERROR_PX,
    )
    is_sure = support.inliers >= FEWEST and support.confidence >= LEAST_CONFIDENCE
    return (found.world_from_cam, support.inliers) if is_sure else None


def _near(frames: Array, world_from_cam: Array) -> NDArray[np.bool_]:
    """Mark the poses (N, 4, 4) that see what another one (4, 4) sees."""
    distance_m, angle_rad = pose_error(frames, world_from_cam)
    return np.asarray((distance_m < NEAR_M) & (angle_rad < NEAR_RAD))
