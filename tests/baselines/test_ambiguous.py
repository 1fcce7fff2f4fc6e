"""A photograph of what looks the same elsewhere has no pose; one of something unique has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from baselines.references.descriptors import Vlad
from baselines.references.features import Features
from baselines.references.map_frames import MeshFile
from baselines.references.mapped import StructureMap
from baselines.references.photographs import Answer, Finder, Photograph
from synfeal.config.dataset import CameraConfig

Array = NDArray[np.float64]
CAMERA = CameraConfig(width=320, height=240, fx=266.0, fy=266.0, cx=160.0, cy=120.0)
REPEAT_M = np.array([1.95, 0.0, 0.0])
N_FEATURES, N_FRAMES = 400, 6  # features of a bay, frames of each of both bays


class Bays:
    """Two bays that look alike but for some features, each seen by frames before it.

    Args:
        n_unique: Features of the second bay that the first has not.
    """

    def __init__(self, n_unique: int) -> None:
        rng = np.random.default_rng(5)
        self.points = rng.uniform([-1.5, -1.0, 3.0], [1.5, 1.0, 5.0], (N_FEATURES, 3))
        first = rng.integers(0, 255, (N_FEATURES, 128), dtype=np.uint8)
        second = first.copy()
        second[:n_unique] = rng.integers(0, 255, (n_unique, 128), dtype=np.uint8)
        self.descriptors = (first, second)
        poses, points, descriptors = [], [], []
        for bay in range(2):
            for _ in range(N_FRAMES):
                pose = np.eye(4)
                offset = rng.uniform(-0.2, 0.2, 3)
                pose[:3, 3] = offset + bay * REPEAT_M
                poses.append(pose)
                points.append(self.points - offset)
                descriptors.append(self.descriptors[bay])
        in_cam = np.concatenate(points)
        features = Features(
            start=np.arange(2 * N_FRAMES + 1) * N_FEATURES,
            slope=in_cam[:, :2] / in_cam[:, 2:],
            depth_m=in_cam[:, 2],
            descriptor=np.concatenate(descriptors),
        )
        self.map = StructureMap(
            names=tuple(map(str, range(2 * N_FRAMES))),
            world_from_cam=np.array(poses),
            camera=CAMERA,
            features=features,
            vectors=np.eye(2 * N_FRAMES, dtype=np.float32),
            vlad=Vlad(torch.zeros(1, 128), np.zeros(128), np.eye(128)),
            sequence_from_world=None,
            mesh_file=MeshFile(),
            record={},
        )

    def seen_from_second(self) -> Photograph:
        """Draw the view of a camera before the middle of the second bay."""
        height, width = CAMERA.height, CAMERA.width
        roots = np.sqrt(self.descriptors[1] / self.descriptors[1].sum(1, keepdims=True))
        return Photograph(
            slope=self.points[:, :2] / self.points[:, 2:],
            roots=roots.astype(np.float32),
            view=np.zeros((64, 64, 3), np.uint8),
            grey=np.zeros((height, width), np.uint8),
            shown=np.ones((height, width), np.bool_),
        )


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], Answer]:
    """The answer where so many features of the second bay are its own."""
    frames = np.arange(2 * N_FRAMES)
    monkeypatch.setattr(Finder, "alike", lambda self, photograph: frames)

    def find(n_unique: int) -> Answer:
        bays = Bays(n_unique)
        return Finder(bays.map).find(bays.seen_from_second())

    return find


def error_m(world_from_cam: Array) -> float:
    return float(np.linalg.norm(world_from_cam[:3, 3] - REPEAT_M))


def test_two_equal_places_are_ambiguous(found: Callable[[int], Answer]) -> None:
    answer = found(0)
    assert answer.support.confidence > 0.999
    assert answer.is_ambiguous
    assert answer.rival is not None
    places_m = sorted([error_m(answer.world_from_cam), error_m(answer.rival.world_from_cam)])
    np.testing.assert_allclose(places_m, [0.0, 1.95], atol=0.01)


def test_a_few_features_of_its_own_do_not_decide(found: Callable[[int], Answer]) -> None:
    assert found(N_FEATURES // 20).is_ambiguous


def test_enough_features_of_its_own_do(found: Callable[[int], Answer]) -> None:
    answer = found(N_FEATURES // 2)
    assert answer.support.inliers > 0.9 * N_FEATURES
    assert not answer.is_ambiguous
    assert error_m(answer.world_from_cam) < 0.01
    assert answer.rival is not None
    assert abs(error_m(answer.rival.world_from_cam) - 1.95) < 0.05
