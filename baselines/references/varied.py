"""Structure-based poses of test frames in other light, through another camera than the map's."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from tqdm import tqdm

from baselines.references.correspondences import match_test_frames
from baselines.references.features import Features, features_of
from baselines.references.run import pose_table
from baselines.references.structure import lifted, localize
from baselines.references.vectors import VLAD, most_alike, read_described
from synfeal.config.models import CameraConfig, ReferencesConfig, RenderConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.dataset.render_sequence import drawn, effects_of
from synfeal.effects.relight import open_scene


def write_varied(
    effects: str,  # what the descriptors call all test frames that are drawn like these
    # ``mesh``, ``plan`` of the test frames, ``labels``, ``features`` with depth and ``descriptors``
    # of the training frames
    files: Mapping[str, Path],
    n_test: int,  # test frames there are
    sample: int,  # how many of them are drawn at most, spread evenly
    camera: CameraConfig,  # of the frames
    render: RenderConfig,  # with effects
    references: ReferencesConfig,  # features and retrieval
    seed: int,  # of RANSAC
    out_predictions: Path,  # poses of the frames drawn, NaN where none is found
) -> None:
    """Draw some test frames with effects, and write what ``structure-depth`` answers for them.

    Raises:
        InputError: a file cannot be read.
    """
    plan, rows = read_pose_table(files["plan"]), sampled(n_test, sample)
    test = varied_features(files["mesh"], plan, rows, camera, render, references)
    train = read_pose_table(files["labels"])
    known = read_described(files["descriptors"], len(train), int(rows[-1]) + 1, effects)
    of_train, of_all = known[VLAD]
    nearest = most_alike(of_train, of_all[rows], references.retrieved)
    matches = match_test_frames(Features.read(files["features"]), test, nearest)
    poses = localize(matches, lifted(matches, train), camera, seed)
    write_pose_table(out_predictions, pose_table(plan.at(rows), poses))


def sampled(count: int, most: int) -> NDArray[np.int64]:
    """Rows spread evenly over ``count`` frames, no more than ``most``."""
    return np.linspace(0, count - 1, min(count, most)).astype(np.int64)


def varied_features(
    mesh: Path,
    plan: PoseTable,
    rows: NDArray[np.int64],
    camera: CameraConfig,
    render: RenderConfig,
    cfg: ReferencesConfig,
) -> Features:
    """Features of frames drawn with effects, each as a part of its path; without depth.

    Raises:
        InputError: the mesh cannot be read.
    """
    effects = effects_of(camera, render)
    with open_scene(mesh, camera, render) as renderer:
        places = tqdm(rows.tolist(), "drawing", unit="frame", mininterval=5)
        poses = (plan.between(row, row + 1) for row in places)
        views = (next(drawn(renderer, pose, False, effects))[0] for pose in poses)
        greys = (np.asarray(Image.fromarray(rgb).convert("L")) for rgb in views)
        return features_of(greys, None, camera, cfg)
