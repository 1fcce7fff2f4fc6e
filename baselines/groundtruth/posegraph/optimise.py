"""The optimisers by the names they have in label sources: ``rgbd-toro`` and ``rgbd-g2o``."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from baselines.groundtruth.posegraph.graph import PoseGraph
from baselines.groundtruth.posegraph.lm import optimise_lm
from baselines.groundtruth.posegraph.toro import optimise_toro
from baselines.groundtruth.trajectory import BatchTrajectory
from synfeal.config.models import PoseGraphConfig

Optimiser = Callable[[PoseGraph, PoseGraphConfig], np.ndarray]

OPTIMISERS: dict[str, Optimiser] = {
    "toro": lambda graph, cfg: optimise_toro(graph, cfg.toro_iterations, cfg.toro_epsilon),
    "g2o": lambda graph, cfg: optimise_lm(graph, cfg.lm_iterations),
}


def optimise(name: str, graph: PoseGraph, cfg: PoseGraphConfig) -> BatchTrajectory:
    """Trajectory of a batch by one of ``OPTIMISERS``; odometry gives every frame a pose."""
    poses = OPTIMISERS[name](graph, cfg)
    return BatchTrajectory(poses, np.ones(len(poses), dtype=bool))
