"""One batch under every setting; stages that settings share are carried out once."""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.groundtruth.chain import fill_gaps
from baselines.groundtruth.sfm.batch import cpu_s
from baselines.groundtruth.sfm.features import extract_features, match_features
from baselines.groundtruth.sfm.images import link_images
from baselines.groundtruth.sfm.mapping import camera_poses, map_matches, read_matches
from baselines.groundtruth.sfm.refine import refine_model
from baselines.groundtruth.sfm.scale import metric_trajectory
from baselines.groundtruth.trajectory import BatchTrajectory
from synfeal.config.models import CameraConfig, GroundTruthConfig, SfmConfig
from synfeal.dataset.sevenscenes import read_pose
from synfeal.files import write_json
from synfeal.geometry.alignment import umeyama_sim3
from synfeal.geometry.poses import pose_error, relative

Array = NDArray[np.float64]

SEED = 0
SETTING_KEYS = (
    "max_features",
    "peak_threshold",
    "overlap",
    "quadratic_overlap",
    "guided_matching",
    "mapper",
    "min_explained",
)


@dataclass(frozen=True)
class BatchFrames:
    """The frames of one batch.

    Attributes:
        scene: name of the scene.
        every: how many frames of the sequence one step is.
        start: first frame in the sequence.
        color: images in order.
    """

    scene: str
    every: int
    start: int
    color: tuple[Path, ...]

    @property
    def name(self) -> str:
        """Name for files."""
        return f"{self.scene}-{self.every}-{self.start:06d}-{len(self.color)}"

    @property
    def poses(self) -> list[Path]:
        """Files of the true poses."""
        return [path.with_suffix("").with_suffix(".pose.txt") for path in self.color]


def batch_at(scene: str, frames: Path, every: int, start: int, length: int) -> BatchFrames:
    """Frames of a 7-Scenes sequence: ``length`` of them, from ``start``, ``every`` apart."""
    color = [
        frames / f"frame-{index:06d}.color.png"
        for index in range(start, start + every * length, every)
    ]
    return BatchFrames(scene, every, start, tuple(color))


def measure_batch(
    batch: BatchFrames, camera: CameraConfig, settings: dict[str, SfmConfig], work: Path
) -> None:
    """Write ``<work>/<batch>/<setting>.json`` for every setting that has none yet."""
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL.value
    directory = work / batch.name
    directory.mkdir(parents=True, exist_ok=True)
    images = directory / "images"
    if not images.is_dir():
        link_images(batch.color, camera, images)
    for name, cfg in settings.items():
        path = directory / f"{name}.json"
        if not path.exists():
            write_json(path, _measure(batch, camera, name, cfg, directory))


def _measure(
    batch: BatchFrames, camera: CameraConfig, name: str, cfg: SfmConfig, directory: Path
) -> dict[str, Any]:
    pycolmap.set_random_seed(SEED)
    database, features_s = _features(camera, cfg, directory)
    database, matching_s = _matches(database, cfg)
    models = directory / "models"
    shutil.rmtree(models, ignore_errors=True)
    begin = time.process_time()
    mapping = map_matches(read_matches(directory / "images", database), models, cfg, SEED)
    true = np.array([read_pose(path) for path in batch.poses])
    mapped = _errors(metric_trajectory(*camera_poses(mapping.model), true), true)
    if mapping.model is not None:
        refine_model(mapping.model)
    mapping_s = time.process_time() - begin
    frames, model_from_cam = camera_poses(mapping.model)
    trajectory = metric_trajectory(frames, model_from_cam, true)
    return {
        "scene": batch.scene,
        "every": batch.every,
        "start": batch.start,
        "frames": len(batch.color),
        "setting": name,
        **{key: getattr(cfg, key) for key in SETTING_KEYS},
        "registered": int(trajectory.registered.sum()),
        "models": mapping.models,
        "starts": mapping.starts,
        "explained": mapping.explained,
        **_errors(trajectory, true),
        "mapped_median_m": mapped["median_m"],
        "mapped_median_deg": mapped["median_deg"],
        "fitted_median_m": fitted_median_m(model_from_cam[:, :3, 3], true[frames, :3, 3]),
        "features_s": features_s,
        "matching_s": matching_s,
        "mapping_s": mapping_s,
        "seconds": features_s + matching_s + mapping_s,
    }


def _features(camera: CameraConfig, cfg: SfmConfig, directory: Path) -> tuple[Path, float]:
    """Database with features, and the CPU seconds that they took."""
    database = directory / f"features-{cfg.max_features}-{cfg.peak_threshold:g}.db"
    return database, _once(
        database, lambda part: extract_features(directory / "images", part, camera, cfg)
    )


def _matches(features: Path, cfg: SfmConfig) -> tuple[Path, float]:
    """Database with features and matches, and the CPU seconds that matching took."""
    kind = "quadratic" if cfg.quadratic_overlap else "linear"
    guided = "-guided" if cfg.guided_matching else ""
    database = features.with_name(f"{features.stem}-{kind}-{cfg.overlap}{guided}.db")

    def match(part: Path) -> None:
        shutil.copyfile(features, part)
        match_features(part, cfg, SEED)

    return database, _once(database, match)


def _once(database: Path, make: Callable[[Path], None]) -> float:
    """CPU seconds that ``make`` took to write the database; it is called if there is none."""
    record = database.with_suffix(".json")
    if not record.exists():
        with tempfile.TemporaryDirectory(dir=database.parent) as temporary:
            part = Path(temporary) / "part.db"
            seconds = cpu_s(lambda: make(part))
            part.replace(database)
        write_json(record, seconds)
    return float(json.loads(record.read_text(encoding="utf-8")))


def fitted_median_m(position: Array, true_position_m: Array) -> float | None:
    """Median error of registered camera centres (m, 3) after a similarity fit to the true ones.

    It is the mapper's own error: neither the scale nor the first pose are in it. None where there
    are too few centres for a fit, or all lie on a line.
    """
    try:
        scale, rotation, translation = umeyama_sim3(position, true_position_m)
    except ValueError:
        return None
    fitted_m = scale * position @ rotation.T + translation
    return float(np.median(np.linalg.norm(fitted_m - true_position_m, axis=1)))


def _errors(trajectory: BatchTrajectory, true_world_from_cam: Array) -> dict[str, float | int]:
    """Errors of all frames when the batch starts at its true first pose, gaps filled."""
    true = relative(true_world_from_cam[0], true_world_from_cam)
    error_m, error_rad = pose_error(fill_gaps(trajectory), true)
    error_deg = np.degrees(error_rad)
    limits = GroundTruthConfig()
    far = error_m[-1] > limits.assist_position_m or error_deg[-1] > limits.assist_orientation_deg
    return {
        "median_m": float(np.median(error_m)),
        "max_m": float(error_m.max()),
        "median_deg": float(np.median(error_deg)),
        "max_deg": float(error_deg.max()),
        "last_m": float(error_m[-1]),
        "last_deg": float(error_deg[-1]),
        "assisted": int(far),
    }
