"""Tables of training runs: their names, what their rows differ in, how often runs are repeated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal, get_args

from pydantic import Field

from baselines.config.learning import ModelName, TrainingConfig
from synfeal.config.collection import Count

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

if TYPE_CHECKING:
    Repeated = str
else:
    Repeated = Literal["default", TableName, ModelName]

# Seeds per run of a table or of a localizer; `default` where neither is named.
Repetitions = dict[Repeated, Count]


class RepeatedTraining(TrainingConfig):
    """Training of all localizers, and its repetitions."""

    repetitions: Repetitions = Field(
        {"default": 1},
        description="seeds per run, by table or localizer; a run that several of them name gets"
        " the most",
    )
