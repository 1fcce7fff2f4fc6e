"""Typed configuration of the label methods."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from synfeal.config.types import Count, Fraction, Positive, Slug, Strict, part


class SfmConfig(Strict):
    """Structure from motion with pycolmap."""

    max_features: Count = Field(2000, description="SIFT features per image")
    peak_threshold: Positive = Field(0.0067, description="SIFT: least contrast; white is 1")
    few_features: int = Field(
        150, ge=0, le=10**9, description="images with fewer features get weaker ones; 0: none do"
    )
    weak_max_features: Count = Field(1500, description="these: SIFT features per image")
    weak_peak_threshold: Positive = Field(0.0015, description="these: least contrast; white is 1")
    overlap: Count = Field(5, description="images further on that each image is matched with")
    quadratic_overlap: bool = Field(True, description="these: 1, 2, 4, 8, …, else 1, 2, 3, 4, …")
    retrieved: int = Field(
        10,
        ge=0,
        le=1000,
        description="images more than 16 further on that each image is matched with, those that"
        " look most like it; 0: none",
    )
    gauge: Literal["first_poses", "first_camera"] = Field(
        "first_poses",
        description="true poses that place and scale a batch: its first 44 poses (mean rotation,"
        " scale and shift), or, as the paper's code, its first pose and 44 distances",
    )
    guided_matching: bool = Field(False, description="match a pair again, along epipolar lines")
    min_num_inliers: Count = Field(15, description="least inliers of a verified pair")
    mapper: Literal["incremental", "global"] = Field(
        "incremental", description="COLMAP's: image by image, or all at once (GLOMAP)"
    )
    init_min_tri_angle_deg: Positive = Field(4.0, description="incremental: of the initial pair")
    min_explained: float = Field(
        0.67,
        ge=0,
        le=1,
        description="incremental: a model that explains less of the matched points is tried anew"
        " from another start, up to four",
    )
    max_mapping_s: Count = Field(1800, description="incremental: stop then with the best model")


class DepthConfig(Strict):
    """Depth images as a method reads them."""

    sensor: Literal["ideal", "kinect"] = Field(
        "ideal", description="`kinect`: quantised, noisy disparity, 0.5 to 4.5 m"
    )
    max_depth_m: Positive = Field(20.0, description="depth beyond is not used")


class RgbdConfig(DepthConfig):
    """RGB-D odometry and loop closures with Open3D."""

    method: Literal["point-to-plane", "hybrid", "intensity"] = Field(
        "point-to-plane", description="what dense odometry compares: depth, both, colour"
    )
    start: Literal["motion", "features", "identity"] = Field(
        "motion", description="first guess: the motion before, feature matches, none"
    )
    keyframe_every: Count = Field(10, description="frames between keyframes")
    loops_per_keyframe: int = Field(3, ge=0, le=10**9, description="loop closures per keyframe")
    max_rmse_m: Positive = Field(0.05, description="motions with a larger residual are rejected")
    min_fitness: Fraction = Field(0.3, description="motions with less overlap are rejected")


class KinectFusionConfig(DepthConfig):
    """Frame-to-model tracking as in KinectFusion."""

    voxel_m: Positive = Field(0.01, description="edge of a voxel")
    min_fitness: Fraction = Field(0.3, description="tracking with less overlap is lost")


class PoseGraphConfig(Strict):
    """The two optimisers, with RTAB-Map's settings."""

    toro_iterations: Count = Field(100, description="passes over all edges")
    toro_epsilon: Positive = Field(1e-5, description="stop when the error changes less")
    lm_iterations: Count = Field(20, description="iterations of Levenberg-Marquardt (g2o)")


# By how much an injected error moves positions; see `baselines.labels.injected.moved_m`.
NoiseDose = Literal["text", "code"]


class EstimationConfig(Strict):
    """Label replacement as in section 4.1, and the dose of errors put into labels."""

    noise_dose: NoiseDose = Field(
        "text",
        description="metres that an injected error moves positions by: those that its row names, as"
        " the paper's text says, or √3 times as many, as its code moves them and print was made",
    )
    batch_frames: int = Field(250, ge=2, le=10**9, description="frames per batch")
    more_scenes: tuple[Slug, ...] = Field((), description="more scenes to count assistance in")
    assist_position_m: Positive = Field(0.20, description="assist a batch whose end is off by more")
    assist_orientation_deg: Positive = Field(10.0, description="or whose last orientation is")
    sfm: SfmConfig = part(SfmConfig, "structure from motion")
    rgbd: RgbdConfig = part(RgbdConfig, "RGB-D odometry")
    kinect_fusion: KinectFusionConfig = part(KinectFusionConfig, "frame-to-model tracking")
    posegraph: PoseGraphConfig = part(PoseGraphConfig, "pose-graph optimisers")
