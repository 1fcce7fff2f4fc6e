"""Localizers, and the nearest image, on test frames that are not like their training frames."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from baselines.references.descriptors import thumbnails
from baselines.references.vectors import most_alike
from baselines.training.checkpoint import read_checkpoint
from baselines.training.data import read_images
from baselines.training.device import memory_errors, open_device
from baselines.training.predict import predict
from synfeal.dataset.packed import read_packed
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.evaluation.metrics import pose_errors, summary
from synfeal.frames import COUNT, MAYBE, TEXT, frame_of

if TYPE_CHECKING:
    import pandas as pd

NEAREST = "nearest-thumbnail"
MEASURES = ("position_m", "orientation_deg")
SCHEMA = {
    **dict.fromkeys(("trained_on", "method", "effects"), TEXT),
    **{f"{measure}{end}": MAYBE for measure in MEASURES for end in ("", "_low", "_high")},
    "n_test": COUNT,
}
Files = Mapping[str, Path]


@memory_errors()
def robustness_table(
    models: Mapping[str, Files],
    train_frames: Files,
    test_frames: Files,
    labels: Path,
    device: Literal["auto", "cpu", "cuda"] = "auto",
) -> pd.DataFrame:
    """Median errors by training set, method and effects, with 95 % limits over whole paths.

    Args:
        models: checkpoints of localizers, by training set and name.
        train_frames: packed training frames by training set; the nearest image is one of them.
        test_frames: packed test frames by the name of their effects.
        labels: folder of the true poses, ``train.csv`` and ``test.csv``: the same for all.
        device: where to predict.

    Raises:
        InputError: a file cannot be used.
        MemoryError: there is too little memory.
    """
    truth, train = read_pose_table(labels / "test.csv"), read_pose_table(labels / "train.csv")
    records = []
    for trained_on, checkpoints in models.items():
        known = thumbnails(read_packed(train_frames[trained_on])[: len(train)])
        for effects, frames in test_frames.items():
            alike = most_alike(known, thumbnails(read_packed(frames)[: len(truth)]), 1)[:, 0]
            answers = PoseTable(
                truth.frame, truth.path, train.position_m[alike], train.quat_wxyz[alike]
            )
            records.append(_record(trained_on, NEAREST, effects, answers, truth))
        for name, checkpoint in checkpoints.items():
            trained = read_checkpoint(checkpoint, open_device(device))
            input_px = trained.description.network.input_px
            for effects, frames in test_frames.items():
                images = read_images(frames, len(truth), input_px, trained.device)
                answers = PoseTable(truth.frame, truth.path, *predict(trained, images))
                records.append(_record(trained_on, name, effects, answers, truth))
    return frame_of(records, SCHEMA)


def _record(
    trained_on: str, method: str, effects: str, answers: PoseTable, truth: PoseTable
) -> dict[str, object]:
    scores = summary(pose_errors(answers, truth), truth.path)
    keys = {"trained_on": trained_on, "method": method, "effects": effects}
    return {**scores, **keys, "n_test": len(truth)}
