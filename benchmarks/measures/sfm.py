"""Structure from motion on one batch: errors of its poses, and what it took."""

from __future__ import annotations

from baselines.groundtruth.chain import fill_gaps
from baselines.groundtruth.sfm.batch import sfm_batch
from benchmarks.measures.batches import BatchCase, errors, open_batch
from synfeal.seeds import seed_of

Case = BatchCase


def run(case: BatchCase, seed: int) -> dict[str, float]:
    """Errors of all frames when the batch starts at its true first pose, gaps filled.

    Raises:
        InputError: the frames cannot be used.
    """
    batch = open_batch(case)
    files = batch.color, case.groundtruth_camera, batch.world_from_cam
    trajectory, facts = sfm_batch(*files, case.groundtruth.sfm, seed_of(seed, "sfm"))
    return {
        **facts,
        **errors("sfm", fill_gaps(trajectory), batch.world_from_cam),
        "cpu_s": facts["features_s"] + facts["matching_s"] + facts["mapping_s"],
    }
