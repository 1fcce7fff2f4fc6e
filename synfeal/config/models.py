"""Typed configuration; all models are imported from here.

A stage takes the model it needs, so a change re-runs its readers only.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal, Self

from pydantic import Field, model_validator

from synfeal.config.collection import (
    Angles,
    Box,
    CollectionConfig,
    Count,
    Fraction,
    NonNegative,
    Positive,
    SceneConfig,
    Slug,
    Strict,
    part,
)
from synfeal.config.dataset import CameraConfig, DatasetConfig, RenderConfig
from synfeal.config.effects import EffectsConfig, RobustnessConfig
from synfeal.config.learning import (
    SHIPPED_WIDTH,
    AugmentationConfig,
    ExternalConfig,
    LocalizerConfig,
    NetworkConfig,
    PretrainingConfig,
    ReferencesConfig,
    TrainingConfig,
)

MODELS = ("posenet", "poselstm", "hourglass", "posenet2resnet", "posenet2")
ModelName = Literal["posenet", "poselstm", "hourglass", "posenet2resnet", "posenet2"]


class RenderSpeedConfig(Strict):
    """How speed and error of rendering are measured, for `speed_vs_error.csv`."""

    poses: Count = Field(6, description="views of each scene; half as many at the larger sizes")
    sizes: int = Field(
        3,
        ge=1,
        le=3,
        description="how many of network_camera, groundtruth_camera and 640 × 480, smallest first",
    )


class SfmConfig(Strict):
    """Structure from motion with pycolmap."""

    max_features: Count = Field(2000, description="SIFT features per image")
    peak_threshold: Positive = Field(0.0067, description="SIFT: least contrast; white is 1")
    overlap: Count = Field(5, description="images further on that each image is matched with")
    quadratic_overlap: bool = Field(True, description="these: 1, 2, 4, 8, …, else 1, 2, 3, 4, …")
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

    voxel_m: Positive = Field(0.02, description="edge of a voxel")
    min_fitness: Fraction = Field(0.3, description="tracking with less overlap is lost")


class PoseGraphConfig(Strict):
    """The two optimisers, with RTAB-Map's settings."""

    toro_iterations: Count = Field(100, description="passes over all edges")
    toro_epsilon: Positive = Field(1e-5, description="stop when the error changes less")
    lm_iterations: Count = Field(20, description="iterations of Levenberg-Marquardt (g2o)")


class GroundTruthConfig(Strict):
    """Label replacement as in section 4.1."""

    batch_frames: int = Field(250, ge=2, le=10**9, description="frames per batch")
    more_scenes: tuple[Slug, ...] = Field((), description="more scenes to count assistance in")
    assist_position_m: Positive = Field(0.20, description="assist a batch whose end is off by more")
    assist_orientation_deg: Positive = Field(10.0, description="or whose last orientation is")
    sfm: SfmConfig = part(SfmConfig, "structure from motion")
    rgbd: RgbdConfig = part(RgbdConfig, "RGB-D odometry")
    kinect_fusion: KinectFusionConfig = part(KinectFusionConfig, "frame-to-model tracking")
    posegraph: PoseGraphConfig = part(PoseGraphConfig, "pose-graph optimisers")


class Config(DatasetConfig):
    """A profile: everything a run depends on."""

    experiments: Path = Field(Path("config/experiments.csv"), description="the design as a table")
    datasets: tuple[Slug, ...] | None = Field(
        None, description="scenes of the target `datasets`; null: those of the design"
    )
    groundtruth_camera: CameraConfig = part(CameraConfig, "of frames labels are estimated from")
    render_speed: RenderSpeedConfig = part(RenderSpeedConfig, "what rendering is measured on")
    groundtruth: GroundTruthConfig = part(GroundTruthConfig, "labels (docs/groundtruth.md)")
    references: ReferencesConfig = part(ReferencesConfig, "other methods (docs/references.md)")
    robustness: RobustnessConfig = part(RobustnessConfig, "tests with effects (docs/variation.md)")
    network: NetworkConfig = part(NetworkConfig, "shape of all localizers")
    training: TrainingConfig = Field(description="docs/localizers.md")
    pretraining: PretrainingConfig = part(PretrainingConfig, "what runs start from (docs/start.md)")
    localizers: dict[ModelName, LocalizerConfig] = Field(description="hyper-parameters of each")

    @model_validator(mode="after")
    def _check(self) -> Self:
        missing = [name for name in MODELS if name not in self.localizers]
        if missing:
            raise ValueError(f"localizers: {', '.join(missing)} missing; all five are compared")
        if self.pretraining.source == "imagenet" and self.network.width != 1.0:
            raise ValueError("network.width: must be 1 when pretraining.source is imagenet")
        if self.pretraining.source == "shipped" and self.network.width != SHIPPED_WIDTH:
            raise ValueError(
                f"network.width: must be {SHIPPED_WIDTH} when pretraining.source is shipped"
            )
        unknown = sorted(set(self.datasets or ()) - set(self.scenes))
        if unknown:
            raise ValueError(f"datasets: '{unknown[0]}' is not one of {sorted(self.scenes)}")
        if self.pretraining.source == "rooms" and not self.rooms:
            raise ValueError("pretraining.source: rooms needs scenes with `builder: random_room`")
        camera = self.network_camera
        least = self.network.input_px + (self.network.view == "square")
        if min(camera.width, camera.height) < least:
            raise ValueError(
                f"network_camera: both sides must be at least {least} pixels for"
                f" network.input_px {self.network.input_px} and this network.view"
            )
        return self

    @property
    def rooms(self) -> list[str]:
        """Scenes that backbones are pretrained on: no table has them."""
        return [name for name, scene in self.scenes.items() if scene.builder == "random_room"]

    def n_largest(self, scene: str, split: str) -> int:
        """Frames planned and rendered for a split: those of the scene's largest size."""
        if scene in self.rooms:
            return self.pretraining.frames if split == "train" else 2
        return max(self.n_frames(scene, size, split) for size in self.scenes[scene].sizes)
