"""RGB-D odometry without optimisation, as a label method."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from baselines.config.labels import PoseGraphConfig
from baselines.labels.posegraph.graph import PoseGraph
from baselines.registry.kinds import LabelMethod


@LabelMethod(
    name="rgbd-odometry",
    title="RGB-D odometry alone",
    rank=5,
    works_on="graph",
    unused=("loops_s",),
)
def odometry_alone(graph: PoseGraph, cfg: PoseGraphConfig) -> NDArray[np.float64]:
    """Return the poses that a graph starts from: chained odometry, no loop closure.

    Args:
        graph: Pose graph of a batch.
        cfg: Settings of the optimisers; unused.

    Returns:
        Poses ``first_from_cam`` (n, 4, 4).
    """
    return graph.first_from_cam
