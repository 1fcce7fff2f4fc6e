"""Small result trees whose errors are known, for the tests of ``synfeal compare``."""

import numpy as np

from baselines.training.score import score_run
from synfeal.dataset.pose_table import PoseTable, write_pose_table

N, PER_PATH = 40, 4
BETTER, SAME, FAILED = "posenet", "poselstm", "hourglass"
MODELS = (BETTER, SAME, FAILED)
LABELS = ("synfeal", "sfm")
RUN = "runs/room/6k/synfeal/pretrained/posenet/seed0"
LABEL_OFFSET_M = 2.0


def poses(x_m):
    position_m = np.zeros((N, 3))
    position_m[:, 0] = x_m
    index = np.arange(N)
    return PoseTable(index, index // PER_PATH, position_m, np.tile([1.0, 0, 0, 0], (N, 1)))


def write_tree(root, error_m, seeds=1):
    """True poses at the origin, SfM labels 2 m to the left, predictions ``error_m`` to the right.

    So errors are ``error_m`` against the true poses, and 2 m more against SfM's labels.
    """
    truth = root / "plans/room/test.csv"
    write_pose_table(truth, poses(0.0))
    for labels, x_m in zip(LABELS, (0.0, -LABEL_OFFSET_M), strict=True):
        carried = root / f"labels/room/6k/{labels}/test.csv"
        write_pose_table(carried, poses(x_m))
        for model, values in error_m.items():
            for seed in range(seeds):
                out = root / f"runs/room/6k/{labels}/pretrained/{model}/seed{seed}"
                write_pose_table(out / "predictions.csv", poses(values + 0.01 * seed))
                files = (out / "predictions.csv", carried, truth, carried)
                score_run(*files, out / "errors.csv", out / "metrics.json", {})
    return root
