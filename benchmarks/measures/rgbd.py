"""RGB-D odometry and loop closures on one batch: errors before and after, and what they took."""

from __future__ import annotations

import time

from baselines.groundtruth.posegraph.optimise import optimise
from baselines.groundtruth.rgbd import rgbd_graph
from benchmarks.measures.batches import BatchCase, errors, open_batch
from synfeal.seeds import seed_of

Case = BatchCase


def run(case: BatchCase, seed: int) -> dict[str, float]:
    """Errors of the odometry, and of the graph as Levenberg-Marquardt leaves it.

    Raises:
        InputError: the frames cannot be used.
    """
    batch, cfg = open_batch(case), case.groundtruth
    graph, facts = rgbd_graph(
        batch.color, batch.depth, case.groundtruth_camera, cfg.rgbd, seed_of(seed, "rgbd")
    )
    begin_s = time.process_time()
    optimised = optimise("g2o", graph, cfg.posegraph).first_from_cam
    optimise_s = time.process_time() - begin_s
    return {
        "pairs_accepted": facts["pairs_accepted"],
        "loops": facts["loops"],
        **errors("odometry", graph.first_from_cam, batch.world_from_cam),
        **errors("g2o", optimised, batch.world_from_cam),
        "cpu_s": facts["odometry_s"] + facts["loops_s"] + optimise_s,
    }
