"""One batch under one setting."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.groundtruth.posegraph.optimise import optimise
from baselines.groundtruth.rgbd import rgbd_graph_with_facts
from synfeal.config.models import CameraConfig, PoseGraphConfig, RgbdConfig
from synfeal.dataset.sevenscenes import read_pose
from synfeal.geometry.poses import pose_error, relative

Array = NDArray[np.float64]

SEED = 0
SETTING_KEYS = ("method", "start", "keyframe_every", "loops_per_keyframe", "sensor")


@dataclass(frozen=True)
class Batch:
    """Frames of one batch.

    Attributes:
        scene: name of the scene.
        start: first frame in the sequence.
        color: colour images in order.
    """

    scene: str
    start: int
    color: tuple[Path, ...]

    def others(self, kind: str) -> list[Path]:
        """Files of another kind, ``depth.png`` or ``pose.txt``, of the same frames."""
        return [path.with_suffix("").with_suffix(f".{kind}") for path in self.color]


def batches_of(scene: str, directory: Path, length: int, count: int) -> list[Batch]:
    """The first batches of a 7-Scenes sequence, each of which begins where the last ends."""
    color = sorted(directory.glob("frame-*.color.png"))
    starts = range(0, len(color) - length + 1, length - 1)
    return [Batch(scene, k, tuple(color[k : k + length])) for k in starts[:count]]


def measure(batch: Batch, camera: CameraConfig, name: str, cfg: RgbdConfig) -> dict[str, Any]:
    """A row of the table: errors in metres and degrees, processor seconds."""
    true = np.array([read_pose(path) for path in batch.others("pose.txt")])
    true = relative(true[0], true)
    depth = batch.others("depth.png")
    graph, facts = rgbd_graph_with_facts(batch.color, depth, camera, cfg, SEED)
    begin_s = time.process_time()
    optimised = optimise("g2o", graph, PoseGraphConfig()).first_from_cam
    seconds = facts.odometry_s + facts.loops_s + time.process_time() - begin_s
    path_m = float(np.linalg.norm(np.diff(true[:, :3, 3], axis=0), axis=1).sum())
    odometry = _errors("odometry", graph.first_from_cam, true)
    return {
        "scene": batch.scene,
        "start_frame": batch.start,
        "frames": len(batch.color),
        "setting": name,
        **{key: getattr(cfg, key) for key in SETTING_KEYS},
        "pairs_accepted": facts.pairs_accepted,
        "loops": facts.loops,
        **odometry,
        "drift_percent": 100 * odometry["odometry_last_m"] / path_m,
        **_errors("g2o", optimised, true),
        "odometry_s": facts.odometry_s,
        "loops_s": facts.loops_s,
        "seconds": seconds,
    }


def _errors(name: str, first_from_cam: Array, true: Array) -> dict[str, float]:
    """Errors of poses (n, 4, 4) in metres and degrees."""
    error_m, error_rad = pose_error(first_from_cam, true)
    error_deg = np.degrees(error_rad)
    return {
        f"{name}_median_m": float(np.median(error_m)),
        f"{name}_max_m": float(error_m.max()),
        f"{name}_last_m": float(error_m[-1]),
        f"{name}_median_deg": float(np.median(error_deg)),
        f"{name}_max_deg": float(error_deg.max()),
    }
