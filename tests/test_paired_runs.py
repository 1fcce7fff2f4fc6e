"""Runs that are compared over their labels differ in nothing else."""

import numpy as np
import pytest
import torch

from synfeal.config import Run
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.labels.noise import add_noise
from tests.coloured_frames import TRAINING, Jitter, train, write_split

RUN = {"scene": "large_room", "size": "6k", "labels": "synfeal", "init": "scratch"}
RUN |= {"model": "posenet", "repetition": 0}
OTHERS = {"scene": "sanctuary", "size": "20k", "init": "pretrained", "model": "posenet2"}


def test_the_seed_of_a_run_leaves_out_its_labels():
    seed = Run(**RUN).seed(0)
    assert Run(**RUN | {"labels": "sfm"}).seed(0) == seed
    others = [Run(**RUN | {key: value}).seed(0) for key, value in OTHERS.items()]
    others += [Run(**RUN | {"repetition": 1}).seed(0), Run(**RUN).seed(1)]
    assert len({seed, *others}) == len(others) + 1


class Recorder(Jitter):
    """Remembers what was shown, image by image."""

    def __init__(self):
        super().__init__()
        self.shown: list[torch.Tensor] = []

    def __call__(self, images, quat_wxyz):
        self.shown.append(images.sum(dim=(1, 2, 3)))
        return super().__call__(images, quat_wxyz)


@pytest.mark.parametrize(("share", "left"), [(0.0, 60), (0.3, 40)])
def test_labels_change_neither_order_nor_held_out_paths(tmp_path, share, left):
    frames, labels = write_split(tmp_path, "train", 60, 0)
    noisy = tmp_path / "noisy.csv"
    write_pose_table(noisy, add_noise(read_pose_table(labels), 0.3, 20, np.random.default_rng(0)))
    training = TRAINING.model_copy(update={"validation_share": share})
    shown = []
    for path in (labels, noisy):
        recorder = Recorder()
        train((frames, path), tmp_path, training=training, augment=recorder)
        shown.append(torch.cat(recorder.shown))
    assert torch.equal(*shown)
    assert len(shown[0].unique()) == left
