"""Typed configuration of the learners: networks, training, pretraining."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from synfeal.config.collection import Count, Finite, Fraction, NonNegative, Positive, Slug, Strict


class NetworkConfig(Strict):
    """Shape shared by all localizers."""

    input_px: Annotated[int, Field(ge=32, le=1024)] = Field(
        224, description="side of the square input"
    )
    width: Annotated[float, Field(gt=0, le=1)] = Field(
        1.0, description="factor on the channels of every backbone; only 1 loads ImageNet weights"
    )


class LocalizerConfig(Strict):
    """Hyper-parameters of one localizer."""

    learning_rate: Positive = Field(
        1e-4, description="peak learning rate of the one-cycle schedule"
    )
    weight_decay: NonNegative = Field(1e-4, description="decoupled weight decay")
    dropout: Fraction = Field(0.5, description="dropout before the regressors")
    beta: Positive | None = Field(None, description="weight of the orientation term (beta losses)")
    s_position: Finite = Field(0.0, description="initial log-variance of position (learned losses)")
    s_orientation: Finite = Field(
        -3.0, description="initial log-variance of orientation (learned losses)"
    )


class TrainingConfig(Strict):
    """The one protocol all localizers are trained with."""

    batch_size: Count = Field(32, description="images per step")
    samples_seen: dict[str, Count] = Field(description="images shown in all, by data set size")
    repetitions: Count = Field(1, description="independent seeds per cell")
    device: Literal["auto", "cpu", "cuda"] = Field("auto", description="where to train")


class PretrainingConfig(Strict):
    """What `init: pretrained` starts from."""

    source: Literal["pretext", "imagenet"] = Field(
        "imagenet", description="`imagenet` downloads weights; `pretext` trains on another scene"
    )
    scene: Slug = Field("pretext_room", description="pretext: the scene to train the backbones on")
    frames: Count = Field(2000, description="pretext: frames to render (not scaled)")
    samples_seen: Count = Field(64_000, description="pretext: images shown in all")
    learning_rate: Positive = Field(1e-3, description="pretext: peak learning rate")
    weights_dir: Path = Field(Path("weights"), description="imagenet: where the files are kept")
