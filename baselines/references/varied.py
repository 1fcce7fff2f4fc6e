"""Structure-based poses of test frames drawn with effects.

Without the localizers they stand beside (:mod:`baselines.references.robustness`): many jobs draw
such frames, and none of them needs a network.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image
from tqdm import tqdm

from baselines.config.references import ReferencesConfig
from baselines.references.arrays import VLAD, most_alike, read_described
from baselines.references.correspondences import match_test_frames
from baselines.references.features import Features, features_of
from baselines.references.run import pose_table
from baselines.references.structure import lifted, localize
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.dataset.render_sequence import drawn, effects_of
from synfeal.effects.scene import open_scene
from synfeal.render.surface import Layers


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
        added = effects_of(camera, render)  # a frame has those of its path
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
