"""The optimisers by the names they have in label sources: ``rgbd-toro``, ``rgbd-g2o``, ...

``open3d`` is no row of table 2; it is compared with the two that are.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from baselines.groundtruth.posegraph.graph import PoseGraph, check_connected
from baselines.groundtruth.posegraph.lm import optimise_lm
from baselines.groundtruth.posegraph.toro import optimise_toro
from baselines.groundtruth.trajectory import BatchTrajectory
from synfeal.config.models import PoseGraphConfig

Optimiser = Callable[[PoseGraph, PoseGraphConfig], np.ndarray]


def _open3d(graph: PoseGraph, cfg: PoseGraphConfig) -> np.ndarray:
    from baselines.groundtruth.posegraph.open3d_lm import optimise_open3d  # takes a second to load

    return optimise_open3d(graph, cfg.lm_iterations)


OPTIMISERS: dict[str, Optimiser] = {
    "toro": lambda graph, cfg: optimise_toro(graph, cfg.toro_iterations, cfg.toro_epsilon),
    "g2o": lambda graph, cfg: optimise_lm(graph, cfg.lm_iterations),
    "open3d": _open3d,
}


def optimise(name: str, graph: PoseGraph, cfg: PoseGraphConfig) -> BatchTrajectory:
    """Trajectory of a batch by one of ``OPTIMISERS``; odometry gives every frame a pose.

    Raises:
        ValueError: the edges do not connect all nodes.
    """
    check_connected(graph)
    poses = OPTIMISERS[name](graph, cfg)
    return BatchTrajectory(poses, np.ones(len(poses), dtype=bool))
