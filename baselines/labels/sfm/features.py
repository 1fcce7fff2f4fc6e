"""SIFT features of the images of one batch; more and weaker ones where there are few.

A camera close to a wall sees little of it. Where a batch crosses such a stretch, the few features
of the usual contrast break the chain of frames; features of a lower contrast are less repeatable,
but many of them hold it together.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import pycolmap

from baselines.config.labels import SfmConfig
from synfeal.config.dataset import CameraConfig


def extract_features(images: Path, database: Path, camera: CameraConfig, cfg: SfmConfig) -> int:
    """Find features in all images of a directory; they share one camera of known intrinsics.

    Args:
        images: Directory of the images.
        database: COLMAP database to write.
        camera: Camera of the images.
        cfg: Number and least contrast of features, usually and where there are few.

    Returns:
        How many images have features of the lower contrast.
    """
    _extract(images, database, camera, cfg.max_features, cfg.peak_threshold)
    if cfg.few_features == 0 or cfg.weak_peak_threshold >= cfg.peak_threshold:
        return 0
    poor = poor_images(database, cfg.few_features)
    if poor:
        _forget_features(database, poor)
        _extract(images, database, camera, cfg.weak_max_features, cfg.weak_peak_threshold, poor)
    return len(poor)


def poor_images(database: Path, few: int) -> list[str]:
    """Return the names of the images with fewer features than ``few``, in order."""
    with pycolmap.Database.open(database) as opened:
        return sorted(
            image.name
            for image in opened.read_all_images()
            if opened.num_keypoints_for_image(image.image_id) < few
        )


def _forget_features(database: Path, names: Sequence[str]) -> None:
    """Remove the features of some images: COLMAP finds none anew where there are any.

    pycolmap removes those of all images or of none. The file is a SQLite database whose tables are
    documented (colmap.github.io/database.html).
    """
    with closing(sqlite3.connect(database)) as connection, connection:
        for table in ("keypoints", "descriptors"):
            connection.executemany(
                f"DELETE FROM {table} WHERE image_id ="
                " (SELECT image_id FROM images WHERE name = ?)",
                [(name,) for name in names],
            )


def _extract(
    images: Path,
    database: Path,
    camera: CameraConfig,
    max_features: int,
    peak_threshold: float,
    names: Sequence[str] = (),
) -> None:
    """Find features in the images of these names, or in all of the directory."""
    extraction = pycolmap.FeatureExtractionOptions(num_threads=1, use_gpu=False)
    extraction.sift.max_num_features = max_features
    extraction.sift.peak_threshold = peak_threshold
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = "FULL_OPENCV" if any(camera.distortion) else "PINHOLE"
    reader.camera_params = ",".join(map(repr, colmap_parameters(camera)))
    pycolmap.extract_features(
        database,
        images,
        image_names=list(names),
        camera_mode=pycolmap.CameraMode.SINGLE,
        reader_options=reader,
        extraction_options=extraction,
        device=pycolmap.Device.cpu,
    )


def colmap_parameters(camera: CameraConfig) -> list[float]:
    """Return the parameters of COLMAP's PINHOLE or, where there is distortion, FULL_OPENCV."""
    pinhole = list(camera.intrinsics)
    return [*pinhole, *camera.distortion, 0.0, 0.0, 0.0] if any(camera.distortion) else pinhole
