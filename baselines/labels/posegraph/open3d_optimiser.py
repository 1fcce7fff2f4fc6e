"""Open3D's optimiser of pose graphs: no row of Table 2, but compared with those that are."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from baselines.config.labels import PoseGraphConfig
from baselines.labels.posegraph.graph import PoseGraph, swapped_blocks
from baselines.registry.kinds import LabelMethod
from synfeal.geometry.poses import relative


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
