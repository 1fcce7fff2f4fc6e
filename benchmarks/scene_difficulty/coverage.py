"""How much of an image has texture that features are found on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.scene_difficulty.features import Features
from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.report.tables import Value

RADIUS_PX = 8.0
QUANTILES = (0.1, 0.5, 0.9)
FRAME_COLUMNS = ("frame", "path", "keypoints", "covered_share")


def covered_share(pixel: NDArray[np.floating], camera: CameraConfig, radius_px: float) -> float:
    """Share of the pixels whose centre is within ``radius_px`` of one of the points (k, 2)."""
    if not len(pixel):
        return 0.0
    row, column = np.mgrid[0 : camera.height, 0 : camera.width].reshape(2, -1)
    centre = np.column_stack([column, row]) + 0.5
    nearest, _ = cKDTree(pixel).query(centre, distance_upper_bound=radius_px * (1 + 1e-9))
    return float(np.mean(np.isfinite(nearest)))


def coverage_rows(
    poses: PoseTable, features: Sequence[Features], camera: CameraConfig
) -> list[dict[str, Value]]:
    """One row per frame: keypoints, and share of pixels near one."""
    return [
        {
            "frame": int(frame),
            "path": int(path),
            "keypoints": len(found),
            "covered_share": covered_share(found.pixel, camera, RADIUS_PX),
        }
        for frame, path, found in zip(poses.frame, poses.path, features, strict=True)
    ]


def coverage_summary(scene: str, rows: Sequence[dict[str, Value]]) -> dict[str, Value]:
    """Mean and quantiles over the frames."""
    summary: dict[str, Value] = {"scene": scene, "frames": len(rows), "radius_px": RADIUS_PX}
    for name in ("covered_share", "keypoints"):
        values = np.array([row[name] for row in rows], np.float64)
        summary[f"{name}_mean"] = float(values.mean())
        for quantile in QUANTILES:
            summary[f"{name}_q{100 * quantile:.0f}"] = float(np.quantile(values, quantile))
    return summary
