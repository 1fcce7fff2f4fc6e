"""The paper's design as a table: data set, labels and initialisation of each row."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast

from pydantic import Field, ValidationError, model_validator

from baselines.config.labels import NoiseDose
from baselines.config.learning import MODELS, ModelName
from baselines.labels.injected import LABEL_ERRORS, moved_m
from reproduction.config.profile import Config
from reproduction.config.tables import DEFAULT, KEYS, Repetitions, TableName
from reproduction.design.label_sets import LabelSet
from synfeal.config.load import describe
from synfeal.config.types import NonNegative, Strict
from synfeal.errors import InputError
from synfeal.records.provenance import seed_of
from synfeal.records.tables import read_records

Start = Literal["pretrained", "scratch"]
Init = Literal[
    "pretrained",
    "pretrained-half",
    "pretrained-quarter",
    "scratch",
    "scratch-half",
    "scratch-quarter",
]
# Share of `training.samples_seen` that a run is shown, by how its `init` ends.
SHARES = {"": 1.0, "half": 0.5, "quarter": 0.25}
# Errors that are put into true poses, of a size that noise_m and noise_deg name.
INJECTED = tuple(LABEL_ERRORS)
FROM_SCRATCH: TableName = "table5_from_scratch"


class Experiment(Strict):
    """One table row: five cells, one per localizer."""

    table: TableName = Field(description="tables 6 and 7 are our own")
    block: Literal["", "orientation", "position", "both"] = Field("", description="only of table 3")
    scene: str = Field(description="a key of `scenes`")
    size: str = Field(description="a key of `scenes.<scene>.sizes` and of `training.samples_seen`")
    labels: str = Field(
        "synfeal",
        description="`synfeal`: true poses; `noise`, `offset`, `bend`, `scale`, `drift`: with an"
        " error (docs/tables.md); or a label method (docs/estimation.md)",
    )
    noise_m: NonNegative = Field(
        0.0,
        description="median position error put into labels, metres, as `estimation.noise_dose`"
        " reads it",
    )
    noise_deg: NonNegative = Field(
        0.0, description="the same of orientation, degrees; 0 with `scale`"
    )
    init: Init = Field("pretrained", description="start, and share of `training.samples_seen`")

    @model_validator(mode="after")
    def _check(self) -> Experiment:
        noisy = self.noise_m > 0 or self.noise_deg > 0
        if noisy != (self.labels in INJECTED):
            kinds = ", ".join(f"`{kind}`" for kind in INJECTED)
            raise ValueError(
                f"labels: must be one of {kinds} exactly when noise_m or noise_deg is above 0"
            )
        turns = self.labels not in LABEL_ERRORS or LABEL_ERRORS[self.labels].turns
        if not turns and (self.noise_deg or not self.noise_m):
            raise ValueError(
                f"noise_deg: must be 0 with labels `{self.labels}`, which turn nothing"
            )
        if (self.table == "table3_inconsistencies") != (self.block != ""):
            raise ValueError("block: rows of table 3, and only those, name one of three blocks")
        for name in ("noise_m", "noise_deg"):
            if float(f"{getattr(self, name):g}") != getattr(self, name):
                raise ValueError(f"{name}: at most six digits, for they name the label set")
        return self

    @property
    def estimated(self) -> bool:
        """True where a method re-estimated the labels."""
        return self.labels not in ("synfeal", *INJECTED)

    @property
    def label_id(self) -> str:
        """Directory name of the label set, e.g. ``sfm`` or ``noise-p0.1-r5``."""
        return str(LabelSet(self.labels, self.noise_m, self.noise_deg))

    @property
    def pretrained(self) -> Experiment:
        """The same data set, trained with transfer learning."""
        return self.model_copy(update={"init": "pretrained"})


COLUMNS = tuple(Experiment.model_fields)


@dataclass(frozen=True, order=True)
class Run:
    """One training run: what the path of its results spells out."""

    scene: str
    size: str
    labels: str
    init: str
    model: str
    repetition: int

    @property
    def start(self) -> Start:
        """Origin of the first weights."""
        return split_init(self.init)[0]

    @property
    def share(self) -> float:
        """Share of the images of its size that it is shown."""
        return SHARES[split_init(self.init)[1]]

    def seed(self, profile_seed: int) -> int:
        """Hash what the run is, leaving out its labels and how many images it is shown.

        So runs that differ in their labels alone have the same initial weights, held-out paths,
        order and rotations: a comparison of labels is paired.
        """
        return seed_of(
            profile_seed,
            "train",
            self.scene,
            self.size,
            self.start,
            self.model,
            self.repetition,
        )

    @property
    def directory(self) -> str:
        """Path below ``<root>/runs``."""
        return (
            f"{self.scene}/{self.size}/{self.labels}/{self.init}/{self.model}/seed{self.repetition}"
        )


def split_init(init: str) -> tuple[Start, str]:
    """Split ``init`` into the start of the weights and its ending, a key of ``SHARES``."""
    start, _, part = init.partition("-")
    return cast(Start, start), part


def read_experiments(config: Config) -> tuple[Experiment, ...]:
    """Read the rows of ``config.experiments`` that ``config.tables`` asks for.

    All rows are checked against the scenes and sizes of the profile. Errors name file, or the
    configuration's key, with row and column.
    """
    return _of_asked_tables(_every_row(config), config)


def _of_asked_tables(rows: Sequence[Experiment], config: Config) -> tuple[Experiment, ...]:
    """Select the rows that ``config.tables`` asks for; refuse a design without any."""
    asked = [row for row in rows if config.tables is None or row.table in config.tables]
    if not asked:
        of = "" if config.tables is None else f" of tables {', '.join(config.tables)}"
        raise InputError(design_name(config), f"has no rows{of}; nothing would be run")
    return tuple(asked)


def _every_row(config: Config) -> tuple[Experiment, ...]:
    """Read and check all rows, those of tables that are not asked for, too."""
    seen: dict[tuple[str, ...], str] = {}
    experiments = []
    for where, row in _given_rows(config):
        try:
            experiment = Experiment.model_validate(row)
        except ValidationError as error:
            raise InputError(where, describe(error)) from error
        keys = KEYS[experiment.table]
        identity = (experiment.table, *(str(getattr(experiment, key)) for key in keys))
        problem = _problem(experiment, config)
        if identity in seen:
            shown = f"{experiment.table} shows each {', '.join(keys)} once"
            problem = f"{shown}, as in {seen[identity]}"
        if problem:
            raise InputError(where, problem)
        seen[identity] = where
        experiments.append(experiment)
    return tuple(experiments)


def idle_scenes(config: Config) -> list[str]:
    """List the scenes of which nothing in a profile asks for frames."""
    asked = {row.scene for row in _every_row(config)}
    asked.update(config.datasets or (), config.rooms, config.estimation.more_scenes)
    if config.robustness.effects:
        asked.add(config.robustness.scene)
    return [scene for scene in config.scenes if scene not in asked]


def design_name(config: Config) -> str:
    """Name the design in error lines: by its file, or by the key that holds its rows."""
    given = config.experiments
    return str(given) if isinstance(given, Path) else "experiments"


def _given_rows(config: Config) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield every row as it is given, after the words that say where; nothing is checked."""
    given = config.experiments
    for number, part in enumerate((given,) if isinstance(given, Path) else given, start=1):
        if isinstance(part, Path):
            header = f"the header must be {','.join(COLUMNS)}"
            rows = read_records(part, COLUMNS, header)
            yield from ((f"{part}: row {line}", row) for line, row in rows)
        else:
            yield f"experiments: row {number}", part


def _problem(row: Experiment, config: Config) -> str:
    """Say why a profile cannot run a row; nothing where it can."""
    if row.scene not in config.scenes:
        return f"scene '{row.scene}': allowed: {sorted(config.scenes)}"
    if row.scene in config.rooms:
        return f"scene '{row.scene}': is a room that backbones are pretrained on"
    sizes = config.scenes[row.scene].sizes
    if row.size not in sizes:
        return f"size '{row.size}': allowed: {sorted(sizes)}"
    if not sizes[row.size].test:
        return f"size '{row.size}' has no test frames to score on"
    if row.size not in config.training.samples_seen:
        return f"size '{row.size}' has no training.samples_seen entry"
    if any(config.estimation_camera.distortion) and row.estimated and row.labels != "sfm":
        return (
            f"labels '{row.labels}' need pinhole images; leave estimation_camera.distortion at"
            " zero (a calibration sets it) or drop the row"
        )
    return ""


class Design(Strict):
    """Rows of tables and how often each of their runs is repeated.

    A run has a name of its own, not a table's: tables that show the same one share it, repetition
    by repetition, and each uses as many as there are.
    """

    rows: tuple[Experiment, ...] = Field(description="in the order of the file")
    repetitions: Repetitions = Field(description="`training.repetitions`")
    more_scenes: tuple[str, ...] = Field((), description="`estimation.more_scenes`")
    noise_dose: NoiseDose = Field("text", description="`estimation.noise_dose`")

    @property
    def estimated(self) -> list[tuple[str, str, str]]:
        """Scene, size and labels of every label set that a method re-estimates."""
        own = [(row.scene, row.size, row.labels) for row in self.rows if row.estimated]
        more = [(scene, size, labels) for scene in self.more_scenes for _, size, labels in own]
        return list(dict.fromkeys([*own, *more]))

    @property
    def tables(self) -> list[str]:
        """The tables that have rows."""
        return sorted({row.table for row in self.rows})

    @property
    def runs(self) -> list[Run]:
        """Every run, each once, as often as its tables, its localizer or its size ask for."""
        runs = {
            Run(e.scene, e.size, e.label_id, e.init, model, repetition)
            for row in self.rows
            for e in _compared(row)
            for model in MODELS
            for repetition in range(self._asked(row.table, model, e.size))
        }
        return sorted(runs)

    def moved_m(self, row: Experiment) -> float:
        """Return the distance that the errors of a row move positions by, metres."""
        return moved_m(row.noise_m, self.noise_dose)

    def rows_of(self, table: str) -> list[Experiment]:
        """List the rows of one table."""
        return [row for row in self.rows if row.table == table]

    def runs_of(self, row: Experiment, model: str) -> list[Run]:
        """List all repetitions of a cell, whichever table asked for them."""
        cell = (row.scene, row.size, row.label_id, row.init)
        asked = [
            self._asked(other.table, model, row.size)
            for other in self.rows
            for e in _compared(other)
            if (e.scene, e.size, e.label_id, e.init) == cell
        ]
        return [
            Run(row.scene, row.size, row.label_id, row.init, model, repetition)
            for repetition in range(max(asked, default=0))
        ]

    def table_runs(self, table: str) -> list[Run]:
        """List every run a table reads."""
        rows = [e for row in self.rows_of(table) for e in _compared(row)]
        return sorted({run for row in rows for model in MODELS for run in self.runs_of(row, model)})

    def _asked(self, table: TableName, model: ModelName, size: str) -> int:
        named = [self.repetitions[n] for n in (table, model, size) if n in self.repetitions]
        return max(named, default=self.repetitions.get(DEFAULT, 1))


def common_every(counts: Collection[int]) -> int:
    """Choose ``k`` so that every k-th frame of a scene's largest test set is in its common one.

    That has about as many frames as the smallest of the test sets, of ``counts`` frames.
    """
    return max(counts) // min(counts)


def read_design(config: Config) -> Design:
    """Read the design of a profile with :func:`read_experiments`, and what its further scenes need.

    Raises:
        InputError: a row, a further scene, or the data set of the robustness table is wrong.
    """
    _check_robustness(config)
    every_row = _every_row(config)
    whole = Design(
        rows=every_row,
        repetitions=config.training.repetitions,
        more_scenes=config.estimation.more_scenes,
        noise_dose=config.estimation.noise_dose,
    )
    missing = _without_frames(whole)
    if missing:
        scene, size = missing[0]
        raise InputError(
            "estimation.more_scenes",
            f"'{scene}': {design_name(config)} has no row of size '{size}' in that scene",
        )
    # `tables` may leave out every row of a further scene: then its labels are left out, too.
    design = whole.model_copy(update={"rows": _of_asked_tables(every_row, config)})
    left_out = {scene for scene, _ in _without_frames(design)}
    kept = tuple(scene for scene in design.more_scenes if scene not in left_out)
    return design.model_copy(update={"more_scenes": kept})


def _without_frames(design: Design) -> list[tuple[str, str]]:
    """List scenes and sizes whose labels are to be estimated and that no row collects."""
    known = {(row.scene, row.size) for row in design.rows}
    return [(scene, size) for scene, size, _ in design.estimated if (scene, size) not in known]


def _check_robustness(config: Config) -> None:
    """Refuse a robustness table of a data set that the profile does not define."""
    scene, size = config.robustness.scene, config.robustness.size
    if not config.robustness.effects:
        return
    if scene not in config.scenes:
        known = sorted(config.scenes)
        raise InputError("robustness.scene", f"'{scene}' is not one of {known}")
    if size not in config.scenes[scene].sizes:
        known = sorted(config.scenes[scene].sizes)
        raise InputError(
            "robustness.size", f"'{size}' is not one of {known}, the sizes of '{scene}'"
        )


def _compared(row: Experiment) -> list[Experiment]:
    """List a row and what its table compares it with: in Table 5 the run with transfer learning."""
    return [row, row.pretrained] if row.table == FROM_SCRATCH else [row]
