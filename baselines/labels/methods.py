"""The methods that re-estimate labels, and how the rules run them.

A method is a function that works on one batch, declared by
:class:`~baselines.registry.kinds.LabelMethod`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from pkgutil import resolve_name

import numpy as np

from baselines.config.labels import EstimationConfig, PoseGraphConfig
from baselines.labels.batches import BatchTrajectory, write_trajectory
from baselines.labels.chain import TruthUsed
from baselines.labels.posegraph.graph import Edge, PoseGraph, check_connected, read_g2o
from baselines.registry.declarations import declared
from baselines.registry.kinds import LabelMethod
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.sevenscenes import frames_between
from synfeal.records.files import write_json
from synfeal.records.timing import Facts, timed

METHODS = declared(LabelMethod)
SIMULATOR = "synfeal"
_SMALLEST = PoseGraph(np.stack([np.eye(4)] * 2), (Edge(0, 1, np.eye(4), np.eye(6)),))


def frame_methods() -> list[str]:
    """List the methods that the rule ``estimate`` runs."""
    return [name for name, method in METHODS.items() if method.works_on == "frames"]


def graph_methods() -> list[str]:
    """List the methods that the rule ``posegraph`` runs."""
    return [name for name, method in METHODS.items() if method.works_on == "graph"]


def stages_of(name: str) -> tuple[str, ...]:
    """List the folders below ``estimates/<scene>/<size>`` of the stages of a method."""
    return ("rgbd", name) if METHODS[name].works_on == "graph" else (name,)


def truth_used(estimation: EstimationConfig, name: str) -> TruthUsed:
    """Return which true poses place and scale the batches of a method."""
    if name != "sfm":
        return TruthUsed.NOTHING
    by_camera = estimation.sfm.gauge == "first_camera"
    return TruthUsed.CAMERA if by_camera else TruthUsed.POSES


def write_estimate(
    frame_method: str,
    sequences: Sequence[Path],
    start: int,
    stop: int,
    camera: CameraConfig,
    estimation: EstimationConfig,
    seed: int,
    out_trajectory: Path,
    out_facts: Path,
) -> None:
    """Estimate one batch by a method that works on frames, and write its trajectory.

    Args:
        frame_method: Key of ``METHODS``.
        sequences: Sequences of the split with colour and depth, from its first one.
        start: First frame of the batch, counted from 0 in the split.
        stop: One past its last frame.
        camera: Camera of colour and depth.
        estimation: Settings of all methods.
        seed: Seed of whatever is random.
        out_trajectory: CSV to write.
        out_facts: JSON to write: what the estimation took.

    Raises:
        InputError: an image is missing, cannot be read, or has another size than the camera.
    """
    color, depth = (
        frames_between(sequences, f"{kind}.png", start, stop) for kind in ("color", "depth")
    )
    trajectory, facts = estimate_batch(frame_method, color, depth, camera, estimation, seed)
    write_json(out_facts, facts)
    write_trajectory(out_trajectory, trajectory)


def estimate_batch(
    name: str,
    color_paths: Sequence[FrameFile],
    depth_paths: Sequence[FrameFile],
    camera: CameraConfig,
    estimation: EstimationConfig,
    seed: int,
) -> tuple[BatchTrajectory, Facts]:
    """Estimate one batch by a method that works on frames.

    Args:
        name: Key of ``METHODS``.
        color_paths: Colour images in order.
        depth_paths: 16-bit depth images in millimetres, 65535 where nothing was hit.
        camera: Camera of colour and depth.
        estimation: Settings of all methods; the function is given those that
            ``LabelMethod.settings`` names.
        seed: Seed of whatever is random.

    Returns:
        The trajectory, and what estimating it took.
    """
    method = METHODS[name]
    function = resolve_name(method.place)
    settings = getattr(estimation, method.settings) if method.settings else None
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
    """Optimise the pose graph of one batch, and write the resulting trajectory.

    Args:
        graph_method: Key of ``METHODS``; a method that works on a graph.
        graph: ``.g2o`` file of the batch.
        posegraph: Settings of the optimiser.
        out_trajectory: CSV to write.
        out_facts: JSON to write: what the optimisation took.

    Raises:
        InputError: the graph cannot be read.
        ValueError: its edges do not connect all nodes.
    """
    trajectory, facts = solve_graph(graph_method, read_g2o(graph), posegraph)
    write_json(out_facts, facts)
    write_trajectory(out_trajectory, trajectory)


def solve_graph(name: str, graph: PoseGraph, cfg: PoseGraphConfig) -> tuple[BatchTrajectory, Facts]:
    """Optimise the pose graph of one batch.

    The optimiser is first run on a graph of two nodes, so that loading and compiling are not timed.

    Args:
        name: Key of ``METHODS``; a method that works on a graph.
        graph: Initial poses and edges.
        cfg: Settings of the optimiser.

    Returns:
        The trajectory, with every frame registered, and what the optimisation took.

    Raises:
        ValueError: the edges do not connect all nodes.
    """
    solve = resolve_name(METHODS[name].place)
    facts: Facts = {}
    solve(_SMALLEST, cfg)  # loads and compiles what it needs: not timed
    check_connected(graph)
    with timed(facts, "estimation_s"):
        first_from_cam = solve(graph, cfg)
    return BatchTrajectory(first_from_cam, np.ones(len(first_from_cam), dtype=bool)), facts
