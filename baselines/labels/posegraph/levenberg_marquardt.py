"""Levenberg-Marquardt on pose graphs, the label method of the g2o row.

The row is solved by gtsam, the maintained library with Python wheels: it and g2o solve the same
non-linear least squares problem, the sum over the edges of the squared Mahalanobis norm of
``Log(measured^-1 predicted)``.
"""

from __future__ import annotations

import gtsam
import numpy as np
from numpy.typing import NDArray

from baselines.config.labels import PoseGraphConfig
from baselines.labels.posegraph.graph import PoseGraph, swapped_blocks
from baselines.registry.kinds import LabelMethod

# Fixes the first pose, which the edges leave free, to a nanometre.
_ANCHOR_SIGMA = 1e-9
# At gtsam's 1e-5 nodes that hang on weak edges are still on their way.
_RELATIVE_CHANGE = 1e-9


def factors_of(graph: PoseGraph) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
    """Return the graph as gtsam's factors, the first pose fixed, and its initial values."""
    factors, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for node, pose in enumerate(graph.first_from_cam):
        values.insert(node, gtsam.Pose3(pose))
    anchor = gtsam.noiseModel.Isotropic.Sigma(6, _ANCHOR_SIGMA)
    factors.add(gtsam.PriorFactorPose3(0, gtsam.Pose3(), anchor))
    for edge in graph.edges:
        noise = gtsam.noiseModel.Gaussian.Information(swapped_blocks(edge.information))
        factors.add(gtsam.BetweenFactorPose3(edge.i, edge.j, gtsam.Pose3(edge.i_from_j), noise))
    return factors, values


def optimise_lm(graph: PoseGraph, iterations: int) -> NDArray[np.float64]:
    """Optimise poses (n, 4, 4) relative to the first, in at most ``iterations`` steps."""
    params = gtsam.LevenbergMarquardtParams()
    params.setMaxIterations(iterations)
    params.setRelativeErrorTol(_RELATIVE_CHANGE)
    params.setAbsoluteErrorTol(0.0)
    # Cholesky squares the range of the information; beyond 1e12 nothing of weak edges is left.
    params.setLinearSolverType("MULTIFRONTAL_QR")
    result = gtsam.LevenbergMarquardtOptimizer(*factors_of(graph), params).optimize()
    return np.array([result.atPose3(node).matrix() for node in range(len(graph))])


@LabelMethod(
    name="rgbd-g2o",
    title="RGB-D SLAM w/ g2o",
    rank=3,
    works_on="graph",
    published_assisted=4,
)
def by_g2o(graph: PoseGraph, cfg: PoseGraphConfig) -> NDArray[np.float64]:
    """Optimise a pose graph by Levenberg-Marquardt; see :func:`optimise_lm`."""
    return optimise_lm(graph, cfg.lm_iterations)
