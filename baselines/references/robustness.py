"""Localizers and reference methods on test frames unlike their training frames.

In other light or through another camera, localizers see packed frames; structure-based poses are
found in a sample of them, drawn large enough for features.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from baselines.localizers.memory import memory_errors
from baselines.references.arrays import THUMBNAIL, VLAD, most_alike, read_described
from baselines.training.checkpoint import read_checkpoint
from baselines.training.data import read_images
from baselines.training.device import open_device
from baselines.training.predict import predict
from baselines.training.score import read_predictions
from synfeal.config.effects import CLEAN
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.evaluation.metrics import pose_errors, summary
from synfeal.records.tables import COUNT, MAYBE, TEXT, frame_of

if TYPE_CHECKING:
    import pandas as pd


NEAREST = {"nearest-thumbnail": THUMBNAIL, "nearest-vlad": VLAD}
STRUCTURE = "structure-depth"
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
    descriptors: Files,
    structure: Files,
    test_frames: Files,
    labels: Path,
    device: Literal["auto", "cpu", "cuda"] = "auto",
) -> pd.DataFrame:
    """Compute median errors by training set, method and effects, with 95 % limits over whole paths.

    Args:
        models: Checkpoints of localizers, by training set and name.
        descriptors: Descriptors of the training frames and of all test frames, by training set.
        structure: Tables of what :func:`baselines.references.varied.write_varied` finds on
            ideal training frames, by effects; empty where there are none.
        test_frames: Packed test frames by the name of their effects.
        labels: Folder of the true poses, ``train.csv`` and ``test.csv``: the same for all.
        device: Device to predict on.

    Raises:
        InputError: a file cannot be used.
        MemoryError: there is too little memory.
    """
    truth, train = read_pose_table(labels / "test.csv"), read_pose_table(labels / "train.csv")
    records = []
    for trained_on, checkpoints in models.items():
        for method, descriptor in NEAREST.items():
            for effects in test_frames:
                known = read_described(descriptors[trained_on], len(train), len(truth), effects)
                alike = most_alike(*known[descriptor], 1)[:, 0]
                answers = PoseTable(
                    frame=truth.frame,
                    path=truth.path,
                    position_m=train.position_m[alike],
                    quat_wxyz=train.quat_wxyz[alike],
                )
                records.append(_record(trained_on, method, effects, answers, truth))
        for effects, file in structure.items() if trained_on == CLEAN else ():
            answers = read_predictions(file)
            records.append(_record(trained_on, STRUCTURE, effects, answers, truth))
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
    asked = truth.at(answers.frame)
    scores = summary(pose_errors(answers, asked), asked.path)
    keys = {"trained_on": trained_on, "method": method, "effects": effects}
    return {**scores, **keys, "n_test": len(asked)}
