"""A map of bays in a row that look alike, and a photograph of the last of them."""

from __future__ import annotations

import numpy as np
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
N_FEATURES = 400  # of a bay


class Bays:
    """Bays in a row that look alike but for some features, each seen by frames before it.

    Args:
        n_unique: Features of the last bay that the others have not.
        n_bays: Bays.
        n_frames: Frames of each bay.
    """

    def __init__(self, n_unique: int, n_bays: int = 2, n_frames: int = 6) -> None:
        rng = np.random.default_rng(5)
        self.points = rng.uniform([-1.5, -1.0, 3.0], [1.5, 1.0, 5.0], (N_FEATURES, 3))
        common = rng.integers(0, 255, (N_FEATURES, 128), dtype=np.uint8)
        self.last = common.copy()
        self.last[:n_unique] = rng.integers(0, 255, (n_unique, 128), dtype=np.uint8)
        self.last_m = (n_bays - 1) * REPEAT_M
        poses, points, descriptors = [], [], []
        for bay in range(n_bays):
            for _ in range(n_frames):
                pose = np.eye(4)
                offset = rng.uniform(-0.2, 0.2, 3)
                pose[:3, 3] = offset + bay * REPEAT_M
                poses.append(pose)
                points.append(self.points - offset)
                descriptors.append(self.last if bay == n_bays - 1 else common)
        in_cam = np.concatenate(points)
        features = Features(
            start=np.arange(n_bays * n_frames + 1) * N_FEATURES,
            slope=in_cam[:, :2] / in_cam[:, 2:],
            depth_m=in_cam[:, 2],
            descriptor=np.concatenate(descriptors),
        )
        self.map = StructureMap(
            names=tuple(map(str, range(n_bays * n_frames))),
            world_from_cam=np.array(poses),
            camera=CAMERA,
            features=features,
            vectors=np.eye(n_bays * n_frames, dtype=np.float32),
            vlad=Vlad(torch.zeros(1, 128), np.zeros(128), np.eye(128)),
            sequence_from_world=None,
            mesh_file=MeshFile(),
            record={},
        )

    def seen_from_last(self) -> Photograph:
        """Draw the view of a camera before the middle of the last bay."""
        height, width = CAMERA.height, CAMERA.width
        roots = np.sqrt(self.last / self.last.sum(1, keepdims=True))
        return Photograph(
            slope=self.points[:, :2] / self.points[:, 2:],
            vector=roots.astype(np.float32),
            view=np.zeros((64, 64, 3), np.uint8),
            grey=np.zeros((height, width), np.uint8),
            shown=np.ones((height, width), np.bool_),
        )

    def found(self) -> Answer:
        """Find that view in the map."""
        return Finder(self.map).find(self.seen_from_last())

    def error_m(self, world_from_cam: Array) -> float:
        return float(np.linalg.norm(world_from_cam[:3, 3] - self.last_m))
