"""The pose graph of a batch, and a record of how it was made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from baselines.config.labels import RgbdConfig
from baselines.labels.posegraph.graph import Edge, PoseGraph, write_g2o
from baselines.labels.rgbd.dense import DenseOdometry
from baselines.labels.rgbd.frames import read_frame
from baselines.labels.rgbd.tracks import (
    FeatureOdometry,
    TrackedFrame,
    closure,
    loop_candidates,
    most_telling,
    neighbour,
)
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.sevenscenes import frames_between
from synfeal.geometry.poses import relative
from synfeal.records.files import write_json
from synfeal.records.timing import Facts, timed

Array = NDArray[np.float64]

# Standard deviations of edges (metres, degrees), of the size measured on rendered rooms: of
# neighbours, whose errors add up, of loop closures, and of guesses, as large as the motion itself.
_NEIGHBOUR, _LOOP, _GUESS = (0.001, 0.03), (0.001, 0.02), (0.1, 5.0)
# Share of a keyframe that an earlier one has to show where odometry says how they lie.
_LOOP_OVERLAP = 0.5


@dataclass(frozen=True)
class _Track:
    """Chained odometry: poses (n, 4, 4), edges, guesses up to each frame, and the keyframes."""

    first_from_cam: Array
    edges: list[Edge]
    guesses: NDArray[np.int64]
    keyframes: dict[int, TrackedFrame]


def write_rgbd(
    sequences: Sequence[Path],
    start: int,
    stop: int,
    camera: CameraConfig,
    rgbd: RgbdConfig,
    seed: int,
    out_graph: Path,
    out_facts: Path,
) -> None:
    """Build the pose graph of one batch by RGB-D odometry, and write it.

    Args:
        sequences: Sequences of the split with colour and depth, from its first one.
        start: First frame of the batch, counted from 0 in the split.
        stop: One past its last frame.
        camera: Camera of colour and depth.
        rgbd: Sensor, odometry, keyframes, and the gates of accepted motions.
        seed: Seed of the sensor's noise; unused by the ideal one.
        out_graph: ``.g2o`` file to write.
        out_facts: JSON to write: what making the graph took.

    Raises:
        InputError: an image is missing, cannot be read, or has another size than the camera.
    """
    color, depth = (
        frames_between(sequences, f"{kind}.png", start, stop) for kind in ("color", "depth")
    )
    graph, facts = rgbd_graph(color, depth, camera, rgbd, seed)
    write_g2o(out_graph, graph)
    write_json(out_facts, facts)


def rgbd_graph(
    color_paths: Sequence[FrameFile],
    depth_paths: Sequence[FrameFile],
    camera: CameraConfig,
    cfg: RgbdConfig,
    seed: int = 0,
) -> tuple[PoseGraph, Facts]:
    """Build the pose graph of one batch: an edge per neighbouring pair, accepted loop closures.

    Args:
        color_paths: Colour images in order.
        depth_paths: 16-bit depth images in millimetres, 65535 where nothing was hit.
        camera: Camera of colour and depth.
        cfg: Sensor, odometry, keyframes, and the gates of accepted motions.
        seed: Seed of the sensor's noise; unused by the ideal one.

    Returns:
        The graph with the chained odometry as initial poses, and what making it took.

    Raises:
        InputError: an image is missing or has another size than the camera.
        ValueError: colour and depth images differ in number.
    """
    o3d.utility.set_max_threads(1)
    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    facts: Facts = {}
    with timed(facts, "odometry_s"):
        track = _odometry(color_paths, depth_paths, camera, cfg, seed)
    with timed(facts, "loops_s"):
        tried, loops = _loops(track, cfg)
    facts |= {
        "pairs": len(track.edges),
        "pairs_accepted": len(track.edges) - int(track.guesses[-1]),
        "loops_tried": tried,
        "loops": len(loops),
    }
    return PoseGraph(track.first_from_cam, tuple(track.edges + loops)), facts


def _odometry(
    color_paths: Sequence[FrameFile],
    depth_paths: Sequence[FrameFile],
    camera: CameraConfig,
    cfg: RgbdConfig,
    seed: int,
) -> _Track:
    """Chain the motions of neighbours; only keyframes stay in memory."""
    dense, by_features = DenseOdometry(camera, cfg), FeatureOdometry(camera)
    poses, edges, guesses, motion = [np.eye(4)], [], [0], np.eye(4)
    keyframes: dict[int, TrackedFrame] = {}
    before: TrackedFrame | None = None
    for j, (color, depth) in enumerate(zip(color_paths, depth_paths, strict=True)):
        view = TrackedFrame(read_frame(color, depth, camera, cfg, seed), dense, by_features)
        if before is not None:
            motion, accepted = neighbour(before, view, motion)
            poses.append(poses[-1] @ motion)
            edges.append(Edge(j - 1, j, motion, _information(_NEIGHBOUR if accepted else _GUESS)))
            guesses.append(guesses[-1] + (not accepted))
        if j % cfg.keyframe_every == 0:
            keyframes[j] = view
        before = view
    return _Track(np.array(poses), edges, np.array(guesses), keyframes)


def _loops(track: _Track, cfg: RgbdConfig) -> tuple[int, list[Edge]]:
    """Close loops; return how many were tried, and those accepted."""

    def predicted(i: int, j: int) -> Array | None:
        if track.guesses[i] != track.guesses[j]:
            return None
        return relative(track.first_from_cam[i], track.first_from_cam[j])

    def overlap(i: int, j: int) -> float:
        i_from_j = predicted(i, j)
        if i_from_j is None:  # nothing is known of where they are: features will tell
            return 1.0
        view = track.keyframes[i]
        share = view.dense.overlap(view.frame, track.keyframes[j].frame, i_from_j)
        return share if share >= _LOOP_OVERLAP else 0.0

    candidates = loop_candidates(track.first_from_cam, cfg.keyframe_every)
    pairs = most_telling(candidates, overlap, cfg.loops_per_keyframe)
    edges = []
    for i, j in pairs:
        i_from_j = closure(track.keyframes[i], track.keyframes[j], predicted(i, j))
        if i_from_j is not None:
            edges.append(Edge(i, j, i_from_j, _information(_LOOP)))
    return len(pairs), edges


def _information(sigma: tuple[float, float]) -> Array:
    """Compute information (6, 6), translation first, from deviations in metres and degrees."""
    sigma_m, sigma_deg = sigma
    return np.diag([sigma_m**-2.0] * 3 + [np.radians(sigma_deg) ** -2.0] * 3)
