"""Localization of photographs in a map: retrieval, feature matching, PnP.

A photograph is reduced to the focal length of the map's frames, in pixels, so that a thing at the
same distance has the same size in both and one pixel means the same angle. Its pose is found twice:
from the frames that look most alike, then from those that were taken nearest to the first pose.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from baselines.references.arrays import most_alike
from baselines.references.confidence import LEAST_CONFIDENCE, NO_SUPPORT, Support, support_of
from baselines.references.correspondences import mutual_matches
from baselines.references.features import roots_of
from baselines.references.mapped import VIEW_PX, StructureMap, detect, detector
from baselines.references.structure import pinhole, refined_focal_px, supported_pose
from synfeal.camera.calibration import Calibration
from synfeal.camera.distortion import distort, undistort
from synfeal.camera.projection import cell_pixels, normalised_of_pixels
from synfeal.config.dataset import CameraConfig
from synfeal.geometry.poses import inverse, pose_error
from synfeal.geometry.rotations import quat_wxyz_from_matrix

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

RETRIEVED = 20  # frames that a photograph is matched with, once its pose is nearly known
# Those that look most alike: of a place that repeats itself, frames of each repeat must be there.
FIRST_RETRIEVED = 40
# Share of the inliers that a pose elsewhere has, from which nothing tells which of both is right.
ALIKE = 0.8
MOST_PLACES = 5  # that may look like what a photograph shows
APART_M, APART_RAD = 0.3, np.radians(10.0)  # between poses of different places
RATIO = 0.85
MAX_ERROR_PX = 6.0  # in the map's frames; poses of a scan contradict each other by some pixels
# Matches that miss by this many times the largest error of an inlier may miss because the focal
# length is wrong.
FOCAL_ERRORS = 2.0
SAMPLES = 4  # along each side of a pixel of what retrieval sees
# How many metres a radian counts in "nearest": turning by 30 degrees changes what is seen about as
# much as a step of a metre does.
METRES_PER_RADIAN = 2.0


class Photograph(NamedTuple):
    """Features and descriptors of a photograph, with its camera.

    Attributes:
        slope: x / z and y / z (k, 2) of the rays of its features, distortion removed.
        roots: RootSIFT descriptors (k, 128).
        view: It as the map's camera would have seen it (64, 64, 3), squeezed into a square.
        grey: Grey values (H, W) as the map's camera would have seen them; edges are continued.
        shown: Pixels (H, W) of these that the photograph shows.
    """

    slope: Array
    roots: NDArray[np.float32]
    view: NDArray[np.uint8]
    grey: NDArray[np.uint8]
    shown: NDArray[np.bool_]


class Answer(NamedTuple):
    """The pose of a photograph and what speaks for it.

    Attributes:
        world_from_cam: Pose (4, 4) in the world of the map, NaN where none was found.
        support: Its evidence.
        focal_ratio: Focal length that fits the matches best, over the one that was given; NaN where
            no pose was found. Of one photograph it means little, for a step back looks much like
            a shorter lens; of many the median does.
        rival: The best pose elsewhere, where there is any: places repeat themselves.
    """

    world_from_cam: Array
    support: Support
    focal_ratio: float
    rival: Rival | None = None

    @property
    def is_ambiguous(self) -> bool:
        """Tell whether another place explains the photograph about as well."""
        if self.rival is None:
            return False
        return self.rival.inliers >= ALIKE * self.support.inliers


class Rival(NamedTuple):
    """The best pose at another place.

    Attributes:
        world_from_cam: Pose (4, 4) in the world of the map.
        inliers: Features of the photograph that agree with it.
    """

    world_from_cam: Array
    inliers: int


NOT_FOUND = Answer(np.full((4, 4), np.nan), NO_SUPPORT, float("nan"))


class Finder:
    """Finds photographs in a map.

    Args:
        place: The map.
        seed: Seed of RANSAC's samples.
    """

    def __init__(self, place: StructureMap, seed: int = 0) -> None:
        self._place = place
        self._seed = seed
        self._sift = detector()
        self._pinhole = pinhole(place.camera)
        self._focal_px = np.array(place.camera.intrinsics[:2])

    def look_at(self, image: Image.Image, calibration: Calibration) -> Photograph:
        """Find the features of a photograph and what retrieval compares.

        Args:
            image: The photograph (RGB), of the calibration's size.
            calibration: Its camera.
        """
        pixels = np.asarray(image)
        full = np.array([calibration.width, calibration.height])
        focal_px = np.array([calibration.fx, calibration.fy])
        size = np.round(full * np.minimum(self._focal_px / focal_px, 1)).astype(int).clip(1)
        if (size < full).any():
            smaller = cv2.resize(pixels, size.tolist(), interpolation=cv2.INTER_AREA)
            pixels = np.asarray(smaller, dtype=np.uint8)
        scale = size / full
        grey = np.asarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
        pixel, descriptor = detect(self._sift, grey)
        centre = np.array([calibration.cx, calibration.cy])
        slope = undistort((pixel / scale - centre) / focal_px, calibration.distortion)
        known = np.isfinite(slope).all(axis=1)
        camera = self._place.camera
        cells = _places(calibration, camera, VIEW_PX * SAMPLES, VIEW_PX * SAMPLES)
        places = _places(calibration, camera, camera.width, camera.height)
        return Photograph(
            slope=slope[known],
            roots=roots_of(descriptor[known]),
            view=_sampled(pixels, cells * scale),
            grey=_looked_up(grey, places * scale),
            shown=np.asarray(((places > 0) & (places < full)).all(axis=-1)),
        )

    def find(self, photograph: Photograph) -> Answer:
        """Estimate where a photograph was taken."""
        first = self._against(photograph, self.alike(photograph))
        if first is None:
            return NOT_FOUND
        attempts = [self._settled(photograph, attempt) for attempt in self._places(first)]
        best = max(attempts, key=lambda attempt: attempt.support.inliers)
        elsewhere = [
            attempt
            for attempt in attempts
            if _are_apart(attempt.world_from_cam, best.world_from_cam)
        ]
        rival = max(elsewhere, key=lambda attempt: attempt.support.inliers, default=None)
        return Answer(
            world_from_cam=best.world_from_cam,
            support=best.support,
            focal_ratio=self._focal_ratio(best),
            rival=None if rival is None else Rival(rival.world_from_cam, rival.support.inliers),
        )

    def _settled(self, photograph: Photograph, attempt: _Attempt) -> _Attempt:
        """Match the frames that were taken nearest to a pose too, and keep the better one."""
        second = self._against(photograph, self.nearest(attempt.world_from_cam))
        if second is None or _are_apart(second.world_from_cam, attempt.world_from_cam):
            return attempt
        better = second.support.log10_nfa < attempt.support.log10_nfa
        return second if better else attempt

    def _places(self, first: _Attempt) -> list[_Attempt]:
        """List the first pose and those that the rest of its matches agree on, elsewhere.

        What is seen from one place matches features of all places that look like it.
        """
        found = [first]
        left = ~first.inlier
        while len(found) < MOST_PLACES:
            other = self._agreed(first.own[left], first.pixel[left], first.point_m[left])
            if other is None or other.support.confidence < LEAST_CONFIDENCE:
                break
            rows = np.flatnonzero(left)
            left[rows[other.inlier]] = False
            if all(_are_apart(other.world_from_cam, known.world_from_cam) for known in found):
                found.append(other)
        return found

    def alike(self, photograph: Photograph) -> Rows:
        """List the frames of the map that look most alike, best first."""
        vector = self._place.vlad.describe(photograph.view[None])
        return most_alike(self._place.vectors, vector, FIRST_RETRIEVED).ravel()

    def nearest(self, world_from_cam: Array) -> Rows:
        """List the frames of the map that were taken nearest to a pose (4, 4), best first."""
        place_m, quat_wxyz = self._place.world_from_cam[:, :3, 3], self._place.quat_wxyz
        distance_m = np.linalg.norm(place_m - world_from_cam[:3, 3], axis=1)
        cosine = np.abs(quat_wxyz @ quat_wxyz_from_matrix(world_from_cam[:3, :3]))
        angle_rad = 2 * np.arccos(np.minimum(cosine, 1))
        far = distance_m + METRES_PER_RADIAN * angle_rad
        order: Rows = np.argsort(far, kind="stable")
        return order[:RETRIEVED]

    def _against(self, photograph: Photograph, frames: Rows) -> _Attempt | None:
        """Estimate a pose from matches with some frames of the map."""
        features = self._place.features
        own, feature = [], []
        for frame in frames:
            mine, other = mutual_matches(photograph.roots, features.roots(int(frame)), RATIO)
            own.append(mine)
            feature.append(features.start[frame] + other)
        matched = np.concatenate(own)
        pixel = photograph.slope[matched] * self._focal_px
        point_m = self._place.point_m[np.concatenate(feature)]
        return self._agreed(matched, pixel, point_m)

    def _agreed(self, own: Rows, pixel: Array, point_m: Array) -> _Attempt | None:
        """Estimate the pose that most matches agree with.

        Args:
            own: Feature of the photograph (m,) of each match.
            pixel: Its position (m, 2) from the principal point.
            point_m: Where it was matched to (m, 3), in the world of the map.
        """
        found = supported_pose(
            pixel=pixel,
            point_m=point_m,
            camera=self._pinhole,
            seed=self._seed,
            max_error_px=MAX_ERROR_PX,
        )
        if found is None:
            return None
        camera = self._place.camera
        support = support_of(
            pixel=pixel,
            own=own,
            inlier=found.inlier,
            size=(camera.width, camera.height),
            max_error_px=MAX_ERROR_PX,
        )
        return _Attempt(found.world_from_cam, support, own, pixel, point_m, found.inlier)

    def _focal_ratio(self, attempt: _Attempt) -> float:
        """Estimate the best focal length over the given one, from matches that nearly agree."""
        cam_from_world = inverse(attempt.world_from_cam)
        in_cam_m = attempt.point_m @ cam_from_world[:3, :3].T + cam_from_world[:3, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            seen = in_cam_m[:, :2] / in_cam_m[:, 2:] * self._focal_px
            near = np.linalg.norm(seen - attempt.pixel, axis=1) < FOCAL_ERRORS * MAX_ERROR_PX
        near &= in_cam_m[:, 2] > 0
        focal_px = refined_focal_px(
            pixel=attempt.pixel[near],
            point_m=attempt.point_m[near],
            world_from_cam=attempt.world_from_cam,
            camera=self._pinhole,
        )
        return focal_px / float(self._focal_px[0])


class _Attempt(NamedTuple):
    """A pose, its support, and the matches (m,) it was found from."""

    world_from_cam: Array
    support: Support
    own: Rows
    pixel: Array
    point_m: Array
    inlier: NDArray[np.bool_]


def _are_apart(world_from_a: Array, world_from_b: Array) -> bool:
    """Tell whether two poses (4, 4) are of two places, not one found twice."""
    distance_m, angle_rad = pose_error(world_from_a, world_from_b)
    return bool(distance_m > APART_M or angle_rad > APART_RAD)


def _sampled(pixels: NDArray[np.uint8], looks: Array) -> NDArray[np.uint8]:
    """Average samples at (64 s, 64 s, 2) pixels to colours (64, 64, 3)."""
    fine = _looked_up(pixels, looks)
    small = cv2.resize(fine, (VIEW_PX, VIEW_PX), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)


def _looked_up(pixels: NDArray[np.uint8], looks: Array) -> NDArray[np.uint8]:
    """Look up colours or grey values at (H, W, 2) pixels; edges are continued."""
    column, row = np.moveaxis((looks - 0.5).astype(np.float32), -1, 0)
    found = cv2.remap(pixels, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found, dtype=np.uint8)


def _places(calibration: Calibration, camera: CameraConfig, columns: int, rows: int) -> Array:
    """Find the pixels (rows, columns, 2) of a photograph that show the cells of a map's view."""
    return _places_of(calibration, camera.model_dump_json(), columns, rows)


@lru_cache(16)
def _places_of(calibration: Calibration, camera_json: str, columns: int, rows: int) -> Array:
    camera = CameraConfig.model_validate_json(camera_json)
    ray = np.nan_to_num(normalised_of_pixels(camera, cell_pixels(camera, columns, rows)))
    centre = np.array([calibration.cx, calibration.cy])
    return centre + distort(ray, calibration.distortion) * [calibration.fx, calibration.fy]
