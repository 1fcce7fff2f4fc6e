"""Typed configuration of the learners and what they are compared with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from synfeal.config.collection import Count, Finite, Fraction, NonNegative, Positive, Slug, Strict
from synfeal.config.tables import Repetitions, once

InceptionName = Literal["googlenet", "inception_v3"]
# Of the backbones that come with the package.
SHIPPED_WIDTH = 0.25
# A smaller image leaves nothing of its last maps: its reductions have no padding.
INCEPTION_V3_MIN_PX = 75


class NetworkConfig(Strict):
    """Shape shared by all localizers."""

    backbone: InceptionName = Field(
        "googlenet",
        description="what PoseNet, PoseLSTM and PoseNet2 stand on: `googlenet` as in their papers,"
        " `inception_v3` as in the Synfeal authors' code (299 pixels there, at least 75)",
    )
    input_px: Annotated[int, Field(ge=32, le=1024)] = Field(
        224, description="side of the square input"
    )
    view: Literal["square", "whole"] = Field(
        "square",
        description="what of a frame the network sees: its central `square`, as in the authors'"
        " code, or the `whole` of it, squeezed into a square",
    )
    width: Annotated[float, Field(gt=0, le=1)] = Field(
        1.0, description="factor on the channels of every backbone; only 1 loads ImageNet weights"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.backbone == "inception_v3" and self.input_px < INCEPTION_V3_MIN_PX:
            raise ValueError(
                f"input_px: must be at least {INCEPTION_V3_MIN_PX} with `backbone: inception_v3`,"
                f" found {self.input_px}"
            )
        return self


class LocalizerConfig(Strict):
    """Hyper-parameters of one localizer."""

    learning_rate: Positive = Field(
        1e-4, description="highest learning rate; Muon's is 20 times as high"
    )
    weight_decay: NonNegative = Field(1e-4, description="decoupled weight decay")
    dropout: Fraction = Field(0.5, description="dropout before the regressors")
    skip: Literal["sum", "concatenation"] = Field(
        "sum",
        description="Hourglass alone: how its decoder joins the encoder's maps; the Synfeal"
        " authors' code concatenates",
    )
    beta: Positive | None = Field(None, description="weight of the orientation term (beta losses)")
    s_position: Finite = Field(0.0, description="initial log-variance of position (learned losses)")
    s_orientation: Finite = Field(
        -3.0, description="initial log-variance of orientation (learned losses)"
    )


class AugmentationConfig(Strict):
    """Rotation augmentation: each image as if its camera had been rotated, and its label with it.

    Angles are drawn anew whenever an image is shown. Exact for pinhole cameras; what the frame did
    not see is filled with its border.
    """

    tilt_deg: Annotated[float, Field(ge=0, le=45)] = Field(
        0.0, description="largest turn about the camera's x and y axes"
    )
    roll_deg: Annotated[float, Field(ge=0, le=180)] = Field(
        0.0, description="largest turn about its optical axis"
    )

    @property
    def turns(self) -> bool:
        """Whether anything changes."""
        return max(self.tilt_deg, self.roll_deg) > 0


class TrainingConfig(Strict):
    """How all localizers are trained."""

    protocol: Literal["corrected", "published"] = Field(
        "corrected",
        description="`corrected`: frames shuffled, weights chosen on training paths that are held"
        " out, Euclidean norms, Muon, a rate that rises and falls; `published`, as in the Synfeal"
        " authors' code: frames in the order of collection, weights chosen on the test set, mean"
        " squared errors, learning rate halved at intervals",
    )
    validation_share: Annotated[float, Field(ge=0, lt=1)] = Field(
        0.1,
        description="`corrected`: share of the training paths that are held out to choose the"
        " weights (at least one path); 0 learns from all and keeps the last weights",
    )
    patience: Count | None = Field(
        None,
        description="`published`: evaluations (20 in a training run) without a new best after which"
        " training stops; not with `corrected`, whose cycle makes most of its gain at the end,"
        " when the rate falls",
    )
    augmentation: AugmentationConfig = Field(
        default_factory=AugmentationConfig,
        description="`corrected`: random rotations of the camera",
    )
    precision: Literal["auto", "float32", "bfloat16"] = Field(
        "auto",
        description="what networks compute in; `auto`: bfloat16 where the device multiplies in it,"
        " else float32",
    )
    batch_size: Count = Field(32, description="images per step")
    samples_seen: dict[str, Count] = Field(description="images shown in all, by data set size")
    repetitions: Repetitions = Field(
        default_factory=once,
        description="seeds per cell, by table (`table2_ground_truth`, ...), `default` for the rest;"
        " a run that several tables show is repeated as often as any of them asks",
    )
    device: Literal["auto", "cpu", "cuda"] = Field("auto", description="where to train")

    @model_validator(mode="after")
    def _check_patience(self) -> Self:
        if self.patience is not None and self.protocol == "corrected":
            raise ValueError(
                "patience: must be left out with `protocol: corrected`, whose learning rate follows"
                " a course of a length known beforehand; lower samples_seen instead"
            )
        return self


class PretrainingConfig(Strict):
    """What `init: pretrained` starts from."""

    source: Literal["shipped", "rooms", "imagenet"] = Field(
        "shipped",
        description="`shipped`: weights that come with the package (docs/start.md), of a quarter of"
        " the width; `rooms` makes such weights anew, on all scenes with `builder: random_room`;"
        " `imagenet` downloads weights",
    )
    frames: Count = Field(3000, description="rooms: frames to render of each (not scaled)")
    samples_seen: Count = Field(64_000, description="rooms: images shown in all")
    batch_size: Count = Field(64, description="rooms: images per step")
    learning_rate: Positive = Field(1e-3, description="rooms: peak learning rate")
    augmentation: AugmentationConfig = Field(
        default_factory=AugmentationConfig, description="rooms: random rotations of the camera"
    )
    weights_dir: Path = Field(Path("weights"), description="imagenet: where the files are kept")


class ExternalConfig(Strict):
    """A localizer of somebody else's: a command that is run, or files of poses that are read.

    `{scene}`, `{size}` and `{labels}` are filled in, so that there is one for every data set.
    """

    title: str = Field(description="as tables and figures call it")
    poses: str = Field(
        "",
        description="path of its answers, a table of poses (docs/references.md), e.g."
        " `mine/{scene}-{size}-{labels}.csv`",
    )
    command: str = Field(
        "",
        description="what writes them instead, with `{train_frames}`, `{train_labels}`,"
        " `{test_frames}`, `{n_test}` and `{out}` filled in too",
    )
    labels: list[str] = Field(
        default_factory=list, description="label sets it answers for; empty: all of the design"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if bool(self.poses) == bool(self.command):
            raise ValueError("give either `poses` or `command`, not both or neither")
        return self


class ReferencesConfig(Strict):
    """Methods that localizers are read against: retrieval, structure-based poses."""

    max_features: Count = Field(1000, description="structure: SIFT features per image")
    contrast: Positive = Field(
        0.013, description="structure: least contrast of a feature, on OpenCV's scale (its 0.04)"
    )
    retrieved: Count = Field(
        20, description="structure: training images that a test image is matched with"
    )
    coordinate_samples: Count = Field(
        2000, description="scene coordinates: images shown to the network in all"
    )
    external: dict[Slug, ExternalConfig] = Field(
        default_factory=dict, description="localizers of somebody else's, by name"
    )
