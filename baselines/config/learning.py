"""Typed configuration of localizers and their training."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import BeforeValidator, Field, SerializeAsAny, ValidationError, model_validator

from baselines.registry.declarations import declared
from baselines.registry.kinds import LocalizerKind
from synfeal.config.load import describe
from synfeal.config.photometric import PhotometricConfig
from synfeal.config.types import Count, Finite, Fraction, NonNegative, Positive, Strict, part

InceptionName = Literal["googlenet", "inception_v3"]
# Of the backbones that come with the package.
SHIPPED_WIDTH = 0.25
# A smaller image leaves nothing of its last maps: its reductions have no padding.
INCEPTION_V3_MIN_PX = 75


class NetworkConfig(Strict):
    """Shape shared by all localizers."""

    backbone: InceptionName = Field(
        "googlenet", description="of PoseNet, PoseLSTM and PoseNet2; `inception_v3` needs 75 px"
    )
    input_px: int = Field(224, ge=32, le=1024, description="side of the square input")
    view: Literal["square", "whole"] = Field(
        "square", description="what it sees: a frame's central square, or the whole of it, squeezed"
    )
    width: float = Field(1.0, gt=0, le=1, description="factor on channels; ImageNet weights need 1")

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

    learning_rate: Positive = Field(1e-4, description="peak; Muon's is 20 times as high")
    weight_decay: NonNegative = Field(1e-4, description="decoupled weight decay")
    dropout: Fraction = Field(0.5, description="dropout before the regressors")
    skip: Literal["sum", "concatenation"] = Field(
        "sum", description="Hourglass: how its decoder joins the encoder's maps"
    )
    auxiliary: bool = Field(
        True,
        description="PoseNet, PoseLSTM, PoseNet2: two auxiliary regressors, as in the Synfeal"
        " authors' code; in their papers PoseNet alone has them",
    )
    beta: Positive | None = Field(None, description="weight of the orientation (beta losses)")
    s_position: Finite = Field(0.0, description="initial log-variance (learned losses)")
    s_orientation: Finite = Field(-3.0, description="initial log-variance (learned losses)")


class AugmentationConfig(Strict):
    """Rotation augmentation: each image as if its camera had been rotated, and its label with it.

    Angles are drawn anew whenever an image is shown. Exact for pinhole cameras; what the frame did
    not see is filled with its border.
    """

    tilt_deg: float = Field(0.0, ge=0, le=45, description="largest rotation about camera x and y")
    roll_deg: float = Field(0.0, ge=0, le=180, description="largest rotation about camera z")

    @property
    def turns(self) -> bool:
        """Return whether images are rotated at all."""
        return max(self.tilt_deg, self.roll_deg) > 0


class TrainingConfig(Strict):
    """Training settings shared by all localizers."""

    unless_none = ("randomisation",)

    protocol: Literal["corrected", "published"] = Field(
        "corrected", description="docs/localizers.md; `published`: as the Synfeal authors' code"
    )
    validation_share: float = Field(
        0.1,
        ge=0,
        lt=1,
        description="`corrected`: share of the training paths held out to choose weights; 0: keep"
        " the last weights",
    )
    patience: Count | None = Field(
        None, description="`published`: stop after so many evaluations (of 20) without a new best"
    )
    augmentation: AugmentationConfig = part(AugmentationConfig, "`corrected`: rotations of images")
    randomisation: PhotometricConfig | None = Field(
        None, description="other light, lens and sensor for every image shown; null: none"
    )
    precision: Literal["auto", "float32", "bfloat16"] = Field(
        "auto", description="`auto`: bfloat16 where the device multiplies in it"
    )
    batch_size: Count = Field(32, description="images per step")
    samples_seen: dict[str, Count] = Field(description="images shown in all, by size")
    device: Literal["auto", "cpu", "cuda"] = Field("auto", description="where to train")

    @model_validator(mode="after")
    def _check_patience(self) -> Self:
        if self.patience is not None and self.protocol == "corrected":
            raise ValueError(
                "patience: must be left out with `protocol: corrected`, whose learning rate follows"
                " a schedule of known length; lower samples_seen instead"
            )
        return self


class PretrainingConfig(Strict):
    """Weights that `init: pretrained` starts from."""

    source: Literal["shipped", "rooms", "imagenet"] = Field(
        "shipped",
        description="`shipped`: the package's weights; `rooms`: made anew, on scenes with"
        " `builder: random_room`; `imagenet`: downloaded",
    )
    frames: Count = Field(3000, description="rooms: frames of each (not scaled)")
    samples_seen: Count = Field(64_000, description="rooms: images shown in all")
    batch_size: Count = Field(64, description="rooms: images per step")
    learning_rate: Positive = Field(1e-3, description="rooms: peak learning rate")
    augmentation: AugmentationConfig = part(AugmentationConfig, "rooms: rotation augmentation")
    weights_dir: Path = Field(Path("weights"), description="imagenet: where files are kept")


LOCALIZERS = declared(LocalizerKind)
MODELS = tuple(LOCALIZERS)
if TYPE_CHECKING:
    ModelName = str
else:
    ModelName = Literal[MODELS]


def hyper_of(name: str) -> type[LocalizerConfig]:
    """Return the model of a localizer's hyper-parameters."""
    model: type[LocalizerConfig] = resolve_name(LOCALIZERS[name].hyper)
    return model


def _by_own_models(values: object) -> object:
    """Read the hyper-parameters of localizers of other packages by their own models.

    Those that are not named get their defaults.
    """
    if not isinstance(values, Mapping):
        return values
    read = dict(values)
    for name, kind in LOCALIZERS.items():
        if not kind.place.startswith("baselines."):
            try:
                read[name] = hyper_of(name).model_validate(read.get(name, {}))
            except ValidationError as error:
                raise ValueError(f"{name}.{describe(error)}") from error
    return read


# Hyper-parameters by name of the localizer.
Localizers = Annotated[
    dict[ModelName, SerializeAsAny[LocalizerConfig]], BeforeValidator(_by_own_models)
]
