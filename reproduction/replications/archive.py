"""Archive of one replication: errors per test frame, label errors, seconds, provenance.

``errors.parquet`` has a row per trained localizer and archived test frame. Every third frame of a
test set is archived: neighbours 3 cm apart are nearly the same picture. Effects are computed from
the archive alone, so that whoever has it can compute them, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from reproduction.claims.evidence import COMMON, SCORES, Cell, Evidence, evidence_of
from reproduction.config.profile import Config
from reproduction.design.experiments import Design, read_design
from reproduction.runs.job_times import read_measured
from reproduction.runs.results import read_text
from reproduction.statistics.limits import MEASURES, read_errors
from synfeal.records.files import atomic_directory, write_json
from synfeal.records.provenance import config_hash, provenance
from synfeal.records.tables import write_frame

ERRORS = "errors.parquet"
ASSISTANCE, LABEL_ERROR = "assistance.csv", "label_error.csv"
SECONDS, PROVENANCE = "seconds.csv", "provenance.json"
EVERY = 3  # every third test frame is kept
KEYS = ("scene", "size", "labels", "init", "model", "test_set")
# Whole millimetres and hundredths of a degree: both below a thousandth of a median error.
UNITS = {"position_mm": 1000.0, "orientation_cdeg": 100.0}
FAILED = np.iinfo(np.uint16).max  # the prediction was no pose, or off by even more
OWN = "own"
# What is judged on a scene's common test set; all else on the set whose labels the method made.
ON_COMMON = ("table4_size", "table5_from_scratch", "table7_images_shown")


def write_archive(root: Path, config: Config, out: Path) -> None:
    """Archive a finished replication.

    Args:
        root: Results of the run.
        config: Its profile, with its seed.
        out: Directory to write; what lies there is replaced as a whole.

    Raises:
        InputError: the run is not finished.
    """
    design = read_design(config)
    with atomic_directory(out, replace=True) as directory:
        errors = pd.concat(list(_errors_of(design, root)), ignore_index=True)
        write_errors(errors, directory / ERRORS)
        for name in (ASSISTANCE, LABEL_ERROR):
            (directory / name).write_text(read_text(root / "tables" / name), encoding="utf-8")
        jobs = read_measured(root).groupby("stage", sort=True)
        seconds = jobs[["wall_s", "cpu_s"]].sum().assign(jobs=jobs.size()).reset_index()
        write_frame(directory / SECONDS, seconds, "%.1f")
        write_json(directory / PROVENANCE, provenance(config.seed, config_hash(config)))


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


def _errors_of(design: Design, root: Path) -> Iterator[pd.DataFrame]:
    """Yield the rows of each run, on each test set that it is judged on."""
    evidence = evidence_of(design, root)
    for test_set, tables in ((OWN, set(design.tables) - {*ON_COMMON}), (COMMON, {*ON_COMMON})):
        runs = {run for table in tables for run in design.table_runs(table)}
        for run in sorted(runs):
            cell = Cell(run.model, run.scene, run.size, run.labels, run.init)
            if run.repetition == 0:
                yield _rows(cell, test_set, evidence, root / "runs" / run.directory)


def _rows(cell: Cell, test_set: str, evidence: Evidence, folder: Path) -> pd.DataFrame:
    score = COMMON if test_set == COMMON else "labels"
    name, columns, measures = SCORES[score]
    table = read_errors(folder / name, columns).iloc[::EVERY]
    poses = evidence.under(score).test_set(cell.scene, cell.size).poses
    rows = {key: getattr(cell, key) for key in KEYS[:-1]} | {"test_set": test_set}
    frame = pd.DataFrame(rows, index=range(len(table)))
    frame["frame"] = table["frame"].to_numpy(dtype=np.uint32)
    frame["path"] = poses.path[::EVERY].astype(np.uint32)
    true = measures if score == COMMON else MEASURES[2:]
    for (unit, factor), measure, true_measure in zip(UNITS.items(), measures, true, strict=True):
        frame[unit] = _whole(table[measure].to_numpy(), factor)
        frame[f"true_{unit}"] = _whole(table[true_measure].to_numpy(), factor)
    return frame


def _whole(values: np.ndarray, factor: float) -> np.ndarray:
    """Round errors to whole units; what is not finite, or too large, failed."""
    scaled = np.where(np.isfinite(values), values * factor, FAILED)
    return np.minimum(np.round(scaled), FAILED).astype(np.uint16)
