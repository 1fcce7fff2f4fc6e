"""The methods that re-estimate labels: the one list that rules, tables and figures are made from.

A method works on one batch. It says so in one of three ways:

- ``estimate``: a function ``(color_paths, depth_paths, camera, settings, seed)`` that returns a
  :class:`~baselines.labels.batches.BatchTrajectory`; the rule ``estimate`` calls it.
- ``optimiser``: what is done to the pose graph of RGB-D odometry; the rule ``posegraph`` does it.
- neither: a rule of its own, named like the method (``sfm``, which is given its scale).

Functions are named by their place, so that a table of titles loads no estimator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name

import numpy as np

from baselines.config.labels import GroundTruthConfig, PoseGraphConfig
from baselines.labels.batches import BatchTrajectory, write_trajectory
from baselines.labels.chain import TruthUsed
from baselines.labels.posegraph.graph import Edge, PoseGraph, read_g2o
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.sevenscenes import frames_between
from synfeal.records.files import write_json
from synfeal.records.timing import Facts, timed

ODOMETRY = "odometry"


@dataclass(frozen=True)
class Method:
    """A source of labels."""

    title: str  # as tables and figures call it
    estimate: str = ""  # place of its function, ``module:name``
    settings: str = ""  # key below ``groundtruth`` whose settings the function is given
    # a key of ``posegraph.optimise.OPTIMISERS``, or ``odometry``, which leaves the graph as it is
    optimiser: str = ""
    unused: tuple[str, ...] = ()  # times in the facts of its stages that it would not have spent
    published_assisted: int | None = None  # batches that section 4.1 says it needed assistance in


METHODS: dict[str, Method] = {
    "sfm": Method("SfM", published_assisted=3),
    "rgbd-toro": Method("RGB-D SLAM w/ TORO", optimiser="toro", published_assisted=6),
    "rgbd-g2o": Method("RGB-D SLAM w/ g2o", optimiser="g2o", published_assisted=4),
    "rgbd-open3d": Method("RGB-D SLAM w/ Open3D", optimiser="open3d"),
    "rgbd-odometry": Method("RGB-D odometry alone", optimiser=ODOMETRY, unused=("loops_s",)),
    "kinect-fusion": Method(
        "KinectFusion",
        estimate="baselines.labels.kinect_fusion:kinect_fusion_batch",
        settings="kinect_fusion",
    ),
}
SIMULATOR = "synfeal"
_SMALLEST = PoseGraph(np.stack([np.eye(4)] * 2), (Edge(0, 1, np.eye(4), np.eye(6)),))


def frame_methods() -> list[str]:
    """Methods that the rule ``estimate`` runs."""
    return [name for name, method in METHODS.items() if method.estimate]


def graph_methods() -> list[str]:
    """Methods that the rule ``posegraph`` runs."""
    return [name for name, method in METHODS.items() if method.optimiser]


def stages_of(name: str) -> tuple[str, ...]:
    """Folders below ``groundtruth/<scene>/<size>`` with what the method took, in its order."""
    return ("rgbd", name) if METHODS[name].optimiser else (name,)


def truth_used(groundtruth: GroundTruthConfig, name: str) -> TruthUsed:
    """Return which true poses place and scale the batches of a method."""
    if name != "sfm":
        return TruthUsed.NOTHING
    by_camera = groundtruth.sfm.gauge == "first_camera"
    return TruthUsed.CAMERA if by_camera else TruthUsed.POSES


def write_estimate(
    frame_method: str,
    sequences: Sequence[Path],
    start: int,
    stop: int,
    camera: CameraConfig,
    groundtruth: GroundTruthConfig,
    seed: int,
    out_trajectory: Path,
    out_facts: Path,
) -> None:
    """Write :func:`estimate_batch` of the frames ``start`` to ``stop`` of a split."""
    color, depth = (
        frames_between(sequences, f"{kind}.png", start, stop) for kind in ("color", "depth")
    )
    trajectory, facts = estimate_batch(frame_method, color, depth, camera, groundtruth, seed)
    write_json(out_facts, facts)
    write_trajectory(out_trajectory, trajectory)


def estimate_batch(
    name: str,  # a key of ``METHODS``
    color_paths: Sequence[FrameFile],  # colour images in order
    # 16-bit depth images in millimetres, 65535 where nothing was hit
    depth_paths: Sequence[FrameFile],
    camera: CameraConfig,  # camera of both
    groundtruth: GroundTruthConfig,  # of which the function is given what ``Method.settings`` names
    seed: int,  # of whatever is random
) -> tuple[BatchTrajectory, Facts]:
    """Trajectory of a batch by a method with a function, and what it took."""
    method = METHODS[name]
    function = resolve_name(method.estimate)
    settings = getattr(groundtruth, method.settings) if method.settings else None
    facts: Facts = {}
    with timed(facts, "estimation_s"):
        trajectory = function(color_paths, depth_paths, camera, settings, seed)
    return trajectory, facts


def write_solved(
    graph_method: str,
    graph: Path,
    posegraph: PoseGraphConfig,
    out_trajectory: Path,
    out_facts: Path,
) -> None:
    """Write :func:`solve_graph` of a ``.g2o`` file."""
    trajectory, facts = solve_graph(graph_method, read_g2o(graph), posegraph)
    write_json(out_facts, facts)
    write_trajectory(out_trajectory, trajectory)


def solve_graph(name: str, graph: PoseGraph, cfg: PoseGraphConfig) -> tuple[BatchTrajectory, Facts]:
    """Trajectory of a batch by a method with an optimiser, and what the optimiser took.

    Raises:
        ValueError: the edges do not connect all nodes.
    """
    optimiser = METHODS[name].optimiser
    facts: Facts = {}
    if optimiser == ODOMETRY:
        with timed(facts, "estimation_s"):
            registered = np.ones(len(graph.first_from_cam), dtype=bool)
        return BatchTrajectory(graph.first_from_cam, registered), facts
    from baselines.labels.posegraph.optimise import optimise  # gtsam takes a second to load

    optimise(optimiser, _SMALLEST, cfg)  # loads and compiles what it needs: not timed
    with timed(facts, "estimation_s"):
        trajectory = optimise(optimiser, graph, cfg)
    return trajectory, facts
