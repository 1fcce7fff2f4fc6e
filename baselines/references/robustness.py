"""Localizers and reference methods on test frames unlike their training frames.

In other light or through another camera, localizers see packed frames; structure-based poses are
found in a sample of them, drawn large enough for features.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from PIL import Image
from tqdm import tqdm

from baselines.config.references import ReferencesConfig
from baselines.localizers.memory import memory_errors
from baselines.references.arrays import THUMBNAIL, VLAD, most_alike, read_described
from baselines.references.correspondences import match_test_frames
from baselines.references.features import Features, features_of
from baselines.references.run import pose_table
from baselines.references.structure import lifted, localize
from baselines.training.checkpoint import read_checkpoint
from baselines.training.data import read_images
from baselines.training.device import open_device
from baselines.training.predict import predict
from baselines.training.score import read_predictions
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.config.effects import CLEAN
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.dataset.render_sequence import drawn, effects_of
from synfeal.effects.scene import open_scene
from synfeal.evaluation.metrics import pose_errors, summary
from synfeal.records.tables import COUNT, MAYBE, TEXT, frame_of
from synfeal.render.surface import Layers

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


def write_varied(
    effects: str,
    files: Mapping[str, Path],
    n_test: int,
    sample: int,
    camera: CameraConfig,
    render: RenderConfig,
    references: ReferencesConfig,
    seed: int,
    out_predictions: Path,
) -> None:
    """Draw some test frames with effects, and write what ``structure-depth`` answers for them.

    Args:
        effects: Name in the descriptors of all test frames that are drawn like these.
        files: ``mesh``, ``plan`` of the test frames, ``labels``, ``features`` with depth and
            ``descriptors`` of the training frames.
        n_test: Number of test frames.
        sample: Largest number of them that are drawn, spread evenly.
        camera: Camera of the frames.
        render: Settings of the renderer, with effects.
        references: Settings of features and retrieval.
        seed: Seed of RANSAC.
        out_predictions: Poses of the frames drawn, NaN where none is found.

    Raises:
        InputError: a file cannot be read.
    """
    plan = read_pose_table(files["plan"])
    rows = np.linspace(0, n_test - 1, min(n_test, sample)).astype(np.int64)
    with open_scene(files["mesh"], camera, render) as renderer:
        places = tqdm(rows.tolist(), "drawing", unit="frame", mininterval=5)
        poses = (plan.between(row, row + 1) for row in places)
        added = effects_of(camera, render)  # of each frame as a part of its path
        views = (next(drawn(renderer, pose, Layers(), added)).rgb for pose in poses)
        greys = (np.asarray(Image.fromarray(rgb).convert("L")) for rgb in views)
        test = features_of(greys, None, camera, references)
    train = read_pose_table(files["labels"])
    known = read_described(files["descriptors"], len(train), int(rows[-1]) + 1, effects)
    of_train, of_all = known[VLAD]
    nearest = most_alike(of_train, of_all[rows], references.retrieved)
    matches = match_test_frames(Features.read(files["features"]), test, nearest)
    answers = localize(matches, lifted(matches, train), camera, seed)
    write_pose_table(out_predictions, pose_table(plan.at(rows), answers))


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
        structure: Tables of what :func:`baselines.references.robustness.write_varied` finds on
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
