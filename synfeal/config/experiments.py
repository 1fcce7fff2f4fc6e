"""The paper's design as a table: which data set and which initialisation each table row needs."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from pydantic import Field, ValidationError, model_validator

from synfeal.config.load import describe
from synfeal.config.models import MODELS, Config, NonNegative, Strict
from synfeal.errors import InputError

Init = Literal["pretrained", "scratch"]
# What tells the rows of a table apart; a table shows each once.
KEYS: Mapping[str, tuple[str, ...]] = {
    "table2_ground_truth": ("scene", "labels"),
    "table3_inconsistencies": ("block", "noise_m", "noise_deg"),
    "table4_size": ("scene", "size"),
    "table5_from_scratch": ("scene", "size"),
}
COLUMNS = ("table", "block", "scene", "size", "labels", "noise_m", "noise_deg", "init")


class Experiment(Strict):
    """One table row: five cells, one per localizer."""

    table: Literal[
        "table2_ground_truth", "table3_inconsistencies", "table4_size", "table5_from_scratch"
    ] = Field(description="the table of the paper the row belongs to")
    block: Literal["", "orientation", "position", "both"] = Field(
        description="rows of table 3: its block; empty in the other tables"
    )
    scene: str = Field(description="a key of `scenes`")
    size: str = Field(description="a key of `scenes.<scene>.sizes` and of `training.samples_seen`")
    labels: str = Field(
        description="where the labels come from: `synfeal` the simulator's own poses, `noise` the "
        "same with noise, or a key of `METHODS` in `baselines/groundtruth/methods.py`: re-estimated"
    )
    noise_m: NonNegative = Field(description="nominal position noise, metres")
    noise_deg: NonNegative = Field(description="nominal orientation noise, degrees")
    init: Init = Field(description="weights a training starts from: `pretrained` or `scratch`")

    @model_validator(mode="after")
    def _check(self) -> Experiment:
        noisy = self.noise_m > 0 or self.noise_deg > 0
        if noisy != (self.labels == "noise"):
            raise ValueError("labels: must be `noise` exactly when noise_m or noise_deg is above 0")
        if (self.table == "table3_inconsistencies") != (self.block != ""):
            raise ValueError("block: rows of table 3, and only those, name one of three blocks")
        for name in ("noise_m", "noise_deg"):
            if float(f"{getattr(self, name):g}") != getattr(self, name):
                raise ValueError(f"{name}: at most six digits, for they name the label set")
        return self

    @property
    def label_id(self) -> str:
        """Directory name of the label set, e.g. ``sfm`` or ``noise-p0.1-r5``."""
        if self.labels != "noise":
            return self.labels
        return f"noise-p{self.noise_m:g}-r{self.noise_deg:g}"


@dataclass(frozen=True, order=True)
class Run:
    """One training: what the path of its results spells out."""

    scene: str
    size: str
    labels: str
    init: str
    model: str
    repetition: int

    @property
    def directory(self) -> str:
        """Path below ``<root>/runs``."""
        return (
            f"{self.scene}/{self.size}/{self.labels}/{self.init}/{self.model}/seed{self.repetition}"
        )


def read_experiments(config: Config) -> tuple[Experiment, ...]:
    """Read and check ``config.experiments`` against the scenes and sizes of the profile.

    Raises:
        InputError: naming file, row and column of the first problem.
    """
    path = config.experiments
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:  # spreadsheets add a mark
            reader = csv.DictReader(file)
            header = tuple(reader.fieldnames or ())
            rows = [(f"{path}: row {reader.line_num}", row) for row in reader]
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as CSV ({error})") from None
    if header != COLUMNS:
        raise InputError(f"{path}: the header must be {','.join(COLUMNS)}")
    experiments = tuple(_parse(row, where, config) for where, row in rows)
    if not experiments:
        raise InputError(f"{path}: has no rows; nothing would be run")
    places = [where for where, _ in rows]
    _refuse_repeats(experiments, places)
    if any(config.groundtruth_camera.distortion):
        _refuse_depth_methods(experiments, places)
    return experiments


def _refuse_repeats(experiments: Sequence[Experiment], places: Sequence[str]) -> None:
    seen: dict[tuple[str, ...], str] = {}
    for experiment, where in zip(experiments, places, strict=True):
        keys = KEYS[experiment.table]
        identity = (experiment.table, *(str(getattr(experiment, key)) for key in keys))
        if identity in seen:
            message = (
                f"{experiment.table} shows each {', '.join(keys)} once, as in {seen[identity]}"
            )
            raise InputError(f"{where}: {message}")
        seen[identity] = where


def _refuse_depth_methods(experiments: Sequence[Experiment], places: Sequence[str]) -> None:
    """Refuse labels that are estimated from depth; of the estimators only SfM knows distortion."""
    for experiment, where in zip(experiments, places, strict=True):
        if experiment.labels not in ("synfeal", "noise", "sfm"):
            raise InputError(
                f"{where}: labels '{experiment.labels}' need pinhole images; leave"
                " groundtruth_camera.distortion at zero (a calibration sets it) or drop the row"
            )


def _parse(row: dict[str, str], where: str, config: Config) -> Experiment:
    if None in row:
        raise InputError(f"{where}: has more cells than the {len(COLUMNS)} columns of the header")
    try:
        experiment = Experiment.model_validate(row)
    except ValidationError as error:
        raise InputError(f"{where}: {describe(error)}") from None
    if experiment.scene not in config.scenes:
        raise InputError(f"{where}: scene '{experiment.scene}': allowed: {sorted(config.scenes)}")
    if config.pretraining.source == "pretext" and experiment.scene == config.pretraining.scene:
        raise InputError(
            f"{where}: scene '{experiment.scene}': is what pretraining.scene trains on"
        )
    sizes = config.scenes[experiment.scene].sizes
    if experiment.size not in sizes:
        raise InputError(f"{where}: size '{experiment.size}': allowed: {sorted(sizes)}")
    if experiment.size not in config.training.samples_seen:
        raise InputError(f"{where}: size '{experiment.size}' has no training.samples_seen entry")
    return experiment


def runs_of(experiments: tuple[Experiment, ...], repetitions: int) -> list[Run]:
    """All distinct trainings behind some table rows; rows may share them."""
    runs = {
        Run(e.scene, e.size, e.label_id, e.init, model, repetition)
        for e in experiments
        for model in MODELS
        for repetition in range(repetitions)
    }
    return sorted(runs)


assert set(KEYS) == set(get_args(Experiment.model_fields["table"].annotation))
