"""``provenance.json``, the inputs and the cost of a run: the file and its section."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup
from pydantic import BaseModel

from reproduction.plan.text import duration
from reproduction.report.html.tables import render, side_html
from reproduction.runs.job_times import read_jobs, write_measured
from reproduction.runs.results import read_result, shaped
from reproduction.tables.columns import Column, SideLayout
from synfeal.records.files import file_sha256, write_json
from synfeal.records.provenance import CPU_INFO, processor_name, provenance
from synfeal.records.tables import records_of
from synfeal.render.choose import graphics


def write_provenance(
    seed: int, config_hash: str, measured: Sequence[Path], results: Sequence[Path], out_json: Path
) -> None:
    """Write where a run's results come from, and beside it what every job took.

    The record is that of :func:`synfeal.records.provenance.provenance`, with ``machine``,
    ``stages`` (:func:`stages_of`), and ``files``: SHA-256 of the results by path.

    Args:
        seed: Seed of the profile.
        config_hash: Hash of its configuration.
        measured: Files of Snakemake's measurements, in the folder ``benchmarks`` beside the record.
        results: Files to hash, or folders all of whose files are hashed.
        out_json: Record to write; ``benchmarks.csv`` is written beside it.
    """
    root = out_json.parent
    jobs = read_jobs(sorted(measured), root / "benchmarks")
    write_measured(jobs, root)
    found = {"machine": machine(), "stages": stages_of(jobs), "files": hashes(results, root)}
    write_json(out_json, provenance(seed, config_hash) | found)


def stages_of(jobs: pd.DataFrame) -> list[dict[str, Any]]:
    """Add up the jobs of each stage, the longest stage first.

    ``seconds`` are of all ``jobs``; ``peak_mb`` is None where all were too short to measure.
    """
    stages = jobs.groupby("stage").agg(
        jobs=("wall_s", "size"),
        seconds=("wall_s", "sum"),
        median_seconds=("wall_s", "median"),
        peak_mb=("peak_mb", "max"),
    )
    stages = stages.reset_index().sort_values(["seconds", "stage"], ascending=[False, True])
    peak_mb = stages.peak_mb.astype(object).where(stages.peak_mb.notna(), None)
    return records_of(stages.assign(peak_mb=peak_mb))


def hashes(results: Iterable[Path], root: Path) -> dict[str, str]:
    """Hash files, and all files in directories, by path relative to ``root`` (SHA-256)."""
    paths = [p for path in results for p in (sorted(path.iterdir()) if path.is_dir() else [path])]
    return {
        path.relative_to(root).as_posix(): file_sha256(path)
        for path in paths
        if not path.name.startswith(".")
    }


def machine() -> dict[str, Any]:
    """Describe processor, usable cores, memory in GiB, GPU (None without one) and OpenGL driver."""
    from torch import cuda  # torch takes a second to load

    pages, page_bytes = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    return {
        "processor": processor_name(CPU_INFO),
        "usable_cores": len(os.sched_getaffinity(0)),
        "memory_gib": round(pages * page_bytes / 2**30, 1),
        "gpu": cuda.get_device_name() if cuda.is_available() else None,
        "graphics": graphics("auto"),
    }


NEEDED = ("commit", "config_sha256", "seed", "python", "packages", "platform", "time_utc")
Record = Mapping[str, Any]


class _Machine(BaseModel):
    processor: str
    usable_cores: int
    memory_gib: float
    gpu: str | None
    graphics: dict[str, str] = {}  # older records lack it


class _Stage(BaseModel):
    stage: str
    jobs: int
    seconds: float
    median_seconds: float
    peak_mb: float | None


class _Origin(BaseModel):
    machine: _Machine
    stages: list[_Stage]
    packages: dict[str, str]


def read_origin(path: Path) -> Record:
    """Read ``provenance.json``: machine, stages, packages and what else the report prints.

    Raises:
        InputError: The file is missing or lacks any of that.
    """
    record: Record = read_result(path, (*NEEDED, "machine", "stages"), "make it again")
    shaped(path, record, _Origin, "make it again")
    return record


def origin_html(record: Record) -> Markup:
    """Format the facts, and the stages as a table."""
    columns = [
        Column("Stage", "stage"),
        Column("Jobs", "jobs", "{:,.0f}"),
        Column("All jobs", "seconds", text="all"),
        Column("Median job", "median_seconds", text="median"),
        Column("Peak memory (MB)", "peak_mb", "{:,.0f}"),
    ]
    stages = pd.DataFrame(record["stages"], columns=list(_Stage.model_fields))
    stages["all"] = stages.seconds.map(duration)
    stages["median"] = stages.median_seconds.map(duration)
    caption = "Time and largest resident memory of the jobs of each stage."
    return render(
        "origin.html", record=record, stages=side_html(SideLayout("cost", caption, columns, stages))
    )


def cost_sentence(record: Record) -> str:
    """Say how much was computed, and on what."""
    seconds = sum(stage["seconds"] for stage in record["stages"])
    jobs = sum(stage["jobs"] for stage in record["stages"])
    machine = record["machine"]
    return (
        f"{jobs} jobs took {duration(seconds)} of computing together, on {machine['processor']}"
        f" ({machine['usable_cores']} cores)."
    )
