"""KinectFusion on one batch: frames lost, errors of those that were found, and what it took."""

from __future__ import annotations

import time

from baselines.groundtruth.kinect_fusion import kinect_fusion_batch
from benchmarks.measures.batches import BatchCase, errors, open_batch
from synfeal.seeds import seed_of

Case = BatchCase


def run(case: BatchCase, seed: int) -> dict[str, float]:
    """Errors of the registered frames against the true poses, the first pose given.

    Raises:
        InputError: the frames cannot be used.
    """
    batch, cfg = open_batch(case), case.groundtruth.kinect_fusion
    files = batch.color, batch.depth, case.groundtruth_camera
    # Two frames compile the registration, which is not what is timed.
    kinect_fusion_batch(files[0][:2], files[1][:2], files[2], cfg)
    begin_s = time.process_time()
    tracked = kinect_fusion_batch(*files, cfg, seed_of(seed, "kinect-fusion"))
    cpu_s = time.process_time() - begin_s
    found = tracked.registered
    return {
        "lost": int((~found).sum()),
        **errors("found", tracked.first_from_cam[found], batch.world_from_cam[found]),
        "s_per_frame": cpu_s / len(found),
    }
