"""Archive of one replication: errors per test frame, label errors, seconds, provenance.

``errors.parquet`` has a row per trained localizer and archived test frame. Every third frame of a
test set is archived: neighbours 3 cm apart are nearly the same picture. Effects are computed from
the archive alone, so that whoever has it can compute them, too.

An archive may be of an unfinished run. Another run, on another machine perhaps, then makes what
remains (:func:`remaining`), and is archived into the same place.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from reproduction.claims.effects import OWN, Against
from reproduction.claims.evidence import COMMON, SCORES, Cell, Evidence, cell_of, evidence_of
from reproduction.config.profile import Config
from reproduction.design.experiments import Design, Run, read_design
from reproduction.design.files import SPLITS, Files
from reproduction.runs.job_times import read_measured
from reproduction.runs.results import read_text
from reproduction.statistics.limits import MEASURES, REMEDY, read_errors
from reproduction.tables.label_error import SCHEMA as LABEL_ERROR_SCHEMA
from synfeal.errors import InputError
from synfeal.evaluation.bootstrap import Array, medians, path_counts
from synfeal.records.files import atomic_directory, write_json
from synfeal.records.provenance import config_hash, generator_of, git_commit, provenance
from synfeal.records.tables import read_frame

ERRORS = "errors.parquet"
LABEL_TABLES = ASSISTANCE, LABEL_ERROR = "assistance.csv", "label_error.csv"
SECONDS, PROVENANCE = "seconds.parquet", "provenance.json"
EVERY = 3  # every third test frame is kept
RESAMPLES = 1000  # resamples of the test paths: enough for a standard error
KEYS = ("scene", "size", "labels", "init", "model", "test_set")
# Whole millimetres and hundredths of a degree: both below a thousandth of a median error.
UNITS = {"position_mm": 1000.0, "orientation_cdeg": 100.0}
FAILED = np.iinfo(np.uint16).max  # the prediction was no pose, or off by even more
# What is judged on a scene's common test set; all else on the set whose labels the method made.
ON_COMMON = ("table4_size", "table5_from_scratch", "table7_images_shown")


def write_archive(root: Path, config: Config, out: Path) -> int:
    """Archive what a run has made of a replication; what was archived before, and it lacks, stays.

    Args:
        root: Results of the run.
        config: Its profile, with its seed.
        out: Directory to write; what lies there is replaced as a whole.

    Returns:
        How many of its trained localizers are not archived yet.

    Raises:
        InputError: what lies in ``out`` was made with another seed, or the run has made nothing.
    """
    design = read_design(config)
    made = provenance(config.seed, config_hash(config))
    made["commit_of_run"] = git_commit(root.resolve().parent)
    earlier = _earlier_parts(out, config.seed)
    parts = list(_errors_of(design, root, out))
    if not parts:
        raise InputError(root, "has no trained localizer", "run its profile first")
    errors = pd.concat(parts, ignore_index=True)
    tables = {name: _newest(root / "tables" / name, out / name) for name in LABEL_TABLES}
    seconds = _seconds(root, out)
    with atomic_directory(out, replace=True) as directory:
        write_errors(errors, directory / ERRORS)
        for name, text in tables.items():
            if text is not None:
                (directory / name).write_text(text, encoding="utf-8")
        seconds.to_parquet(directory / SECONDS, index=False, compression="zstd")
        write_json(directory / PROVENANCE, made | {"earlier": earlier})
    return len({run for _, run in _missing(design, out)})


def remaining(config: Config, archive: Path, estimated: bool | None = None) -> list[str]:
    """List the Snakemake targets that a replication still needs.

    Args:
        config: Its profile, with its seed.
        archive: Its archive; need not exist.
        estimated: Only what needs estimated labels, or only what needs none; None for all. Labels
            take long and are not archived, so that a machine whose time may end makes them last.

    Returns:
        Errors of each localizer that is not archived, with what places their test frames on paths,
        and the rule of the label tables. Nothing where the archive is whole.
    """
    design = read_design(config)
    methods = {method for _, _, method in design.estimated}
    runs = sorted(
        {run for _, run in _missing(design, archive) if estimated in (None, run.labels in methods)}
    )
    scenes = {run.scene for run in runs}
    targets = [f"{config.root}/runs/{run.directory}/errors.csv" for run in runs]
    for scene, size in Files(config, design).sizes:
        if scene in scenes:
            folder = f"{config.root}/labels/{scene}/{size}/synfeal"
            targets += [f"{folder}/{split}.csv" for split in SPLITS]
    tables = all((archive / name).is_file() for name in LABEL_TABLES)
    if not tables and estimated is not False:
        targets.append("labels")
    return targets


def write_errors(errors: pd.DataFrame, path: Path) -> None:
    """Write errors per frame; those against the truth are left empty where labels are exact."""
    table = errors.copy()
    for key in KEYS:
        table[key] = table[key].astype("category")
    for unit in UNITS:
        true = table[f"true_{unit}"].astype("UInt16")
        table[f"true_{unit}"] = true.where(table[unit] != table[f"true_{unit}"])
    measured = [name for unit in UNITS for name in (unit, f"true_{unit}")]
    table.to_parquet(
        path,
        index=False,
        compression="zstd",
        compression_level=19,
        use_dictionary=[name for name in table.columns if name not in measured],
        column_encoding=dict.fromkeys(measured, "BYTE_STREAM_SPLIT"),
    )


def read_archived(path: Path) -> pd.DataFrame:
    """Read errors per frame, with those against the truth filled in where labels are exact."""
    table = pd.read_parquet(path)
    for unit in UNITS:
        table[f"true_{unit}"] = table[f"true_{unit}"].fillna(table[unit]).astype(np.uint16)
    return table


@dataclass(frozen=True)
class Archive:
    """One archived replication: a source of effects."""

    folder: Path
    _samples: dict[tuple[str, ...], Array] = field(default_factory=dict, repr=False, compare=False)

    @property
    def cells(self) -> list[tuple[Cell, str]]:
        """Cells and the test sets that they are archived on."""
        return [(Cell(*key[:-1]), key[-1]) for key in self._groups]

    @cached_property
    def _groups(self) -> dict[tuple[str, ...], pd.DataFrame]:
        return _archived(self.folder)

    def log_errors(self, cell: Cell, test_set: str, against: Against) -> Array:
        """Sample over the test paths; cells on the same test set share the draws."""
        key = (*cell, test_set, against)
        if key not in self._samples:
            self._samples[key] = self._sample(cell, test_set, against)
        return self._samples[key]

    def _sample(self, cell: Cell, test_set: str, against: Against) -> Array:
        rows = self._groups[(*cell, test_set)]
        _, place = np.unique(rows["path"], return_inverse=True)
        draw = generator_of("replication", cell.scene, test_set, cell.size * (test_set == OWN))
        counts = path_counts(int(place.max()) + 1, draw, RESAMPLES)
        names = [f"true_{unit}" if against == "true" else unit for unit in UNITS]
        values = [rows[name].to_numpy(dtype=float) for name in names]
        failed = [np.where(v == FAILED, np.inf, v) for v in values]
        found = np.array([medians(v, place, counts) for v in failed])
        with np.errstate(divide="ignore"):
            logs: Array = np.log(found)
        return logs

    @cached_property
    def label_errors(self) -> pd.DataFrame:
        """Errors of the training labels, after assistance, of each label method."""
        table = read_frame(self.folder / LABEL_ERROR, LABEL_ERROR_SCHEMA, "archive again")
        own = (table["split"] == "train") & (table["assistance"] == "after")
        return table[own].set_index("method")

    @cached_property
    def assistance(self) -> pd.DataFrame:
        """Batches of each label method, and how many of them needed assistance."""
        table = pd.read_csv(self.folder / ASSISTANCE)
        return table[table["split"] == "total"].set_index("method")

    def batches_of(self, method: str) -> tuple[int, int]:
        """Count the batches of a label method that needed assistance, and all of them."""
        some, total = self.assistance.loc[[method], ["assisted", "batches"]].to_numpy(dtype=int)[0]
        return int(some), int(total)


def _wanted(design: Design) -> list[tuple[str, Run]]:
    """List the test sets and localizers that are archived, a localizer on each set it is judged on.

    Of repetitions, the first is.
    """
    wanted = []
    for test_set, tables in ((OWN, set(design.tables) - {*ON_COMMON}), (COMMON, {*ON_COMMON})):
        runs = {run for table in tables for run in design.table_runs(table)}
        wanted += [(test_set, run) for run in sorted(runs) if run.repetition == 0]
    return wanted


def _missing(design: Design, archive: Path) -> list[tuple[str, Run]]:
    archived = _archived(archive)
    return [(on, run) for on, run in _wanted(design) if (*cell_of(run), on) not in archived]


def _archived(archive: Path) -> dict[tuple[str, ...], pd.DataFrame]:
    """Read an archive's rows by cell and test set; empty where there is no archive."""
    if not (archive / ERRORS).is_file():
        return {}
    errors = read_archived(archive / ERRORS)
    for key in KEYS:
        errors[key] = errors[key].astype(str)
    names = [*Cell._fields, "test_set"]
    return {tuple(map(str, key)): rows for key, rows in errors.groupby(names, sort=False)}


def _errors_of(design: Design, root: Path, archive: Path) -> Iterator[pd.DataFrame]:
    """Yield the rows of each finished run on each test set, or those that are archived.

    A run is finished when its errors are there, and the poses that place its test frames on paths.
    """
    evidence = evidence_of(design, root)
    archived = _archived(archive)
    for test_set, run in _wanted(design):
        cell, folder = cell_of(run), root / "runs" / run.directory
        of_score = evidence.under(_score(test_set))
        poses = [root / path for path in of_score.pose_tables(cell.scene, cell.size)]
        if all(path.is_file() for path in (folder / SCORES["labels"][0], *poses)):
            yield _rows(cell, test_set, of_score, folder)
        elif (*cell, test_set) in archived:
            yield archived[(*cell, test_set)]


def _earlier_parts(archive: Path, seed: int) -> list[dict[str, Any]]:
    """List the provenance of an archive and of what it was added to, oldest first.

    Each part names its commit and the hash of its settings.
    """
    path = archive / PROVENANCE
    if not path.is_file():
        return []
    record = json.loads(read_text(path))
    if record["seed"] != seed:
        raise InputError(archive, f"was made with seed {record['seed']}", "archive elsewhere")
    return [*record.pop("earlier"), record]


def _newest(made: Path, archived: Path) -> str | None:
    return next((read_text(path) for path in (made, archived) if path.is_file()), None)


def _seconds(root: Path, archive: Path) -> pd.DataFrame:
    """Join the jobs of a run to those archived; one that ran in both took what it took last."""
    jobs = read_measured(root)[["stage", "job", "wall_s", "cpu_s"]]
    if (archive / SECONDS).is_file():
        jobs = pd.concat([pd.read_parquet(archive / SECONDS), jobs], ignore_index=True)
    jobs = jobs.drop_duplicates(["stage", "job"], keep="last").round(1)
    return jobs.sort_values(["stage", "job"], ignore_index=True)


def _score(test_set: str) -> str:
    return COMMON if test_set == COMMON else "labels"


def _rows(cell: Cell, test_set: str, evidence: Evidence, folder: Path) -> pd.DataFrame:
    name, columns, measures = SCORES[evidence.score]
    table = read_errors(folder / name, columns).iloc[::EVERY]
    poses = evidence.test_set(cell.scene, cell.size).poses
    rows = {key: getattr(cell, key) for key in KEYS[:-1]} | {"test_set": test_set}
    frame = pd.DataFrame(rows, index=range(len(table)))
    if not np.array_equal(table["frame"], poses.frame[::EVERY]):
        raise InputError(folder / name, "its frames are not those of the test set", REMEDY)
    frame["frame"] = table["frame"].to_numpy(dtype=np.uint32)
    frame["path"] = poses.path[::EVERY].astype(np.uint32)
    true = measures if test_set == COMMON else MEASURES[2:]
    for (unit, factor), measure, true_measure in zip(UNITS.items(), measures, true, strict=True):
        frame[unit] = _whole(table[measure].to_numpy(), factor)
        frame[f"true_{unit}"] = _whole(table[true_measure].to_numpy(), factor)
    return frame


def _whole(values: np.ndarray, factor: float) -> np.ndarray:
    """Round errors to whole units; what is not finite, or too large, failed."""
    scaled = np.where(np.isfinite(values), values * factor, FAILED)
    return np.minimum(np.round(scaled), FAILED).astype(np.uint16)
