"""A localizer that is no part of this project: the mean pose of the three most similar images.

Called as ``nearest_grey.py TRAIN_FRAMES TRAIN_LABELS TEST_FRAMES N_TEST OUT``; docs/references.md
says what these files are, and examples/external.yaml makes it a row of the tables.
"""

import sys

import numpy as np
import pandas as pd

POSE = ["tx", "ty", "tz", "qw", "qx", "qy", "qz"]


def grey(frames):
    """Images (N, S, S, 3) as normalised grey vectors (N, S * S)."""
    vectors = frames.mean(axis=3).reshape(len(frames), -1)
    vectors -= vectors.mean(axis=1, keepdims=True)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def mean_pose(poses):
    """Mean of poses (3, 7); quaternions are first turned to the side of the nearest image's."""
    sides = np.where(poses[:, 3:] @ poses[0, 3:] < 0, -1.0, 1.0)
    quat_wxyz = (sides[:, None] * poses[:, 3:]).sum(axis=0)
    return [*poses[:, :3].mean(axis=0), *quat_wxyz / np.linalg.norm(quat_wxyz)]


train_frames, train_labels, test_frames, n_test, out = sys.argv[1:]
labels = pd.read_csv(train_labels)
train = grey(np.load(train_frames)[: len(labels)])  # a smaller data set is a prefix of the largest
test = grey(np.load(test_frames)[: int(n_test)])
nearest = np.argsort(-(test @ train.T), axis=1)[:, :3]
answers = [mean_pose(labels[POSE].to_numpy()[rows]) for rows in nearest]
pd.DataFrame(answers, columns=POSE).rename_axis("frame").to_csv(out)
