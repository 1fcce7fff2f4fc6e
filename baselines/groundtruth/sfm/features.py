"""Features of a batch and verified matches between its frames, in a COLMAP database."""

from __future__ import annotations

from pathlib import Path

import pycolmap

from synfeal.config.models import CameraConfig, SfmConfig


def extract_features(images: Path, database: Path, camera: CameraConfig, cfg: SfmConfig) -> None:
    """SIFT features of all images in a directory; they share one camera of known intrinsics."""
    extraction = pycolmap.FeatureExtractionOptions(num_threads=1, use_gpu=False)
    extraction.sift.max_num_features = cfg.max_features
    extraction.sift.peak_threshold = cfg.peak_threshold
    pycolmap.extract_features(
        database,
        images,
        camera_mode=pycolmap.CameraMode.SINGLE,
        reader_options=_reader_options(camera),
        extraction_options=extraction,
        device=pycolmap.Device.cpu,
    )


def match_features(database: Path, cfg: SfmConfig, seed: int) -> None:
    """Verified matches between frames near in time; ``seed`` is that of RANSAC."""
    matching = pycolmap.FeatureMatchingOptions(
        num_threads=1, use_gpu=False, guided_matching=cfg.guided_matching
    )
    pairing = pycolmap.SequentialPairingOptions(
        overlap=cfg.overlap, quadratic_overlap=cfg.quadratic_overlap, num_threads=1
    )
    verification = pycolmap.TwoViewGeometryOptions(min_num_inliers=cfg.min_num_inliers)
    verification.ransac.random_seed = seed
    pycolmap.match_sequential(database, matching, pairing, verification, device=pycolmap.Device.cpu)


def colmap_parameters(camera: CameraConfig) -> list[float]:
    """Parameters of COLMAP's PINHOLE or, where there is distortion, FULL_OPENCV."""
    pinhole = list(camera.intrinsics)
    return [*pinhole, *camera.distortion, 0.0, 0.0, 0.0] if any(camera.distortion) else pinhole


def _reader_options(camera: CameraConfig) -> pycolmap.ImageReaderOptions:
    """The camera model and its parameters."""
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = "FULL_OPENCV" if any(camera.distortion) else "PINHOLE"
    reader.camera_params = ",".join(map(repr, colmap_parameters(camera)))
    return reader
