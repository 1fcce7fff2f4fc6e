"""Structure-based poses of test frames in other light, through another camera than the map's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from tqdm import tqdm

from baselines.references.correspondences import match_test_frames
from baselines.references.evidence import Evidence
from baselines.references.features import Features, features_of, read_features
from baselines.references.structure import lifted, localize
from baselines.references.vectors import VLAD, most_alike, read_described
from synfeal.config.models import CameraConfig, ReferencesConfig, RenderConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.render_sequence import drawn, effects_of
from synfeal.effects.relight import open_scene


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


def answer_varied(
    evidence: Evidence, test: Features, rows: NDArray[np.int64], effects: str, retrieved: int
) -> NDArray[np.float64]:
    """Poses (N, 4, 4), NaN where none is found, as by ``structure-depth`` of the registry.

    Args:
        evidence: of the training frames: labels, ``features`` with depth, ``descriptors``.
        test: features of N test frames.
        rows: (N,) which of the test frames these are.
        effects: what the descriptors call all test frames that are drawn like these.
        retrieved: training frames that a test frame is matched with.

    Raises:
        InputError: a file cannot be read.
    """
    train = evidence.train
    stored = evidence.files["descriptors"]
    of_train, of_all = read_described(stored, len(train), int(rows[-1]) + 1, effects)[VLAD]
    nearest = most_alike(of_train, of_all[rows], retrieved)
    matches = match_test_frames(read_features(evidence.files["features"]), test, nearest)
    return localize(matches, lifted(matches, train), evidence.camera, evidence.seed)
