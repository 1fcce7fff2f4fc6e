"""Tables of training runs: their names, what their rows differ in, how often runs are repeated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

from pydantic import Field, ValidationInfo, field_validator

from baselines.config.learning import ModelName, TrainingConfig
from synfeal.config.types import Count

TableName = Literal[
    "table2_ground_truth",
    "table3_inconsistencies",
    "table4_size",
    "table5_from_scratch",
    "table6_label_errors",
    "table7_images_shown",
]
# A table shows each combination of these columns once.
KEYS: Mapping[str, tuple[str, ...]] = {
    "table2_ground_truth": ("scene", "labels"),
    "table3_inconsistencies": ("block", "noise_m", "noise_deg"),
    "table4_size": ("scene", "size"),
    "table5_from_scratch": ("scene", "size"),
    "table6_label_errors": ("labels", "noise_m", "noise_deg"),
    "table7_images_shown": ("scene", "size", "init"),
}
assert set(KEYS) == set(get_args(TableName))

DEFAULT = "default"
# Seeds per run of a table, of a localizer or of a size; `DEFAULT` where none of them is named.
Repetitions = dict[str, Count]


class RepeatedTraining(TrainingConfig):
    """Training of all localizers, and its repetitions."""

    repetitions: Repetitions = Field(
        {DEFAULT: 1},
        description="seeds per run, by table, localizer or size; a run that several of them name"
        " gets the most",
    )

    @field_validator("repetitions")
    @classmethod
    def _are_named(cls, repetitions: Repetitions, info: ValidationInfo) -> Repetitions:
        """Refuse names that no run could have."""
        known = [DEFAULT, *KEYS, *get_args(ModelName), *info.data.get("samples_seen", ())]
        for name in repetitions:
            if name not in known:
                raise ValueError(f"{name!r} is not one of {', '.join(known)}")
        return repetitions
