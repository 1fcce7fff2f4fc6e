"""Optimisers of pose graphs, each a label method.

The g2o row is Levenberg-Marquardt by gtsam, the maintained library with Python wheels: both solve
the same non-linear least squares problem, the sum over the edges of the squared Mahalanobis norm of
``Log(measured^-1 predicted)``. ``open3d`` is no row of table 2; it is compared with the two that
are.
"""

from __future__ import annotations

import gtsam
import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from baselines.config.labels import PoseGraphConfig
from baselines.labels.posegraph.graph import PoseGraph, swapped_blocks
from baselines.labels.posegraph.toro import optimise_toro
from baselines.registry.kinds import LabelMethod
from synfeal.geometry.poses import relative

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
    name="rgbd-toro",
    title="RGB-D SLAM w/ TORO",
    rank=2,
    works_on="graph",
    published_assisted=6,
)
def by_toro(graph: PoseGraph, cfg: PoseGraphConfig) -> NDArray[np.float64]:
    """Optimise a pose graph by TORO; see :func:`~baselines.labels.posegraph.toro.optimise_toro`."""
    return optimise_toro(graph, cfg.toro_iterations, cfg.toro_epsilon)


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


@LabelMethod(name="rgbd-open3d", title="RGB-D SLAM w/ Open3D", rank=4, works_on="graph")
def by_open3d(graph: PoseGraph, cfg: PoseGraphConfig) -> NDArray[np.float64]:
    """Optimise a pose graph by Open3D; see :func:`optimise_open3d`."""
    return optimise_open3d(graph, cfg.lm_iterations)


def optimise_open3d(graph: PoseGraph, iterations: int) -> NDArray[np.float64]:
    """Optimise poses (n, 4, 4) relative to the first, in at most ``iterations`` steps.

    Its line process, which switches off edges that disagree, is left out: all edges count, as in
    the other optimisers.
    """
    registration = o3d.pipelines.registration
    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    edges = [
        registration.PoseGraphEdge(
            edge.j, edge.i, edge.i_from_j, swapped_blocks(edge.information), uncertain=False
        )
        for edge in graph.edges
    ]
    nodes = [registration.PoseGraphNode(pose) for pose in graph.first_from_cam]
    poses = registration.PoseGraph()
    poses.nodes = registration.PoseGraphNodeVector(nodes)
    poses.edges = registration.PoseGraphEdgeVector(edges)
    criteria = registration.GlobalOptimizationConvergenceCriteria()
    criteria.max_iteration = iterations
    criteria.min_relative_increment = criteria.min_relative_residual_increment = 1e-12
    criteria.min_residual = criteria.min_right_term = 0.0
    registration.global_optimization(
        poses,
        registration.GlobalOptimizationLevenbergMarquardt(),
        criteria,
        registration.GlobalOptimizationOption(reference_node=0),
    )
    found = np.array([node.pose for node in poses.nodes])
    return relative(found[0], found)
