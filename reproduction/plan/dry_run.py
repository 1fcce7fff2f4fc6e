"""The jobs of a profile and what each needs, as Snakemake plans them.

Snakemake is asked in a process of its own, ``python -m reproduction.plan.dry_run``: it takes over
logging and the working directory. What it says of a job is the record that its logger plugins get.
"""

from __future__ import annotations

import json
import logging
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from reproduction.plan.jobs import Key
from synfeal.errors import InputError
from synfeal.records.files import read_json, write_json


@dataclass(frozen=True)
class PlannedJobs:
    """Jobs of the target ``all`` that are measured."""

    keys: tuple[Key, ...]  # stage and name of each, as below ``<root>/benchmarks``
    # By table of the paper, the jobs it needs, that which writes it included.
    needed: Mapping[str, frozenset[Key]]


def planned_jobs(profile: Path) -> PlannedJobs:
    """List all jobs of a run that begins with nothing."""
    with tempfile.TemporaryDirectory(prefix="plan-") as folder:
        out = Path(folder) / "jobs.json"
        command = [sys.executable, "-m", __spec__.name, str(profile), folder, str(out)]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode != 0 or not out.exists():
            said = [line for line in run.stderr.splitlines() if line.strip()] or ["it says nothing"]
            raise InputError(f"{profile}: Snakemake cannot plan a run of it here: {said[-1]}")
        records = read_json(out)
    keys = tuple(key_of(record["benchmark"]) for record in records if record["benchmark"])
    return PlannedJobs(keys, _needed(records))


def job_name(benchmark: str) -> str:
    """Name a job ``stage/name`` by the file that measures it."""
    return benchmark.partition("/benchmarks/")[2].removesuffix(".tsv")


def key_of(benchmark: str) -> Key:
    """Return stage and name of a job by the file that measures it."""
    stage, _, name = job_name(benchmark).partition("/")
    return stage, name


def _needed(records: list[dict[str, Any]]) -> dict[str, frozenset[Key]]:
    """Return, by table, the jobs that it depends on and its own."""
    makers = {path: place for place, record in enumerate(records) for path in record["output"]}
    needed = {}
    for place, record in enumerate(records):
        if record["rule"] in ("table1_meshes", "table"):
            found, asked = set(), {place}
            while asked:
                found |= asked
                inputs = {path for job in asked for path in records[job]["input"]}
                asked = {makers[path] for path in inputs & makers.keys()} - found
            measured = (records[job]["benchmark"] for job in found)
            needed[key_of(record["benchmark"])[1]] = frozenset(map(key_of, filter(None, measured)))
    return dict(sorted(needed.items()))


def _dry_run(profile: Path, results: Path, out: Path) -> None:
    """Write the records of all jobs."""
    from snakemake.api import SnakemakeApi
    from snakemake.logging import logger
    from snakemake.settings.types import (
        ConfigSettings,
        DAGSettings,
        OutputSettings,
        ResourceSettings,
        StorageSettings,
    )
    from snakemake_interface_logger_plugins.common import LogEvent

    records: list[dict[str, Any]] = []

    class Keep(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            said = record.__dict__
            if said.get("event") == LogEvent.JOB_INFO:
                kept = {name: said[name] for name in ("benchmark", "input", "output")}
                records.append({"rule": said["rule_name"], **kept})

    with SnakemakeApi(OutputSettings(dryrun=True)) as api:
        workflow = api.workflow(
            resource_settings=ResourceSettings(cores=1),
            config_settings=ConfigSettings(config={"results": str(results)}, configfiles=[profile]),
            storage_settings=StorageSettings(),
            snakefile=Path("Snakefile"),
        )
        dag = workflow.dag(DAGSettings(targets={"all"}, forceall=True))
        logger.addHandler(Keep())
        dag.execute_workflow(executor="dryrun")
    write_json(out, json.loads(json.dumps(records, default=str)))


if __name__ == "__main__":
    _dry_run(*map(Path, sys.argv[1:]))
