"""Localization of photographs in a map: retrieval, feature matching, PnP.

A photograph is reduced to the focal length of the map's frames, in pixels, so that a thing at the
same distance has the same size in both and one pixel means the same angle. Its pose is found twice:
from the frames that look most alike, then from those that were taken nearest to the first pose.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from baselines.references.arrays import most_alike
from baselines.references.confidence import (
    LEAST_CONFIDENCE,
    NO_SUPPORT,
    Support,
    patches_of,
    support_of,
)
from baselines.references.local_features import Described, LocalFeatures, Sift
from baselines.references.mapped import VIEW_PX, StructureMap
from baselines.references.pose_covariance import Spread, pose_covariance, spread_of
from baselines.references.repeats import MAX_ERROR_PX, METRES_PER_RADIAN
from baselines.references.structure import (
    missed_px,
    pinhole,
    refined_focal_px,
    refined_pose,
    supported_pose,
)
from synfeal.camera.calibration import Calibration
from synfeal.camera.distortion import distort, undistort
from synfeal.camera.projection import cell_centres_px, normalised_of_pixels
from synfeal.config.dataset import CameraConfig
from synfeal.geometry.poses import pose_error
from synfeal.geometry.rotations import quat_wxyz_from_matrix

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

RETRIEVED = 20  # frames that a photograph is matched with, once its pose is nearly known
# Those that look most alike: of a place that repeats itself, frames of each repeat must be there.
FIRST_RETRIEVED = 40
# Share of the inliers that a pose elsewhere has, from which nothing tells which of both is right:
# the right place has fewer where no frame of the map was taken like the photograph.
ALIKE = 0.7
ELSEWHERE = 0.5  # share of what a pose explains by other things, from which it is one elsewhere
MOST_PLACES = 8  # that may look like what a photograph shows
MOST_ROUNDS = 3  # of look-alikes of a pose that was itself a look-alike
APART_M, APART_RAD = 0.3, np.radians(10.0)  # between poses of different places
# Matches that miss by this many times the largest error of an inlier may miss because the focal
# length is wrong; by this many because the lens is not known.
FOCAL_ERRORS, ROUGHLY = 2.0, 5.0
SAMPLES = 4  # along each side of a pixel of what retrieval sees


class Photograph(NamedTuple):
    """Features and descriptors of a photograph, with its camera.

    Attributes:
        slope: x / z and y / z (k, 2) of the rays of its features, distortion removed.
        vector: Descriptors (k, D) as they are compared: RootSIFT (k, 128).
        view: It as the map's camera would have seen it (64, 64, 3), squeezed into a square.
        grey: Grey values (H, W) as the map's camera would have seen them; edges are continued.
        shown: Pixels (H, W) of these that the photograph shows.
    """

    slope: Array
    vector: NDArray[np.float32]
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
        spread: What its inliers say of its error, not calibrated; None where no pose was found.
    """

    world_from_cam: Array
    support: Support
    focal_ratio: float
    rival: Rival | None = None
    spread: Spread | None = None

    @property
    def is_ambiguous(self) -> bool:
        """Tell whether another place explains the photograph about as well."""
        if self.rival is None:
            return False
        return self.rival.share >= ALIKE


class Rival(NamedTuple):
    """The best pose at another place.

    Attributes:
        world_from_cam: Pose (4, 4) in the world of the map.
        inliers: Features of the photograph that it explains, most by other things than the answer.
        share: Their number over that of the answer's, both by matches with the same frames.
    """

    world_from_cam: Array
    inliers: int
    share: float


NOT_FOUND = Answer(np.full((4, 4), np.nan), NO_SUPPORT, float("nan"))


class Finder:
    """Finds photographs in a map.

    Args:
        place: The map.
        seed: Seed of RANSAC's samples.
        kind: Local features that the map holds; None for those of :func:`build_map`.
    """

    def __init__(
        self, place: StructureMap, seed: int = 0, kind: LocalFeatures | None = None
    ) -> None:
        self._place = place
        self._seed = seed
        self._kind: LocalFeatures = Sift() if kind is None else kind
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
        pixel, descriptor = self._kind.detect(grey)
        centre = np.array([calibration.cx, calibration.cy])
        slope = undistort((pixel / scale - centre) / focal_px, calibration.distortion)
        known = np.isfinite(slope).all(axis=1)
        camera = self._place.camera
        cells = _places(calibration, camera, VIEW_PX * SAMPLES, VIEW_PX * SAMPLES)
        places = _places(calibration, camera, camera.width, camera.height)
        return Photograph(
            slope=slope[known],
            vector=self._kind.vectors(descriptor[known]),
            view=_sampled(pixels, cells * scale),
            grey=_looked_up(grey, places * scale),
            shown=np.asarray(((places > 0) & (places < full)).all(axis=-1)),
        )

    def find(self, photograph: Photograph, among: Rows | None = None) -> Answer:
        """Estimate where a photograph was taken.

        Args:
            photograph: The photograph.
            among: Frames of the map to use; None for all.
        """
        if among is None:
            among = np.arange(len(self._place))
        matched = _Matched(photograph, self._place, self._focal_px, self._kind)
        candidates = self._candidates(matched, among)
        places = [self._settled(matched, attempt, among) for attempt in candidates]
        if not places:
            return NOT_FOUND
        places = self._with_look_alikes(matched, places, among)
        matches = matched.with_all()
        compared = [self._supported(matches, attempt.world_from_cam) for attempt in places]
        first = max(range(len(places)), key=lambda index: compared[index].support.inliers)
        best = places[first]
        return Answer(
            world_from_cam=best.world_from_cam,
            support=best.support,
            focal_ratio=self._focal_ratio(best),
            rival=self._rival(compared[first], compared),
            spread=self._spread(best),
        )

    def _rival(self, best: _Attempt, others: Iterable[_Attempt]) -> Rival | None:
        """Return the pose elsewhere with most support, all of them by the same matches."""
        rivals = [
            Rival(
                world_from_cam=other.world_from_cam,
                inliers=other.support.inliers,
                share=other.support.inliers / max(best.support.inliers, 1),
            )
            for other in others
            if _are_apart(other.world_from_cam, best.world_from_cam)
            and self._elsewhere(other, best) >= ELSEWHERE * other.support.inliers
        ]
        return max(rivals, key=lambda rival: rival.inliers, default=None)

    def _elsewhere(self, attempt: _Attempt, best: _Attempt) -> int:
        """Count the features that an attempt explains by something else than the best one does.

        Poses also differ because a lens bends lines or depth is wrong. Then both are based on the
        same points, or on points that the best pose misses by little.
        """
        matches, inlier = attempt.matches, attempt.inlier
        off_px = self._missed_px(matches, best.world_from_cam)[inlier]
        own, point_m = matches.own[inlier], matches.point_m[inlier]
        other = best.mean_points_m(own)
        apart_m = np.linalg.norm(point_m - other, axis=1)
        is_elsewhere = np.where(
            np.isfinite(apart_m), apart_m > APART_M, off_px > ROUGHLY * MAX_ERROR_PX
        )
        return len(np.unique(own[is_elsewhere]))

    def _candidates(self, matched: _Matched, among: Rows) -> list[_Attempt]:
        """List poses at different places, those with most support first.

        All matches together agree on one pose. Of a place that repeats itself they hold many, each
        with a small share of the matches, which RANSAC misses; the matches with one frame are of
        few repeats, mostly of one.
        """
        frames = self.alike(matched.photograph, among)
        matches = matched.with_frames(frames)
        first = self._agreed(matches)
        alone = [matched.with_frames([frame]) for frame in frames]
        by_frame = [self._agreed(own) for own in alone if not self._explained(own, first)]
        poses = [attempt.world_from_cam for attempt in by_frame if attempt is not None]
        others = [self._supported(matches, pose) for pose in poses]
        others = [other for other in others if other.support.confidence >= LEAST_CONFIDENCE]
        others.sort(key=lambda attempt: attempt.support.inliers, reverse=True)
        found = [] if first is None else [first]
        for other in others:
            if all(_are_apart(other.world_from_cam, known.world_from_cam) for known in found):
                found.append(other)
        return found[:MOST_PLACES]

    def _explained(self, matches: _Matches, first: _Attempt | None) -> bool:
        """Tell whether half of the matches agree with a pose: no other one has more of them."""
        if first is None:
            return False
        agreeing = int(self._inliers(matches, first.world_from_cam).sum())
        return 2 * agreeing >= len(matches.own)

    def _with_look_alikes(
        self, matched: _Matched, places: list[_Attempt], among: Rows
    ) -> list[_Attempt]:
        """Add the poses that the best one may be mistaken for, until none is better.

        Retrieval names frames that look most alike, which may all be of the wrong repeats.
        """
        places, asked = list(places), [attempt.world_from_cam for attempt in places]
        for _ in range(MOST_ROUNDS):
            best = max(places, key=lambda attempt: attempt.support.inliers)
            frames = self._place.world_from_cam
            new: list[Array] = []
            for pose in self._place.repeats.look_alikes(best.world_from_cam, frames):
                if all(_are_apart(pose, known) for known in asked):
                    asked.append(pose)
                    new.append(pose)
                if len(new) == MOST_PLACES:
                    break
            for pose in new:
                matches = matched.with_frames(self.nearest(pose, among))
                attempt = self._settled(matched, self._supported(matches, pose), among)
                if attempt.support.confidence >= LEAST_CONFIDENCE:
                    places.append(attempt)
            if not new or best is max(places, key=lambda attempt: attempt.support.inliers):
                break
        return places

    def _settled(self, matched: _Matched, attempt: _Attempt, among: Rows) -> _Attempt:
        """Match the frames that were taken nearest to a pose too, and keep the better one."""
        matches = matched.with_frames(self.nearest(attempt.world_from_cam, among))
        second = self._agreed(matches)
        if second is None or _are_apart(second.world_from_cam, attempt.world_from_cam):
            second = self._refined(matches, attempt.world_from_cam)
        better = second.support.log10_nfa < attempt.support.log10_nfa
        return second if better else attempt

    def alike(self, photograph: Photograph, among: Rows) -> Rows:
        """List the frames, of some of the map, that look most alike, best first."""
        vector = self._place.vlad.describe(photograph.view[None])
        vectors = self._place.vectors
        if len(among) < len(vectors):
            vectors = vectors[among]
        return among[most_alike(vectors, vector, FIRST_RETRIEVED).ravel()]

    def nearest(self, world_from_cam: Array, among: Rows) -> Rows:
        """List the frames, of some of the map, that were taken nearest to a pose (4, 4)."""
        place_m = self._place.world_from_cam[among, :3, 3]
        quat_wxyz = self._place.quat_wxyz[among]
        distance_m = np.linalg.norm(place_m - world_from_cam[:3, 3], axis=1)
        cosine = np.abs(quat_wxyz @ quat_wxyz_from_matrix(world_from_cam[:3, :3]))
        angle_rad = 2 * np.arccos(np.minimum(cosine, 1))
        far = distance_m + METRES_PER_RADIAN * angle_rad
        order: Rows = np.argsort(far, kind="stable")
        return among[order[:RETRIEVED]]

    def _agreed(self, matches: _Matches) -> _Attempt | None:
        """Estimate the pose that most matches agree with."""
        found = supported_pose(
            pixel=matches.pixel,
            point_m=matches.point_m,
            camera=self._pinhole,
            seed=self._seed,
            max_error_px=MAX_ERROR_PX,
        )
        if found is None:
            return None
        return self._attempt(matches, found.world_from_cam, found.inlier)

    def _refined(self, matches: _Matches, world_from_cam: Array) -> _Attempt:
        """Refine a pose (4, 4) on the matches that agree with it."""
        inlier = self._inliers(matches, world_from_cam)
        refined = refined_pose(
            pixel=matches.pixel,
            point_m=matches.point_m,
            world_from_cam=world_from_cam,
            inlier=inlier,
            camera=self._pinhole,
        )
        return self._supported(matches, refined)

    def _supported(self, matches: _Matches, world_from_cam: Array) -> _Attempt:
        """Count the matches that agree with a pose (4, 4)."""
        return self._attempt(matches, world_from_cam, self._inliers(matches, world_from_cam))

    def _inliers(self, matches: _Matches, world_from_cam: Array) -> NDArray[np.bool_]:
        """Mark the matches (m,) that agree with a pose (4, 4)."""
        return self._missed_px(matches, world_from_cam) < MAX_ERROR_PX

    def _attempt(
        self, matches: _Matches, world_from_cam: Array, inlier: NDArray[np.bool_]
    ) -> _Attempt:
        camera = self._place.camera
        support = support_of(
            pixel=matches.pixel,
            own=matches.own,
            inlier=inlier,
            size=(camera.width, camera.height),
            max_error_px=MAX_ERROR_PX,
        )
        return _Attempt(world_from_cam, support, matches, inlier)

    def _missed_px(self, matches: _Matches, world_from_cam: Array) -> Array:
        """Compute by how much a pose (4, 4) misses matches (m,); infinity behind the camera."""
        return missed_px(matches.pixel, matches.point_m, world_from_cam, self._focal_px)

    def _spread(self, attempt: _Attempt) -> Spread:
        """Say how exact a pose is by the matches that agree with it."""
        camera, (_, pixel, point_m), good = self._place.camera, attempt.matches, attempt.inlier
        return spread_of(
            pose_covariance(
                pixel=pixel[good],
                point_m=point_m[good],
                world_from_cam=attempt.world_from_cam,
                focal_px=self._focal_px,
                cluster=patches_of(pixel[good], (camera.width, camera.height)),
            )
        )

    def _focal_ratio(self, attempt: _Attempt) -> float:
        """Estimate the best focal length over the given one, from matches that nearly agree.

        NaN where it is not found.
        """
        matches = attempt.matches
        near = self._missed_px(matches, attempt.world_from_cam) < FOCAL_ERRORS * MAX_ERROR_PX
        focal_px = refined_focal_px(
            pixel=matches.pixel[near],
            point_m=matches.point_m[near],
            world_from_cam=attempt.world_from_cam,
            camera=self._pinhole,
        )
        return focal_px / float(self._focal_px[0])


class _Matches(NamedTuple):
    """Matches of a photograph with features of the map.

    Attributes:
        own: Feature of the photograph (m,) of each.
        pixel: Its position (m, 2) from the principal point.
        point_m: Where it was matched to (m, 3), in the world of the map.
    """

    own: Rows
    pixel: Array
    point_m: Array


class _Attempt(NamedTuple):
    """A pose, its support, the matches (m,) it was found from, and which of them agree with it."""

    world_from_cam: Array
    support: Support
    matches: _Matches
    inlier: NDArray[np.bool_]

    def mean_points_m(self, own: Rows) -> Array:
        """Average the points that agree with the pose, by feature of the photograph.

        Args:
            own: Features (k,).

        Returns:
            Points (k, 3) in the world; NaN where no match of the feature agrees.
        """
        known, point_m = self.matches.own[self.inlier], self.matches.point_m[self.inlier]
        count = int(max(own.max(initial=-1), known.max(initial=-1))) + 1
        sums = np.stack([np.bincount(known, axis, count) for axis in point_m.T], axis=1)
        with np.errstate(invalid="ignore"):
            return np.asarray((sums / np.bincount(known, minlength=count)[:, None])[own])


class _Matched:
    """Matches of one photograph with frames of a map, each frame matched once.

    Args:
        photograph: The photograph.
        place: The map.
        focal_px: Focal lengths (2,) of the map's frames.
        kind: Local features of both.
    """

    def __init__(
        self, photograph: Photograph, place: StructureMap, focal_px: Array, kind: LocalFeatures
    ) -> None:
        self.photograph = photograph
        self._place = place
        self._kind = kind
        self._focal_px = focal_px
        self._pixel = photograph.slope * focal_px
        self._by_frame: dict[int, tuple[Rows, Rows]] = {}

    def with_all(self) -> _Matches:
        """List the matches with all frames that were matched so far."""
        return self.with_frames(sorted(self._by_frame))

    def with_frames(self, frames: Iterable[int]) -> _Matches:
        """List the matches with some frames of the map."""
        pairs = [self._with_frame(int(frame)) for frame in frames]
        own, feature = (np.concatenate(part) for part in zip(*pairs, strict=True))
        return _Matches(own, self._pixel[own], self._place.point_m[feature])

    def _with_frame(self, frame: int) -> tuple[Rows, Rows]:
        """Match features of the photograph (m,) with features of the map (m,)."""
        if frame not in self._by_frame:
            features = self._place.features
            rows = features.of(frame)
            own, other = self._kind.match(
                Described(self._pixel, self.photograph.vector),
                Described(
                    pixel=features.slope[rows] * self._focal_px,
                    vector=self._kind.vectors(features.descriptor[rows]),
                ),
            )
            self._by_frame[frame] = own, features.start[frame] + other
        return self._by_frame[frame]


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
    ray = np.nan_to_num(normalised_of_pixels(camera, cell_centres_px(camera, columns, rows)))
    centre = np.array([calibration.cx, calibration.cy])
    return centre + distort(ray, calibration.distortion) * [calibration.fx, calibration.fy]
