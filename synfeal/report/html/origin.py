"""The section on where the results come from: commit, versions, machine, and what it cost."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup
from pydantic import BaseModel, TypeAdapter

from synfeal.report.html.render import render
from synfeal.report.html.sortable import Column, sortable
from synfeal.report.results import check_result, read_result

NEEDED = ("commit", "config_sha256", "seed", "python", "packages", "platform", "time_utc")
Record = Mapping[str, Any]


class _Machine(BaseModel):
    processor: str
    usable_cores: int
    memory_gib: float
    gpu: str | None


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


_SHAPE = TypeAdapter(_Origin)


def read_origin(path: Path) -> Record:
    """``provenance.json``."""
    record = read_result(path, (*NEEDED, "machine", "stages"), "make it again")
    check_result(path, record, _SHAPE, "make it again")
    return record


def origin_html(record: Record) -> Markup:
    """Facts, and the stages as a table."""
    machine = record["machine"]
    facts = {
        "Commit": record["commit"],
        "Configuration (SHA-256)": record["config_sha256"],
        "Seed": record["seed"],
        "Written (UTC)": record["time_utc"],
        "Processor": f"{machine['processor']}, {machine['usable_cores']} cores used",
        "Memory": f"{machine['memory_gib']} GiB",
        "GPU": machine["gpu"] or "none",
        "System": record["platform"],
        "Python": record["python"],
        "Packages": ", ".join(f"{name} {v}" for name, v in record["packages"].items()),
    }
    return render("origin.html", facts=facts, stages=_stages(record))


def cost_sentence(record: Record) -> str:
    """How much was computed, and on what."""
    seconds = sum(stage["seconds"] for stage in record["stages"])
    jobs = sum(stage["jobs"] for stage in record["stages"])
    machine = record["machine"]
    return (
        f"{jobs} jobs took {duration(seconds)} of computing together, on {machine['processor']}"
        f" ({machine['usable_cores']} cores)."
    )


def duration(seconds: float) -> str:
    """Seconds as a person reads them."""
    if seconds < 90:
        return f"{seconds:.1f} s"
    if seconds < 5400:
        return f"{seconds / 60:.1f} min"
    return f"{seconds / 3600:.1f} h"


def _stages(record: Record) -> Markup:
    columns = [
        *(Column("Stage", "stage"), Column("Jobs", "jobs", "{:,}")),
        Column("All jobs", "seconds", text="all"),
        Column("Median job", "median_seconds", text="median"),
        Column("Peak memory (MB)", "peak_mb", "{:,.0f}"),
    ]
    stages = pd.DataFrame(record["stages"], columns=list(_Stage.model_fields))
    texts = {"all": stages.seconds.map(duration), "median": stages.median_seconds.map(duration)}
    caption = "<b>Cost.</b> Time and largest resident memory of the jobs of each stage."
    return sortable("stages", caption, columns, stages.assign(**texts))
