"""The frames of straight paths, section 3.3 of the paper, and the stream their targets come from.

Candidates are independent of the path they are drawn for. So they are drawn and their free views
tested a block at a time, and paths are served in turn from one stream: a path tests several of the
next rounds at once and takes the first with an admissible candidate; the next path goes on with the
round after it. The numbers drawn, their order and what they are used for are those of drawing and
testing one round at a time; the sizes of blocks and windows change the speed alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from synfeal.config.collection import CollectionConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import interpolate, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.planning.space import (
    PoseSpace,
    PoseVectors,
    connected_space,
    drawn_until,
    farthest_admissible,
)

Array = NDArray[np.float64]


def n_frames_of(start: Array, target: Array, frame_spacing_m: float) -> int:
    """Count frames between two pose vectors (6,): distance over spacing, rounded, at least 1."""
    distance = float(np.linalg.norm(target[:3] - start[:3]))
    return max(1, round(distance / frame_spacing_m))


def step_of(start: Array, target: Array, n_frames: int) -> Array:
    """Return the change of every element (6,) per frame; each angle turns the short way round."""
    change = target - start
    change[3:] = (change[3:] + np.pi) % (2.0 * np.pi) - np.pi
    return change / n_frames


def path_vectors(start: Array, target: Array, n_frames: int) -> PoseVectors:
    """Return the pose vectors of frames 1 to n: ``v_j = v_i + j * step``.

    Erratum: the paper prints ``v_j = v_(j-1) + j * step``, which grows quadratically and overshoots
    the target; the movement it describes is this linear one.

    Args:
        start: Pose vector (6,) of the path's start, which is no frame of it.
        target: Pose vector (6,) of frame n, its angles up to whole turns.
        n_frames: Number n of frames.

    Returns:
        Pose vectors (n, 6).
    """
    frame = np.arange(1, n_frames + 1)[:, None]
    return start + frame * step_of(start, target, n_frames)


def path_poses(
    start: Array, target: Array, frame_spacing_m: float, interpolation: Literal["rpy", "slerp"]
) -> Array:
    """Interpolate the frames of a straight path.

    Args:
        start: Pose vector (6,) of the path's start, which is no frame of it.
        target: Pose vector (6,) of its last frame.
        frame_spacing_m: Distance between neighbouring frames, metres.
        interpolation: ``rpy`` moves roll, pitch and yaw as the paper does; ``slerp`` turns about
            one axis at constant speed.

    Returns:
        Poses ``world_from_cam`` (n, 4, 4).
    """
    n_frames = n_frames_of(start, target, frame_spacing_m)
    if interpolation == "rpy":
        return poses_of(path_vectors(start, target, n_frames))
    ends = poses_of(np.stack([start, target]))
    return interpolate(ends[0], ends[1], np.arange(1, n_frames + 1) / n_frames)


def poses_of(vectors: PoseVectors) -> Array:
    """Return ``world_from_cam`` (N, 4, 4) of pose vectors (N, 6)."""
    return pose_matrix(rotation_from_rpy(vectors[:, 3:]), vectors[:, :3])


BLOCK = 4096  # candidates drawn at once; more gain nothing
FIRST_WINDOW = 8  # candidates tested at once for a path; doubled while none is admissible


class CandidateStream:
    """Rounds of candidates in the order they are drawn."""

    def __init__(self, space: PoseSpace, candidates: int, frame_spacing_m: float = np.inf) -> None:
        """Draw rounds of ``candidates`` poses; frames of paths stand ``frame_spacing_m`` apart."""
        self._space, self._candidates = space, candidates
        self._frame_spacing_m = frame_spacing_m
        self._poses = np.empty((0, candidates, 6))
        self._has_view = np.empty((0, candidates), np.bool_)
        self._at = 0

    def next_target(
        self, start: NDArray[np.float64], min_path_m: float, max_rounds: int
    ) -> NDArray[np.float64] | None:
        """Draw the target of a path: the farthest candidate of the first round that has one.

        Args:
            start: Pose vector (6,) that the path starts from.
            min_path_m: Least length of the path, metres.
            max_rounds: Rounds to try.

        Returns:
            The pose vector (6,); None if none of the rounds has an admissible candidate that far
            away.
        """
        tried, window = 0, max(1, FIRST_WINDOW // self._candidates)
        while tried < max_rounds:
            if self._at == len(self._poses):
                self._draw()
            ahead = slice(self._at, self._at + min(window, max_rounds - tried))
            poses, has_view = self._poses[ahead], self._has_view[ahead]
            found = farthest_admissible(
                self._space.caster, start, poses, has_view, min_path_m, self._clear_way(start)
            )
            if found is not None:
                self._at += found[0] + 1
                target: NDArray[np.float64] = poses[found]
                return target
            self._at += len(poses)
            tried += len(poses)
            window *= 2
        return None

    def _clear_way(self, start: Array) -> Callable[[Array], bool] | None:
        """Return whether all frames from ``start`` (6,) to a target (6,) keep the clearance."""
        clearance = self._space.clearance
        if clearance is None:
            return None

        def is_clear(target: Array) -> bool:
            n_frames = n_frames_of(start, target, self._frame_spacing_m)
            return bool(clearance.keeps(path_vectors(start, target, n_frames)[:, :3]).all())

        return is_clear

    def _draw(self) -> None:
        """Replace the block, which is used up, by the next."""
        rounds = max(1, BLOCK // self._candidates)
        poses = self._space.sample(rounds * self._candidates)
        has_view = self._space.has_free_view(poses)
        self._poses = poses.reshape(rounds, self._candidates, 6)
        self._has_view = has_view.reshape(rounds, self._candidates)
        self._at = 0


def independent_poses(space: PoseSpace, collection: CollectionConfig, n_frames: int) -> PoseVectors:
    """Draw poses uniformly from those with a free view in the connected space.

    Every admissible candidate is kept, so a round of candidates gives as many frames as it has
    admissible ones, and ``candidates`` does not change what is drawn. A shorter plan is a prefix
    of a longer one.

    Args:
        space: Where poses are sampled.
        collection: ``max_tries`` and ``candidates``, which say when to give up.
        n_frames: Number of poses.

    Returns:
        Pose vectors (n_frames, 6).

    Raises:
        InputError: ``max_tries`` rounds of ``candidates`` in a row had no admissible pose.
    """
    tries = collection.max_tries
    connected = connected_space(space, tries)
    most_empty = -(-tries * collection.candidates // BLOCK)

    def draw() -> PoseVectors:
        poses = space.sample(BLOCK)
        poses = poses[space.has_free_view(poses)]
        return poses[connected.contains(poses[:, :3])]

    def refusal(n_empty: int) -> InputError:
        return InputError(
            "plan",
            f"no admissible pose among {n_empty * BLOCK} candidates that looks farther than"
            f" min_view_distance_m ({space.min_view_distance_m} m){space.also_asked}",
            "lower it, or widen the box",
        )

    return drawn_until(n_frames, draw, most_empty, refusal)
